"""Render thousands of frames in one process, or millions of triangles.

python tests/tools/soak.py --renders 20000        the process must not grow by 1 %
python tests/tools/soak.py --triangles 10000000   one frame of each method without a wrong pixel
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

import numpy as np

import lixel as lx


def resident_bytes() -> int:
    """Memory that the process has (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096


def soak(renders: int, warm_up: int) -> tuple[int, int]:
    """Renders with every method in turn, under lights and with images of several kinds, some of
    them refused; memory after the first `warm_up` and after all."""
    scene = lx.scenes.plane_and_box()
    point_light = lx.PointLight((1.0, 4.0, 0.5))
    lights = (
        scene.lights["default"],
        point_light,
        lx.SpotLight((1.0, 4.0, 0.5), (0.0, -1.0, 0.0), 0.7),
    )
    known = list(lx.METHODS)
    methods = [
        method if method.name == "exact" or not hasattr(method, "resolution")
        else type(method)(resolution=64)
        for method in map(lx.method_from, known)
    ]  # fmt: skip
    before = 0
    for i in range(renders):
        if i == warm_up:
            before = resident_bytes()
        method = methods[i % len(methods)]
        light = next(x for x in np.roll(np.array(lights, object), i) if method.takes(x))
        camera = scene.cameras["default"].resized(24 + 8 * (i % 3), 16)
        if i % 5 == 0:
            scene.update_vertices(scene.vertices * (1.0 + 1e-3 * (-1) ** i))
        if i % 50 == 0:
            try:
                lx.render_shadows(scene, camera, light, lx.Uniform(resolution=32768))
            except (lx.DeviceError, ValueError):
                pass
            else:
                raise AssertionError("a map of 32768² should not fit")
        if i % 7 == 0:
            lx.render(scene, camera, light, method)
        else:
            lx.render_shadows(scene, camera, light, method)
    return before, resident_bytes()


def large(triangles: int) -> None:
    """A terrain of so many triangles, by the methods without a map and by one with."""
    start = time.time()
    scene = lx.scenes.terrain(cells=math.ceil(math.sqrt(triangles / 2)))
    camera, light = scene.cameras["default"].resized(480, 270), scene.lights["default"]
    print(f"{scene.triangle_count:,} triangles made in {time.time() - start:.1f} s")
    for method in ("desired_view", "exact", "ray_traced"):
        start = time.time()
        frame = lx.render(scene, camera, light, method)
        first = time.time() - start
        start = time.time()
        again = lx.render_shadows(scene, camera, light, method)
        assert again.tobytes() == frame.visibility.tobytes()
        print(f"{method}: {first:.1f} s, again {time.time() - start:.1f} s, {frame.timings}")


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--renders", type=int, default=2000)
    parser.add_argument("--triangles", type=int)
    options = parser.parse_args()
    if options.triangles is not None:
        large(options.triangles)
        return 0
    start = time.time()
    before, after = soak(options.renders, options.renders // 10)
    growth = after / before - 1.0
    print(
        f"{options.renders:,} renders in {time.time() - start:.0f} s: "
        f"{before / 2**20:.1f} MiB after a tenth, {after / 2**20:.1f} MiB at the end, {growth:+.2%}"
    )
    return int(growth >= 0.01)


if __name__ == "__main__":
    sys.exit(main())
