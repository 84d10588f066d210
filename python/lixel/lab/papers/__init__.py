"""The tables of the papers again, beside the papers' own figures.

The papers' scenes are not to be had; a generated scene of the same size and kind stands for each,
and is named. Ratios come first, because the machines differ: each time over that of the table's
plainest method, or the share of a stage in its frame. What the tables leave out is added: how many
pixels are wrong. Where the order of two rows is not the paper's, a line says so.

A row whose method this version does not have is left out, and named.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ...arguments import needs
from ...camera import Camera
from ...light import Light, PointLight
from ...methods import Method, method_from
from ...scenes import GENERATORS
from ..report import say, table
from ..result_tables import save
from ..study import study
from . import chong_gortler

if TYPE_CHECKING:
    import pandas

Figure: TypeAlias = float | tuple[float, float]

# All passes that a frame may have, in the words of the papers.
CAMERA = ("visibility",)
IMPORTANCE = ("receivers", "importance map", "forward importance", "shadow edge", "boundary")
LOOKUP = ("lookup",)
DESIRED_VIEW = ("receivers",)
WARP = ("importance map", "warp map")
SHADOW_MAP = ("shadow map",)


@dataclass(frozen=True)
class SubstituteScene:
    """A generated scene that stands for one of a paper."""

    generator: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    light: Light | None = None

    def __str__(self) -> str:
        return f"{self.generator}({', '.join(f'{k}={v}' for k, v in self.arguments.items())})"


@dataclass(frozen=True)
class Row:
    """A method of a table and its figures, one for each column: a number, a range, or None where
    the paper has none."""

    name: str
    method: str
    figures: tuple[Figure | None, ...]
    parameters: Mapping[str, Any] = field(default_factory=dict)
    # The passes that the figures are of; None: those of the table.
    passes: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Table:
    """A table of a paper, and how to measure it."""

    name: str
    title: str
    source: str
    size: tuple[int, int]
    resolution: int
    scenes: Mapping[str, SubstituteScene]
    rows: tuple[Row, ...]
    # The row that the others are divided by.
    base: str
    # Cameras on a path; more than one gives ranges.
    path: int = 1
    # Passes that the paper's times leave out.
    without: tuple[str, ...] = ()
    # Columns that are stages of a frame rather than scenes, with their passes; figures are then
    # shares of the frame.
    stages: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    unit: str = "ms"
    # Columns of the study, whose medians are added under these names.
    details: Mapping[str, str] = field(default_factory=dict)
    # Why ours differ where they do.
    remark: str = ""


ROSEN = "P. Rosen, I3D 2012"
MILET = "T. Milet, J. Navrátil, P. Zemčík, WSCG 2015"
THESIS = "J. Navrátil, doctoral thesis"
CHONG = "H. Y. Chong, S. J. Gortler, Harvard TR-07-07"
VANEK = "J. Vaněk, J. Navrátil, A. Herout, P. Zemčík, ISVC 2011"

_PLAYGROUND = SubstituteScene("objects_on_floor", {"count": 160})
_ROSEN_SCENES = {
    "Playground": _PLAYGROUND,
    "Sandbox": SubstituteScene("city", {"blocks": 26}),
    "Town": SubstituteScene("city", {"blocks": 112}),
}
_FORWARD = {"analysis": "forward"}
_HYBRID = {"analysis": "hybrid"}
_OBSERVATORY = SubstituteScene("terrain", {"cells": 162})
_MILET_SCENES = {
    "Conf. room": SubstituteScene("colonnade", {"columns": 10}),
    "Sponza": SubstituteScene("colonnade"),
    "Observatory": _OBSERVATORY,
}

_MILET_1 = (
    Row("SM", "uniform", (1.596,)),
    Row("MIN-SM", "min_sm", (1.7,)),
    Row("RTW", "rtw", (3.296,)),
    Row("NoTW", "notw", (4.708,)),
    Row("NoTW-DV", "desired_view", (2.521,)),
)
_MILET_3 = (
    Row("gbuffer", "uniform", (2.16, 2.229, 1.84), passes=CAMERA),
    Row("SM", "uniform", (0.21, 0.40, 0.16)),
    Row("RTW", "rtw", (3.14, 3.47, 3.02)),
    Row("NoTW", "notw", (3.63, 3.84, 3.23)),
)
_MILET_3_REMARK = (
    "Here compute shaders rasterize the shadow map and look it up, so that SM weighs more against "
    "the warps and the gbuffer than in the paper, where hardware does both."
)

_LINEAR = {"lookup": "depth", "rasterization": "linear"}
_SPLIT = ((None, "not split"), (0.05, "5 %"), (0.025, "2.5 %"), (0.01, "1 %"))
_DRAWN = {
    "shadow map, ms": "pass_ms.shadow map",
    "triangles drawn": "stats.shadow map.rasterized",
}


def _straight_and_exact(
    method: str, figures: Sequence[tuple[Figure | None, ...]] = ((None,),) * 4
) -> tuple[Row, ...]:
    """Straight edges, split or not, with the paper's figures of each, and exact ones."""
    straight = (
        Row(f"{method}, {words}", method, given, {**_LINEAR, "tessellation": share})
        for (share, words), given in zip(_SPLIT, figures, strict=True)
    )
    none = (None,) * len(figures[0])
    return (*straight, Row(f"{method}, exact", method, none, {"lookup": "depth"}))


