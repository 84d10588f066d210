"""Light matrices and warps of one's own: the built-in pictures come back; faults are named."""

from __future__ import annotations

import dataclasses
import math
import pickle
import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import lixel as lx
from lixel import _core

SCENE = lx.scenes.objects_on_floor(count=9, subdivisions=1)
CAMERA = lx.Camera.look_at((-3.1, 2.3, 4.2), (0.2, 0.3, 0.1), yfov=0.8, width=160, height=90)
SUN = lx.DirectionalLight((0.4, -1.0, 0.3))
POINT = lx.PointLight((0.3, 2.5, 0.2))
SPOT = lx.SpotLight((2.0, 3.0, 1.0), (-0.6, -1.0, -0.3), 0.8)
FAR = lx.PointLight((-400.0, 1000.0, -300.0))
TRUTH = lx.reference(SCENE, CAMERA, SUN)
SMALL: dict[str, Any] = {"resolution": 128}


def same(got: Any, want: Any) -> None:
    np.testing.assert_array_equal(got, want)


BUILT_IN = [
    ("uniform", SUN),
    ("desired_view", SUN),
    ("focused", SUN),
    ("lispsm", SUN),
    ("psm", SUN),
    ("cascades", SUN),
    ("lispsm", FAR),
    ("desired_view", FAR),
    ("lispsm", POINT),
    ("cube", POINT),
    ("spot", SPOT),
]


@pytest.mark.parametrize(("name", "light"), BUILT_IN)
def test_the_matrices_of_a_frame_give_its_picture(name, light, engine):
    frame = lx.render(SCENE, CAMERA, light, name, **SMALL)
    given = lx.render(SCENE, CAMERA, light, lx.LightMatrix.of(frame, **SMALL))
    same(given.visibility, frame.visibility)
    np.testing.assert_allclose(given.aliasing_error, frame.aliasing_error, rtol=1e-6)
    np.testing.assert_allclose(
        given.largest_aliasing_error, frame.largest_aliasing_error, rtol=1e-6
    )
    assert given.stats["layers"] == frame.stats["layers"]
    if name in ("lispsm", "psm"):
        # The same rays to the last bit, and the same depths.
        same(given.shadow_map, frame.shadow_map)


def own_uniform(light: lx.DirectionalLight, turn: float = 0.3) -> npt.NDArray[np.float64]:
    """A map over the box of the scene's corners, as a first-year student has it: look along the
    light, then scale."""
    along = light.direction
    right = np.cross(along, (math.sin(turn), 0.2, math.cos(turn)))
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(along, right), along])
    places = SCENE.vertices @ axes.T
    low, high = places.min(axis=0) - 0.01, places.max(axis=0) + 0.01
    matrix = np.eye(4)
    matrix[:3, :3] = axes / (high - low)[:, None]
    matrix[:3, 3] = -low / (high - low)
    return matrix


@pytest.mark.parametrize("lookup", ["auto", "depth", "triangle", "auto_5x5", lx.Pcf(radius=2.0)])
@pytest.mark.parametrize("rasterization", ["exact", "linear"])
def test_a_matrix_of_ones_own_is_looked_up_in_every_way(lookup, rasterization, engine):
    method = lx.LightMatrix(
        own_uniform(SUN), resolution=256, lookup=lookup, rasterization=rasterization
    )
    found = lx.compare(lx.render_shadows(SCENE, CAMERA, SUN, method), TRUTH)
    built_in = lx.Uniform(resolution=256, lookup=lookup, rasterization=rasterization)
    like = lx.compare(lx.render_shadows(SCENE, CAMERA, SUN, built_in), TRUTH)
    assert found.misclassified_count <= 1.5 * like.misclassified_count + 20


def test_a_light_far_away_is_a_directional_one_in_all_but_name(engine):
    far = lx.PointLight(-1e7 * SUN.direction)
    matrix = lx.LightMatrix(own_uniform(SUN), **SMALL)
    pictures = [lx.render_shadows(SCENE, CAMERA, light, matrix) for light in (SUN, far)]
    same(*pictures)


