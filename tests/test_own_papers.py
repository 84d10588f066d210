"""Methods of papers written anew in numpy, as methods of one's own: the built-in ones' pictures."""

from __future__ import annotations

import numpy as np
import pytest

import lixel as lx

SCENE = lx.scenes.objects_on_floor(count=9, subdivisions=1)
CAMERA = lx.Camera.look_at((-3.1, 2.3, 4.2), (0.2, 0.3, 0.1), yfov=0.8, width=160, height=90)
SUN = lx.DirectionalLight((0.4, -1.0, 0.3))
VIEW = (SCENE, CAMERA, SUN)
CELLS = 64

pytestmark = pytest.mark.usefixtures("engine")


@pytest.fixture(autouse=True, scope="module")
def _methods():
    """The methods have names only here."""
    for function in (lispsm_anew, rtw_anew, notw_anew):
        lx.shadow_method(function)


def places(receivers, light, scene):
    """Where the receivers are in the map of the fit, from 0 to 1, and which they are."""
    plain = lx.render(scene, receivers.camera, light, "desired_view", resolution=CELLS)
    facing = receivers.facing
    points = receivers.position[facing]
    homogeneous = np.column_stack([points, np.ones(len(points))]) @ plain.light_matrix[0].T
    return homogeneous[:, :2] / homogeneous[:, 3:] / CELLS, facing


def lispsm_anew(receivers, light, scene, *, margin=0.02):
    """Wimmer, Scherzer, Purgathofer, EGSR 2004, around the receivers."""
    camera, some = receivers.camera, receivers.every(4)
    points = some.position[some.facing] - camera.eye
    forward = -camera.pose[:3, 2]
    line = forward - light.direction * (forward @ light.direction)
    sine = np.linalg.norm(line)
    line /= sine
    side = np.cross(light.direction, line)
    along, depth = points @ line, points @ forward
    near = max(depth.min(), depth.max() / 20)
    far = near + np.ptp(along) * sine
    apex = along.min() - (near + np.sqrt(near * far)) / sine  # section 4.2
    w = np.array([*line, -apex])
    x, y = np.array([*side, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])
    relative = np.column_stack([points, np.ones(len(points))])
    rows = []
    for row in (x, y):
        seen = (relative @ row) / (relative @ w)
        size = np.ptp(seen) * (1 + margin)
        middle = (seen.min() + seen.max()) / 2
        rows.append((row - (middle - size / 2) * w) / size)
    from_eye = np.eye(4)
    from_eye[:3, 3] = -camera.eye
    return lx.LightMatrix([*rows, [*light.direction, 0.0], w] @ from_eye)


def rtw_anew(receivers, light, scene, *, resolution=128):
    """Rosen, I3D 2012: backward analysis, importance by distance."""
    uv, facing = places(receivers, light, scene)
    column, row = np.clip((uv * CELLS).astype(int), 0, CELLS - 1).T
    importance = np.zeros((CELLS, CELLS))
    np.maximum.at(importance, (row, column), 1.0 / receivers.depth[facing])
    weights = np.exp(-0.5 * (np.arange(-9, 10) / 3.0) ** 2)
    functions = []
    for axis in (0, 1):
        maxima = importance.max(axis=axis)
        blurred = np.convolve(maxima, weights, mode="same")
        blurred /= np.convolve(np.ones(CELLS), weights, mode="same")
        functions.append([np.append(0.0, np.cumsum(blurred) / blurred.sum())])
    return lx.GivenWarp(ended(functions), resolution=resolution)


def notw_anew(receivers, light, scene, *, resolution=128):
    """Milet et al., WSCG 2015: one function for each row, then for each column."""
    x, y = places(receivers, light, scene)[0].T
    even = np.linspace(0, 1, CELLS + 1)

    def equalized(lines, along):
        counts = np.histogram2d(lines, along, bins=CELLS, range=((0, 1), (0, 1)))[0]
        total = counts.sum(axis=1, keepdims=True)
        sums = np.cumsum(np.pad(counts, ((0, 0), (1, 0))), axis=1)
        return np.where(total > 0, sums / np.maximum(total, 1), even)

    along_x = equalized(y, x)
    row = np.minimum((y * CELLS).astype(int), CELLS - 1)
    warped = np.array([np.interp(at, even, along_x[i]) for at, i in zip(x, row, strict=True)])
    along_y = equalized(warped, y)
    return lx.GivenWarp(ended([along_x, along_y]), resolution=resolution)


def ended(functions):
    """From 0 to 1, whatever is rounded."""
    functions = np.asarray(functions)
    functions[..., 0], functions[..., -1] = 0.0, 1.0
    return functions


BUILT_IN = {
    "lispsm_anew": lx.LightSpacePerspective(sample_resolution=40, resolution=128),
    "rtw_anew": lx.RectilinearWarp(importance_resolution=CELLS, resolution=128),
    "notw_anew": lx.NonOrthogonalWarp(
        importance_resolution=CELLS,
        function_count=CELLS,
        smoothing=0.0,
        exponent=1.0,
        even_share=0.0,
        resolution=128,
    ),
}


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_papers_written_anew_have_the_built_in_pictures(name):
    given = lx.render(*VIEW, name, resolution=128)
    built_in = lx.render(*VIEW, BUILT_IN[name])
    if name == "lispsm_anew":
        corners = np.column_stack([SCENE.vertices, np.ones(len(SCENE.vertices))])
        found = [corners @ frame.light_matrix[0].T for frame in (given, built_in)]
        got, want = (place[:, :2] / place[:, 3:] for place in found)
        np.testing.assert_allclose(got, want, atol=1e-9 * 128)
    else:
        # Sums in float64 here, of whole numbers or of float32 there.
        np.testing.assert_allclose(given.warp_map, built_in.warp_map, atol=1e-6)
    np.testing.assert_array_equal(given.visibility, built_in.visibility)
