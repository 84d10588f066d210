"""Time whole frames side by side with other renderers, in one run on the same cores.

A frame goes from a new camera to a visibility image as a numpy array: primary visibility, shadows,
readback. Scenes are uploaded and acceleration structures built before the clock starts, and every
renderer warms up first. Frames are interleaved, so that a disturbance hits all alike. No two frames
have the same camera, so that nothing of a frame can be kept for the next.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import statistics
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ... import _core
from ...arguments import count
from ...camera import Camera
from ...compare import compare
from ...frame import render_shadows
from ...light import DirectionalLight, Light
from ...methods import Method
from ...reference import Reference, reference
from ...scene import Scene
from ..options import (
    DEFAULT_SCENE,
    SCENE_HELP,
    add_one_method,
    add_output,
    add_view,
    keep,
    method_with,
    view_of,
)
from ..rays import refuse_holes
from ..report import progress, status, table
from ..timing import moved_by_a_hair, wall_ms
from . import rasterizers, ray_casters
from .ray_casters import Render

# A slow peer is timed less often, so that it takes about this many seconds in all.
_PATIENCE = 30.0
_MIN_FRAMES = 3

PEERS: dict[str, tuple[str, Callable[[Scene, DirectionalLight], Render]]] = {
    "Mitsuba 3 llvm_ad_rgb": ("mitsuba", ray_casters.mitsuba_peer),
    "embreex": ("embreex", ray_casters.embree_peer),
    "trimesh with embreex": ("embreex", ray_casters.trimesh_peer),
    "Open3D": ("open3d", ray_casters.open3d_peer),
    "Warp": ("warp", ray_casters.warp_peer),
    # Before pyrender: VTK ends other EGL contexts of the process when it opens a window.
    "PyVista": ("pyvista", rasterizers.pyvista_peer),
    "pyrender": ("pyrender", rasterizers.pyrender_peer),
    "pygfx": ("pygfx", rasterizers.pygfx_peer),
}
"""The module that each peer needs, and what prepares it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab peers`."""
    parser.add_argument(
        "scene", nargs="?", default=DEFAULT_SCENE, metavar="FILE",
        help=f"{SCENE_HELP}; default: {DEFAULT_SCENE}",
    )  # fmt: skip
    add_view(parser)
    add_one_method(parser, 2048)
    parser.add_argument("--repeats", type=int, default=15, metavar="N", help="timed frames")
    add_output(parser, "write the table, .csv or .parquet")


def run(options: argparse.Namespace) -> None:
    """Measure, print and keep the table."""
    method = method_with(options.method, options.resolution, options.parameters)
    scene, camera, light = view_of(options)
    rows = measure(scene, camera, light, method, repeats=options.repeats)
    shared = {
        "scene": Path(options.scene).stem,
        "triangles": scene.triangle_count,
        "width": camera.width,
        "height": camera.height,
    }
    keep(options, [{**row, **shared} for row in rows])


def measure(
    scene: Scene,
    camera: Camera,
    light: Light,
    method: Method,
    *,
    repeats: int = 15,
) -> list[dict[str, Any]]:
    """Time whole frames of a method and of every peer that is installed; print a table.

    Of each renderer `repeats` frames are timed, at least 1; slow peers get fewer. A row has its
    version, its median, least and greatest milliseconds, the number of frames, and the pixels that
    it misclassifies.
    """
    repeats = count("repeats", repeats)
    if not isinstance(light, DirectionalLight):
        raise ValueError(f"light must be directional to compare renderers, got {light}")
    refuse_holes(scene)
    status("reference: casting rays on the CPU")
    truth = reference(scene, camera, light)
    contenders = [
        _Contender(
            f"lixel {method.name} {method.map_resolution or ''}".rstrip(),
            _core.__version__,
            lambda seen_by: render_shadows(scene, seen_by, light, method),
            scene,
            camera,
        )
    ]
    bounded = with_planes(camera, truth)
    for name, (module, prepare) in PEERS.items():
        if importlib.util.find_spec(module) is None:
            status(f"left out: {name}, which needs the package {module}")
            continue
        try:
            render = prepare(scene, light)
            render(bounded)
        # A peer may lack a driver or a library of its own, and says so with errors of its own; that
        # is no reason to lose the others.
        except Exception as error:
            status(f"left out: {name}: {' '.join(str(error).split()) or type(error).__name__}")
        else:
            contenders.append(_Contender(name, _version(module), render, scene, bounded))

    for contender in contenders:
        contender.warm_up(repeats)
    for turn in progress(range(repeats), "round"):
        for contender in contenders:
            if turn < contender.repeats:
                contender.milliseconds.append(contender.time())

    rows = [_row(contender, truth) for contender in contenders]
    device = _core.device()
    print(
        f"{scene.triangle_count:,} triangles, {camera.width} x {camera.height} pixels, "
        f"on {device.get('name', '?')}, driver {device.get('driver', '?')}"
    )
    print(table(rows))
    return rows


@dataclass
class _Contender:
    name: str
    version: str
    render: Render
    scene: Scene
    camera: Camera
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    repeats: int = 0
    milliseconds: list[float] = field(default_factory=list)

    def warm_up(self, repeats: int) -> None:
        """Compiles, allocates, and decides how often to time."""
        self.time()
        seconds = self.time() / 1e3
        self.repeats = min(repeats, max(_MIN_FRAMES, int(_PATIENCE / seconds)))

    def time(self) -> float:
        """Milliseconds of a frame from a new camera."""
        camera = moved_by_a_hair(self.camera, self.scene, self.random)
        return wall_ms(lambda: self.render(camera))


def with_planes(camera: Camera, truth: Reference) -> Camera:
    """The camera with a near and a far plane around all that it sees.

    A depth buffer is as exact as its near plane is far away, and most renderers must be told one.
    """
    seen = truth.depth[truth.covered]
    if not seen.size:
        raise ValueError("camera must see a surface to compare renderers")
    return camera._replaced(
        # Between pixels' centres something may be nearer.
        znear=max(camera.znear or 0.0, 0.5 * float(seen.min())),
        zfar=min(camera.zfar, 2.0 * float(seen.max())),
    )


def _version(module: str) -> str:
    """Of the package that has the module, whose own name may be another."""
    packages = importlib.metadata.packages_distributions().get(module, [])
    return importlib.metadata.version(packages[0]) if packages else "?"


def _row(contender: _Contender, truth: Reference) -> dict[str, Any]:
    visibility = contender.render(contender.camera)
    found = compare(visibility, truth, other_surfaces="count")
    times = contender.milliseconds
    return {
        "renderer": contender.name,
        "version": contender.version,
        "ms, median": statistics.median(times),
        "least": min(times),
        "greatest": max(times),
        "frames": len(times),
        "misclassified": found.misclassified_count,
        "% of covered": 100.0 * found.rate_covered,
    }
