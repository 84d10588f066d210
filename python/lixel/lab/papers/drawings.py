"""The papers' figures, drawn again of the substitute scenes, with methods as published.

Misclassified pixels are red, as in the papers. Details are where a plain map misclassifies most.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ...arguments import did_you_mean, needs
from ...camera import Camera
from ...compare import Comparison, compare
from ...frame import Frame, render
from ...light import DirectionalLight, HemisphereLight, Light, PointLight
from ...methods import Method
from ...pictures import plots, warp_plots
from ...pictures.display import shadow_picture
from ...reference import Reference, reference
from ...scene import Scene
from ...scenes import GENERATORS
from ...warps import receiver_places, warp_points
from ..report import status
from . import milet, path, rosen, vanek
from .fence import fence
from .measuring import QUICK
from .tables import SubstituteScene, method_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Panel: TypeAlias = tuple[str, Callable[["Axes"], object]]
"""A title, and what draws below it."""

Grid: TypeAlias = Sequence[Sequence[Panel]]
"""Rows of panels."""

CELLS = 128
"""Of a count map, along each side."""


@dataclass(frozen=True)
class View:
    """A scene as one camera sees it in one light, maps of a size for it, and what else all of its
    methods have in place of their papers' values."""

    scene: Scene
    camera: Camera
    light: Light
    resolution: int
    changes: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def truth(self) -> Reference:
        return reference(self.scene, self.camera, self.light)

    def frame(self, method: str | Method, **changes: Any) -> Frame:
        """By a method's spelling, with a map of the view's size."""
        if isinstance(method, str):
            own = {"resolution": self.resolution, **self.changes, **changes}
            method = method_of(method, **own)
        return render(self.scene, self.camera, self.light, method)

    def compared(self, frame: Frame) -> Comparison:
        return compare(frame, self.truth)

    @cached_property
    def detail(self) -> tuple[slice, slice]:
        """The window of a sixth of the image where a plain map misclassifies most."""
        wrong = self.compared(self.frame("uniform@published")).misclassified
        rows, columns = (max(1, length // 6) for length in wrong.shape)
        sums = np.pad(wrong.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
        windows = sums[rows:, columns:] - sums[:-rows, columns:]
        windows = windows - sums[rows:, :-columns] + sums[:-rows, :-columns]
        row, column = np.unravel_index(windows.argmax(), windows.shape)
        return slice(int(row), int(row) + rows), slice(int(column), int(column) + columns)


def view_of(
    substitute: SubstituteScene,
    size: tuple[int, int],
    resolution: int,
    part: int,
    light: Light | None = None,
) -> View:
    """The default view of a scene; image and map are smaller by a part."""
    quick = substitute.quick if part > 1 else {}
    scene = GENERATORS[substitute.generator](**{**substitute.arguments, **quick})
    camera = scene.cameras["default"].resized(size[0] // part, size[1] // part)
    chosen = light or substitute.light or scene.lights["default"]
    return View(scene, camera, chosen, resolution // part)


# --- Panels ---

WHOLE = (slice(None), slice(None))


def picture(
    title: str, pixels: npt.NDArray[Any], window: tuple[slice, slice] = WHOLE, **shown: Any
) -> Panel:
    return title, lambda ax: ax.imshow(pixels[window], interpolation="nearest", **shown)


def shadows(title: str, view: View, frame: Frame, window: tuple[slice, slice] = WHOLE) -> Panel:
    """Without what is wrong, but its number."""
    wrong = view.compared(frame).misclassified_count
    return picture(f"{title}, {wrong:,} wrong", shadow_picture(frame.visibility), window)


def errors(title: str, view: View, frame: Frame, window: tuple[slice, slice] = WHOLE) -> Panel:
    found = view.compared(frame)
    wrong = int(found.misclassified[window].sum())
    return picture(f"{title}, {wrong:,} wrong", found.picture(), window)


def truth(view: View, window: tuple[slice, slice] = WHOLE) -> Panel:
    return picture("ray-cast reference", shadow_picture(view.truth.visibility), window)


def shadow_map(title: str, frame: Frame, layer: int = 0) -> Panel:
    return title, partial(warp_plots.shadow_map, frame, layer=layer)


def counts(title: str, places: npt.NDArray[np.float64]) -> Panel:
    """How many receivers fall in each cell of a map."""
    found, *_ = np.histogram2d(places[:, 1], places[:, 0], bins=CELLS, range=((0, 1), (0, 1)))
    shown = np.ma.masked_equal(found, 0)
    return f"{title}, at most {found.max():.0f}", lambda ax: ax.imshow(shown, norm="log")


def counts_of(title: str, frame: Frame) -> Panel:
    """Of the layer with most receivers, where the frame's warp, if it has one, puts them."""
    layer = fullest_layer(frame)
    places = receiver_places(frame, layer)
    if len(frame.warp_map):
        places = warp_points(frame.warp_map[layer], places)
    return counts(title, places)


def fullest_layer(frame: Frame) -> int:
    layers = range(len(frame.shadow_map))
    return max(layers, key=lambda layer: len(receiver_places(frame, layer)))


# --- Figures ---


def rosen_figure_1(part: int) -> Grid:
    view = view_of(rosen.PLAYGROUND, (1920, 1080), 2048, part)
    large, small = view.resolution, view.resolution // 4
    frames = {
        f"conventional {large}²": view.frame("uniform@published"),
        f"RTW {small}²": view.frame("rtw@published", resolution=small, **rosen.WHOLE),
        f"RTW {large}²": view.frame("rtw@published", **rosen.WHOLE),
    }
    windows = {"": WHOLE, ", detail": view.detail}
    rows = [
        [*(errors(name + words, view, frame, window) for name, frame in frames.items()),
         truth(view, window)]
        for words, window in windows.items()
    ]  # fmt: skip
    return [*rows, [shadow_map(f"{name}, map", frame) for name, frame in frames.items()]]


def rosen_figure_3(part: int) -> Grid:
    view = view_of(rosen.SANDBOX, (1920, 1080), 2048, part)
    large, small = view.resolution, view.resolution // 4
    hybrid = rosen.ANALYSES["Hybrid Analysis"]
    frames = {
        f"conventional {large}²": view.frame("uniform@published"),
        f"RTW {small}²": view.frame("rtw@published", resolution=small, **rosen.WHOLE),
        f"RTW {small}² with edges": view.frame(
            "rtw@published", resolution=small, **rosen.WHOLE, **hybrid
        ),
    }
    return [_of_warp(name, view, frame) for name, frame in frames.items()]


def rosen_figure_6(part: int) -> Grid:
    view = view_of(rosen.PLAYGROUND, (1920, 1080), 2048, part)
    normal = view.frame("rtw@published", **rosen.WHOLE, importance=rosen.NORMAL)
    return [
        _of_warp("distance", view, view.frame("rtw@published", **rosen.WHOLE)),
        _of_warp("distance and normal", view, normal),
    ]


def _of_warp(name: str, view: View, frame: Frame) -> list[Panel]:
    row = [errors(name, view, frame), errors("detail", view, frame, view.detail)]
    if len(frame.warp_map):
        row.append(("grid", partial(warp_plots.warp_grid, frame)))
    return [*row, shadow_map("map", frame)]


def rosen_figure_8(part: int) -> Grid:
    view = view_of(rosen.PLAYGROUND, (1920, 1080), 1024, part)
    lookups = {
        "one texel": "depth",
        "PCF in the map": rosen.FILTERS["warped"],
        "PCF in the world": rosen.FILTERS["unwarped"],
    }
    frames = {
        name: view.frame("rtw@published", lookup=of, **rosen.WHOLE) for name, of in lookups.items()
    }
    return [
        [picture(name, shadow_picture(frame.visibility), window) for name, frame in frames.items()]
        for window in (WHOLE, view.detail)
    ]


def rosen_figure_10(part: int) -> Grid:
    """The first view of the path of Figure 9."""
    view = view_of(rosen.TOWN, (1920, 1080), 2048, part)
    first = path.cameras(view.scene, (view.camera.width, view.camera.height), range(1))
    view = replace(view, camera=next(first))
    methods = path.methods(part)
    rows = []
    for name in ("RTW, tessellated, 5 %", "CSM, 4 cascades"):
        frame = view.frame(methods[name])
        layers = range(len(frame.shadow_map))
        maps = [shadow_map(f"map {i + 1} of {len(layers)}", frame, i) for i in layers]
        rows.append([errors(name, view, frame), *maps])
    return rows


def milet_figure_3(part: int) -> Grid:
    view = view_of(milet.OBSERVATORY, milet.SIZE, milet.RESOLUTION, part)
    places, after_rows, after_both = _steps(view.frame("notw@published"))
    return [[
        counts("receivers", places),
        counts("after the rows' functions", after_rows),
        counts("after the columns', too", after_both),
    ]]  # fmt: skip


def milet_figure_4(part: int) -> Grid:
    view = view_of(milet.OBSERVATORY, milet.SIZE, milet.RESOLUTION, part)
    plain, smooth = (view.frame("notw@published", smoothing=of) for of in (0.0, 16.0 / part))
    places, after_rows, _ = _steps(smooth)
    offsets = [
        frame.warp_map[0][0] - np.linspace(0, 1, frame.warp_map.shape[-1])
        for frame in (plain, smooth)
    ]
    limit = max(float(np.abs(each).max()) for each in offsets)
    shown: dict[str, Any] = {"cmap": "PuOr_r", "vmin": -limit, "vmax": limit, "aspect": "equal"}
    return [
        [counts("receivers", places), picture("offsets of the rows", offsets[0], **shown)],
        [picture("smoothed", offsets[1], **shown), counts("receivers after the rows", after_rows)],
    ]


def _steps(frame: Frame) -> tuple[npt.NDArray[np.float64], ...]:
    """Receivers in the map, after the functions of the rows, and after those of the columns."""
    places, warp = receiver_places(frame, 0), frame.warp_map[0]
    identity = np.broadcast_to(np.linspace(0, 1, warp.shape[-1]), warp[1].shape)
    return places, warp_points(np.stack([warp[0], identity]), places), warp_points(warp, places)


def milet_figure_7(part: int) -> Grid:
    methods = {name: f"{milet.METHODS[name]}@milet-2015" for name in ("SM", "RTW", "NoTW")}
    views = {name: view_of(of, milet.SIZE, 512, part) for name, of in milet.SCENES.items()}
    return [
        [errors(f"{scene}, {name}", views[scene], views[scene].frame(of))
         for name, of in methods.items()]
        for scene in ("Sponza", "Observatory", "Conf. room")
    ]  # fmt: skip


def thesis_figure(other: str, part: int) -> Grid:
    """5.2 and 5.3: the reference, and details of two methods."""
    view = view_of(milet.OBSERVATORY, milet.SIZE, milet.RESOLUTION, part)
    frames = {name: view.frame(f"{milet.METHODS[name]}@navratil") for name in (other, "NoTW")}
    details = (errors(f"{n}, detail", view, frame, view.detail) for n, frame in frames.items())
    return [[truth(view), truth(view, view.detail), *details]]


def _omnidirectional(part: int) -> tuple[View, dict[str, Frame]]:
    view = view_of(milet.LAMP, milet.SIZE, milet.RESOLUTION, part)
    methods = {name: f"{of}@{milet.OF_THESIS}" for name, of in milet.LAMP_METHODS.items()}
    return view, {name: view.frame(of, **milet.by_hand(of)) for name, of in methods.items()}


def thesis_figure_4(part: int) -> Grid:
    view, frames = _omnidirectional(part)
    return [
        [*(errors(name, view, frame, window) for name, frame in frames.items()),
         truth(view, window)]
        for window in (WHOLE, view.detail)
    ]  # fmt: skip


def thesis_figure_5(part: int) -> Grid:
    _, frames = _omnidirectional(part)
    layers = {name: fullest_layer(frame) for name, frame in frames.items()}
    return [[shadow_map(f"{name}, map", of, layers[name]) for name, of in frames.items()]]


def thesis_figure_6(part: int) -> Grid:
    _, frames = _omnidirectional(part)
    return [[counts_of(name, frame) for name, frame in frames.items()]]


def vanek_figure(scene: str, light: Light | None, methods: Mapping[str, str], part: int) -> Grid:
    """1, 6 and 7."""
    return of_methods(view_of(vanek.SCENES[scene], (1600, 1200), 1024, part, light), methods)


def of_methods(view: View, methods: Mapping[str, str]) -> Grid:
    """Methods side by side, and a detail of each."""
    frames = {name: view.frame(of) for name, of in methods.items()}
    return [
        [errors(name, view, frame, window) for name, frame in frames.items()]
        for window in (WHOLE, view.detail)
    ]


def vanek_figure_2(part: int) -> Grid:
    """By each texel's own ray: pieces with straight edges have no holes."""
    scene = fence()
    camera = scene.cameras["default"].resized(1600 // part, 1200 // part)
    exact = {"rasterization": "exact"}
    view = View(scene, camera, scene.lights["default"], 1024 // part, exact)
    return of_methods(view, PARABOLOIDS)


def vanek_figure_5(part: int) -> Grid:
    lamp = vanek.SCENES["Car"].light
    assert isinstance(lamp, PointLight)
    lights = {
        "omnidirectional": PointLight((1.0, 3.0, 1.0)),
        "hemispherical": HemisphereLight(lamp.position, -lamp.position),
        "directional": None,
    }
    row = []
    for name, light in lights.items():
        of = vanek.SCENES["Car"] if light else SubstituteScene("objects_on_floor", {"count": 140})
        view = view_of(of, (1600, 1200), 1024, part, light)
        row.append(shadows(name, view, view.frame("improved_paraboloid@published")))
    return [row]


def chong_figure_2(part: int) -> Grid:
    """The pixels next to boundaries, of those that face the light, in an image of 180²."""
    view = view_of(SubstituteScene("objects_on_floor"), (750, 750), 400, part)
    found = reference(view.scene, view.camera.resized(180, 180), view.light)
    dark = found.visibility == 0.0
    is_next = np.zeros_like(dark)
    for axis in (0, 1):
        differ = np.diff(dark.astype(np.int8), axis=axis) != 0
        pairs = np.pad(differ, [(1, 1) if i == axis else (0, 0) for i in (0, 1)])
        is_next |= pairs.take(range(180), axis) | pairs.take(range(1, 181), axis)
    chosen = is_next & found.facing
    pixels = shadow_picture(found.visibility)
    pixels[chosen] = (0, 114, 178)
    return [[truth(view), picture(f"{int(chosen.sum()):,} samples", pixels)]]


PARABOLOIDS = {"DPSM": "dual_paraboloid@vanek-2011", "IPSM": "improved_paraboloid@published"}
WITH_UNIFORM = {"uniform": "uniform@vanek-2011", **PARABOLOIDS}


def _hemisphere(scene: str, towards: tuple[float, float, float]) -> Light:
    """In the place of the scene's lamp."""
    lamp = vanek.SCENES[scene].light
    assert isinstance(lamp, PointLight)
    return HemisphereLight(lamp.position, towards)


FIGURES: Mapping[str, Callable[[int], Grid]] = {
    "rosen-figure-1": rosen_figure_1,
    "rosen-figure-3": rosen_figure_3,
    "rosen-figure-6": rosen_figure_6,
    "rosen-figure-8": rosen_figure_8,
    "rosen-figure-10": rosen_figure_10,
    "milet-figure-3": milet_figure_3,
    "milet-figure-4": milet_figure_4,
    "milet-figure-7": milet_figure_7,
    "thesis-figure-5.2": partial(thesis_figure, "SM"),
    "thesis-figure-5.3": partial(thesis_figure, "RTW"),
    "thesis-figure-5.4": thesis_figure_4,
    "thesis-figure-5.5": thesis_figure_5,
    "thesis-figure-5.6": thesis_figure_6,
    "vanek-figure-1": partial(
        vanek_figure, "Sibenik", _hemisphere("Sibenik", (-0.1, -0.4, -1.0)), PARABOLOIDS
    ),
    "vanek-figure-2": vanek_figure_2,
    "vanek-figure-5": vanek_figure_5,
    # A uniform map has one direction; a spot light is one that all three can render.
    "vanek-figure-6": partial(vanek_figure, "Car", vanek.SCENES["Car"].spot, WITH_UNIFORM),
    "vanek-figure-7": partial(
        vanek_figure, "Trees", DirectionalLight((60, -70, 25)),
        {"uniform": "uniform@vanek-2011", "IPSM": "improved_paraboloid@published"},
    ),
    "chong-figure-2": chong_figure_2,
}  # fmt: skip
"""Each by a part by which image and map are smaller than the paper's."""


def draw(names: Sequence[str], folder: Path, *, quick: bool = False) -> list[Path]:
    """Draw figures of `FIGURES`, all without `names`, into files of the folder.

    `quick` draws images and maps of a quarter of the size. An unknown name is a `ValueError`.
    """
    for name in names:
        if name not in FIGURES:
            raise ValueError(
                f"figure must be one of {', '.join(FIGURES)}, got {name!r}"
                f"{did_you_mean(name, FIGURES)}"
            )
    matplotlib = needs("matplotlib.figure", "plot")
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name in names or FIGURES:
        status(f"drawing {name}")
        rows = FIGURES[name](QUICK if quick else 1)
        columns = max(map(len, rows))
        figure = matplotlib.Figure((3.6 * columns, 3.0 * len(rows)), layout="constrained")
        axes = figure.subplots(len(rows), columns, squeeze=False)
        for row, of_row in zip(axes, rows, strict=True):
            for ax, panel in zip(row, [*of_row, *[None] * (columns - len(of_row))], strict=True):
                ax.set_axis_off()
                if panel is not None:
                    panel[1](ax)
                    ax.set_title(panel[0], fontsize="small")
        figure.suptitle(name)
        paths.append(folder / f"{name}.png")
        plots.save(figure, paths[-1], f"lixel lab papers --figures {name}", dpi=120)
    return paths
