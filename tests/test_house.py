"""The storeys of the source: what may import what, no circle of imports, nothing too long."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.of_checkout("it reads the source")

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src"
SHADERS = ROOT / "shaders"

Graph = dict[str, set[str]]


def module_of(file: Path) -> str:
    """Path of a Rust module below the crate: `fits::boxes`; of a `mod.rs` its folder's."""
    parts = list(file.relative_to(SOURCE).with_suffix("").parts)
    return "::".join(parts[:-1] if parts[-1] == "mod" else parts)


def paths_of(tree: str, prefix: str = "") -> Iterator[str]:
    """The paths of a `use` tree: `a::{b, c::d}` has `a::b` and `a::c::d`."""
    depth, start, parts = 0, 0, []
    for i, letter in enumerate(tree):
        depth += (letter == "{") - (letter == "}")
        if letter == "," and depth == 0:
            parts.append(tree[start:i])
            start = i + 1
    for part in [*parts, tree[start:]]:
        head, brace, rest = part.strip().partition("{")
        if brace:
            yield from paths_of(rest[: rest.rindex("}")], prefix + head)
        elif head:
            yield prefix + head.split(" as ")[0]


def imports_of(text: str, module: str, is_folder: bool) -> set[str]:
    """Absolute paths that a file names, but for its tests."""
    text = re.sub(r"//.*", "", text.split("#[cfg(test)]\nmod tests")[0])
    trees = re.findall(r"\buse ((?:[^;{]|\{[^;]*\})+);", text)
    named = re.findall(r"\b(?:crate|super)(?:::\w+)+", text)
    children = re.findall(r"\bmod (\w+);", text)
    parent = module if is_folder else module.rpartition("::")[0]
    found = set()
    for path in [path for tree in trees for path in paths_of(tree)] + named:
        head, _, rest = path.partition("::")
        if head == "crate":
            found.add(rest)
        elif head == "super":
            above = module.rpartition("::")[0] if is_folder else parent
            found.add(f"{above}::{rest}".removeprefix("::"))
        elif head == "self" or head in children:
            found.add(f"{module}::{path.removeprefix('self::')}")
    return found


def rust_graph(source: Path = SOURCE) -> Graph:
    """Modules but for those of tests, and those that each imports."""
    files = {module_of(file): file for file in source.rglob("*.rs") if file.name != "lib.rs"}
    for module, file in [("", source / "lib.rs"), *files.items()]:
        for name in re.findall(r"#\[cfg\(test\)\]\nmod (\w+);", file.read_text()):
            del files[f"{module}::{name}".removeprefix("::")]
    graph: Graph = {}
    for module, file in files.items():
        graph[module] = set()
        for path in imports_of(file.read_text(), module, file.name == "mod.rs"):
            while path and path not in files:
                path = path.rpartition("::")[0]
            # The front of a folder may name its own files, which share what stands there.
            if path and path != module and path.rpartition("::")[0] != module:
                graph[module].add(path)
    return graph


def shader_graph() -> Graph:
    """Shaders by their names, and those that each imports."""
    return {
        str(file.relative_to(SHADERS).with_suffix("")): set(
            re.findall(r"^#import (\S+)", file.read_text(), re.MULTILINE)
        )
        for file in SHADERS.rglob("*.wgsl")
    }


def circle_in(graph: Graph) -> list[str]:
    """Modules of which each imports the next, and the last the first; none without a circle."""
    done: set[str] = set()

    def search(module: str, way: list[str]) -> list[str]:
        if module in way:
            return way[way.index(module) :]
        if module in done:
            return []
        for other in sorted(graph.get(module, ())):
            if circle := search(other, [*way, module]):
                return circle
        done.add(module)
        return []

    return next((circle for module in sorted(graph) if (circle := search(module, []))), [])


def test_a_circle_is_found() -> None:
    graph = {"a": {"b", "d"}, "b": {"c"}, "c": {"a"}, "d": set()}
    assert circle_in(graph) == ["a", "b", "c"]
    assert circle_in(graph | {"c": {"d"}}) == []


