"""What the documentation makes of the code: a page for each method, the API, mathematics.

A hook of mkdocs; `make docs` builds the site. Methods, their docstrings and their citations are
asked of the package, the figures are rendered, and the measurements are read from `results/`. The
tables of the other pages are written into them by tables.py.
"""

from __future__ import annotations

import dataclasses
import inspect
import io
import os
import re
import subprocess
import sys
import tempfile
import textwrap
from functools import cache
from pathlib import Path

import diagrams
import matplotlib as mpl
import matplotlib.pyplot as plt
import pandas as pd
from markdown import Extension, Markdown
from markdown.preprocessors import Preprocessor
from matplotlib import mathtext
from matplotlib.figure import Figure
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

import lixel as lx
from lixel import _core
from lixel.lab import departures
from lixel.lab.result_tables import read
from lixel.methods import PAPERS, PUBLISHED
from lixel.pictures import display, page_plots, plots

mpl.use("agg")

RESULTS = Path(__file__).parent / "results"
TITLES = {method["name"]: method["title"] for method in _core.methods()}
MODULES = (
    "scenes", "methods.published", "pictures.plots", "pictures.page_plots", "pictures.warp_plots",
    "pictures.explore", "testing", "pytest_plugin", "lab.papers", "lab.stress", "lab.culling",
    "lab.flicker", "lab.result_tables",
)  # fmt: skip
CITATIONS = {method["name"]: method["citation"] for method in _core.methods()}


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    config.markdown_extensions.append(Mathematics())
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    def add(uri: str, content: str | bytes) -> None:
        if uri in files.src_uris:
            files.remove(files.src_uris[uri])
        files.append(File.generated(config, uri, content=content))

    add("methods/index.md", methods_page())
    for name, method in lx.METHODS.items():
        add(f"methods/{name}.md", method_page(name, method))
        add(f"methods/{name}.png", figure(method))
        add(f"gallery/{name}.png", display.png_bytes(compared(method, *IN_GALLERY).picture()))
    folder = Path(__file__).parent
    # What the site has no page of stays as words.
    results = (RESULTS / "README.md").read_text(encoding="utf-8")
    add("results.md", re.sub(r"\[([^]]+)\]\(\.\./[^)]+\)", r"`\1`", results))
    add("virtual_pages.png", pages_figure())
    for name, draw in diagrams.DIAGRAMS.items():
        add(f"concepts/{name}.svg", diagrams.svg(draw))
    for page in ("tutorial", "holes"):
        for name, content in saved_by(files.src_uris[f"{page}.md"].content_string):
            add(f"{page}/{name}", content)
    add("side_by_side.png", (folder / "side_by_side.png").read_bytes())
    picture = folder / "time_against_error.png"
    if picture.exists():
        add("methods/time_against_error.png", picture.read_bytes())
    add("api.md", api_page(files.src_uris["api.md"].content_string))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    return markdown.replace("<!-- gallery -->", gallery())


def saved_by(page: str) -> list[tuple[str, bytes]]:
    """The pictures that the examples of a page save."""
    code = "\n".join(re.findall(r"^```python\n(.*?)^```$", page, flags=re.M | re.S))
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "MPLBACKEND": "agg", "LIXEL_DEVICE": "cpu"}
        subprocess.run(
            [sys.executable, "-c", code], cwd=folder, env=environment, check=True,
            stdout=subprocess.DEVNULL,
        )  # fmt: skip
        return [(path.name, path.read_bytes()) for path in sorted(Path(folder).glob("*.png"))]


# --- Pages ---


