"""Hard shadows with research shadow-map methods, and how wrong each one is.

A *lixel* is a light pixel: one texel of a shadow map. A whole example::

    import lixel as lx

    scene = lx.load("sponza.glb")
    camera = lx.Camera.look_at((-10.5, 2, 0), (6, 3.2, -0.3), yfov=1.1, width=1920, height=1080)
    light = lx.DirectionalLight((0.25, -1, 0.15))

    visibility = lx.render_shadows(scene, camera, light)  # (H, W): 1 lit, 0 in shadow, NaN nothing

    frame = lx.render(scene, camera, light, lx.DesiredView(resolution=2048))
    frame.save("shadows.png")
    print(frame.timings)  # milliseconds for each pass

    truth = lx.reference(scene, camera, light)
    print(lx.compare(frame, truth))  # misclassified pixels: false lit, false shadow

    lx.shadows_at(scene, points, light)  # the same of any points in space, (n, 3)

Without a file at hand, `lixel.scenes` makes one::

    scene = lx.scenes.colonnade()
    camera, light = scene.cameras["default"], scene.lights["default"]

A method is carried out by a GPU, or by lixel's own engine on the CPU, which needs no driver:
``device="gpu"``, ``device="cpu"``, or the best that is there; `info` lists them.

Conventions are glTF's: right-handed, cameras and lights look along their -Z, angles in radians,
poses from the camera to the world. Images are (H, W) arrays with row 0 at the top; lengths are
world units. A wrong argument is a `TypeError` or `ValueError` that names the argument, the rule and
the value; a machine that cannot do it is a `DeviceError` that says the remedy.
"""

import os

from . import scenes
from ._core import DeviceError, __version__, clear_cache
from .camera import Camera
from .compare import Comparison, compare
from .coverage import Coverage, CoverageComparison, coverage
from .fractions import ShadowFractions, shadow_fractions
from .frame import Frame, render, render_shadows
from .image_files import read_metadata, read_visibility
from .info import Info, info
from .lab.study import study
from .light import DirectionalLight, HemisphereLight, Light, PointLight, SpotLight
from .load import load
from .masks import AlphaMask
from .methods import (
    METHODS,
    Auto,
    Cascades,
    Cube,
    DesiredView,
    DualParaboloid,
    Exact,
    ExponentialVariance,
    Focused,
    GivenWarp,
    ImprovedParaboloid,
    LightMatrix,
    LightSpacePerspective,
    LogPerspective,
    Method,
    MinimalShadowMap,
    Moments,
    NonOrthogonalWarp,
    Pcf,
    PerspectiveShadowMap,
    PlaneOptimal,
    RayTraced,
    RectilinearWarp,
    SceneOptimized,
    ShadowVolumes,
    Spot,
    Trapezoidal,
    Uniform,
    Variance,
    VirtualShadowMap,
    method_from,
    shadow_method,
)
from .points import shadows_at
from .receivers import SeenSurface
from .reference import Reference, reference
from .scene import Scene
from .sequence import render_sequence
from .smoothing import automatic_smoothing
from .warps import importance_map, unwarp_points, warp_map, warp_points

__all__ = [
    "METHODS",
    "AlphaMask",
    "Auto",
    "Camera",
    "Cascades",
    "Comparison",
    "Coverage",
    "CoverageComparison",
    "Cube",
    "DesiredView",
    "DeviceError",
    "DirectionalLight",
    "DualParaboloid",
    "Exact",
    "ExponentialVariance",
    "Focused",
    "Frame",
    "GivenWarp",
    "HemisphereLight",
    "ImprovedParaboloid",
    "Info",
    "Light",
    "LightMatrix",
    "LightSpacePerspective",
    "LogPerspective",
    "Method",
    "MinimalShadowMap",
    "Moments",
    "NonOrthogonalWarp",
    "Pcf",
    "PerspectiveShadowMap",
    "PlaneOptimal",
    "PointLight",
    "RayTraced",
    "RectilinearWarp",
    "Reference",
    "Scene",
    "SceneOptimized",
    "SeenSurface",
    "ShadowFractions",
    "ShadowVolumes",
    "Spot",
    "SpotLight",
    "Trapezoidal",
    "Uniform",
    "Variance",
    "VirtualShadowMap",
    "__version__",
    "automatic_smoothing",
    "clear_cache",
    "compare",
    "coverage",
    "importance_map",
    "info",
    "load",
    "method_from",
    "read_metadata",
    "read_visibility",
    "reference",
    "render",
    "render_sequence",
    "render_shadows",
    "scenes",
    "shadow_fractions",
    "shadow_method",
    "shadows_at",
    "study",
    "unwarp_points",
    "warp_map",
    "warp_points",
]

# Mesa's layer that picks a device for a display complains on stderr, for each device made, where
# there is no folder for Wayland's sockets. lixel has no display, and picks for itself. The Vulkan
# loader reads this at the first frame.
if not {"XDG_RUNTIME_DIR", "MESA_VK_DEVICE_SELECT"} & os.environ.keys():
    os.environ.setdefault("NODEVICE_SELECT", "1")
