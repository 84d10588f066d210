"""Rendering: the visibility image alone, or a frame with all that a method has to show."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, SupportsIndex, TypeAlias, get_args, overload

import numpy as np
import numpy.typing as npt

from . import _core, image_files
from .arguments import count, instance
from .auto import choose, choose_on_cpu
from .camera import Camera
from .light import LIGHTS, Light, one_or_several
from .methods import Auto, Exact, LightMatrix, Method, OwnMethod, method_from
from .pictures import display
from .receivers import Receivers, SeenSurface
from .scene import Scene

Output: TypeAlias = Literal[
    "triangle_id",
    "shadow_map",
    "importance_map",
    "warp_map",
    "light_matrix",
    "projections",
    "aliasing_error",
    "largest_aliasing_error",
    "max_effective_resolution",
    "pages",
    "page_levels",
]
OUTPUTS: tuple[Output, ...] = get_args(Output)
"""What a frame may have to show beside the visibility image; the rest follows from it."""


_PAGE_NUMBERS = ("layer", "face", "level", "column", "row", "is_kept")
PAGE = np.dtype([(name, np.int32) for name in _PAGE_NUMBERS])
"""What is known of a page."""


@dataclass(frozen=True, eq=False)
class FrameParts:
    """What was asked of one render, without the rest of a `Frame`."""

    method: Method
    """The one that was chosen where `Auto` was asked for."""
    visibility: npt.NDArray[np.float32]
    timings: dict[str, float]
    """Of all that was rendered for the choice of a method, too."""
    stats: dict[str, Any]
    adapter: dict[str, Any]
    outputs: _core.Rendered
    """The outputs by name, each None unless asked for."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Frame(Receivers):
    """All that one render has to show, as numpy arrays; images are (H, W), row 0 at the top.

    `position`, `normal`, `depth` and `facing` are computed on first use.

    Attributes
    ----------
    visibility : (H, W) float32, or uint8 where `render` was asked for that
        1 lit, 0 in shadow, NaN where no surface is seen. As uint8 255, 0 and 255.
    triangle_id : (H, W) int32
        Row of the scene's `faces`, -1 where no surface is seen.
    method : Method
        The method with its parameters; the one that was chosen where `Auto` was asked for.
    importance_map : (layers, h, w) float32
        What the warp was made from: the greatest importance in each cell (`RectilinearWarp`), or
        the number of receivers (`NonOrthogonalWarp`). No layers where a method has none.
    warp_map : (layers, 2, functions, cells + 1) float32
        The warp's functions along x, one for each band of rows, and along y, one for each band of
        columns: values in [0, 1] at the boundaries of cells, linear in between. No layers where a
        method has none. Of a `GivenWarp` by samples (layers, h, w, 2), the samples.
    shadow_map : (layers, h, w) float32
        Depth from the light in [0, 1], 1 where empty. It is whole here; `render_shadows` draws only
        what receivers look at. Of `VirtualShadowMap` (pages, h, w): those of its pages.
    light_matrix : (layers, 4, 4) float64
        (column, row, depth, w) in texels of the map, before any warp, from a point in world space.
        Of a paraboloid the point in its axes, relative to the light; of a logarithm (column, s,
        depth, w), where s / w is one over the distance from the apex, which is one at the centre.
    projections : list of dict
        What each layer's map is beside its matrix: ``kind``, ``"parallel"``, ``"homography"``,
        ``"perspective"``, ``"paraboloid"`` or ``"log_perspective"``; the ``scale`` in texels and
        the ``centre`` of a paraboloid, which takes (x, y, z) in its axes to
        centre + scale (x, y) / (|(x, y, z)| + z), and of a logarithm, whose row is that of the
        centre - scale log(s / w); and the planes (a, b, c, d) of its ``region``: it is for
        receivers that have a x + b y + c z + d >= 0.
    aliasing_error : (H, W) float32
        The papers' m = w'_l / w'_i: the width of a texel over that of the pixel it falls in; above
        1 shadow edges turn into stairs. NaN where no surface is seen.
    largest_aliasing_error : float
        The largest perspective aliasing error over the view frustum, between the nearest and the
        farthest surface (Lloyd et al. 2006): the longer side of a texel over the width of a pixel,
        across their beams, wherever a surface might be and however turned, on a grid of 32 x 32
        pixels and 32 depths. What no layer covers is left out. Infinite where a warp leaves a place
        no texels, NaN where nothing is seen or a method has no layers.
    max_effective_resolution : (2,) float
        Rosen's MER, (width, height) in texels: the size of a uniform map with the detail that this
        one has where it has most.
    pages : (pages,) structured
        What `VirtualShadowMap` drew, in the order of `shadow_map`; none of another method. Of each
        page its ``layer`` (that of `light_matrix`), its ``face``, 0 where the light has one
        map, else the number among the faces that receivers fall in, its ``level``, 0 the finest,
        its ``column`` and ``row`` among the pages of its level, and whether it ``is_kept``: 1 if it
        was taken from the frame before.
    page_levels : (H, W) int32
        The level that each pixel looks into, -1 where it needs none.
    timings : dict of str to float
        Milliseconds for each pass that ran, on the GPU or on the CPU engine. A pass that was not
        needed has no entry.
    stats : dict
        What was culled, skipped and written.
    adapter : dict
        Name, type, backend and driver of the GPU; of the CPU engine the name of the processor, the
        type ``"Cpu engine"``, the backend ``"lixel"``, and as the driver its version, the kind of
        vector instructions and the number of threads.
    """

    visibility: npt.NDArray[Any]
    method: Method
    importance_map: npt.NDArray[np.float32]
    warp_map: npt.NDArray[np.float32]
    shadow_map: npt.NDArray[np.float32]
    light_matrix: npt.NDArray[np.float64]
    projections: list[dict[str, Any]]
    aliasing_error: npt.NDArray[np.float32]
    largest_aliasing_error: float
    max_effective_resolution: tuple[float, float]
    pages: npt.NDArray[np.void]
    page_levels: npt.NDArray[np.int32]
    timings: dict[str, float]
    stats: dict[str, Any]
    adapter: dict[str, Any]

    def to_image(self, shaded: bool = True) -> npt.NDArray[np.uint8]:
        """A picture: lit light, shadow dark, background white.

        Parameters
        ----------
        shaded : bool
            Darken surfaces that are turned away from the light or the camera, so that their shape
            shows in lit and shadowed parts alike.

        Returns
        -------
        (H, W, 3) uint8
        """
        picture = display.shadow_picture(self._shares)
        if not shaded:
            return picture
        covered = self.covered
        normal = self.normal[covered]
        points = self.position[covered]
        to_light = self.light.vectors_from(points)
        sight = self.camera.sights_of(points)
        lit = np.nan_to_num(self._shares[covered]) * np.clip(_cosine(normal, to_light), 0.0, 1.0)
        shade = 0.45 + 0.25 * np.abs(_cosine(normal, sight)) + 0.3 * lit
        picture[covered] = (picture[covered] * shade[:, None] + 0.5).astype(np.uint8)
        return picture

    def save(self, path: str | Path) -> None:
        """Write what the ending names, and into all but .npy files what made it.

        Parameters
        ----------
        path : path
            ``.png`` for the picture (`to_image`); ``.mask.png`` for `visibility` in 16 bits of
            grey, 0 no surface, 1 shadow, 65535 lit; ``.npy`` for `visibility`; ``.npz`` and
            ``.exr`` for `visibility`, `triangle_id`, `object_id`, `depth` and `normal`.
            `read_visibility` and `read_metadata` read them; ``.exr`` needs the extra ``exr``.

        Raises
        ------
        ValueError
            Another ending.
        ImportError
            The package for .exr is missing.
        """
        image_files.save(path, self._picture, self._layers, self._made_by)

    def _layers(self) -> dict[str, npt.NDArray[Any]]:
        names = ["triangle_id", "object_id"]
        # Depths and normals are gone once the scene has moved.
        names += ["depth", "normal"] if self.is_current else []
        return {"visibility": self._shares, **{name: getattr(self, name) for name in names}}

    def _made_by(self) -> dict[str, Any]:
        return {
            **super()._made_by(),
            "method": image_files.method_record(self.method),
            "device": self.adapter.get("name"),
            "driver": self.adapter.get("driver"),
        }

    def _picture(self) -> npt.NDArray[np.uint8]:
        # Shading needs the points, and those are gone once the scene has moved.
        return self.to_image(shaded=self.is_current)

    def __repr__(self) -> str:
        height, width = self.visibility.shape
        return (
            f"<lixel.Frame: {width} x {height}, {self.method}, "
            f"{sum(self.timings.values()):.2f} ms on {self.adapter.get('name', 'unknown')}>"
        )

    def _repr_png_(self) -> bytes:
        return display.png_bytes(self._picture())

    def _repr_html_(self) -> str:
        rows: list[tuple[str, object]] = [(f"{k}, ms", v) for k, v in self.timings.items()]
        rows += [("all passes, ms", sum(self.timings.values())), *self.stats.items()]
        rows.append(("adapter", self.adapter.get("name", "unknown")))
        return display.html_figure(self._picture(), rows, str(self.method))


