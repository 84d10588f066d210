"""Measure the line coverage of Rust and Python by all tests: `make coverage`.

For Python the tests run in one process, half an hour. For Rust the extension module and the Rust
tests are built with counters, and what both and the Python tests run counts. That takes hours, as
counting slows the reference down. The tests' own lines do not count.

python tests/tools/measure_coverage.py --language python
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

import core_library

from lixel.lab.result_tables import write

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "out" / "coverage"
TARGET = ROOT / "target" / "coverage"
PROFILES = FOLDER / "profiles"

PYTEST = ("-m", "pytest", "--quiet", "--timeout=3600")


def run(*command: str | Path, **environment: str | Path) -> str:
    """What the command prints; it prints its errors itself."""
    print("$", *command, flush=True)
    changed = {**os.environ, **{name: str(value) for name, value in environment.items()}}
    ended = subprocess.run(list(map(str, command)), cwd=ROOT, env=changed, stdout=subprocess.PIPE)
    printed = ended.stdout.decode()
    if ended.returncode != 0:
        raise SystemExit(f"{printed}\n{command[0]} failed")
    return printed


def llvm(tool: str) -> Path:
    """Of the Rust toolchain, `rustup component add llvm-tools`."""
    found = list(Path(run("rustc", "--print", "sysroot").strip()).glob(f"lib/rustlib/*/bin/{tool}"))
    if not found:
        raise SystemExit(f"{tool} must be installed: rustup component add llvm-tools")
    return found[0]


def measured_rust() -> list[Path]:
    """Runs all tests; the programs and libraries that have counters."""
    counting = {
        "RUSTFLAGS": "-C instrument-coverage",
        "CARGO_TARGET_DIR": TARGET,
        # Threads that count the same lines wait for each other.
        "RAYON_NUM_THREADS": "1",
        "LLVM_PROFILE_FILE": PROFILES / "%p-%8m.profraw",
        "LD_LIBRARY_PATH": sysconfig.get_config_var("LIBDIR") or "",
    }
    run("cargo", "build", "--release", "--locked", "--lib", **counting)
    messages = run(
        "cargo", "test", "--release", "--locked", "--lib", "--no-run",
        "--message-format=json", **counting,
    )  # fmt: skip
    built = [json.loads(line) for line in messages.splitlines()]
    (tests,) = (Path(message["executable"]) for message in built if message.get("executable"))
    run(tests, **counting)
    folder = FOLDER / "python"
    shutil.copytree(ROOT / "python", folder)
    module = core_library.install(TARGET / "release", folder / "lixel")
    run(
        sys.executable, *PYTEST, "--numprocesses=2", "--dist=loadfile",
        PYTHONPATH=folder, **counting,
    )  # fmt: skip
    return [module, tests]


def rust() -> Iterator[tuple[str, int, int]]:
    """File, lines and covered lines."""
    PROFILES.mkdir(parents=True)
    objects = measured_rust()
    merged = FOLDER / "merged.profdata"
    run(llvm("llvm-profdata"), "merge", "--sparse", "--output", merged, PROFILES)
    first, *others = objects
    lines = run(
        llvm("llvm-cov"), "export", "--format=lcov", f"--instr-profile={merged}", first,
        *(f"--object={other}" for other in others),
    )  # fmt: skip
    counts: dict[int, int] = {}
    path = Path()
    for line in lines.splitlines():
        kind, _, value = line.partition(":")
        if kind == "SF":
            path, counts = Path(value), {}
        elif kind == "DA":
            number, count, *_ = value.split(",")
            counts[int(number)] = int(count)
        elif kind == "end_of_record" and path.is_relative_to(ROOT / "src"):
            source = path.read_text(encoding="utf-8").splitlines()
            last = source.index("#[cfg(test)]") if "#[cfg(test)]" in source else len(source)
            own = [count for number, count in counts.items() if number <= last]
            yield str(path.relative_to(ROOT)), len(own), sum(count > 0 for count in own)


def python() -> Iterator[tuple[str, int, int]]:
    """File, lines and covered lines."""
    # In one process, where counting begins before pytest loads lixel's plugin.
    coverage = (sys.executable, "-m", "coverage")
    data = f"--data-file={FOLDER / 'python.data'}"
    report = FOLDER / "python.json"
    run(*coverage, "run", data, "--source=lixel", *PYTEST)
    run(*coverage, "json", data, "-o", report)
    for name, found in json.loads(report.read_text(encoding="utf-8"))["files"].items():
        summary = found["summary"]
        yield name, summary["num_statements"], summary["covered_lines"]


LANGUAGES = {"python": python, "rust": rust}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--language", choices=LANGUAGES, help="default: both")
    chosen = parser.parse_args().language
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    rows = []
    for language in [chosen] if chosen else LANGUAGES:
        files = list(LANGUAGES[language]())
        whole = ("all", sum(file[1] for file in files), sum(file[2] for file in files))
        for name, lines, covered in [*sorted(files), whole]:
            percent = f"{100.0 * covered / max(lines, 1):.1f}"
            row = {"language": language, "file": name, "lines": lines, "covered": covered}
            rows.append({**row, "percent": percent})
        print(f"{language}: {whole[2]:,} of {whole[1]:,} lines, {rows[-1]['percent']} %")
    command = "python tests/tools/measure_coverage.py" + (f" --language {chosen}" if chosen else "")
    write(FOLDER / "coverage.csv", command, rows)


if __name__ == "__main__":
    main()
