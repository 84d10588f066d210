"""An interactive view for Jupyter: camera, light and method by sliders, the errors at once."""

from __future__ import annotations

import html
import io
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .._core import DeviceError
from ..arguments import needs, size
from ..camera import Camera
from ..compare import compare
from ..default_view import DEFAULT_LIGHT, see_all
from ..frame import Frame, check_view, render
from ..light import DirectionalLight, Light
from ..methods import METHODS
from ..reference import reference
from ..scene import Scene
from ..scenes import rotation
from . import display, warp_plots

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
    """Sliders for camera, light and method: misclassified pixels, shadow map and warp at once.

    The camera turns around the middle of the scene and comes closer; a directional light turns and
    rises, any other moves. Every change renders a frame and compares it with the reference.

    Parameters
    ----------
    scene : Scene
    camera, light : optional
        Where to start; the scene's own if None, or a camera that sees all and a light from above.
    width, height : int
        Size of the image in pixels. The reference is cast on the CPU at each change: keep it small.

    Returns
    -------
    ipywidgets.VBox
        Jupyter shows it where it is the last value of a cell.

    Raises
    ------
    ImportError
        ipywidgets or matplotlib is missing; the extra ``notebook`` has both.
    TypeError, ValueError
        A wrong argument.
    """
    widgets = needs("ipywidgets", "notebook")
    image = size(width, height)
    start_camera = camera or next(iter(scene.cameras.values()), None) or see_all(scene)
    start_light = light or next(iter(scene.lights.values()), None) or DEFAULT_LIGHT
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
        seen_from = _orbited(start_camera.resized(*image), scene, turn.value, closer.value)
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
        shadow_map.value = _drawn(warp_plots.shadow_map, frame, len(frame.shadow_map), image[1])
        grid.value = _drawn(warp_plots.warp_grid, frame, len(frame.warp_map), image[1])
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
        azimuth = slider("light turns", -180.0, 180.0, math.degrees(math.atan2(x, z)), 5.0)
        rises = slider("light rises", -90.0, 90.0, math.degrees(math.asin(y)), 1.0)

        def turned() -> Light:
            a, e = math.radians(azimuth.value), math.radians(rises.value)
            return DirectionalLight(
                (-math.sin(a) * math.cos(e), -math.sin(e), -math.cos(a) * math.cos(e))
            )

        return [azimuth, rises], turned

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
    turn = rotation(math.radians(degrees))
    pose = camera.pose.copy()
    pose[:3, :3] = turn @ pose[:3, :3]
    eye = turn @ (camera.eye - middle) + middle
    pose[:3, 3] = eye - pose[:3, 2] * closer * float(np.linalg.norm(eye - middle))
    return camera.posed(pose)


def _drawn(draw: Callable[..., object], frame: Frame, layers: int, height: int) -> bytes:
    """A PNG file with the layers side by side, each as high and as wide as the image is high."""
    figures = needs("matplotlib.figure", "notebook")
    inches = height / 100
    figure = figures.Figure((max(layers, 1) * inches, inches), dpi=100, layout="constrained")
    for layer in range(layers):
        ax = figure.add_subplot(1, layers, layer + 1)
        draw(frame, ax, layer=layer)
        ax.set(title="", xticks=[], yticks=[])
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return stream.getvalue()