@overload
def render_shadows(
    scene: Scene,
    camera: Camera,
    light: Light | Sequence[Light],
    method: str | Method | None = None,
    *,
    dtype: type[np.float32] | Literal["float32"] = np.float32,
    device: str | None = None,
    threads: SupportsIndex | None = None,
    max_error: float | None = None,
    max_ms: float | None = None,
    **parameters: Any,
) -> npt.NDArray[np.float32]: ...


@overload
def render_shadows(
    scene: Scene,
    camera: Camera,
    light: Light | Sequence[Light],
    method: str | Method | None = None,
    *,
    dtype: type[np.uint8] | Literal["uint8"],
    device: str | None = None,
    threads: SupportsIndex | None = None,
    max_error: float | None = None,
    max_ms: float | None = None,
    **parameters: Any,
) -> npt.NDArray[np.uint8]: ...


def render_shadows(
    scene: Scene,
    camera: Camera,
    light: Light | Sequence[Light],
    method: str | Method | None = None,
    *,
    dtype: npt.DTypeLike = np.float32,
    device: str | None = None,
    threads: SupportsIndex | None = None,
    max_error: float | None = None,
    max_ms: float | None = None,
    **parameters: Any,
) -> npt.NDArray[Any]:
    """Which pixels the light, or each of several lights, reaches.

    Several lights share the pass that finds what the camera sees. On a GPU they submit their work
    together; with ``"auto"`` each has its turn.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    light : Light, or list or tuple of them
    method : str or method object, optional
        A name of `lixel.METHODS`, or an object with parameters such as
        ``DesiredView(resolution=2048)``; ``"auto"`` chooses for each light, see `Auto`. None:
        ``"exact"`` on the CPU engine, where nothing is faster; on a GPU, or where `max_error` or
        `max_ms` is given, ``"auto"``.
    dtype : {float32, uint8}
        Of the image, as numpy or its names have it: ``np.uint8`` is a quarter of the memory.
    device : str, optional
        Who renders: ``"cpu"``, lixel's own engine, which needs no driver; ``"gpu"``, the best
        adapter, of hardware or else of software; or a part of the name of an adapter, in any case,
        such as ``"llvmpipe"``. None: what the environment variable ``LIXEL_DEVICE`` names; without
        it a hardware GPU where there is one, else the CPU engine. `info` lists what there is.
    threads : int, optional
        Threads of the CPU engine, from 1 to 1024; the image is the same with any number. None: as
        many as the environment variable ``LIXEL_THREADS`` says, else ``RAYON_NUM_THREADS``, else
        as there are cores. A GPU's driver has its own.
    max_error : float, optional
        Parameter of `Auto`: most wrong pixels, as a share of those that see a surface. None: 0.001.
    max_ms : float, optional
        Parameter of `Auto`: most milliseconds on the GPU for each light, a preference.
    **parameters
        Parameters of the method that is named, by their names: ``method="rtw", resolution=2048``.

    Returns
    -------
    (H, W) float32 or uint8
        1 lit, 0 in shadow, NaN where no surface is seen; row 0 at the top. As uint8 255 lit, 0 in
        shadow, and 255 where no surface is seen. For ``L`` lights (L, H, W), in their order, each
        layer what the light alone would give.

    Raises
    ------
    ValueError
        An unknown method; the message lists the known ones. `max_error` or `max_ms` with a method
        other than ``"auto"``. A device that there is not; the message lists the adapters. Another
        `dtype`.
    TypeError
        An argument of another type, or a parameter that the method does not have; the message lists
        those that it has.
    DeviceError
        No adapter, or it lacks what the method needs. The message says the remedy.
    """
    kind = _dtype_of_image(dtype)
    chosen = chosen_method(method, device, parameters, max_error=max_error, max_ms=max_ms)
    on = _on(device, threads)
    check_view(scene, camera)
    lights, is_list = one_or_several(light)
    found = _parts_of_lights(scene, camera, lights, chosen, on)
    if is_list:
        images = np.array([_as_dtype(parts.visibility, kind) for parts in found], kind)
        return images.reshape(-1, camera.height, camera.width)
    [parts] = found
    return _as_dtype(parts.visibility, kind)


