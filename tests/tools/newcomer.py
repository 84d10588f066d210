"""Go the way from the README to a picture of one's own, with nothing at hand but Rust and Python.

    python tests/tools/newcomer.py -o docs/results/newcomer/steps.csv

Clones the checkout's last commit into an empty folder, gives cargo and pip no crate and no package
that was downloaded before, and does what the README says, word by word. The table has each step's
line, its seconds and the last one that it printed; all that it printed stands beside the table,
in NUMBER.txt.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from try_wheel import TOWN, readme_code

from lixel.lab.result_tables import write

ROOT = Path(__file__).parents[2]

# A progress bar prints each of its states after the one before it, and colours.
OVERWRITTEN = re.compile(r"[^\n]*\r(?!\n)|\x1b\[[0-9;]*[A-Za-z]")


class Step(NamedTuple):
    what: str
    command: str


def steps() -> list[Step]:
    """The README's own lines; its SCENE is a file that the newcomer has."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")

    def line(start: str) -> str:
        (found, *_) = re.findall(rf"^    ({start}[^#\n]*?) *(?:#.*)?$", readme, re.M)
        return str(found)

    activate = line("source ")
    render = line("lixel render").replace("SCENE", "town.glb")
    return [
        Step("clone", f"git clone --quiet {shlex.quote(str(ROOT))} lixel"),
        Step("build, and render the demo", f"cd lixel && {line('make demo')}"),
        Step("bring a scene", f"cd lixel && {activate} && python town.py"),
        Step("render it", f"cd lixel && {activate} && {render}"),
        Step("run the README's code", f"cd lixel && {activate} && python readme.py"),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="write a table")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for number, step in enumerate(steps(), start=1):
            if number == 2:
                (folder / "lixel" / "town.py").write_text(TOWN)
                (folder / "lixel" / "readme.py").write_text(readme_code())
            start = time.perf_counter()
            printed = run(step.command, folder)
            seconds = time.perf_counter() - start
            lines = printed.splitlines() or [""]
            rows.append(
                {
                    "step": step.what,
                    "line": step.command.replace(str(ROOT), "URL"),
                    "seconds": round(seconds, 1),
                    "last_line": lines[-1],
                }
            )
            print(f"{seconds:7.1f} s  {step.what}", flush=True)
            if options.output is not None and printed:
                options.output.parent.mkdir(parents=True, exist_ok=True)
                options.output.with_name(f"{number}.txt").write_text(printed)
        assert (folder / "lixel" / "shadows.png").read_bytes().startswith(b"\x89PNG")
    print(f"{sum(row['seconds'] for row in rows):7.1f} s  in all")
    if options.output is not None:
        command = f"python tests/tools/newcomer.py -o {options.output}"
        write(options.output, command, rows)


def run(command: str, folder: Path) -> str:
    """What it printed, without this folder's name."""
    kept = {
        name: text
        for name, text in os.environ.items()
        if not name.startswith(("PYTHON", "CARGO", "LIXEL", "VIRTUAL_ENV", "MAKE"))
    }
    # rustc and cargo themselves are found as before.
    rustup = os.environ.get("RUSTUP_HOME", str(Path.home() / ".rustup"))
    environment = {
        **kept,
        "RUSTUP_HOME": rustup,
        "CARGO_HOME": str(folder / "cargo"),
        "PIP_NO_CACHE_DIR": "1",
        "PATH": ":".join(p for p in kept["PATH"].split(":") if ".venv" not in p),
    }
    ended = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    printed = OVERWRITTEN.sub("", ended.stdout).replace(str(folder) + "/", "")
    # Where this machine's pip looks first, and where maturin builds.
    printed = re.sub(r"^Looking in .*\n", "", printed, flags=re.MULTILINE)
    printed = re.sub(r" /\S*/\.tmp\w+/", " ", printed)
    if ended.returncode != 0:
        sys.exit(f"{command}\n{printed}")
    return printed


if __name__ == "__main__":
    main()
