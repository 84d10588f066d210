"""Break the formulas that errors hide in, one at a time: tests must fail.

`python tests/tools/mutants.py -o docs/results/stability/mutants.csv` copies the project to
target/mutants, changes one formula at a time, builds, and runs the tests named with it: a minute or
two each, or seconds where it is a shader's, which the copy reads when it runs. A mutant that
survives is a gap in the tests.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import core_library
from mutant_list import MUTANTS

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


def run(folder: Path, command: list[str]) -> subprocess.CompletedProcess[str]:
    """Built with what compiles fast."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(folder / "python"),
        "CARGO_TARGET_DIR": str(folder / "target"),
        "CARGO_INCREMENTAL": "1",
        "CARGO_PROFILE_RELEASE_DEBUG": "0",
        "CARGO_PROFILE_RELEASE_OPT_LEVEL": "1",
    }
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


def failing_test(folder: Path, tests: tuple[str, ...]) -> str:
    """The first test that fails, none if all pass."""
    kind, *options = tests
    if kind == "cargo":
        ended = run(folder, ["cargo", "test", "--release", "--locked", *options])
        found = re.search(r"^test (\S+) \.\.\. FAILED$", ended.stdout, re.MULTILINE)
    else:
        ended = run(folder, ["cargo", "build", "--release", "--locked", "--lib"])
        if ended.returncode != 0:
            raise RuntimeError(ended.stderr)
        built = folder / "target" / "release"
        core_library.install(built, folder / "python" / "lixel")
        ended = run(folder, [sys.executable, "-m", "pytest", "-q", "-x", *options])
        found = re.search(r"^(?:FAILED|ERROR) (\S+)", ended.stdout, re.MULTILINE)
    if ended.returncode == 0:
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
    chosen = [mutant for mutant in MUTANTS if options.only in (None, mutant.subject)]
    command = "python tests/tools/mutants.py" + (
        f" --only '{options.only}'" if options.only else ""
    )
    rows = []
    folder = ROOT / "target" / "mutants"
    copy_project(folder)
    read_shaders_when_run(folder)
    for tests in dict.fromkeys(mutant.tests for mutant in chosen):
        if broken := failing_test(folder, tests):
            raise RuntimeError(f"{broken} fails without a mutant")
    for mutant in chosen:
        path = folder / mutant.file
        text = path.read_text()
        if text.count(mutant.old) != 1:
            raise RuntimeError(f"{mutant.file} must have {mutant.old!r} once")
        path.write_text(text.replace(mutant.old, mutant.new))
        by = failing_test(folder, mutant.tests)
        path.write_text(text)
        print(f"{mutant.subject}, {mutant.name}: {by or 'survives'}", flush=True)
        row = {"subject": mutant.subject, "mutant": mutant.name, "file": mutant.file}
        rows.append({**row, "killed": bool(by), "by": by})
    if options.output is not None:
        write(options.output, command, rows)
    return int(not all(row["killed"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
