"""Measure `virtual` beside `cascades` that has as many texels: misclassified pixels, pages, times.

Suns over the scenes of a folder, from each camera, as `lixel lab accuracy --kind directional
--shadow-edges` draws them. The cascades' maps together have the texels of the pages that `virtual`
stores in the same view. There are two kinds of cascades: the default, around the receivers in each
slab, and those of engines, around the slabs of the view frustum. The table is written view by view,
and the same command goes on where the last one stopped.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..arguments import needs
from ..camera import Camera
from ..compare import compare
from ..frame import FrameParts, frame_parts
from ..light import DirectionalLight, Light
from ..load import load
from ..methods import Cascades, VirtualShadowMap
from ..reference import Reference, reference
from ..scene import Scene
from .accuracy import views_of
from .options import MORE, add_output, add_parameters, add_size, natural
from .report import progress, table as as_text
from .result_tables import append, read, resume
from .views import listed_in

if TYPE_CHECKING:
    import pandas


CASCADES = {
    "cascades": Cascades(),
    "cascades of slabs": Cascades(boxes="slabs", splits="practical"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab pages`."""
    parser.add_argument("folder", type=Path, help="with a scenes.json and the files that it lists")
    add_size(parser, "480x270", (480, 270))
    parser.add_argument(
        "--random", type=natural, default=20, metavar="N", help="random suns from each camera; 20"
    )
    parser.add_argument("--scene", action="append", metavar="NAME", help=f"of the folder; {MORE}")
    add_parameters(parser, " of virtual;")
    add_output(parser, "table of every view, .csv or .parquet", required=True)


def run(options: argparse.Namespace) -> None:
    """Measure what the table does not have yet, append it, and print the sums."""
    method = VirtualShadowMap(**dict(options.parameters))
    before = resume(options.output, options.line)
    done = {(row["scene"], str(row["camera"]), str(row["light"])) for row in before}
    for file, listed in listed_in(options.folder):
        name = Path(file).stem
        if options.scene and name not in options.scene:
            continue
        scene, kinds = load(options.folder / file), [DirectionalLight]
        views = views_of(file, listed, scene, options.size, options.random, kinds, True)
        missing = [view for view in views if (name, view[0], view[2]) not in done]
        for camera_name, camera, light_name, light in progress(missing, name):
            shared = {"scene": name, "camera": camera_name, "light": light_name}
            rows = [{**shared, **row} for row in evaluate(scene, camera, light, method)]
            append(options.output, options.line, rows)
    if options.output.exists():
        print(as_text(summary(read(options.output)).to_dict("records")))


def evaluate(
    scene: Scene, camera: Camera, light: Light, method: VirtualShadowMap
) -> Iterator[dict[str, Any]]:
    """A row for the method and for each of the cascades in one view."""
    truth = reference(scene, camera, light)
    paged = frame_parts(scene, camera, light, method)
    pages = paged.stats.get("shadow map", {}).get("pages", 0)
    texels = pages * method.page_size**2
    yield {**_row(method.name, texels, paged, truth), "pages": pages}
    for name, cascades in CASCADES.items():
        # A slab without receivers has no map.
        few = replace(cascades, resolution=1)
        layers = max(1, frame_parts(scene, camera, light, few).stats["layers"])
        side = max(1, round(math.sqrt(texels / layers)))
        parts = frame_parts(scene, camera, light, replace(cascades, resolution=side))
        yield {**_row(name, layers * side**2, parts, truth), "pages": None}


def _row(name: str, texels: int, parts: FrameParts, truth: Reference) -> dict[str, Any]:
    result = compare(parts.visibility, truth)
    return {
        "method": name,
        "texels": texels,
        "covered": result.covered_count,
        "misclassified": result.misclassified_count,
        "milliseconds": round(sum(parts.timings.values()), 2),
    }


def summary(table: pandas.DataFrame) -> pandas.DataFrame:
    """By scene and method: views, misclassified pixels, those of `virtual` over them, the medians
    of pages, texels and milliseconds."""
    whole = needs("pandas", "study").concat([table, table.assign(scene="all")])
    groups = whole.groupby(["scene", "method"], sort=False)
    sums = groups.agg(
        views=("misclassified", "count"),
        misclassified=("misclassified", "sum"),
        most=("misclassified", "max"),
        pages=("pages", "median"),
        texels=("texels", "median"),
        milliseconds=("milliseconds", "median"),
    ).reset_index()
    own = sums[sums["method"] == VirtualShadowMap.name].set_index("scene")["misclassified"]
    wrong = sums["misclassified"]
    sums["ratio"] = (sums["scene"].map(own) / wrong.where(wrong > 0)).round(3)
    return sums