def render(
    scene: Scene,
    camera: Camera,
    light: Light,
    method: str | Method | None = None,
    *,
    dtype: npt.DTypeLike = np.float32,
    device: str | None = None,
    threads: SupportsIndex | None = None,
    max_error: float | None = None,
    max_ms: float | None = None,
    **parameters: Any,
) -> Frame:
    """As `render_shadows`, with everything that the method has to show.

    Parameters
    ----------
    scene, camera, light, method, dtype, device, threads, max_error, max_ms, **parameters
        As for `render_shadows`; one light.

    Returns
    -------
    Frame

    Raises
    ------
    ValueError, TypeError, DeviceError
        As for `render_shadows`.
    """
    kind = _dtype_of_image(dtype)
    chosen = chosen_method(method, device, parameters, max_error=max_error, max_ms=max_ms)
    on = _on(device, threads)
    [parts] = _parts_of_lights(scene, camera, [light], chosen, on, OUTPUTS)
    outputs = {name: getattr(parts.outputs, name) for name in OUTPUTS}
    outputs["pages"] = outputs["pages"].view(PAGE).ravel()
    values = {name: value for name, value in vars(parts).items() if name != "outputs"}
    values["visibility"] = _as_dtype(parts.visibility, kind)
    return Frame(scene=scene, camera=camera, light=light, **values, **outputs)


