"""How a paper's table is measured, and printed beside the paper's figures."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...arguments import needs
from ...camera import Camera
from ...methods import Method
from ...scenes import GENERATORS, rotation
from ..options import texels_text
from ..report import status, table
from ..result_tables import save
from ..study import cell, study
from .figures import Figure, middle
from .tables import Row, Table, method_of

if TYPE_CHECKING:
    import pandas


QUICK = 4
"""By how much images and maps are smaller on each side in a table that is to be had in minutes."""


def quick_version(chosen: Table) -> Table:
    """The table with smaller images, maps and scenes, and two cameras on a path."""
    return dataclasses.replace(
        chosen,
        size=(chosen.size[0] // QUICK, chosen.size[1] // QUICK),
        resolution=chosen.resolution // QUICK,
        path=min(chosen.path, 2),
        rows=tuple(_quick_row(row) for row in chosen.rows),
        scenes={
            name: dataclasses.replace(scene, arguments={**scene.arguments, **scene.quick})
            for name, scene in chosen.scenes.items()
        },
    )


def _quick_row(row: Row) -> Row:
    if "resolution" not in row.parameters:
        return row
    parameters = {**row.parameters, "resolution": row.parameters["resolution"] // QUICK}
    return dataclasses.replace(row, parameters=parameters)


def measure_table(chosen: Table, repeats: int, folder: Path | None) -> pandas.DataFrame:
    """A study of the table's rows; with a folder it is saved there, and goes on after a stop."""
    journal = None
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        journal = folder / f"{chosen.name}.jsonl"
    status(f"{chosen.name}: {chosen.source}")
    parts = []
    for by_spot in (False, True):
        methods = [m for row, m in runnable(chosen) if row.by_spot is by_spot]
        if methods:
            parts.append(_studied(chosen, by_spot, methods, repeats, journal))
    # Columns of either part.
    measured = needs("pandas", "study").concat(parts, ignore_index=True)
    measured.attrs["command"] = f"lixel lab papers {chosen.name}"
    if folder is not None:
        save(measured, folder / f"{chosen.name}.csv")
    return measured


def _studied(
    chosen: Table, by_spot: bool, methods: Sequence[Method], repeats: int, journal: Path | None
) -> pandas.DataFrame:
    scenes, cameras, lights = {}, {}, {}
    for name, substitute in chosen.scenes.items():
        scene = GENERATORS[substitute.generator](**substitute.arguments)
        scenes[name] = (substitute.generator, substitute.arguments)
        cameras[name] = _path(scene.cameras["default"].resized(*chosen.size), chosen.path)
        light = substitute.spot if by_spot else substitute.light
        lights[name] = {"spot" if by_spot else "0": light or scene.lights["default"]}
    measured = study(
        scenes,
        cameras=cameras,
        lights=lights,
        methods=list({repr(m): m for m in methods}.values()),
        repeats=repeats,
        journal=journal,
    )
    if not measured.attrs["complete"]:
        raise KeyboardInterrupt
    return measured


def _path(camera: Camera, number: int) -> dict[str, Camera]:
    """Cameras that turn by a quarter of the angle of view to either side."""
    cameras = {}
    for i, share in enumerate(np.linspace(-1.0, 1.0, number) if number > 1 else [0.0]):
        pose = camera.pose.copy()
        pose[:3, :3] = rotation(share * camera.yfov / 4) @ pose[:3, :3]
        cameras[str(i)] = camera.posed(pose)
    return cameras


def runnable(chosen: Table) -> Iterator[tuple[Row, Method]]:
    """The rows that this version can measure, with their methods."""
    for row in chosen.rows:
        values = dict(row.parameters)
        try:
            if method_of(row.method).map_resolution is not None:
                values.setdefault("resolution", chosen.resolution)
            yield row, method_of(row.method, **values)
        except ValueError:
            continue