def gallery() -> str:
    """Every method in the same view, each picture a link to its page."""
    cards = []
    for name, method in lx.METHODS.items():
        found = compared(method, *IN_GALLERY)
        wrong = f"{found.misclassified_count:,} wrong"
        lamp = "" if method().takes(SUN) else ", by a lamp"
        cards.append(
            f'<a href="methods/{name}/"><img src="gallery/{name}.png" alt="{name}: {wrong}" '
            f'width="{IN_GALLERY[0][0]}" height="{IN_GALLERY[0][1]}" loading="lazy">'
            f"<code>{name}</code> <span>{wrong}{lamp}</span></a>"
        )
    return f'<div class="gallery">\n{chr(10).join(cards)}\n</div>'


def methods_page() -> str:
    rows = "\n".join(
        f"| [`{name}`]({name}.md) | `lx.{method.__name__}` | {TITLES[name]} |"
        for name, method in lx.METHODS.items()
    )
    lines = [
        "# Methods",
        'A method is a name, `method="rtw"`, or an object with parameters, '
        "`lx.RectilinearWarp(resolution=2048)`.",
        f"| name | object | title |\n|---|---|---|\n{rows}",
    ]
    if (RESULTS.parent / "time_against_error.png").exists():
        lines.append("![Time against error](time_against_error.png)")
    return "\n\n".join(lines)


def method_page(name: str, method: type) -> str:
    return "\n\n".join(
        [
            f"# {TITLES[name]}",
            f'`method="{name}"`, or `lx.{method.__name__}` with parameters. {CITATIONS[name]}',
            f"![Shadows by {name}, its aliasing error and its wrong pixels]({name}.png)",
            "The colonnade at 480 x 270"
            + (", with a map of 256²" if is_sized(method) else "")
            + ": wrong pixels in red, and the aliasing error.",
            *docstring(method),
            *as_published(name),
            *measurements(name),
        ]
    )


def docstring(method: type) -> list[str]:
    """The class's own words, and what the class that it builds on says of the other parameters."""
    words = sections(method)
    parts = [words.pop(""), "## Parameters"]
    described = parameters(words.pop("Parameters", ""), method)
    for base in method.__mro__[1:]:
        for name, text in parameters(sections(base).get("Parameters", ""), method).items():
            described.setdefault(name, text)
    parts += described.values() or ["It has none."]
    for title, text in words.items():
        if title == "Examples":
            text = f"```pycon\n{text.strip()}\n```"
        parts += [f"## {title}", text]
    return parts


def sections(thing: type) -> dict[str, str]:
    """A docstring in numpydoc's form by its headings; what comes first has none."""
    if thing is object:
        return {}
    pieces = re.split(r"^(\w[\w ]*)\n-{3,}\n", inspect.getdoc(thing) or "", flags=re.M)
    return {"": pieces[0], **dict(zip(pieces[1::2], pieces[2::2], strict=True))}


def parameters(text: str, method: type) -> dict[str, str]:
    """Each parameter's description by its name, with its type and its default."""
    defaults = {f.name: f.default for f in dataclasses.fields(method)}
    found = re.findall(r"^(\w+) : (.+)\n((?:(?: {4}.*)?\n?)*)", text, flags=re.M)
    described = {}
    for name, kind, body in found:
        if name in defaults:
            kind = kind.replace("{", "").replace("}", "")
            # Lists within lists are four spaces in.
            words = re.sub(r"^( +)", r"\1\1", textwrap.dedent(body).strip(), flags=re.M)
            # A definition, in the words of Markdown's extension.
            words = textwrap.indent(words, "    ").replace("    ", ":   ", 1)
            described[name] = f"`{name}` : {kind}; default `{defaults[name]!r}`\n\n{words}"
    return described