@pytest.mark.parametrize("scale", [-3.0, 1e-6, 1e9])
def test_only_a_positive_factor_leaves_a_matrix_the_same(scale, engine):
    matrix = own_uniform(SUN)
    want = lx.render_shadows(SCENE, CAMERA, SUN, lx.LightMatrix(matrix, **SMALL))
    scaled = lx.LightMatrix(scale * matrix, **SMALL)
    if scale < 0.0:
        with pytest.raises(ValueError, match="matrix must have w, its last row, above 0 somewhere"):
            lx.render_shadows(SCENE, CAMERA, SUN, scaled)
    else:
        same(lx.render_shadows(SCENE, CAMERA, SUN, scaled), want)


def test_a_matrix_is_looked_up_where_numpy_says():
    """The shadow map holds the nearest triangle along the ray of each texel."""
    matrix = own_uniform(SUN)
    frame = lx.render(SCENE, CAMERA, SUN, lx.LightMatrix(matrix, resolution=32))
    texels = frame.light_matrix[0] @ np.append((0.3, 0.2, -0.4), 1.0)
    places = matrix @ np.append((0.3, 0.2, -0.4), 1.0)
    np.testing.assert_allclose(texels[:2] / texels[3] / 32, places[:2] / places[3], rtol=1e-9)


@pytest.mark.parametrize(("name", "light"), BUILT_IN)
def test_numbers_of_float32_do(name, light):
    frame = lx.render(SCENE, CAMERA, light, name, device="cpu", **SMALL)
    exact = lx.LightMatrix.of(frame, **SMALL)
    rounded = lx.LightMatrix(np.asarray(exact.matrix, np.float32), regions=exact.regions, **SMALL)
    got = lx.render_shadows(SCENE, CAMERA, light, rounded, device="cpu")
    assert np.count_nonzero(got[~np.isnan(got)] != frame.visibility[~np.isnan(got)]) < 20


def test_clip_space_becomes_the_map_as_the_docstring_says():
    to_map = np.array([[0.5, 0, 0, 0.5], [0, -0.5, 0, 0.5], [0, 0, 1, 0], [0, 0, 0, 1]])
    clip = np.linalg.inv(to_map) @ own_uniform(SUN)
    same(
        lx.render_shadows(SCENE, CAMERA, SUN, lx.LightMatrix(to_map @ clip, **SMALL)),
        lx.render_shadows(SCENE, CAMERA, SUN, lx.LightMatrix(own_uniform(SUN), **SMALL)),
    )


def test_several_layers_are_each_for_what_lies_in_their_maps(engine):
    """Two halves of a map, side by side, are as good as one of twice the resolution."""
    matrix = own_uniform(SUN)
    halves = [np.diag([2.0, 1.0, 1.0, 1.0]) @ matrix for _ in range(2)]
    halves[1][0] -= halves[1][3]
    frame = lx.render(SCENE, CAMERA, SUN, lx.LightMatrix(halves, resolution=256))
    assert frame.stats["layers"] == 2
    assert lx.compare(frame, TRUTH).misclassified_count < 250
    # One that no receiver falls in is left out.
    beside = np.array(matrix)
    beside[0] -= 3.0 * beside[3]
    frame = lx.render(SCENE, CAMERA, SUN, lx.LightMatrix([matrix, beside], resolution=256))
    assert (frame.stats["layers"], frame.stats["skipped_layers"]) == (1, 1)


def test_a_given_map_can_be_warped(engine):
    plain = lx.LightMatrix.of(lx.render(SCENE, CAMERA, SUN, "lispsm", **SMALL))
    for warp in (lx.RectilinearWarp, lx.NonOrthogonalWarp):
        given = lx.render(SCENE, CAMERA, SUN, warp(fit=plain, **SMALL))
        built_in = lx.render(SCENE, CAMERA, SUN, warp(fit="lispsm", **SMALL))
        same(given.warp_map, built_in.warp_map)
        same(given.visibility, built_in.visibility)
        assert given.method.composition == f"light_matrix+{warp.name}"


WARPED = [
    ("rtw", SUN),
    ("notw", SUN),
    ("cascades+notw", SUN),
    ("cube+rtw", POINT),
    ("dual_paraboloid+notw", POINT),
]