def beside(chosen: Table, measured: pandas.DataFrame) -> Iterator[dict[str, Any]]:
    """The rows of the table as it is printed."""
    methods = {row.key: method for row, method in runnable(chosen)}
    rows = [row for row in chosen.rows if row.key in methods]
    base = next(row for row in rows if row.name == chosen.base)
    columns = dict.fromkeys((s, stage) for row in rows for s, stage, *_ in chosen.columns(row))
    for scene, stage in columns:
        base_cases = _cases_of(measured, scene, base, methods[base.key])
        base_figure, base_ms = None, None
        for its_scene, its_stage, passes, name in chosen.columns(base):
            if (its_scene, its_stage) == (scene, stage):
                base_figure = base.figures.get(name)
                base_ms = _ms(chosen, base, base_cases, passes)
        for row in rows:
            found = [each for each in chosen.columns(row) if each[:2] == (scene, stage)]
            if not found:
                continue
            ((_, _, passes, name),) = found
            cases = _cases_of(measured, scene, row, methods[row.key])
            figure, ms = row.figures.get(name), _ms(chosen, row, cases, passes)
            cells = _head(scene, stage, row, methods[row.key])
            if chosen.as_shares:
                cells |= _shares(chosen, row, cases, scene, ms, figure)
            else:
                ratio = None if base_ms is None else float(ms.median() / base_ms.median())
                cells |= {
                    "paper, ratio": _ratio(chosen, figure, base_figure),
                    "ours, ratio": ratio,
                }
            if chosen.unit != "%":
                cells[f"paper, {chosen.unit}"] = _text(figure)
            cells["ours, ms"] = _range(ms)
            cells |= {title: float(cases[of].median()) for title, of in chosen.details.items()}
            if chosen.has_mer:
                cells |= _mer(row, cases)
            if row.passes is None and passes is None:
                cells |= _errors(cases, base_cases)
            yield cells


def _head(scene: str, stage: str | None, row: Row, method: Method) -> dict[str, Any]:
    cells: dict[str, Any] = {"scene": scene}
    if stage is not None:
        cells["stage"] = stage
    return {**cells, "row": row.name, "by": row.by, "ours": _ours(method)}


def _shares(
    chosen: Table,
    row: Row,
    cases: pandas.DataFrame,
    scene: str,
    ms: pandas.Series,
    figure: Figure | None,
) -> dict[str, Any]:
    """In percent of the columns of a scene."""
    own = [each for each in chosen.columns(row) if each[0] == scene]
    whole = sum(_ms(chosen, row, cases, passes) for _, _, passes, _ in own)
    theirs = sum(middle(row.figures[name]) for *_, name in own if name in row.figures)
    if chosen.unit == "%":
        theirs = 100.0
    return {
        "paper, %": None if figure is None else 100.0 * middle(figure) / theirs,
        "ours, %": 100.0 * float((ms / whole).median()),
    }


def _mer(row: Row, cases: pandas.DataFrame) -> dict[str, Any]:
    """How many texels a plain map would need, along each side."""
    paper = [row.figures.get(f"MER {side}") for side in ("width", "height")]
    ours = [float(cases[f"max_effective_resolution_{axis}"].max()) for axis in "xy"]
    words = [f"{middle(n):,.0f}" for n in paper if n is not None]
    return {"paper, MER": " x ".join(words) or "-", "ours, MER": f"{ours[0]:,.0f} x {ours[1]:,.0f}"}


def _errors(cases: pandas.DataFrame, base_cases: pandas.DataFrame) -> dict[str, Any]:
    counts = [each["misclassified_count"] for each in (cases, base_cases)]
    if any(each.isna().any() for each in counts):
        return {"misclassified, ratio": None, "misclassified": None}
    wrong, base_wrong = (int(each.sum()) for each in counts)
    return {"misclassified, ratio": wrong / max(base_wrong, 1), "misclassified": wrong}


def _cases_of(measured: pandas.DataFrame, scene: str, row: Row, method: Method) -> pandas.DataFrame:
    chosen = (measured["scene"] == scene) & (measured["method"] == method.name)
    chosen &= (measured["light"] == "spot") == row.by_spot
    for name, value in method.parameters().items():
        found = cell(value)
        chosen &= measured[name].isna() if found is None else measured[name] == found
    return measured[chosen]


def _ms(
    chosen: Table, row: Row, cases: pandas.DataFrame, passes: tuple[str, ...] | None
) -> pandas.Series:
    """Of some passes, or of a frame."""
    own = row.passes if passes is None else passes
    if own is not None:
        return _of_passes(cases, own)
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
    return 1.0 / middle(figure) if chosen.unit == "fps" else middle(figure)


