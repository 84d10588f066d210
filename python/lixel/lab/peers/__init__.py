"""Time whole frames side by side with other renderers, in one run on the same cores.

A frame goes from a new camera to a visibility image as a numpy array: primary visibility, shadows,
readback. Scenes are uploaded and acceleration structures built before the clock starts, and every
renderer warms up first. Frames are interleaved, so that a disturbance hits all alike. No two frames
have the same camera, so that no image can be kept for the next frame. After these a few frames are
timed from vertices that have moved, where acceleration structures are built within the time.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ... import _core
from ...arguments import count
from ...camera import Camera
from ...compare import compare
from ...frame import render_shadows
from ...light import DirectionalLight, Light, PointLight
from ...methods import Method, method_from, resolution_text
from ...reference import Reference, reference
from ...scene import Scene
from ..options import (
    RESOLUTION_HELP,
    add_methods,
    add_output,
    add_scene_and_view,
    keep,
    map_resolution,
    view_of,
)
from ..rays import refuse_holes
from ..report import progress, status, table
from ..timing import moved_by_a_hair, wall_ms
from . import rasterizers, ray_casters
from .ray_casters import Peer

# A slow peer is timed less often, so that it takes about this many seconds in all.
_PATIENCE = 30.0
_MIN_FRAMES = 3

CAST: tuple[type[Light], ...] = (DirectionalLight, PointLight)
"""Lights that peers take which cast rays."""


class Renderer(NamedTuple):
    """Another renderer: the module that it needs, what prepares it, and the lights it takes."""

    module: str
    prepare: Callable[[Scene, Any], Peer]
    lights: tuple[type[Light], ...] = (DirectionalLight,)


PEERS: dict[str, Renderer] = {
    "Mitsuba 3 llvm_ad_rgb": Renderer("mitsuba", ray_casters.mitsuba_peer, CAST),
    "embreex": Renderer("embreex", ray_casters.embree_peer, CAST),
    "trimesh with embreex": Renderer("embreex", ray_casters.trimesh_peer, CAST),
    "Open3D": Renderer("open3d", ray_casters.open3d_peer, CAST),
    "Warp": Renderer("warp", ray_casters.warp_peer, CAST),
    # Before pyrender: VTK ends other EGL contexts of the process when it opens a window.
    "PyVista": Renderer("pyvista", rasterizers.pyvista_peer),
    "pyrender": Renderer("pyrender", rasterizers.pyrender_peer),
    "pygfx": Renderer("pygfx", rasterizers.pygfx_peer),
}

METHODS = ("exact", "ray_traced", "desired_view", "cube")
"""The methods beside which they are timed by default, as far as they take the light."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab peers`."""
    add_scene_and_view(parser)
    add_methods(parser, f"{', '.join(METHODS)}, as far as they take the light")
    parser.add_argument(
        "--resolution", type=map_resolution, default=2048, metavar="N|WxH",
        help=f"{RESOLUTION_HELP}; default: 2048",
    )  # fmt: skip
    parser.add_argument("--repeats", type=int, default=15, metavar="N", help="timed frames")
    add_output(parser, "write the table, .csv or .parquet")


