"""How a paper's table is measured, and printed beside the paper's figures."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...camera import Camera
from ...methods import Method, method_from
from ...scenes import GENERATORS, rotation
from ..report import status, table
from ..result_tables import save
from ..study import study
from .tables import Figure, Row, Table

if TYPE_CHECKING:
    import pandas


def halved(chosen: Table) -> Table:
    """The table for images and maps of half the size on each side, and two cameras on a path."""
    return dataclasses.replace(
        chosen,
        size=(chosen.size[0] // 2, chosen.size[1] // 2),
        resolution=chosen.resolution // 2,
        path=min(chosen.path, 2),
        rows=tuple(_halved_row(row) for row in chosen.rows),
    )


def _halved_row(row: Row) -> Row:
    if "resolution" not in row.parameters:
        return row
    parameters = {**row.parameters, "resolution": row.parameters["resolution"] // 2}
    return dataclasses.replace(row, parameters=parameters)


def measure_table(chosen: Table, repeats: int, folder: Path | None) -> pandas.DataFrame:
    """A study of the table's rows; with a folder it is saved there, and goes on after a stop."""
    scenes, cameras, lights = {}, {}, {}
    for name, substitute in chosen.scenes.items():
        scene = GENERATORS[substitute.generator](**substitute.arguments)
        scenes[name] = (substitute.generator, substitute.arguments)
        cameras[name] = _path(scene.cameras["default"].resized(*chosen.size), chosen.path)
        lights[name] = {"0": substitute.light or scene.lights["default"]}
    journal = None
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        journal = folder / f"{chosen.name}.jsonl"
    status(f"{chosen.name}: {chosen.source}")
    measured = study(
        scenes,
        cameras=cameras,
        lights=lights,
        methods=list({repr(m): m for _, m in runnable(chosen)}.values()),
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
        pose = camera.pose.copy()
        pose[:3, :3] = rotation(share * camera.yfov / 4) @ pose[:3, :3]
        cameras[str(i)] = camera.posed(pose)
    return cameras


def runnable(chosen: Table) -> Iterator[tuple[Row, Method]]:
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


def beside(chosen: Table, measured: pandas.DataFrame) -> Iterator[dict[str, Any]]:
    """The rows of the table as it is printed."""
    columns = chosen.stages or dict.fromkeys(chosen.scenes, ())
    base = next(row for row in chosen.rows if row.name == chosen.base)
    methods = {row.name: method for row, method in runnable(chosen)}
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
                cells |= {
                    "misclassified, ratio": wrong / max(base_wrong, 1),
                    "misclassified": wrong,
                }
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


def turned(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
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


def print_table(
    chosen: Table, rows: Sequence[Mapping[str, Any]], measured: pandas.DataFrame
) -> None:
    print(f"\n{chosen.title} ({chosen.source})")
    width, height = chosen.size
    devices = {*zip(measured.device, measured.driver, strict=True)}
    device = "; ".join(f"{name}, {driver}" for name, driver in sorted(devices))
    print(f"{width} x {height} pixels, maps of {chosen.resolution}²; ours on {device}")
    counts = dict(zip(measured.scene, measured.triangles, strict=True))
    for name, substitute in chosen.scenes.items():
        print(f"for {name}: {substitute}, {counts[name]:,} triangles")
    print(table(rows))
    for line in turned(rows):
        print(line)
    missing = {row.name for row in chosen.rows} - {row["row"] for row in rows}
    if missing:
        print(f"left out, because this version has no such method: {', '.join(sorted(missing))}")
    if chosen.remark:
        print(chosen.remark)
