"""Files of the core import each other in one direction."""

from __future__ import annotations

import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "src"


def imports_of(path):
    """The paths that a file takes names from, as `crate::a::b`; its tests play no part."""
    text = path.read_text().split("#[cfg(test)]\nmod tests")[0]
    text = re.sub(r"^ *//.*$", "", text, flags=re.MULTILINE)
    own = ["crate", *path.relative_to(SOURCE).with_suffix("").parts]
    if own[-1] in ("mod", "lib"):
        own.pop()
    uses = re.findall(r"^(?:pub(?:\(\w+\))? )?use ([^;]+);", text, flags=re.MULTILINE)
    uses += re.findall(r"\b((?:crate|super)(?:::\w+)+)", text)
    children = {found.stem for found in path.parent.iterdir()} if path.name == "mod.rs" else set()
    for use in uses:
        for name in names_of(re.sub(r"\s+", "", use)):
            first, *rest = name.split("::")
            if first == "super":
                above = 1
                while rest and rest[0] == "super":
                    rest.pop(0)
                    above += 1
                yield [*own[: len(own) - above], *rest]
            elif first == "crate":
                yield [first, *rest]
            elif first == "self" or first in children:
                yield [*own, *([] if first == "self" else [first]), *rest]


def names_of(use):
    """Every name of a `use` with braces, in full."""
    if "{" not in use:
        return [use]
    start, rest = use.split("{", 1)
    parts, depth = [""], 0
    for letter in rest.rsplit("}", 1)[0]:
        depth += (letter == "{") - (letter == "}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [name for part in parts if part for name in names_of(start + part)]


def file_of(path):
    """The file that the longest part of a path names."""
    for count in range(len(path), 1, -1):
        stem = SOURCE.joinpath(*path[1:count])
        for candidate in (stem.with_suffix(".rs"), stem / "mod.rs"):
            if candidate.exists():
                return candidate
    return None


def test_no_file_of_the_core_imports_itself_by_way_of_another():
    graph = {}
    for path in (SOURCE / "gpu").rglob("*.rs"):
        found = {file_of(name) for name in imports_of(path)} - {None, path}
        graph[path] = {file for file in found if file.is_relative_to(SOURCE / "gpu")}
    assert sum(map(len, graph.values())) > 100
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        circle = " -> ".join(str(file.relative_to(SOURCE)) for file in error.args[1])
        raise AssertionError(circle) from None
