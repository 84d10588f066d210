"""The drawings of the page Concepts, each from what lixel renders."""

from __future__ import annotations

import io
from collections.abc import Callable

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

import lixel as lx
from lixel.pictures import warp_plots

INK, LIGHT, SHADOW, RED = "#444444", "#f2e6c8", "#7d8597", "#d62728"


def edges() -> Figure:
    """A few texels on the ground, the answer of the map and the truth."""
    plate = [[-1.3, 1.0, -0.8], [1.2, 1.0, -1.1], [0.9, 1.0, 1.2], [-0.9, 1.0, 0.9]]
    floor = [[-4, 0, 4], [4, 0, 4], [4, 0, -4], [-4, 0, -4]]
    scene = lx.Scene(floor + plate, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    # From below, through nothing: the floor as a plan, so that texels are squares on it.
    camera = lx.Camera.look_at((0, 0.5, 0), (0, 0, 0), (0, 0, -1), ymag=1.6, width=192, height=192)
    light = lx.DirectionalLight((0.0, -1.0, 0.0))
    method = lx.Uniform(resolution=48, lookup="depth", rotation=0.0)
    frame, truth = lx.render(scene, camera, light, method), lx.reference(scene, camera, light)
    figure, axes = plt.subplots(1, 2, figsize=(8.4, 4.2), layout="constrained")
    for ax, lit in zip(axes, (frame.visibility, truth.visibility), strict=True):
        shown = np.where((lit > 0)[..., None], colour(LIGHT), colour(SHADOW))
        if ax is axes[0]:
            shown[frame.visibility != truth.visibility] = colour(RED)
        ax.imshow(shown, interpolation="none", extent=(-1.6, 1.6, 1.6, -1.6))
        ax.set_axis_off()
    # The map spans the scene: eight units, 48 texels.
    for at in np.arange(-4, 4.01, 8 / 48):
        if abs(at) < 1.6:
            axes[0].axhline(at, color=INK, linewidth=0.4)
            axes[0].axvline(at, color=INK, linewidth=0.4)
    outline = np.array([*plate, plate[0]])
    axes[0].plot(outline[:, 0], outline[:, 2], color="black", linewidth=1.2)
    axes[0].set_title("what the map says; wrong pixels in red")
    axes[1].set_title("the truth")
    return figure


def warps() -> Figure:
    """The light's view under the texels of three methods."""
    scene = lx.scenes.colonnade(columns=6, detail=12)
    camera = scene.cameras["default"].resized(480, 270)
    light = scene.lights["default"]
    truth = lx.reference(scene, camera, light)
    methods = {
        "desired_view": lx.DesiredView(resolution=128),
        "rtw": lx.RectilinearWarp(resolution=128),
        "notw": lx.NonOrthogonalWarp(resolution=128),
    }
    figure, axes = plt.subplots(1, 3, figsize=(9.6, 3.6), layout="constrained")
    for ax, (name, method) in zip(axes, methods.items(), strict=True):
        frame = lx.render(scene, camera, light, method)
        depths = warp_plots.unwarped_depths(frame)
        low, high = float(depths.min()), float(depths.max())
        # No darker than what lines can be seen on.
        ax.imshow(depths, extent=(0, 1, 1, 0), cmap="gray_r", vmin=low, vmax=2.2 * high - 1.2 * low)
        for line in warp_plots.grid_lines(frame.warp_map[0] if len(frame.warp_map) else None, 25):
            ax.plot(*line.T, color="#0072B2", linewidth=0.6)
        wrong = lx.compare(frame, truth).misclassified_count
        ax.set(xlim=(0, 1), ylim=(1, 0), aspect="equal", xticks=(), yticks=())
        ax.set_title(f"{name}: {wrong:,} wrong pixels")
    return figure


def bias() -> Figure:
    """A row of a map across a slanting floor with a plate above: what texels store, less a bias."""
    slope, gap, plate = 0.45, 0.5, (4.0, 6.0)
    corners = [[x, x * slope, z] for x, z in ((0, -1), (8, -1), (8, 1), (0, 1))]
    corners += [[x, x * slope + gap, z] for x in plate for z in (-1, 1)]
    scene = lx.Scene(corners, [[0, 2, 1], [0, 3, 2], [4, 5, 6], [5, 7, 6]])
    # The light looks down, and each pixel of this camera is one of its texels.
    camera = lx.Camera.look_at((4, 9, 0), (4, 0, 0), (0, 0, -1), ymag=0.5, width=8, height=1)
    down = lx.DirectionalLight((0, -1, 0))
    stored = lx.reference(scene, camera, down).position[0, :, 1]
    x = np.linspace(0, 8, 1601)
    floor = x * slope
    is_lit = lx.shadows_at(scene, np.stack([x, floor, 0 * x], axis=1), down) > 0
    figure, axes = plt.subplots(1, 3, figsize=(9.6, 3.4), layout="constrained", sharey=True)
    titles = {"no bias: stripes": 0.0, "enough: half a step": slope / 2, "too much: a leak": 0.8}
    for ax, (title, shift) in zip(axes, titles.items(), strict=True):
        found = floor >= stored[np.minimum(x, 7).astype(int)] - shift - 1e-9
        ax.plot(x, floor, color=LIGHT, linewidth=5, solid_capstyle="butt")
        ax.plot(x, np.where(found, np.nan, floor), color=SHADOW, linewidth=5)
        ax.plot(x, np.where(found & ~is_lit, floor, np.nan), color=RED, linewidth=5)
        ax.plot(plate, np.array(plate) * slope + gap, color="black", linewidth=3)
        for texel, depth in enumerate(stored - shift):
            ax.plot([texel, texel + 1], [depth, depth], color="#0072B2", linewidth=1.4)
        ax.set_title(title)
        ax.set_xticks(range(9), [])
        ax.set_yticks([])
    figure.supxlabel("texels of the map, from the side; the light is above", fontsize="medium")
    words = {"#0072B2": "stored, less the bias", "black": "a plate above the floor"}
    words |= {LIGHT: "floor, lit", SHADOW: "floor, in shadow", RED: "floor, falsely lit"}
    for ink, word in words.items():
        axes[0].plot([], [], color=ink, linewidth=3, label=word)
    axes[0].legend(loc="upper left", fontsize=8, frameon=False)
    return figure


def ties() -> Figure:
    """A shadow whose edges pass through the middles of pixels."""
    floor = [[-4, 0, 4], [4, 0, 4], [4, 0, -4], [-4, 0, -4]]
    plate = [[-2.5, 1, 1.5], [0.5, 1, 1.5], [0.5, 1, -2.5], [-2.5, 1, -2.5]]
    scene = lx.Scene(floor + plate, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    camera = lx.Camera.look_at((0, 0.5, 0), (0, 0, 0), (0, 0, -1), ymag=4, width=8, height=8)
    truth = lx.reference(scene, camera, lx.DirectionalLight((0, -1, 0)))
    shown = np.where((truth.visibility > 0)[..., None], colour(LIGHT), colour(SHADOW))
    shown[truth.tie] = colour("#e8a33d")
    figure, ax = plt.subplots(figsize=(4.2, 4.2), layout="constrained")
    ax.imshow(shown, interpolation="none", extent=(-4, 4, 4, -4))
    centres = np.arange(-3.5, 4)
    ax.scatter(*np.meshgrid(centres, centres), s=4, color=INK)
    outline = np.array([*plate, plate[0]])
    ax.plot(outline[:, 0], outline[:, 2], color="black", linewidth=1.2)
    ax.set_title("in orange: ties. Dots: middles of pixels")
    ax.set_axis_off()
    return figure


DIAGRAMS: dict[str, Callable[[], Figure]] = {
    "edges": edges,
    "warps": warps,
    "bias": bias,
    "ties": ties,
}


def svg(draw: Callable[[], Figure]) -> bytes:
    """A drawing as text of SVG, the same each time."""
    stream = io.BytesIO()
    with plt.rc_context({"svg.hashsalt": "lixel", "svg.fonttype": "path"}):
        figure = draw()
        figure.savefig(stream, format="svg", facecolor="white", metadata={"Date": None})
    plt.close(figure)
    return stream.getvalue()


def colour(digits: str) -> np.ndarray:
    """A colour in hexadecimal digits as three shares."""
    return np.array([int(digits[i : i + 2], 16) / 255 for i in (1, 3, 5)])
