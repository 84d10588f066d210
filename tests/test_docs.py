"""The documentation: its examples run, and the site is built without a warning."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import diagrams
import matplotlib.pyplot as plt
import numpy as np
import pytest
import tables
from PIL import Image

import lixel as lx

pytestmark = pytest.mark.of_checkout("it builds the documentation")

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
        [sys.executable, *command],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr


@pytest.mark.parametrize("page", tables.PAGES, ids=lambda p: p.stem)
def test_tables_in_prose_are_made_from_the_results(page):
    """`python docs/tables.py` writes them."""
    text = page.read_text(encoding="utf-8")
    assert tables.filled(text) == text


def test_every_table_stands_in_a_page():
    pages = "".join(page.read_text(encoding="utf-8") for page in tables.PAGES)
    missing = [name for name in tables.BLOCKS if f"<!-- {name} -->" not in pages]
    assert missing == []


def test_every_kept_file_is_described():
    kept = {path.relative_to(tables.RESULTS).with_suffix("").as_posix() for path in tables.kept()}
    # That of `tests/tools/mutants.py` comes and goes.
    assert kept <= set(tables.WHAT) <= kept | {"stability/mutants"}


def test_the_rule_of_the_auto_lookup_has_the_numbers_of_the_shader():
    shader = (DOCS.parent / "shaders" / "lookup.wgsl").read_text(encoding="utf-8")
    numbers = re.findall(r"const AGREEING\w*: f32 = ([\d.]+);", shader)
    numbers += re.findall(r"ninths >= (\d)u", shader)
    assert sorted(numbers) == ["0.6", "0.9", "4", "6"]
    page = (DOCS / "pages" / "index.md").read_text(encoding="utf-8")
    for text in (page, lx.methods.ShadowMapMethod.__doc__):
        rule = text[text.index("in this order") :][:900]
        assert all(re.search(rf"\b{re.escape(number)}\b", rule) for number in numbers)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site, built without a warning."""
    folder = tmp_path_factory.mktemp("docs") / "site"
    ran = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet",
         "--config-file", str(DOCS / "mkdocs.yml"), "--site-dir", str(folder)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return folder


def test_every_method_has_a_page(site):
    for name, method in lx.METHODS.items():
        page = (site / "methods" / name / "index.html").read_text()
        assert f"lx.{method.__name__}" in page
        assert (site / "methods" / f"{name}.png").stat().st_size > 10_000
        # Equations are drawn, and nothing of the docstring's own markup is left.
        assert ("<svg" in page.split("<article")[1]) == (".. math::" in (method.__doc__ or ""))
        assert "math::" not in page
        # A list within a list ends where it does in the docstring.
        assert page.count("<li>Otherwise lit.</li>\n</ol>") == page.count("Otherwise lit.")
        # On both engines, by a light that the method takes.
        measured = re.findall(r"<h2 [^>]*>Measured by an? (\w+) light on ([^<&]+)", page)
        assert len({device for _, device in measured}) == 2, name
        assert ("directional" in dict(measured)) == method().takes(lx.DirectionalLight((0, -1, 0)))


def test_the_drawings_of_concepts_show_what_their_page_says():
    edges = diagrams.edges().axes[0].images[0].get_array()
    wrong = np.argwhere((edges == diagrams.colour(diagrams.RED)).all(axis=-1))
    assert 100 < len(wrong) < 2000
    # Whole texels are one answer, so that wrong pixels come in blocks along the edge.
    assert len(np.unique(wrong // 10, axis=0)) < len(wrong) / 5
    titles = [ax.get_title() for ax in diagrams.warps().axes]
    counts = [int(re.sub(r"\D", "", title)) for title in titles]
    assert [title.partition(":")[0] for title in titles] == ["desired_view", "rtw", "notw"]
    assert counts == sorted(counts, reverse=True)
    stripes, enough, leak = diagrams.bias().axes
    dark, falsely_lit = (
        [ax.lines[i].get_ydata() for ax in (stripes, enough, leak)] for i in (1, 2)
    )
    changes = [np.count_nonzero(np.diff(np.isnan(y))) for y in dark]
    assert changes[0] > 10
    assert changes[1:] == [2, 0]
    # Of 400 places below the plate.
    assert [np.count_nonzero(~np.isnan(y)) > 350 for y in falsely_lit] == [False, False, True]
    plt.close("all")


def test_every_public_name_is_in_the_api(site):
    api = (site / "api" / "index.html").read_text()
    methods = {method.__name__ for method in lx.METHODS.values()}
    for name in {*lx.__all__} - methods - {"__version__", "scenes"}:
        assert f'id="lixel.{name}"' in api


def test_the_home_page_shows_every_method(site):
    home = (site / "index.html").read_text()
    shown = re.findall(r'<a href="methods/(\w+)/"><img src="gallery/(\w+).png"', home)
    assert shown == [(name, name) for name in lx.METHODS]
    wrong = dict(re.findall(r'alt="(\w+): ([\d,]+) wrong"', home))
    assert wrong["exact"] == wrong["ray_traced"] == "0"
    for name in lx.METHODS:
        pixels = np.asarray(Image.open(site / "gallery" / f"{name}.png")).astype(int)
        red = np.count_nonzero(pixels[..., 0] - pixels[..., 1] > 100)
        assert red == int(wrong[name].replace(",", "")), name


class Links(HTMLParser):
    """What a page refers to, and the names of its places."""

    def __init__(self, page):
        super().__init__()
        self.found, self.places = set(), set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ("href", "src"):
                self.found.add(value)
            elif name in ("id", "name"):
                self.places.add(value)


def test_links_within_the_site_lead_somewhere(site):
    # Its links begin at the address that the site will have.
    pages = {page: Links(page) for page in site.rglob("*.html") if page.name != "404.html"}
    assert len(pages) > len(lx.METHODS)
    broken = []
    for page, links in pages.items():
        for link in links.found:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            target = target / "index.html" if target.is_dir() else target
            places = pages[target].places if target in pages else {""}
            if not target.is_file() or unquote(parts.fragment) not in {"", *places}:
                broken.append(f"{page.relative_to(site)}: {link}")
    assert broken == []