TABLES = (
    Table(
        "rosen-1",
        "Range of frame times on a path",
        f"{ROSEN}, Table 1",
        (1920, 1080),
        2048,
        _ROSEN_SCENES,
        (
            Row("Conventional", "uniform", ((2.7, 3.6), (1.9, 2.1), (2.7, 3.2))),
            Row("Forward Analysis", "rtw", ((5.3, 7.0), (4.2, 5.3), (3.7, 4.8)), _FORWARD),
            Row("Backward Analysis", "rtw", ((4.2, 5.9), (4.0, 5.4), (3.7, 4.8))),
            Row("Hybrid Analysis", "rtw", ((5.8, 7.3), (5.0, 5.7), (4.5, 5.4)), _HYBRID),
        ),
        base="Conventional",
        path=4,
    ),
    Table(
        "rosen-2",
        "Stages of the pipeline",
        f"{ROSEN}, Table 2",
        (1920, 1080),
        2048,
        {"Playground": _PLAYGROUND},
        (
            Row("Conventional", "uniform", (0.0, 0.0, 1.3, 1.8)),
            Row("Forward Analysis", "rtw", (1.3, 0.1, 2.2, 1.9), _FORWARD),
            Row("Backward Analysis", "rtw", (1.4, 0.3, 2.2, 0.9)),
            Row("Hybrid Analysis", "rtw", (2.7, 0.4, 2.0, 1.1), _HYBRID),
        ),
        base="Conventional",
        stages={
            "(a) importance map": IMPORTANCE,
            "(b) warping map": ("warp map",),
            "(c) shadow map": SHADOW_MAP,
            "(d) output": CAMERA + LOOKUP,
        },
        remark="Forward and hybrid analysis render the light's depth image first, which the paper "
        "counts to (a), and we, as it is the same pass, to (c).",
    ),
    Table(
        "rosen-3",
        "Straight edges between warped corners",
        f"{ROSEN}, Table 3",
        (1920, 1080),
        2048,
        _ROSEN_SCENES,
        _straight_and_exact(
            "rtw",
            (
                ((4.3, 5.4), (3.8, 4.8), (3.8, 5.0)),
                ((5.5, 6.9), (5.2, 5.9), (8.4, 9.5)),
                ((5.8, 7.0), (5.9, 7.0), (10.9, 11.9)),
                ((6.0, 7.2), (8.0, 9.5), (16.5, 17.4)),
            ),
        ),
        base="rtw, not split",
        details=_DRAWN,
        remark="Triangles are split until no edge in the map is longer than the share of its side. "
        "The exact rows, which the paper has not, take each texel's own ray.",
    ),
    Table(
        "rosen-3-warps",
        "Straight edges between warped corners, and exact ones",
        "as Rosen's Table 3",
        (1920, 1080),
        1024,
        {"colonnade": SubstituteScene("colonnade")},
        _straight_and_exact("rtw") + _straight_and_exact("notw"),
        base="rtw, not split",
        details=_DRAWN,
    ),
    Table(
        "rosen-3-paraboloids",
        "Straight edges between corners on paraboloids, and exact ones",
        "as Rosen's Table 3",
        (1920, 1080),
        1024,
        {
            "colonnade": SubstituteScene("colonnade", light=PointLight((0.4, 3.4, -9.3))),
            "plane and box": SubstituteScene("plane_and_box", light=PointLight((0.3, 4.0, 0.2))),
        },
        _straight_and_exact("dual_paraboloid", ((None, None),) * 4),
        base="dual_paraboloid, not split",
        details=_DRAWN,
    ),
    Table(
        "rosen-figure-1",
        "RTW at 512² beside a conventional map of 2048²",
        f"{ROSEN}, Figure 1",
        (1920, 1080),
        2048,
        {"Playground": _PLAYGROUND},
        (
            Row("Conventional 2048²", "uniform", (3.1,)),
            Row("RTW 512²", "rtw", (4.8,), {"resolution": 512}),
            Row("RTW 2048²", "rtw", (4.8,)),
        ),
        base="Conventional 2048²",
        remark="The paper's figure shows pictures; its times are those of Table 2, at 2048².",
    ),
    Table(
        "milet-1",
        "Methods at 1024 x 1024 with a map of 512²",
        f"{MILET}, Table 1; {THESIS}, Table 5.3",
        (1024, 1024),
        512,
        {"Observatory": _OBSERVATORY},
        _MILET_1,
        base="SM",
        remark="Here a fit is one reduction over the receivers that stays on the GPU, and casters "
        "that reach none of them are left out, so that NoTW-DV and MIN-SM cost no more than SM.",
    ),
    Table(
        "milet-2",
        "Shares of the steps",
        f"{MILET}, Table 2",
        (1024, 1024),
        512,
        {"Sponza": _MILET_SCENES["Sponza"]},
        (
            # The paper counts the importance map of RTW to its desired view.
            Row("NoTW", "notw", (15.4, 61.0, 19.9, 3.7)),
            Row("RTW", "rtw", (82.5, 0.0, 14.1, 3.2)),
        ),
        base="NoTW",
        stages={
            "desired view": DESIRED_VIEW,
            "importance map": WARP,
            "shadow map": SHADOW_MAP,
            "final pass": LOOKUP,
        },
    ),
    Table(
        "milet-3",
        "Scenes",
        f"{MILET}, Table 3; {THESIS}, Table 5.1",
        (1024, 1024),
        512,
        _MILET_SCENES,
        _MILET_3,
        base="SM",
        without=CAMERA,
        remark=_MILET_3_REMARK,
    ),
    Table(
        "thesis-2",
        "An omnidirectional light",
        f"{THESIS}, Table 5.2",
        (1024, 1024),
        512,
        {"its scene": SubstituteScene("colonnade", light=PointLight((0.4, 3.4, -9.3)))},
        (
            Row("SV", "ray_traced", (4.8,)),
            Row("CubeSM", "cube", (2.5,)),
            Row("DPSM", "dual_paraboloid", (2.3,)),
            Row("CubeSM w/ warping", "cube+notw", (5.8,)),
            Row("DPSM w/ warping", "dual_paraboloid+notw", (3.4,)),
        ),
        base="CubeSM",
        remark="The thesis does not tell scene, size and map of this table. Its SV, shadow "
        "volumes, is exact; so are our rays.",
    ),
    Table(
        "vanek-1",
        "Paraboloids, in frames per second",
        f"{VANEK}, Table 1",
        (1600, 1200),
        512,
        {
            "Sibenik": SubstituteScene("colonnade", {"detail": 24}, PointLight((0.4, 3.4, -9.3))),
            "Car": SubstituteScene(
                "objects_on_floor", {"count": 140, "subdivisions": 3}, PointLight((-14, 16, 10))
            ),
            "Trees": SubstituteScene("grass", {"blades": 30000}, PointLight((-60, 70, -25))),
        },
        (
            Row("DPSM 512²", "dual_paraboloid", (102.0, 97.0, 135.0)),
            Row("DPSM 2048²", "dual_paraboloid", (78.0, 84.0, 123.0), {"resolution": 2048}),
            Row("IPSM 512²", "improved_paraboloid", (95.0, 107.0, 148.0), {"cut": "frustum"}),
            Row(
                "IPSM 2048²",
                "improved_paraboloid",
                (76.0, 95.0, 134.0),
                {"cut": "frustum", "resolution": 2048},
            ),
        ),
        base="DPSM 512²",
        unit="fps",
        remark="The paper's uniform map is left out: one map does not hold all sides of a light.",
    ),
)