def measurements(name: str) -> list[str]:
    """What was measured of a method, from every file of results that has it."""
    parts = []
    for file in sorted(RESULTS.glob("*.csv")):
        table = read(file)
        rows = table[(table["method"] == name) & table["error"].isna()]
        if rows.empty:
            continue
        first, made = rows.iloc[0], table.attrs
        light = re.sub(r"(?<=\w)(?=[A-Z])", " ", first.light_kind).lower()
        lines = [
            "| scene | map | ms | quartiles | misclassified | % of covered | false shadow |",
            "|---|---|---|---|---|---|---|",
        ]
        for row in rows.itertuples():
            resolution = "-" if pd.isna(row.resolution) else f"{row.resolution:.0f}²"
            lines.append(
                f"| {row.scene} | {resolution} | {row.gpu_ms:.1f} "
                f"| {row.gpu_ms_q1:.1f} to {row.gpu_ms_q3:.1f} | {row.misclassified_count:,.0f} "
                f"| {100 * row.rate_covered:.3f} | {row.false_shadow_count:,.0f} |"
            )
        parts += [
            f"## Measured by a {light} on {made['device']}",
            f"{first.width} x {first.height} pixels, {made['date']}, driver {made['driver']}, by "
            f"`{made['command']}`.",
            "\n".join(lines),
        ]
    return parts


def as_published(name: str) -> list[str]:
    """The values of the papers that run the method, and of its compositions."""
    parts = []
    for key, papers in PUBLISHED.items():
        if key.rpartition("+")[2] != name:
            continue
        for paper, values in papers.items():
            is_own = values is next(iter(papers.values()))
            default = lx.method_from(key)
            names = f"`{key}@published`, `{key}@{paper}`" if is_own else f"`{key}@{paper}`"
            rows = [
                f"| `{parameter}` | `{given.value!r}` | `{getattr(default, parameter)!r}` "
                f"| {'left open: ' if given.is_open else ''}{given.source} |"
                for parameter, given in values.items()
            ]
            head = "| parameter | published | default | where |\n|---|---|---|---|\n"
            parts += [
                f"{names}: {PAPERS[paper]}.",
                head + "\n".join(rows) if rows else "It has no parameters.",
            ]
        parts += gains(key)
    return ["## As published", *parts] if parts else []


def gains(key: str) -> list[str]:
    """What each departure of a method's defaults from its own paper gains."""
    table = read(RESULTS / "departures" / "cpu.parquet")
    own = table.query("method == @key")
    if own.empty:
        return []
    rows = departures.summary(own).to_dict("records")
    tried = departures.departures(key, departures.RESOLUTION)
    lines = [
        f"| {departure_in_words(tried, row['departure'])} | {row['published']:,} "
        f"| {row['departed']:,} | {row['median ratio']:.2f} |"
        for row in rows
    ]
    return [
        f"What the departures from `{key}@published` gain, one at a time and all together, in "
        f"{rows[0]['views']} views of {table['scene'].nunique()} scenes with maps of "
        f"{departures.RESOLUTION}², by `{table.attrs['command']}`. The ratio is the median over "
        "the views of what is left of the misclassified pixels.",
        "| departure | misclassified as published | with the departure | ratio |\n"
        "|---|---|---|---|\n" + "\n".join(lines),
    ]


def departure_in_words(tried: dict[str, lx.Method], name: str) -> str:
    """The parameters that a departure changes, from which value to which."""
    if name == departures.ALL:
        return "all of them: the default"
    published, changed = tried[""].parameters(), tried[name].parameters()
    differing = [
        f"`{parameter}` from `{value!r}` to `{changed[parameter]!r}`"
        for parameter, value in published.items()
        if changed[parameter] != value
    ]
    return ", ".join(differing)


def api_page(start: str) -> str:
    """Every public name, and the modules that are used by their own names."""
    methods = {method.__name__ for method in lx.METHODS.values()}
    names = [name for name in lx.__all__ if name not in methods and name != "__version__"]
    parts = [start, *(f"::: lixel.{name}" for name in names if name != "scenes")]
    for module in MODULES:
        parts.append(
            f"## lixel.{module}\n\n::: lixel.{module}\n    options:\n      "
            "show_root_heading: false\n      show_root_toc_entry: false"
        )
    return "\n\n".join(parts)


# --- Figures ---