@pytest.mark.parametrize(("name", "light"), WARPED)
def test_the_warps_of_a_frame_give_its_picture(name, light, engine):
    frame = lx.render(SCENE, CAMERA, light, name, **SMALL)
    warp = lx.GivenWarp(frame.warp_map, fit=frame.method.fit, **SMALL)
    given = lx.render(SCENE, CAMERA, light, warp)
    for part in ("visibility", "warp_map", "shadow_map", "aliasing_error", "light_matrix"):
        same(getattr(given, part), getattr(frame, part))
    assert given.importance_map.size == 0


def test_a_warp_of_other_cells_is_for_every_layer(engine):
    bent = np.linspace(0, 1, 6) ** [[1.5], [1.0], [0.7]]
    functions = np.stack([bent, bent[::-1]])
    given = lx.render(SCENE, CAMERA, POINT, lx.GivenWarp(functions, fit="cube", **SMALL))
    assert len(given.warp_map) == given.stats["layers"] > 1
    for layer in given.warp_map:
        same(layer, functions.astype(np.float32))
    even = lx.GivenWarp(np.broadcast_to(np.linspace(0, 1, 4), (2, 3, 4)), **SMALL)
    found = lx.compare(lx.render_shadows(SCENE, CAMERA, SUN, even), TRUTH)
    plain = lx.compare(lx.render_shadows(SCENE, CAMERA, SUN, "desired_view", **SMALL), TRUTH)
    assert abs(found.misclassified_count - plain.misclassified_count) < 50


# --- What is refused ---


EYE = np.eye(4)
SKEWED = own_uniform(lx.DirectionalLight((0.5, -1.0, 0.3)))
BEHIND = own_uniform(SUN) * [[1], [1], [-1], [1]]


@pytest.mark.parametrize(
    ("matrix", "light", "words"),
    [
        (
            np.zeros((4, 4)),
            SUN,
            "matrix must be invertible: rows x, y and w must not follow from each other, got [[0",
        ),
        (own_uniform(SUN)[[0, 0, 2, 3]], SUN, "matrix must be invertible: "),
        ([own_uniform(SUN), np.ones((4, 4))], SUN, "matrix[1] must be invertible: "),
        (SKEWED, SUN, "matrix must send every point of a light's ray to one place of the map: "),
        (
            own_uniform(SUN),
            POINT,
            "the light's rays meet at [0.3, 2.5, 0.2",
        ),
        (SKEWED, SUN, "the light's rays run along ["),
        (BEHIND, SUN, "matrix must have depths, row 3 over row 4, that grow away from the light"),
    ],
)
def test_matrices_that_are_none_of_the_lights_are_named(matrix, light, words, engine):
    with pytest.raises(ValueError, match=re.escape(words)):
        lx.render_shadows(SCENE, CAMERA, light, lx.LightMatrix(matrix))


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lx.LightMatrix, TypeError, "matrix"),
        (lambda: lx.LightMatrix(None), ValueError, "matrix must be given"),
        (lambda: lx.LightMatrix(np.eye(3)), ValueError, "(layers, 4, 4) for up to 64 layers"),
        (lambda: lx.LightMatrix(np.ones((0, 4, 4))), ValueError, "matrix must be a finite matrix"),
        (lambda: lx.LightMatrix(np.ones((65, 4, 4))), ValueError, "for up to 64 layers"),
        (lambda: lx.LightMatrix(EYE * np.nan), ValueError, "matrix must be a finite matrix"),
        (lambda: lx.LightMatrix("eye"), TypeError, "matrix must be a finite matrix"),
        (lambda: lx.LightMatrix(EYE * 1j), TypeError, "matrix must be a finite matrix"),
        (lambda: lx.LightMatrix(EYE, regions=3), TypeError, "regions must be for each layer"),
        (lambda: lx.LightMatrix(EYE, regions=[]), ValueError, "as many as matrices, 1, got 0"),
        (lambda: lx.LightMatrix(EYE, regions=[[[0, 0, 0, 1]]]), ValueError, "not all 0"),
        (lambda: lx.LightMatrix(EYE, regions=[np.ones((6, 4))]), ValueError, "up to 5 finite"),
        (lambda: lx.LightMatrix(EYE, regions=[np.ones((2, 3))]), ValueError, "got shape [2, 3]"),
        (lambda: lx.LightMatrix(EYE, resolution=0), ValueError, "resolution must be a whole"),
        (lambda: lx.RectilinearWarp(fit=EYE), TypeError, "or a lixel.LightMatrix, got"),
        (lambda: lx.RectilinearWarp(fit="eye"), ValueError, "or a lixel.LightMatrix, got 'eye'"),
        (
            lambda: lx.RectilinearWarp(fit=lx.LightMatrix(EYE), snap=True),
            ValueError,
            "snap must come with one of the fits",
        ),
        (
            lambda: lx.GivenWarp([[0, 1]]),
            ValueError,
            "functions must be an array (2, n, cells + 1)",
        ),
        (lambda: lx.GivenWarp(np.ones((3, 1, 2))), ValueError, "got shape [3, 1, 2]"),
        (lambda: lx.GivenWarp([[[0, 1.0]], [[0, 0.9]]]), ValueError, "got values from 0 to 0.9 in"),
        (
            lambda: lx.GivenWarp([[[0, 0.6, 0.5, 1]], [[0, 0.3, 0.5, 1]]]),
            ValueError,
            "got 0.5 after 0.6 in function 0 along x of layer 0",
        ),
        (
            lambda: lx.GivenWarp([[[0, 0.5, 1]], [[0, np.nan, 1]]]),
            ValueError,
            "got NaN after 0 in function 0 along y of layer 0",
        ),
        (
            lambda: lx.GivenWarp(np.broadcast_to([0.0, 1.0], (2, 2, 2))),
            ValueError,
            "got 2 functions of 2 values",
        ),
        (
            lambda: lx.GivenWarp(
                np.broadcast_to(np.linspace(0, 1, 500), (2, 400, 500)), resolution=32768
            ),
            ValueError,
            "functions must be at most 255 along each axis with a map of 32768 texels, got 400",
        ),
        (lambda: lx.GivenWarp(np.ones(3, "U1")), TypeError, "functions must be an array"),
    ],
)
def test_arrays_of_other_kinds_are_named(make, error, words):
    with pytest.raises(error, match=re.escape(words)):
        make()