def run(options: argparse.Namespace) -> None:
    """Measure, print and keep the table."""
    scene, camera, light = view_of(options)
    named = [method_from(name) for name in options.method or METHODS]
    methods = [
        method if method.map_resolution is None else replace(method, resolution=options.resolution)
        for method in named
        if options.method or method.takes(light)
    ]
    rows = measure(scene, camera, light, methods, repeats=options.repeats)
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
    methods: Method | Sequence[Method],
    *,
    repeats: int = 15,
) -> list[dict[str, Any]]:
    """Time whole frames of methods and of every peer that is installed; print a table.

    Of each renderer `repeats` frames are timed, at least 1; slow peers get fewer. A row has its
    version, its median, least and greatest milliseconds and its processor time of all threads, the
    number of frames, the median of frames that build what follows from the vertices, and the pixels
    that it misclassifies. Peers that cast rays take point lights, too.
    """
    repeats = count("repeats", repeats)
    if not isinstance(light, CAST):
        raise ValueError(f"light must be directional or a point to compare renderers, got {light}")
    methods = [methods] if isinstance(methods, Method) else list(methods)
    refuse_holes(scene)
    status("reference: casting rays on the CPU")
    truth = reference(scene, camera, light)
    contenders = [_own(scene, camera, light, method) for method in methods]
    bounded = with_planes(camera, truth)
    for name, (module, prepare, lights) in PEERS.items():
        if importlib.util.find_spec(module) is None:
            status(f"left out: {name}, which needs the package {module}")
            continue
        if not isinstance(light, lights):
            status(f"left out: {name}, which is tried with directional lights alone")
            continue
        try:
            peer = prepare(scene, light)
            peer.render(bounded)
        # A peer may lack a driver or a library of its own, and says so with errors of its own; that
        # is no reason to lose the others.
        except Exception as error:
            status(f"left out: {name}: {' '.join(str(error).split()) or type(error).__name__}")
        else:
            contenders.append(_Contender(name, _version(module), peer, scene, bounded))

    for contender in contenders:
        contender.warm_up(repeats)
    for turn in progress(range(repeats), "round"):
        for contender in contenders:
            if turn < contender.repeats:
                contender.measure()
    for _ in progress(range(_MIN_FRAMES), "round with building"):
        for contender in contenders:
            contender.measure_building()

    rows = [_row(contender, truth) for contender in contenders]
    device = _core.device()
    print(
        f"{scene.triangle_count:,} triangles, {camera.width} x {camera.height} pixels, "
        f"on {device.get('name', '?')}, driver {device.get('driver', '?')}"
    )
    print(table(rows))
    return rows


def _own(scene: Scene, camera: Camera, light: Light, method: Method) -> _Contender:
    """A method of lixel."""
    size = "" if method.map_resolution is None else resolution_text(method.map_resolution)
    name = f"lixel {method.name} {size}".rstrip()

    def render(seen_by: Camera) -> npt.NDArray[np.float32]:
        return render_shadows(scene, seen_by, light, method)

    peer = Peer(render, lambda: scene.update_vertices(scene.vertices))
    return _Contender(name, _core.__version__, peer, scene, camera)


@dataclass
class _Contender:
    name: str
    version: str
    peer: Peer
    scene: Scene
    camera: Camera
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    repeats: int = 0
    milliseconds: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    built: list[float] = field(default_factory=list)

    def warm_up(self, repeats: int) -> None:
        """Compiles, allocates, and decides how often to time."""
        self.time()
        seconds = self.time() / 1e3
        self.repeats = min(repeats, max(_MIN_FRAMES, int(_PATIENCE / seconds)))

    def measure(self) -> None:
        before = time.process_time()
        self.milliseconds.append(self.time())
        self.cpu.append(1e3 * (time.process_time() - before))

    def measure_building(self) -> None:
        if self.peer.build is not None:
            self.built.append(self.time(self.peer.build))

    def time(self, before: Callable[[], object] = lambda: None) -> float:
        """Milliseconds of a frame from a new camera, and of what is done before."""
        camera = moved_by_a_hair(self.camera, self.scene, self.random)
        return wall_ms(lambda: (before(), self.peer.render(camera)))


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
    visibility = contender.peer.render(contender.camera)
    found = compare(visibility, truth, other_surfaces="count")
    times = contender.milliseconds
    return {
        "renderer": contender.name,
        "version": contender.version,
        "ms, median": statistics.median(times),
        "least": min(times),
        "greatest": max(times),
        "processor ms, median": statistics.median(contender.cpu),
        "ms with building, median": statistics.median(contender.built or [math.nan]),
        "frames": len(times),
        "misclassified": found.misclassified_count,
        "% of covered": 100.0 * found.rate_covered,
    }
