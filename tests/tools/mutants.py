"""Break the formulas that errors hide in, one at a time: tests must fail.

`python tests/tools/mutants.py -o docs/results/stability/mutants.csv` copies the project to
target/mutants, changes one formula at a time, and runs the tests named with it. It builds once: all
mutants of Rust functions are compiled together, and shaders are read when they are run. Tests of
shaders run on whatever adapter there is. A mutant that survives is a gap in the tests.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import core_library
from mutant_list import MUTANTS
from mutant_switch import VARIABLE, switch

from lixel.lab.result_tables import write

ROOT = Path(__file__).parents[2]


def copy_project(folder: Path) -> None:
    """Of what git knows."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True)
    for name in listed.stdout.decode().split("\0"):
        if name and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)


def read_shaders_when_run(folder: Path) -> None:
    """Takes shaders from the folder, and not into the program: one that changes needs no build."""
    path = folder / "src" / "gpu" / "shaders.rs"
    text, included = re.subn(r"include_str!\(.*?\)\)", '""', path.read_text(), flags=re.DOTALL)
    of_name = '"{}/shaders/{name}.wgsl", env!("CARGO_MANIFEST_DIR")'
    read = f"std::fs::read_to_string(format!({of_name})).unwrap().leak()"
    text, looked_up = re.subn(
        r"file\.unwrap_or_else\(.*\)\.1\n", f"file.map(|_| {read}).unwrap()\n", text
    )
    if (included, looked_up) != (1, 1):
        raise RuntimeError(f"{path} takes shaders in another way")
    path.write_text(text)


class Copy(NamedTuple):
    """The project, and what runs of it: a mutant by its number, and the engine of all tests that
    name none."""

    folder: Path
    mutant: int
    device: str


def run(copy: Copy, command: list[str]) -> subprocess.CompletedProcess[str]:
    """Built with what compiles fast."""
    environment = {
        **os.environ,
        VARIABLE: str(copy.mutant),
        "LIXEL_DEVICE": copy.device,
        "PYTHONPATH": str(copy.folder / "python"),
        "CARGO_TARGET_DIR": str(copy.folder / "target"),
        "CARGO_INCREMENTAL": "1",
        "CARGO_PROFILE_RELEASE_DEBUG": "0",
        "CARGO_PROFILE_RELEASE_OPT_LEVEL": "1",
    }
    return subprocess.run(command, cwd=copy.folder, env=environment, capture_output=True, text=True)


def failing_test(copy: Copy, tests: tuple[str, ...]) -> str:
    """The first test that fails, none if all pass."""
    kind, *options = tests
    if kind == "cargo":
        command = ["cargo", "test", "--release", "--locked", *options, "--", "--include-ignored"]
        ended = run(copy, command)
        found = re.search(r"^test (\S+) \.\.\. FAILED$", ended.stdout, re.MULTILINE)
    else:
        ended = run(copy, ["cargo", "build", "--release", "--locked", "--lib"])
        if ended.returncode != 0:
            raise RuntimeError(ended.stderr)
        built = copy.folder / "target" / "release"
        core_library.install(built, copy.folder / "python" / "lixel")
        ended = run(copy, [sys.executable, "-m", "pytest", "-q", "-x", *options])
        found = re.search(r"^(?:FAILED|ERROR) (\S+)", ended.stdout, re.MULTILINE)
    if ended.returncode == 0:
        if not re.search(r"[1-9][0-9]* passed", ended.stdout):
            raise RuntimeError(f"{' '.join(tests)} runs no test")
        return ""
    if found is None:
        raise RuntimeError(f"no test failed, but:\n{ended.stdout}\n{ended.stderr}")
    return found[1]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--only", choices=sorted({mutant.subject for mutant in MUTANTS}), help="mutants of it alone"
    )
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="write a table")
    options = parser.parse_args()
    numbered = dict(enumerate(MUTANTS, start=1))
    chosen = {n: m for n, m in numbered.items() if options.only in (None, m.subject)}
    command = "python tests/tools/mutants.py" + (
        f" --only '{options.only}'" if options.only else ""
    )
    rows = []
    folder = ROOT / "target" / "mutants"
    copy_project(folder)
    read_shaders_when_run(folder)
    for mutant in numbered.values():
        if (folder / mutant.file).read_text().count(mutant.old) != 1:
            raise RuntimeError(f"{mutant.file} must have {mutant.old!r} once")
    compiled = switch(folder, numbered)
    for device, tests in dict.fromkeys((mutant.device, mutant.tests) for mutant in chosen.values()):
        if broken := failing_test(Copy(folder, 0, device), tests):
            raise RuntimeError(f"{broken} fails without a mutant")
    for number, mutant in chosen.items():
        if number in compiled:
            by = failing_test(Copy(folder, number, mutant.device), mutant.tests)
        else:
            path = folder / mutant.file
            text = path.read_text()
            path.write_text(text.replace(mutant.old, mutant.new))
            by = failing_test(Copy(folder, 0, mutant.device), mutant.tests)
            path.write_text(text)
        print(f"{mutant.subject}, {mutant.name}: {by or 'survives'}", flush=True)
        row = {"subject": mutant.subject, "mutant": mutant.name, "file": mutant.file}
        rows.append({**row, "killed": bool(by), "by": by})
    if options.output is not None:
        write(options.output, command, rows)
    return int(not all(row["killed"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
