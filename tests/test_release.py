"""What a release needs: one version everywhere, and a public interface with words and types."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest
import yaml

import lixel as lx

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
