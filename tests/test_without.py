"""Features that not every GPU has: without them the same bytes."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import lixel as lx

pytestmark = pytest.mark.not_on_cpu("it leaves out what an adapter has")

LEFT_OUT = (
    "SHADER_INT64_ATOMIC_MIN_MAX", "TIMESTAMP_QUERY", "MAPPABLE_PRIMARY_BUFFERS", "PIPELINE_CACHE",
)  # fmt: skip
MORE_METHODS = (
    "cube+notw", "dual_paraboloid+rtw", "lispsm+rtw",
    lx.RectilinearWarp(analysis="forward"),
    lx.RectilinearWarp(rasterization="linear", tessellation=0.1),
    lx.NonOrthogonalWarp(lookup="depth", importance="boundary"),
    lx.NonOrthogonalWarp(function_count=64, exponent=0.5),
    lx.VirtualShadowMap(page_size=64),
)  # fmt: skip


def seen() -> Iterator[tuple[str, tuple[lx.Scene, lx.Camera, lx.Light, lx.Method]]]:
    """Every method with every kind of light that it takes."""
    scene = lx.scenes.colonnade(columns=3, detail=8)
    camera = scene.cameras["default"].resized(80, 45)
    low, high = scene.bounds
    inside = low + (high - low) * [0.45, 0.6, 0.55]
    lights = (
        scene.lights["default"],
        lx.PointLight(inside),
        lx.SpotLight(inside, (0.2, -1, 0.1), 0.8),
        lx.HemisphereLight(inside, (0, -1, 0)),
    )
    for named in (*lx.METHODS, *MORE_METHODS):
        method = lx.method_from(named)
        if hasattr(method, "resolution"):
            method = replace(method, resolution=96)
        for light in lights:
            if method.takes(light):
                yield f"{method} {type(light).__name__}", (scene, camera, light, method)


def digests() -> dict[str, list[str]]:
    """Of all that a frame holds, its counts among them."""
    found = {}
    for name, view in seen():
        frame = lx.render(*view)
        arrays = ("visibility", "triangle_id", "depth", "shadow_map", "importance_map", "warp_map")
        parts = [np.ascontiguousarray(getattr(frame, part)).tobytes() for part in arrays]
        parts.append(json.dumps(frame.stats, sort_keys=True, default=str).encode())
        found[name] = [hashlib.sha256(part).hexdigest() for part in parts]
    return found


def _leave_out(features: str) -> None:
    os.environ["LIXEL_WITHOUT"] = features


def process_without(features: str) -> ProcessPoolExecutor:
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(1, context, initializer=_leave_out, initargs=(features,))


def test_without_what_not_every_gpu_has_frames_are_the_same():
    """No 64-bit atomics, no times, and no memory that both sides read: as on other GPUs."""
    with process_without(",".join(LEFT_OUT)) as pool:
        there = pool.submit(digests)
        info = pool.submit(lx.info)
        here = digests()
        assert here == there.result(timeout=300)
        found = info.result(timeout=300)
    assert not found.adapters[0]["missing_features"]
    assert not {*LEFT_OUT, "SHADER_INT64"} & set(found.device["used_features"])


def test_a_feature_that_there_is_not_is_refused(view):
    with process_without("TIMESTAMPS") as pool:
        drawn = pool.submit(lx.render_shadows, *view, "uniform")
        with pytest.raises(ValueError, match=r"LIXEL_WITHOUT must name .*, got TIMESTAMPS"):
            drawn.result(timeout=300)
