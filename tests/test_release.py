"""What a release needs: one version everywhere, and a public interface with words and types."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest
import yaml

import lixel as lx

pytestmark = pytest.mark.of_checkout("it reads files of the checkout")

ROOT = Path(__file__).parents[1]


def found_in(file: str, pattern: str) -> str:
    found = re.search(pattern, (ROOT / file).read_text(encoding="utf-8"), re.M)
    assert found is not None, file
    return found[1]


def test_every_file_has_the_same_version():
    package = r'^name = "lixel"\nversion = "([\d.]+)"'
    versions = {
        "Cargo.toml": found_in("Cargo.toml", package),
        "Cargo.lock": found_in("Cargo.lock", package),
        "CITATION.cff": found_in("CITATION.cff", r"^version: ([\d.]+)$"),
        "CHANGELOG.md": found_in("CHANGELOG.md", r"^## \[([\d.]+)\]"),
    }
    assert len(set(versions.values())) == 1, versions


def test_the_citation_file_names_every_reference_in_full():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors", "version", "license"} <= set(cited)
    for reference in cited["references"]:
        assert {"type", "title", "authors"} <= set(reference)
        assert "year" in reference or "notes" in reference


@pytest.mark.parametrize(
    "path", sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.md")), ids=lambda p: p.stem
)
def test_templates_of_issues_have_a_name_and_name_commands_that_there_are(path):
    text = path.read_text(encoding="utf-8")
    _, head, body = text.split("---\n", 2)
    assert set(yaml.safe_load(head)) == {"name", "about"}
    commands = set(re.findall(r"\blixel (\w+)", body)) - {"wrote"}
    from lixel import cli

    assert commands <= set(cli.COMMANDS)


def public_callables():
    """Functions of the package's front, and methods of its classes that are its own."""
    for name in lx.__all__:
        value = getattr(lx, name)
        if inspect.isfunction(value):
            yield name, value
        elif inspect.isclass(value) and value.__module__.startswith("lixel"):
            for attribute, member in inspect.getmembers_static(value):
                if isinstance(member, (classmethod, staticmethod)):
                    member = member.__func__
                member = member.fget if isinstance(member, property) else member
                if inspect.isfunction(member) and not attribute.startswith("_"):
                    yield f"{name}.{attribute}", member


@pytest.mark.parametrize(("name", "value"), dict(public_callables()).items())
def test_what_is_public_has_words_and_types(name, value):
    assert inspect.getdoc(value)
    signature = inspect.signature(value)
    untyped = [
        p.name
        for p in signature.parameters.values()
        if p.annotation is p.empty and p.name not in ("self", "cls")
    ]
    assert untyped == []
    assert signature.return_annotation is not signature.empty


@pytest.mark.parametrize("name", [n for n in lx.__all__ if inspect.isfunction(getattr(lx, n))])
def test_each_argument_of_a_function_is_described(name):
    function = getattr(lx, name)
    described = re.findall(
        r"^(\*{0,2}\w+(?:, \*{0,2}\w+)*)(?: : .*)?$", inspect.getdoc(function), re.M
    )
    words = {word.strip("*") for line in described for word in line.split(", ")}
    assert set(inspect.signature(function).parameters) <= words


# --- The workflow that makes wheels ---

WORKFLOW = ROOT / ".github" / "workflows" / "wheels.yml"
JOBS = yaml.safe_load(WORKFLOW.read_text(encoding="utf-8"))["jobs"]


def steps_of(job, action):
    """What each step of a job gives an action."""
    return [step["with"] for step in JOBS[job]["steps"] if step.get("uses", "").startswith(action)]


def commands_of(job):
    return "\n".join(step.get("run", "") for step in JOBS[job]["steps"])


def test_wheels_are_of_the_oldest_python_and_tested_on_a_newer_one():
    oldest = found_in("pyproject.toml", r'^requires-python = ">=([\d.]+)"$')
    # One wheel for all of them.
    assert found_in("Cargo.toml", r'features = \["abi3-py(\d+)"\]') == oldest.replace(".", "")
    for job in ("wheel", "sdist"):
        assert steps_of(job, "actions/setup-python@") == [{"python-version": oldest}]
    versions = JOBS["test"]["strategy"]["matrix"]["python"]
    assert versions[0] == oldest
    assert len(versions) > 1


def test_every_wheel_is_built_with_the_lock_file_and_tested():
    platforms = {row["platform"]: row for row in JOBS["wheel"]["strategy"]["matrix"]["include"]}
    assert set(platforms) == {
        "manylinux-x86_64", "manylinux-aarch64", "macos-arm64", "windows-x86_64",
    }  # fmt: skip
    matrix = JOBS["test"]["strategy"]["matrix"]
    assert matrix["platform"] == list(platforms)
    # Where it was built, so that it runs on the processor that it is for.
    assert {row["platform"]: row["runner"] for row in matrix["include"]} == {
        name: row["runner"] for name, row in platforms.items()
    }
    (built,) = steps_of("wheel", "PyO3/maturin-action@")
    assert {"--release", "--locked", "--strip"} <= set(built["args"].split())
    (uploaded,), (fetched,) = (
        steps_of("wheel", "actions/upload-artifact@"),
        steps_of("test", "actions/download-artifact@"),
    )
    assert uploaded["name"] == fetched["name"]
    (packed,) = steps_of("sdist", "PyO3/maturin-action@")
    assert packed["command"] == "sdist"


def test_wheels_are_tested_on_the_cpu_engine_alone():
    assert JOBS["test"]["env"] == JOBS["sdist"]["env"] == {"LIXEL_DEVICE": "cpu"}
    marker = re.search(r'pytest .*-m "not (\w+)"', commands_of("test"))[1]
    assert f'"{marker}(why): ' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    for job in ("test", "sdist"):
        for tool in re.findall(r"python (tests/\S+)", commands_of(job)):
            assert (ROOT / tool).is_file()
    # No driver is installed, and nothing of the checkout's package is used.
    assert not re.search(r"apt|vulkan|PYTHONPATH", commands_of("test"))