def test_imports_are_read_from_a_file() -> None:
    text = """
        pub mod child;
        use crate::fits::{boxes::{self, Cut}, layer::Layer};
        use super::parallel::axes_at;
        use child::Thing;
        fn f() -> crate::error::Result<()> {} // crate::comment
        #[cfg(test)]\nmod tests { use crate::gpu; }
    """
    expected = {
        "fits::boxes::self", "fits::boxes::Cut", "fits::layer::Layer", "a::parallel::axes_at",
        "a::b::child::Thing", "error::Result",
    }  # fmt: skip
    assert expected <= imports_of(text, "a::b", True)
    assert not [path for path in imports_of(text, "a::b", True) if "gpu" in path or "com" in path]


def test_no_circle_of_imports_among_shaders() -> None:
    assert circle_in(shader_graph()) == []


def test_no_circle_of_imports_among_modules() -> None:
    assert circle_in(rust_graph()) == []


# The folders and files of each storey, and what they must not name.
WORLD = {
    "aliasing", "bias", "bvh", "camera", "edge_directions", "edges", "error", "frustum", "geometry",
    "importance", "instructions", "lanes", "light", "lock", "map_settings", "map_size", "masks",
    "moments", "neighbourhood", "occlusion", "paging", "projection", "reference", "region",
    "rounding", "scene", "sides", "stats", "threads", "warp",
}  # fmt: skip
ENGINES = {"gpu", "cpu"}
TOP = {"engine", "render", "python"}
STOREYS = [
    (WORLD, {"fits", "methods"} | ENGINES | TOP),
    ({"fits"}, {"methods", "verbs"} | ENGINES | TOP),
    ({"verbs"}, {"methods"} | ENGINES | TOP),
    (ENGINES, {"methods"} | TOP),
    ({"cpu"}, {"gpu"}),
    ({"gpu"}, {"cpu"}),
    ({"methods"}, TOP),
    ({"engine", "render"}, {"python"}),
]


def test_every_module_has_a_storey() -> None:
    modules = {module.partition("::")[0] for module in rust_graph()}
    assert modules == {name for storey, _ in STOREYS for name in storey} | {"python"}


@pytest.mark.parametrize(("storey", "above"), STOREYS, ids=lambda names: "+".join(sorted(names)))
def test_no_storey_knows_the_one_above(storey: set[str], above: set[str]) -> None:
    named = {
        f"{module} names {other}"
        for module, others in rust_graph().items()
        for other in others
        if module.partition("::")[0] in storey and other.partition("::")[0] in above
    }
    assert named == set()


def test_only_python_names_pyo3() -> None:
    naming = [file for file in SOURCE.rglob("*.rs") if re.search(r"\bpyo3\b", file.read_text())]
    assert {module_of(file).partition("::")[0] for file in naming} <= {"python", "lib"}


MAX_FUNCTION_LINES = 90
MAX_FILE_LINES = 600
# The reference is one argument from its first line to its last.
LONG_FILES = {"src/reference.rs"}


def functions_of(file: Path) -> Iterator[tuple[str, int]]:
    """Functions of a file, and how many lines each has."""
    text = file.read_text()
    if file.suffix == ".py":
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                yield node.name, (node.end_lineno or node.lineno) - node.lineno + 1
        return
    lines = text.splitlines()
    for number, line in enumerate(lines):
        if found := re.match(r"( *)(?:pub(?:\(\w+\))? )?(?:const )?fn (\w+)", line):
            end = (i for i in range(number, len(lines)) if lines[i].startswith(f"{found[1]}}}"))
            yield found[2], next(end, number) - number + 1


def test_functions_and_files_are_short() -> None:
    files = [
        file
        for folder in ("src", "shaders", "python", "tests", "docs")
        for file in (ROOT / folder).rglob("*")
        if file.suffix in (".rs", ".wgsl", ".py")
    ]
    too_long = [
        f"{file.relative_to(ROOT)}, {name}: {lines} lines"
        for file in files
        for name, lines in functions_of(file)
        if lines > MAX_FUNCTION_LINES
    ]
    long_files = {
        str(file.relative_to(ROOT))
        for file in files
        if len(file.read_text().splitlines()) > MAX_FILE_LINES
    }
    assert (too_long, long_files) == ([], LONG_FILES)