NAMES = (*(each.name for each in TABLES), *chong_gortler.EXPERIMENTS)


def run(
    names: Sequence[str] = (), *, quick: bool = False, folder: Path | None = None, repeats: int = 5
) -> dict[str, list[dict[str, Any]]]:
    """Measure tables, and print each beside the paper's figures.

    Parameters
    ----------
    names : sequence of str
        Of `NAMES`; empty: all.
    quick : bool
        Images and maps of half the size on each side, two cameras on a path and three frames each.
    folder : path, optional
        Where each table goes as .csv with all that was measured, and its journal.
    repeats : int
        Timed frames of each case.

    Returns
    -------
    dict of str to list of dict
        The rows by the name of the table.

    Raises
    ------
    ValueError
        An unknown name.
    """
    needs("pandas", "study")
    known = {each.name: each for each in TABLES}
    for name in names:
        if name not in NAMES:
            raise ValueError(f"table must be one of {', '.join(NAMES)}, got {name!r}")
    found = {}
    for name in names or NAMES:
        if name in chong_gortler.EXPERIMENTS:
            title, measure = chong_gortler.EXPERIMENTS[name]
            say(f"{name}: {CHONG}")
            found[name] = measure(quick, folder)
            print(f"\n{title} ({CHONG})")
            chong_gortler.say_rows(found[name])
            continue
        chosen = known[name]
        if quick:
            chosen = dataclasses.replace(
                chosen,
                size=(chosen.size[0] // 2, chosen.size[1] // 2),
                resolution=chosen.resolution // 2,
                path=min(chosen.path, 2),
                rows=tuple(_halved(row) for row in chosen.rows),
            )
        measured = _measure(chosen, min(repeats, 3) if quick else repeats, folder)
        found[name] = list(_beside(chosen, measured))
        _print(chosen, found[name], measured)
    return found


def _halved(row: Row) -> Row:
    if "resolution" not in row.parameters:
        return row
    halved = {**row.parameters, "resolution": row.parameters["resolution"] // 2}
    return dataclasses.replace(row, parameters=halved)


def _measure(chosen: Table, repeats: int, folder: Path | None) -> pandas.DataFrame:
    scenes, cameras, lights = {}, {}, {}
    for name, stand in chosen.scenes.items():
        scene = GENERATORS[stand.generator](**stand.arguments)
        scenes[name] = (stand.generator, stand.arguments)
        cameras[name] = _path(scene.cameras["default"].resized(*chosen.size), chosen.path)
        lights[name] = {"0": stand.light or scene.lights["default"]}
    journal = None
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        journal = folder / f"{chosen.name}.jsonl"
    say(f"{chosen.name}: {chosen.source}")
    measured = study(
        scenes,
        cameras=cameras,
        lights=lights,
        methods=list({repr(m): m for _, m in _runnable(chosen)}.values()),
        repeats=repeats,
        journal=journal,
    )
    if not measured.attrs["complete"]:
        raise KeyboardInterrupt
    if folder is not None:
        save(measured, folder / f"{chosen.name}.csv")
    return measured


def _path(camera: Camera, number: int) -> dict[str, Camera]:
    """Cameras that turn by a quarter of the angle of view to either side."""
    cameras = {}
    for i, share in enumerate(np.linspace(-1.0, 1.0, number) if number > 1 else [0.0]):
        angle = share * camera.yfov / 4
        turn = np.eye(4)
        turn[[0, 0, 2, 2], [0, 2, 0, 2]] = (
            np.cos(angle), np.sin(angle), -np.sin(angle), np.cos(angle),
        )  # fmt: skip
        pose = camera.pose.copy()
        pose[:3, :3] = turn[:3, :3] @ pose[:3, :3]
        cameras[str(i)] = camera.posed(pose)
    return cameras


def _runnable(chosen: Table) -> Iterator[tuple[Row, Method]]:
    """The rows that this version can measure, with their methods."""
    for row in chosen.rows:
        try:
            method = method_from(row.method)
        except ValueError:
            continue
        values = dict(row.parameters)
        if hasattr(method, "resolution"):
            values.setdefault("resolution", chosen.resolution)
        yield row, dataclasses.replace(method, **values)


def _beside(chosen: Table, measured: pandas.DataFrame) -> Iterator[dict[str, Any]]:
    """The rows of the table as it is printed."""
    columns = chosen.stages or dict.fromkeys(chosen.scenes, ())
    base = next(row for row in chosen.rows if row.name == chosen.base)
    methods = {row.name: method for row, method in _runnable(chosen)}
    for i, column in enumerate(columns):
        scene = column if not chosen.stages else next(iter(chosen.scenes))
        base_cases = _cases_of(measured, scene, methods[base.name])
        base_ms = _ms(chosen, base, base_cases)
        for row in chosen.rows:
            if row.name not in methods:
                continue
            cases = _cases_of(measured, scene, methods[row.name])
            figure = row.figures[i]
            cells: dict[str, Any] = {
                "stage" if chosen.stages else "scene": column,
                "row": row.name,
                "ours": _ours(methods[row.name]),
            }
            if chosen.stages:
                ms = _of_passes(cases, columns[column])
                whole = sum(_of_passes(cases, passes) for passes in columns.values())
                figures = [_middle(each) for each in row.figures if each is not None]
                cells |= {
                    "paper, %": None if figure is None else 100.0 * _middle(figure) / sum(figures),
                    "ours, %": 100.0 * float((ms / whole).median()),
                }
            else:
                ms = _ms(chosen, row, cases)
                cells |= {
                    "paper, ratio": _ratio(chosen, figure, base.figures[i]),
                    "ours, ratio": float(ms.median() / base_ms.median()),
                }
            cells |= {f"paper, {chosen.unit}": _text(figure), "ours, ms": _range(ms)}
            cells |= {name: float(cases[of].median()) for name, of in chosen.details.items()}
            if row.passes is None and not chosen.stages:
                wrong, base_wrong = (
                    int(each["misclassified_count"].sum()) for each in (cases, base_cases)
                )
                cells |= {"wrong, ratio": wrong / max(base_wrong, 1), "wrong pixels": wrong}
            yield cells


def _cases_of(measured: pandas.DataFrame, scene: str, method: Method) -> pandas.DataFrame:
    chosen = (measured["scene"] == scene) & (measured["method"] == method.name)
    for name, value in method.parameters().items():
        chosen &= measured[name].isna() if value is None else measured[name] == value
    return measured[chosen]


def _ms(chosen: Table, row: Row, cases: pandas.DataFrame) -> pandas.Series:
    if row.passes is not None:
        return _of_passes(cases, row.passes)
    return cases["gpu_ms"] - _of_passes(cases, chosen.without)


def _of_passes(cases: pandas.DataFrame, passes: Sequence[str]) -> pandas.Series:
    names = [f"pass_ms.{name}" for name in passes if f"pass_ms.{name}" in cases]
    return cases[names].fillna(0.0).sum(axis=1)


def _ratio(chosen: Table, figure: Figure | None, base: Figure | None) -> float | None:
    if figure is None or base is None:
        return None
    return _time(chosen, figure) / _time(chosen, base)


def _time(chosen: Table, figure: Figure) -> float:
    """In whatever unit; frames per second are turned over."""
    return 1.0 / _middle(figure) if chosen.unit == "fps" else _middle(figure)


def _middle(figure: Figure) -> float:
    return sum(figure) / 2 if isinstance(figure, tuple) else figure


def _text(figure: Figure | None) -> str:
    if figure is None:
        return "-"
    return "-".join(f"{f:g}" for f in figure) if isinstance(figure, tuple) else f"{figure:g}"


def _range(ms: pandas.Series) -> str:
    low, high = float(ms.min()), float(ms.max())
    return f"{low:.4g}" if len(ms) == 1 else f"{low:.4g}-{high:.4g}"


def _ours(method: Method) -> str:
    resolution = getattr(method, "resolution", None)
    return method.name if resolution is None else f"{method.name} {resolution}²"


def _turned(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Pairs of rows that stand the other way round than in the paper, by a twentieth or more."""
    for first, second in itertools.combinations(rows, 2):
        if first.get("paper, ratio") is None or first["scene"] != second["scene"]:
            continue
        if second["paper, ratio"] is None:
            continue
        paper = first["paper, ratio"] / second["paper, ratio"]
        ours = first["ours, ratio"] / second["ours, ratio"]
        if (paper - 1.0) * (ours - 1.0) < 0.0 and min(abs(paper - 1.0), abs(ours - 1.0)) >= 0.05:
            slow, fast = (first, second) if paper > 1.0 else (second, first)
            yield f"{first['scene']}: {slow['row']} is slower than {fast['row']} only in the paper"


def _print(chosen: Table, rows: Sequence[Mapping[str, Any]], measured: pandas.DataFrame) -> None:
    print(f"\n{chosen.title} ({chosen.source})")
    width, height = chosen.size
    devices = {*zip(measured.device, measured.driver, strict=True)}
    device = "; ".join(f"{name}, {driver}" for name, driver in sorted(devices))
    print(f"{width} x {height} pixels, maps of {chosen.resolution}²; ours on {device}")
    counts = dict(zip(measured.scene, measured.triangles, strict=True))
    for name, stand in chosen.scenes.items():
        print(f"for {name}: {stand}, {counts[name]:,} triangles")
    print(table(rows))
    for line in _turned(rows):
        print(line)
    missing = {row.name for row in chosen.rows} - {row["row"] for row in rows}
    if missing:
        print(f"left out, because this version has no such method: {', '.join(sorted(missing))}")
    if chosen.remark:
        print(chosen.remark)
