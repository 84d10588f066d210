"""Break the formulas that errors hide in, one at a time: tests must fail.

`python tests/tools/mutants.py -o docs/results/stability/mutants.csv` copies the project to
target/mutants, changes one formula at a time, and runs the tests named with it. It builds once: all
mutants of Rust functions are compiled together, and shaders are read when they are run. Tests of
shaders run on whatever adapter there is. A mutant that survives is a gap in the tests; one by which
tests do not end is killed.

It goes on where it was stopped: a mutant that is killed in the table already is not run again,
unless code other than tests has changed since.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import platform
import re
import signal
import subprocess
import sys
import time
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import core_library
from mutant_list import MUTANTS, Mutant
from mutant_switch import VARIABLE, switched_files

from lixel.lab.result_tables import resume, write

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "target" / "mutants"

# What compiles fast.
PROFILE = {"INCREMENTAL": "1", "PROFILE_RELEASE_DEBUG": "0", "PROFILE_RELEASE_OPT_LEVEL": "1"}
# Functions with mutants are called by themselves, and are to know the processor's lanes.
FLAGS = ("-Ctarget-cpu=native", "-Clto=off", "-Cdebuginfo=0")

# In place of the macro of fearless_simd: one kind of lanes is compiled in a quarter of the time.
ONE_LEVEL = """
macro_rules! dispatch {
    ($level:expr, $simd:pat => $op:expr) => {{
        let token = $level.as_avx2().expect("the processor has AVX2");
        let $simd = token;
        fearless_simd::Simd::vectorize(token, #[inline(always)] || $op)
    }};
}
pub(crate) use dispatch;
"""

# Modules that only tests are made of: of a file of their own, and those at the end of a file.
TEST_MODULE = re.compile(r"#\[cfg\(test\)\]\n(?:pub )?mod (\w+);")
TESTS_AT_END = re.compile(r"\n#\[cfg\(test\)\]\n(?:pub )?mod \w+ \{.*", re.DOTALL)

# A mutant's tests have this many seconds, and this many times as many as they take without it.
PATIENCE = (60, 5)


def known_files() -> list[str]:
    """What git knows."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True)
    return [name for name in listed.stdout.decode().split("\0") if (ROOT / name).is_file()]


def folder_of_modules(file: Path) -> Path:
    return file.parent if file.name in ("lib.rs", "mod.rs") else file.with_suffix("")


def hash_of_code(names: list[str]) -> str:
    """Of all that is built and run, without tests."""
    rust = {name: (ROOT / name).read_text() for name in names if re.match(r"src/.*\.rs$", name)}
    of_tests = {
        folder_of_modules(Path(name)) / f"{module[1]}{ending}"
        for name, text in rust.items()
        for module in TEST_MODULE.finditer(text)
        for ending in ("", ".rs")
    }
    code = hashlib.sha256()
    for name in sorted(names):
        if not of_tests.isdisjoint((Path(name), *Path(name).parents)):
            continue
        if name in rust:
            code.update(f"{name}\n{TESTS_AT_END.sub('', rust[name])}".encode())
        elif name.startswith(("shaders/", "python/", "Cargo.")):
            code.update(f"{name}\n".encode() + (ROOT / name).read_bytes())
    return code.hexdigest()


def number_of(mutant: Mutant) -> int:
    """What it is called in the build, which another mutant does not change."""
    return zlib.crc32(f"{mutant.subject}, {mutant.name}".encode())


def hash_of(mutant: Mutant, code: str) -> str:
    """While it lasts, a mutant that is killed stays so."""
    return hashlib.sha256(f"{code}\n{mutant.old}\n{mutant.new}".encode()).hexdigest()[:12]


def read_shaders_when_run(text: str) -> str:
    """`src/gpu/shaders.rs` with shaders from the folder: one that changes needs no build."""
    text, included = re.subn(r"include_str!\(.*?\)\)", '""', text, flags=re.DOTALL)
    of_name = '"{}/shaders/{name}.wgsl", env!("CARGO_MANIFEST_DIR")'
    read = f"std::fs::read_to_string(format!({of_name})).unwrap().leak()"
    text, looked_up = re.subn(
        r"file\.unwrap_or_else\(.*\)\.1\n", f"file.map(|_| {read}).unwrap()\n", text
    )
    if (included, looked_up) != (1, 1):
        raise RuntimeError("src/gpu/shaders.rs takes shaders in another way")
    return text


def copy_project(folder: Path, names: list[str], changed: Mapping[str, str]) -> None:
    """Writes only what differs: cargo builds again what is new."""
    # What has moved since would be there twice.
    for moved in ("src", "shaders"):
        for path in (folder / moved).rglob("*.*"):
            if path.relative_to(folder).as_posix() not in names:
                path.unlink()
    for name in names:
        content = changed[name].encode() if name in changed else (ROOT / name).read_bytes()
        path = folder / name
        if not path.is_file() or path.read_bytes() != content:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


class Copy(NamedTuple):
    """The project with all mutants, built, and the program of its Rust tests."""

    folder: Path
    rust_tests: Path


def environment(folder: Path, mutant: int, device: str) -> dict[str, str]:
    return {
        **os.environ,
        VARIABLE: str(mutant),
        "LIXEL_DEVICE": device,
        "PYTHONPATH": str(folder / "python"),
        "CARGO_TARGET_DIR": str(folder / "target"),
        "CARGO_MANIFEST_DIR": str(folder),
        **{f"CARGO_{name}": value for name, value in PROFILE.items()},
    }


def build(folder: Path) -> Copy:
    """The extension module, put into the copy's package, and the Rust tests."""

    def cargo(*arguments: str) -> str:
        command = ["cargo", "rustc", *arguments, "--locked", "--lib", "--", *FLAGS]
        of_none = environment(folder, 0, "cpu")
        ended = subprocess.run(command, cwd=folder, env=of_none, capture_output=True, text=True)
        if ended.returncode != 0:
            raise RuntimeError(ended.stderr)
        return ended.stdout

    cargo("--release")
    core_library.install(folder / "target" / "release", folder / "python" / "lixel")
    # With their checks, and what else is built for tests as it is for those of the project.
    fast = ("--config", "profile.dev.package.lixel.opt-level=1")
    listed = cargo("--profile=test", "--message-format=json", *fast).splitlines()
    (program,) = filter(None, (json.loads(line).get("executable") for line in listed))
    return Copy(folder, Path(program))


def failing_test(
    copy: Copy, mutant: int, device: str, tests: tuple[str, ...], seconds: float | None = None
) -> str:
    """The first test that fails, none if all pass."""
    kind, *options = tests
    if kind == "cargo":
        names = [option for option in options if not option.startswith("-")]
        command = [str(copy.rust_tests), *names, "--include-ignored"]
        failed = r"^test (\S+) \.\.\. FAILED$"
    else:
        command = [sys.executable, "-m", "pytest", "-q", "-x", *options]
        failed = r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$"
    process = subprocess.Popen(
        command, cwd=copy.folder, env=environment(copy.folder, mutant, device), text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
    )  # fmt: skip
    try:
        output, _ = process.communicate(timeout=seconds)
    except BaseException as error:
        # With what it started.
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        if isinstance(error, subprocess.TimeoutExpired):
            return f"no end of {' '.join(tests)}"
        raise
    if process.returncode < 0:
        return f"signal {-process.returncode} in {' '.join(tests)}"
    if process.returncode == 0:
        if not re.search(r"[1-9][0-9]* passed", output):
            raise RuntimeError(f"{' '.join(tests)} runs no test")
        return ""
    found = re.search(failed, output, re.MULTILINE)
    if found is None:
        raise RuntimeError(f"no test failed, but:\n{output}")
    return found[1]


def run_all(
    copy: Copy, chosen: Mapping[int, Mutant], compiled: set[int]
) -> Iterator[tuple[int, str]]:
    """Each mutant's number, and the test that kills it; none if it survives."""
    limits: dict[tuple[str, tuple[str, ...]], float] = {}
    for number, mutant in chosen.items():
        job = (mutant.engine, mutant.tests)
        if job not in limits:
            begun = time.monotonic()
            if broken := failing_test(copy, 0, *job):
                raise RuntimeError(f"{broken} fails without a mutant")
            seconds = time.monotonic() - begun
            limits[job] = max(PATIENCE[0], PATIENCE[1] * seconds)
            print(f"  {seconds:.0f} s: {' '.join(mutant.tests)}, {mutant.engine}", flush=True)
        if number in compiled:
            yield number, failing_test(copy, number, *job, limits[job])
            continue
        path = copy.folder / mutant.file
        text = path.read_text()
        path.write_text(text.replace(mutant.old, mutant.new))
        by = failing_test(copy, 0, *job, limits[job])
        path.write_text(text)
        yield number, by


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--only", choices=sorted({mutant.subject for mutant in MUTANTS}), help="mutants of it alone"
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="a table to write or go on with"
    )
    options = parser.parse_args()
    numbered = {number_of(mutant): mutant for mutant in MUTANTS}
    for mutant in MUTANTS:
        if (ROOT / mutant.file).read_text().count(mutant.old) != 1:
            raise RuntimeError(f"{mutant.file} must have {mutant.old!r} once")
    command = "python tests/tools/mutants.py"
    names = known_files()
    code = hash_of_code(names)
    keys = {
        number: (mutant.subject, mutant.name, hash_of(mutant, code))
        for number, mutant in numbered.items()
    }
    rows = {}
    for row in resume(options.output, command) if options.output is not None else []:
        key = (row["subject"], row["mutant"], row["code"])
        if row["killed"] and key in keys.values():
            rows[key] = row
    folder = FOLDER
    changed, compiled = switched_files(ROOT, numbered)
    for number, mutant in numbered.items():
        if mutant.file.endswith(".rs") and number not in compiled:
            raise RuntimeError(f"{mutant.file} must have {mutant.old!r} in a function")
    shaders = "src/gpu/shaders.rs"
    if platform.machine() in ("x86_64", "AMD64"):
        lanes = "src/cpu/lanes.rs"
        changed[lanes] = (ROOT / lanes).read_text().replace(" dispatch,", "") + ONE_LEVEL
    changed[shaders] = read_shaders_when_run(changed.get(shaders, (ROOT / shaders).read_text()))
    copy_project(folder, names, changed)
    chosen = {
        number: mutant
        for number, mutant in numbered.items()
        if options.only in (None, mutant.subject) and keys[number] not in rows
    }
    survive = 0
    for number, by in run_all(build(folder), chosen, compiled):
        mutant, key = numbered[number], keys[number]
        print(f"{mutant.subject}, {mutant.name}: {by or 'survives'}", flush=True)
        survive += not by
        row = dict(zip(("subject", "mutant", "code"), key, strict=True))
        rows[key] = {**row, "file": mutant.file, "killed": bool(by), "by": by}
        if options.output is not None:
            write(options.output, command, [rows[key] for key in keys.values() if key in rows])
    print(f"{len(chosen)} mutants run, {survive} survive")
    return int(survive > 0)


if __name__ == "__main__":
    sys.exit(main())