def _text(figure: Figure | None) -> str:
    if figure is None:
        return "-"
    return "-".join(f"{f:g}" for f in figure) if isinstance(figure, tuple) else f"{figure:g}"


def _range(ms: pandas.Series) -> str:
    low, high = float(ms.min()), float(ms.max())
    return f"{low:.4g}" if len(ms) == 1 else f"{low:.4g}-{high:.4g}"


def _ours(method: Method) -> str:
    name = method.composition
    return name if method.map_size is None else f"{name} {texels_text(method)}"


def turned(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """A sentence for each pair of rows that stands the other way round than in the paper."""
    for first, second, paper, ours in apart(rows):
        if (paper - 1.0) * (ours - 1.0) < 0.0:
            slow, fast = (first, second) if paper > 1.0 else (second, first)
            yield f"{_at(first)}: {slow['row']} is slower than {fast['row']} only in the paper"


def apart(
    rows: Sequence[Mapping[str, Any]],
) -> Iterator[tuple[Mapping[str, Any], Mapping[str, Any], float, float]]:
    """Pairs of rows that have figures of the paper and are a twentieth or more apart, there and
    here: the first row's time over the second's, the paper's and ours."""
    for first, second in itertools.combinations(rows, 2):
        if any(first.get(of) != second.get(of) for of in ("scene", "stage", "by")):
            continue
        if first.get("paper, ratio") is None or second.get("paper, ratio") is None:
            continue
        paper = first["paper, ratio"] / second["paper, ratio"]
        ours = first["ours, ratio"] / second["ours, ratio"]
        if min(abs(paper - 1.0), abs(ours - 1.0)) >= 0.05:
            yield first, second, paper, ours


def misranked(chosen: Table, rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Pairs of neighbours in the paper's ranking of which the second has more wrong pixels."""
    wrong = {(_at(row), row["row"]): row.get("misclassified") for row in rows}
    for at in dict.fromkeys(_at(row) for row in rows):
        for worse, better in itertools.pairwise(chosen.ranking):
            first, second = wrong.get((at, worse)), wrong.get((at, better))
            if first is not None and second is not None and second > first:
                yield (
                    f"{at}: {better} misclassifies {second:,} pixels and {worse} {first:,}; "
                    "in the paper it is better"
                )


def _at(row: Mapping[str, Any]) -> str:
    return ", ".join(row[of] for of in ("scene", "stage", "by") if of in row)


def heading(chosen: Table, measured: pandas.DataFrame) -> Iterator[str]:
    """Sizes, and what stands for each scene."""
    width, height = chosen.size
    yield f"{width} x {height} pixels, maps of {chosen.resolution}²"
    counts = dict(zip(measured.scene, measured.triangles, strict=True))
    for name, substitute in chosen.scenes.items():
        yield f"for {name}: {substitute}, {counts[name]:,} triangles"


def remarks(
    chosen: Table, rows: Sequence[Mapping[str, Any]], measured: pandas.DataFrame
) -> Iterator[str]:
    """What ranks otherwise than in the paper, what is left out, and why."""
    yield from misranked(chosen, rows)
    if "error" in measured:
        for error in measured["error"].dropna().unique():
            yield f"a row without times could not be rendered: {error}"
    missing = {row.name for row in chosen.rows} - {row["row"] for row in rows}
    if missing:
        yield f"left out, because this version has no such method: {', '.join(sorted(missing))}"
    for name, reason in chosen.left_out.items():
        yield f"left out: {name}, because {reason}"
    if chosen.remark:
        yield chosen.remark


def print_table(
    chosen: Table, rows: Sequence[Mapping[str, Any]], measured: pandas.DataFrame
) -> None:
    print(f"\n{chosen.title} ({chosen.source})")
    devices = {*zip(measured.device, measured.driver, strict=True)}
    device = "; ".join(f"{name}, {driver}" for name, driver in sorted(devices))
    sizes, *scenes = heading(chosen, measured)
    for line in (f"{sizes}; ours on {device}", *scenes, table(rows)):
        print(line)
    for line in (*turned(rows), *remarks(chosen, rows, measured)):
        print(line)
