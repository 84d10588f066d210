"""The package as a whole: names, documentation, and a quick import."""

from __future__ import annotations

import doctest
import importlib
import inspect
import os
import pkgutil
import re
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

import lixel as lx

ROOT = Path(__file__).parents[1]
MODULES = [m.name for m in pkgutil.iter_modules(lx.__path__) if m.name not in ("_core", "__main__")]


@pytest.mark.parametrize("name", lx.__all__)
def test_public_names_are_documented(name):
    value = getattr(lx, name)
    if inspect.isclass(value) or inspect.isfunction(value) or inspect.ismodule(value):
        assert inspect.getdoc(value)


@pytest.mark.parametrize("name", MODULES)
def test_docstring_examples_run(name):
    module = importlib.import_module(f"lixel.{name}")
    # sys.modules, because `lixel.compare` is the function.
    assert doctest.testmod(sys.modules[module.__name__]).failed == 0


def test_import_leaves_slow_packages_alone():
    code = "import lixel, sys; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    slow = {"trimesh", "skimage", "scipy", "matplotlib", "PIL", "pandas", "tqdm"}
    assert slow.isdisjoint(loaded.stdout.split())


def test_a_server_without_a_desktop_gets_no_complaints():
    desktop = {"XDG_RUNTIME_DIR", "NODEVICE_SELECT"}
    code = (
        "import lixel as lx; s = lx.scenes.plane_and_box(); "
        "lx.render_shadows(s, s.cameras['default'].resized(64, 36), s.lights['default'])"
    )
    ran = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={name: value for name, value in os.environ.items() if name not in desktop},
    )
    assert (ran.stdout, ran.stderr) == ("", "")


@pytest.mark.of_checkout("it packs the checkout")
def test_the_source_distribution_is_small_and_has_no_results(tmp_path):
    command = [sys.executable, "-m", "maturin", "sdist", "-o", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    (archive,) = tmp_path.iterdir()
    assert archive.stat().st_size < 2_000_000
    with tarfile.open(archive) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    assert {"Cargo.lock", "pyproject.toml", "README.md", "src/lib.rs"} <= names
    assert "python/lixel/lab/viewer/page.html" in names
    assert {p.relative_to(ROOT).as_posix() for p in (ROOT / "shaders").rglob("*.wgsl")} <= names
    assert not [name for name in names if name.startswith(("docs/", "notebooks/", "tests/"))]


@pytest.mark.of_checkout("it runs make")
@pytest.mark.skipif(sys.platform != "linux", reason="make and apt are Linux's")
def test_make_demo_says_what_it_installs_before_it_does():
    dry = subprocess.run(
        ["make", "--dry-run", "demo"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert dry.stdout.index("make demo installs") < dry.stdout.index(".ci/setup\n")
    said = subprocess.run(
        ["make", "announce"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    assert re.search(r"^  for the system: (nothing|[a-z0-9 .-]+)$", said, re.M)
    for words in (".venv: maturin and lixel", "target: what cargo builds", "pictures into out/"):
        assert words in said


def test_info_is_readable():
    found = lx.info()
    text = str(found)
    assert lx.__version__ in text
    assert (found.device is None) == (found.problem is not None)
    for adapter in found.adapters:
        assert adapter["name"] in text
