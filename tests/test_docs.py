"""The documentation: its examples run, and the site is built without a warning."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import lixel as lx
from lixel.lab.result_tables import read

DOCS = Path(__file__).parents[1] / "docs"
PAGES = sorted((DOCS / "pages").glob("**/*.md"))


def examples(path):
    return re.findall(r"^```python\n(.*?)^```$", path.read_text(), flags=re.M | re.S)


@pytest.mark.parametrize("path", [p for p in PAGES if examples(p)], ids=lambda p: p.stem)
def test_examples_run(path, tmp_path):
    """The examples of a page run one after the other, as a test where they hold one."""
    code = "\n".join(examples(path))
    script = tmp_path / "test_example.py"
    # Drawn without a window.
    script.write_text(f"import matplotlib\nmatplotlib.use('agg')\n{code}")
    command = [str(script)]
    if "def test_" in code:
        command = ["-m", "pytest", "-q", str(script)]
    ran = subprocess.run(
        [sys.executable, *command], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_the_table_of_methods_is_what_the_demo_measured():
    table = read(DOCS / "results" / "demo" / "llvmpipe.csv")
    measured = [
        f"| {row['GPU ms']:,.0f} | {row['misclassified']:,} | {row['% of covered']:.2f} | "
        f"{row['false shadow']:,} |"
        for row in table.to_dict("records")
    ]
    readme = (DOCS.parent / "README.md").read_text()
    shown = re.findall(
        r"^\| `([^`]+)` \| [^|]+ (\| .* \| .* \| .* \| .* \|)$", readme, re.MULTILINE
    )
    assert shown == list(zip(table["method"], measured, strict=True))


def test_the_site_is_built_without_a_warning(tmp_path):
    ran = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet",
         "--config-file", str(DOCS / "mkdocs.yml"), "--site-dir", str(tmp_path / "site")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout + ran.stderr
    for name, method in lx.METHODS.items():
        page = (tmp_path / "site" / "methods" / name / "index.html").read_text()
        assert f"lx.{method.__name__}" in page
        assert (tmp_path / "site" / "methods" / f"{name}.png").stat().st_size > 10_000
        # Equations are drawn, and nothing of the docstring's own markup is left.
        assert ("<svg" in page.split("<article")[1]) == (".. math::" in (method.__doc__ or ""))
        assert "math::" not in page
    api = (tmp_path / "site" / "api" / "index.html").read_text()
    methods = {method.__name__ for method in lx.METHODS.values()}
    for name in {*lx.__all__} - methods - {"__version__", "scenes"}:
        assert f'id="lixel.{name}"' in api
