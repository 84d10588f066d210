"""An interactive view for Jupyter: camera, light and method by sliders, the errors at once."""

from __future__ import annotations

import html
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .._core import DeviceError
from ..arguments import count, needs
from ..camera import Camera
from ..compare import compare
from ..default_view import SUN, see_all
from ..frame import Frame, check_view, render
from ..light import DirectionalLight, Light
from ..methods import METHODS
from ..reference import reference
from ..scene import Scene
from . import display

if TYPE_CHECKING:
    import ipywidgets

RESOLUTIONS = tuple(2**n for n in range(5, 13))


def explore(
    scene: Scene,
    camera: Camera | None = None,
    light: Light | None = None,
    *,
    width: int = 480,
    height: int = 270,
) -> ipywidgets.VBox:
    """Sliders for camera, light and method; wrong pixels in red, shadow map and warp at once.

    The camera turns around the middle of the scene and comes closer; a directional light turns and
    rises, any other moves. Every change renders a frame and judges it against the reference.

    Parameters
    ----------
    scene : Scene
    camera, light : optional
        Where to start; the scene's own if None, or a camera that sees all and a sun from above.
    width, height : int
        Size of the image in pixels. The reference is cast on the CPU at each change: keep it small.

    Returns
    -------
    ipywidgets.VBox
        Jupyter shows it where it is the last value of a cell.

    Raises
    ------
    ImportError
        ipywidgets is missing; the extra ``notebook`` has it.
    TypeError, ValueError
        A wrong argument.
    """
    widgets = needs("ipywidgets", "notebook")
    size = (count("width", width, "pixels"), count("height", height, "pixels"))
    start_camera = camera or next(iter(scene.cameras.values()), None) or see_all(scene)
    start_light = light or next(iter(scene.lights.values()), None) or SUN
    check_view(scene, start_camera, start_light)

    def slider(name: str, low: float, high: float, value: float, step: float) -> Any:
        # Rendered when let go: the reference takes longer than a mouse moves.
        return widgets.FloatSlider(
            value, min=low, max=high, step=step, description=name, continuous_update=False
        )

    turn = slider("turn", -180.0, 180.0, 0.0, 5.0)
    closer = slider("closer", -1.0, 0.95, 0.0, 0.05)
    light_sliders, light_at = _light_controls(scene, start_light, slider)
    method = widgets.Dropdown(options=list(METHODS), value="rtw", description="method")
    resolution = widgets.Dropdown(options=RESOLUTIONS, value=256, description="map, texels")
    shadows, shadow_map, grid = (widgets.Image(format="png") for _ in range(3))
    words = widgets.HTML()

    def draw(_: object = None) -> None:
        seen_from = _orbited(start_camera.resized(*size), scene, turn.value, closer.value)
        lit_by = light_at()
        made: Any = METHODS[method.value]()
        if hasattr(made, "resolution"):
            made = METHODS[method.value](resolution=resolution.value)  # type: ignore[call-arg]
        resolution.disabled = not hasattr(made, "resolution")
        try:
            frame = render(scene, seen_from, lit_by, made)
        except (ValueError, DeviceError) as error:
            words.value = f"<b>{html.escape(str(error))}</b>"
            return
        found = compare(frame, reference(scene, seen_from, lit_by))
        shadows.value = display.png_bytes(found.picture())
        shadow_map.value = display.png_bytes(_map_picture(frame, size[1]))
        grid.value = display.png_bytes(_grid_picture(frame, size[1]))
        words.value = (
            f"{html.escape(str(found))}<br>{sum(frame.timings.values()):.1f} ms on "
            f"{html.escape(str(frame.adapter.get('name', '?')))}: "
            f"{html.escape(display.milliseconds(frame.timings))}"
        )

    for control in (turn, closer, *light_sliders, method, resolution):
        control.observe(draw, names="value")
    draw()
    return widgets.VBox(
        [
            widgets.HBox(
                [widgets.VBox([turn, closer]), widgets.VBox(light_sliders),
                 widgets.VBox([method, resolution])]
            ),
            widgets.HBox([shadows, shadow_map, grid]),
            words,
        ]
    )  # fmt: skip


