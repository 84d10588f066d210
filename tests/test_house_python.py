"""The storeys of the Python package: who may import whom, and where the names of passes stand."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import lixel as lx
from lixel import _core
from lixel.lab import passes

PACKAGE = Path(lx.__file__).parent

# What experiments share; none of it knows an experiment.
SHARED = {
    "hard_views", "options", "passes", "random_views", "rays", "report", "result_tables", "timing",
    "views",
}  # fmt: skip


def name_of(path: Path) -> str:
    parts = ["lixel", *path.relative_to(PACKAGE).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {name_of(path): path for path in PACKAGE.rglob("*.py")}


def imports_of(name: str) -> set[str]:
    """The package's modules that a module imports, at any place but for the checker of types."""
    tree = ast.parse(FILES[name].read_text(encoding="utf-8"))
    package = name if FILES[name].name == "__init__.py" else name.rpartition(".")[0]
    only_for_types = {
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    found = set()
    for node in ast.walk(tree):
        if node in only_for_types:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level]
            source = ".".join([*(above if node.level else []), *filter(None, [node.module])])
            for alias in node.names:
                inner = f"{source}.{alias.name}"
                found.add(inner if inner in {*FILES, "lixel._core"} else source)
    return found & set(FILES)


IMPORTS = {name: imports_of(name) for name in FILES}


def test_the_imports_have_no_circle():
    # Raises an error that names the circle.
    assert len(list(TopologicalSorter(IMPORTS).static_order())) == len(FILES)


@pytest.mark.parametrize("name", sorted(FILES))
def test_no_module_imports_from_a_storey_above(name):
    lab = {other for other in IMPORTS[name] if other.startswith("lixel.lab")}
    pictures = {other for other in IMPORTS[name] if other.startswith("lixel.pictures")}
    if name.startswith("lixel.lab."):
        _, _, module, *_ = name.split(".")
        if module in SHARED:
            assert {other.split(".")[2] for other in lab} <= SHARED
    elif name.startswith("lixel.pictures"):
        assert not lab
    elif name == "lixel":
        assert lab == {"lixel.lab.study"}
        assert not pictures
    elif name not in ("lixel.cli", "lixel.__main__"):
        assert not lab
        # A frame shows itself as a picture.
        assert pictures <= {"lixel.pictures.display"}


@pytest.mark.parametrize("name", sorted(FILES))
def test_the_command_is_the_one_way_to_run(name):
    text = FILES[name].read_text(encoding="utf-8")
    assert name == "lixel.__main__" or '__name__ == "__main__"' not in text
    assert name == "lixel.cli" or "ArgumentParser(" not in text


def test_every_pass_is_in_one_group():
    assert sorted(label for group in passes.GROUPS for label in group) == sorted(_core.labels())


@pytest.mark.parametrize("name", sorted(set(FILES) - {"lixel.lab.passes"}))
def test_no_other_module_spells_a_pass(name):
    words_of_the_field = {"shadow map", "importance map", "warp map"}
    labels = {label for label in _core.labels() if " " in label} - words_of_the_field
    tree = ast.parse(FILES[name].read_text(encoding="utf-8"))
    texts = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)}
    assert not labels & {text.split(".")[-1] for text in texts if isinstance(text, str)}