def test_functions_of_another_number_of_layers_are_named(engine):
    functions = np.broadcast_to(np.linspace(0, 1, 9), (7, 2, 1, 9))
    with pytest.raises(ValueError, match="or of as many as the fit makes here, 5, got 7"):
        lx.render_shadows(SCENE, CAMERA, POINT, lx.GivenWarp(functions, fit="cube"))


def test_paraboloids_have_no_matrix():
    frame = lx.render(SCENE, CAMERA, POINT, "dual_paraboloid", **SMALL)
    with pytest.raises(ValueError, match="frame must have light matrices, got paraboloid"):
        lx.LightMatrix.of(frame)


def test_arrays_are_kept_in_one_form():
    method = lx.LightMatrix(np.eye(4, dtype=np.float32), regions=[[(1, 0, 0, 2)]])
    assert method.matrix.shape == (1, 4, 4)
    assert method.matrix.dtype == np.float64
    assert not method.matrix.flags.writeable
    assert method.regions == (((1.0, 0.0, 0.0, 2.0),),)
    again = pickle.loads(pickle.dumps(method))
    same(again.matrix, method.matrix)
    assert dataclasses.replace(method, resolution=64).map_resolution == 64
    warp = lx.GivenWarp([[[0, 0.25, 1]], [[0, 0.5, 1]]])
    assert warp.functions.dtype == np.float32
    assert not warp.functions.flags.writeable
    # Both entries refuse in the same words.
    for name, parameter in (("light_matrix", "matrix"), ("given_warp", "functions")):
        core = (SCENE._core, CAMERA._core_for(SCENE), [SUN._core])
        with pytest.raises(ValueError, match=f"{parameter} must be an? .*, got shape"):
            _core.render(*core, (name, {parameter: np.ones((3, 3))}), [])
    assert not {"light_matrix", "given_warp"} & set(lx.METHODS)


@pytest.mark.parametrize("method", [lx.LightMatrix, lx.GivenWarp])
def test_fields_are_the_declared_parameters_and_are_described(method):
    declared = {known["name"]: known for known in _core.parameters(method.name)}
    assert {known.name for known in dataclasses.fields(method)} == set(declared)
    words = "".join(base.__doc__ or "" for base in method.__mro__ if base is not object)
    for known in dataclasses.fields(method):
        assert f"\n    {known.name} : " in words
        if known.default is not dataclasses.MISSING:
            assert known.default == declared[known.name]["default"]