def frame_parts(
    scene: Scene,
    camera: Camera,
    light: Light,
    method: str | Method,
    outputs: Sequence[Output] = (),
    *,
    device: str | None = None,
    threads: SupportsIndex | None = None,
    culling: bool = True,
) -> FrameParts:
    """The visibility image and the named outputs of one frame; no more is drawn than they need.

    Without `culling` nothing is left out, not even what cannot change a picture.
    """
    chosen = chosen_method(method, device)
    on = _on(device, threads)
    [parts] = _parts_of_lights(scene, camera, [light], chosen, on, outputs, culling=culling)
    return parts


def _parts_of_lights(
    scene: Scene,
    camera: Camera,
    lights: Sequence[Light],
    method: Method,
    on: tuple[str | None, int | None],
    outputs: Sequence[Output] = (),
    *,
    culling: bool = True,
) -> list[FrameParts]:
    """Those of each light. With `Auto` each light has its turn, else they submit work together."""
    check_view(scene, camera, *lights)

    def core(
        lights: Sequence[Light],
        name: str,
        parameters: Mapping[str, Any],
        outputs: Sequence[Output],
    ) -> list[_core.Rendered]:
        return _core.render(
            scene._core,
            camera._core_for(scene),
            [light._core for light in lights],
            (name, dict(parameters)),
            outputs,
            culling=culling,
            on=on,
        )

    def rendered(
        lights: Sequence[Light], method: Method, outputs: Sequence[Output]
    ) -> list[FrameParts]:
        return [
            FrameParts(method, found.visibility, found.timings, found.stats, found.adapter, found)
            for found in core(lights, method.name, method.parameters(), outputs)
        ]

    if isinstance(method, OwnMethod):
        return _own_parts(scene, camera, lights, method, outputs, core, rendered)
    if not isinstance(method, Auto):
        return rendered(lights, method, outputs)

    chooses = choose if is_on_gpu(on[0]) else choose_on_cpu

    def chosen_for(light: Light) -> FrameParts:
        parts = chooses(scene, camera, light, method, lambda tried: rendered([light], tried, ())[0])
        if not outputs:
            return parts
        [whole] = rendered([light], parts.method, outputs)
        return replace(parts, outputs=whole.outputs)

    return [chosen_for(light) for light in lights]