def _light_controls(
    scene: Scene, start: Light, slider: Callable[[str, float, float, float, float], Any]
) -> tuple[list[Any], Callable[[], Light]]:
    """Sliders, and the light that they describe."""
    if isinstance(start, DirectionalLight):
        x, y, z = -start.direction
        azimuth = slider("sun turns", -180.0, 180.0, math.degrees(math.atan2(x, z)), 5.0)
        rises = slider("sun rises", -90.0, 90.0, math.degrees(math.asin(y)), 1.0)

        def sun() -> Light:
            a, e = math.radians(azimuth.value), math.radians(rises.value)
            return DirectionalLight(
                (-math.sin(a) * math.cos(e), -math.sin(e), -math.cos(a) * math.cos(e))
            )

        return [azimuth, rises], sun

    reach = float(np.linalg.norm(np.diff(scene.bounds, axis=0))) / 2
    sliders = [slider(f"light {axis}", -reach, reach, 0.0, reach / 50) for axis in "xyz"]

    def moved() -> Light:
        offset = [each.value for each in sliders]
        values = {name: getattr(start, name) for name in start._fields}
        return type(start)(**values | {"position": start.position + offset})

    return sliders, moved


def _orbited(camera: Camera, scene: Scene, degrees: float, closer: float) -> Camera:
    """The camera turned around the vertical through the middle of the scene, and moved towards it
    by a share of the way."""
    middle = scene.bounds.mean(axis=0)
    angle = math.radians(degrees)
    turn = np.eye(3)
    turn[[0, 0, 2, 2], [0, 2, 0, 2]] = (
        math.cos(angle), math.sin(angle), -math.sin(angle), math.cos(angle),
    )  # fmt: skip
    pose = camera.pose.copy()
    pose[:3, :3] = turn @ pose[:3, :3]
    eye = turn @ (camera.eye - middle) + middle
    pose[:3, 3] = eye - pose[:3, 2] * closer * float(np.linalg.norm(eye - middle))
    return camera.posed(pose)


def _map_picture(frame: Frame, height: int) -> npt.NDArray[np.uint8]:
    """(height, W, 3): the layers of the shadow map side by side, near dark, far and empty light."""
    if not frame.shadow_map.size:
        return np.full((height, height, 3), 255, np.uint8)
    parts = []
    for layer in frame.shadow_map:
        rows = np.arange(height) * layer.shape[0] // height
        columns = np.arange(height) * layer.shape[1] // height
        depth = layer[rows][:, columns]
        hit = depth < 1.0
        low, high = (depth[hit].min(), depth[hit].max()) if hit.any() else (0.0, 1.0)
        grey = 40.0 + 180.0 * (depth - low) / (high - low or 1.0)
        parts.append(np.where(hit, grey, 255.0))
    picture = np.concatenate(parts, axis=1).clip(0, 255).astype(np.uint8)
    return np.repeat(picture[..., None], 3, axis=2)


def _grid_picture(frame: Frame, height: int) -> npt.NDArray[np.uint8]:
    """(height, W, 3): for each layer, where the warp moves the lines of a grid of 16 x 16."""
    parts = []
    along = (np.arange(4 * height) + 0.5) / (4 * height)
    for across, down in frame.warp_map:
        picture = np.full((height, height), 255, np.uint8)
        for line in np.arange(1, 16) / 16:
            for x, y in ((np.full_like(along, line), along), (along, np.full_like(along, line))):
                # A row's function moves x, and the column that x falls in then moves y.
                x = _moved(across, y, x)
                y = _moved(down, x, y)
                rows, columns = ((v * height).astype(int).clip(0, height - 1) for v in (y, x))
                picture[rows, columns] = 60
        parts.append(picture)
    if not parts:
        return np.full((height, 1, 3), 255, np.uint8)
    return np.repeat(np.concatenate(parts, axis=1)[..., None], 3, axis=2)


def _moved(
    functions: npt.NDArray[np.float32],
    band: npt.NDArray[np.float64],
    value: npt.NDArray[np.float64],
) -> npt.NDArray[np.float64]:
    """The functions of the bands at the values, linear between the boundaries of cells."""
    chosen = functions[(band * len(functions)).astype(int).clip(0, len(functions) - 1)]
    cells = functions.shape[1] - 1
    cell = (value * cells).astype(int).clip(0, cells - 1)
    rows = np.arange(len(value))
    low, high = chosen[rows, cell], chosen[rows, cell + 1]
    return np.asarray(low + (high - low) * (value * cells - cell))