SCENE = lx.scenes.colonnade()
SUN = SCENE.lights["default"]
PLACE = (0.4, 3.4, -6.3)
LIGHTS = (SUN, lx.PointLight(PLACE), lx.SpotLight(PLACE, (0.1, -1.0, 0.4), 1.0))

IN_GALLERY, IN_FIGURE = ((320, 180), 128), ((480, 270), 256)
"""Sizes of the images, and texels along a side of the maps."""


def is_sized(method: type) -> bool:
    """Whether its texels are those of its resolution; of pages there are as many as pixels need."""
    return hasattr(method(), "resolution") and not hasattr(method(), "page_size")


@cache
def rendered(method: type, size: tuple[int, int], resolution: int) -> lx.Frame:
    chosen = method(resolution=resolution) if is_sized(method) else method()
    light = next(light for light in LIGHTS if chosen.takes(light))
    camera = SCENE.cameras["default"].resized(*size)
    # It knows every method.
    return lx.render(SCENE, camera, light, chosen, device="cpu")


@cache
def truth(size: tuple[int, int], light: lx.Light) -> lx.Reference:
    return lx.reference(SCENE, SCENE.cameras["default"].resized(*size), light)


def compared(method: type, size: tuple[int, int], resolution: int) -> lx.Comparison:
    frame = rendered(method, size, resolution)
    return lx.compare(frame, truth(size, frame.light))


def figure(method: type) -> bytes:
    shown, axes = plt.subplots(1, 2, figsize=(12, 3.6), layout="constrained")
    plots.difference(compared(method, *IN_FIGURE), axes[0])
    plots.aliasing_error(rendered(method, *IN_FIGURE), axes[1])
    return png(shown)


def pages_figure() -> bytes:
    frame = rendered(lx.VirtualShadowMap, *IN_FIGURE)
    shown, axes = plt.subplots(1, 2, figsize=(12, 4.2), layout="constrained")
    page_plots.page_levels(frame, axes[0])
    page_plots.page_table(frame, axes[1])
    return png(shown)


def png(figure: Figure) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, dpi=100)
    plt.close(figure)
    return stream.getvalue()


# --- Mathematics: reStructuredText's, as docstrings have it, drawn without a script ---


class Mathematics(Extension):
    """``.. math::`` blocks and :math:`formulae` as pictures in the page."""

    def extendMarkdown(self, md: Markdown) -> None:  # noqa: N802
        # After the one that strips control characters, which mark what is stored.
        md.preprocessors.register(Formulae(md), "formulae", 27)


class Formulae(Preprocessor):
    def run(self, lines: list[str]) -> list[str]:
        text = "\n".join(lines)
        text = re.sub(
            r"^\.\. math:: *((?:.+\n?)(?: +.+\n?)*)",
            lambda found: f"\n\n{self.stored(f'<p>{picture(found[1])}</p>')}\n\n",
            text,
            flags=re.M,
        )
        # The colons before a literal block.
        text = re.sub(r"(?<=\w)::$", ":", text, flags=re.M)
        text = re.sub(r":math:`([^`]+)`", lambda found: self.stored(picture(found[1])), text)
        return text.split("\n")

    def stored(self, html: str) -> str:
        return self.md.htmlStash.store(html)


def picture(formula: str) -> str:
    """A formula of LaTeX as a drawing that takes the colour of the text."""
    formula = " ".join(formula.split()).replace(r"\quad", r"\ \ \ ")
    stream = io.StringIO()
    depth = mathtext.math_to_image(f"${formula}$", stream, dpi=72, format="svg")
    svg = re.sub(r"<metadata>.*?</metadata>", "", stream.getvalue(), flags=re.S)
    svg = svg[svg.index("<svg") :].replace("fill: #000000", "fill: currentColor")
    return svg.replace("<svg ", f'<svg style="vertical-align:-{depth:.1f}pt" role="img" ', 1)