def _own_parts(
    scene: Scene,
    camera: Camera,
    lights: Sequence[Light],
    method: OwnMethod,
    outputs: Sequence[Output],
    core: Callable[..., list[_core.Rendered]],
    rendered: Callable[..., list[FrameParts]],
) -> list[FrameParts]:
    """Those of a method of one's own: its function is asked for each light."""
    found = []
    seen: list[_core.Rendered] = []
    for light in lights:
        # Without a matrix there is no map: what the camera sees is all that is found.
        seen = seen or core([light], LightMatrix.name, {}, ["triangle_id"])
        triangle_id = seen[0].triangle_id
        assert triangle_id is not None
        start = time.perf_counter()
        receivers = SeenSurface(triangle_id=triangle_id, scene=scene, camera=camera, light=light)
        made = method.made(receivers, light, scene)
        timings = {**seen[0].timings, "python": 1e3 * (time.perf_counter() - start)}
        [parts] = rendered([light], made, outputs)
        for label, milliseconds in parts.timings.items():
            timings[label] = timings.get(label, 0.0) + milliseconds
        found.append(replace(parts, method=method, timings=timings))
    return found


def _dtype_of_image(dtype: npt.DTypeLike) -> np.dtype[Any]:
    try:
        kind = np.dtype(dtype)
    except TypeError:
        kind = None
    if dtype is None or kind not in (np.float32, np.uint8):
        raise ValueError(f"dtype must be float32 or uint8, got {dtype!r}")
    return kind


def _as_dtype(visibility: npt.NDArray[np.float32], dtype: np.dtype[Any]) -> npt.NDArray[Any]:
    """The image itself, or as bytes; it is overwritten on the way, which spares copies."""
    if dtype == visibility.dtype:
        return visibility
    np.fmin(visibility, 1.0, out=visibility)  # 1 for NaN
    np.multiply(visibility, 255.0, out=visibility)
    return np.rint(visibility, out=visibility).astype(dtype)


def _on(device: str | None, threads: SupportsIndex | None) -> tuple[str | None, int | None]:
    """Who renders, and on how many threads."""
    return device, thread_count(threads)


def thread_count(threads: SupportsIndex | None) -> int | None:
    """A number of threads, checked."""
    return None if threads is None else count("threads", threads)


def is_on_gpu(device: str | None) -> bool:
    """Whether a GPU renders."""
    return _core.engine(device) == "gpu"


def chosen_method(
    method: str | Method | None,
    device: str | None,
    parameters: Mapping[str, Any] = MappingProxyType({}),
    *,
    max_error: float | None = None,
    max_ms: float | None = None,
) -> Method:
    """The method with its parameters, or the one for want of one; `Auto` with the bounds that are
    given."""
    if method is None:
        if parameters:
            raise TypeError(f"{', '.join(parameters)} must come with a method, got None")
        is_bounded = max_error is not None or max_ms is not None
        method = Auto() if is_bounded or is_on_gpu(device) else Exact()
    chosen = method_from(method, **parameters)
    bounds = {"max_error": max_error, "max_ms": max_ms}
    given: dict[str, Any] = {name: value for name, value in bounds.items() if value is not None}
    if not given:
        return chosen
    if not isinstance(chosen, Auto):
        raise ValueError(
            f"{' and '.join(given)} must come with the method 'auto', got {chosen.name!r}"
        )
    return replace(chosen, **given)


def check_view(scene: object, camera: object, *lights: object) -> None:
    """Refuses arguments of other types, by name."""
    instance("scene", scene, Scene)
    instance("camera", camera, Camera)
    for light in lights:
        instance("light", light, *LIGHTS)


def _cosine(
    normal: npt.NDArray[np.floating], vector: npt.NDArray[np.floating]
) -> npt.NDArray[np.float64]:
    length = np.linalg.norm(vector, axis=-1)
    return np.asarray(np.einsum("nc,nc->n", normal, vector) / np.where(length > 0.0, length, 1.0))
