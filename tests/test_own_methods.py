"""Functions in Python as shadow methods: by name wherever a method has a name."""

from __future__ import annotations

import concurrent.futures
import gc
import multiprocessing
import pickle
import re
import traceback
import weakref
from typing import Any

import numpy as np
import pytest

import lixel as lx
from lixel import sequence
from lixel.lab.cases import canonical
from lixel.methods import OWN_METHODS

SCENE = lx.scenes.objects_on_floor(count=9, subdivisions=1)
CAMERA = lx.Camera.look_at((-3.1, 2.3, 4.2), (0.2, 0.3, 0.1), yfov=0.8, width=160, height=90)
SUN = lx.DirectionalLight((0.4, -1.0, 0.3))
VIEW = (SCENE, CAMERA, SUN)


@lx.shadow_method
def own_lispsm(receivers, light, scene):
    """The matrix of the built-in method."""
    frame = lx.render(scene, receivers.camera, light, "lispsm", resolution=128)
    return lx.LightMatrix.of(frame)


@lx.shadow_method
def own_notw(receivers, light, scene, *, resolution=128, function_count=4):
    """The warp of the built-in method."""
    warp = lx.NonOrthogonalWarp(resolution=resolution, function_count=function_count)
    return lx.GivenWarp(lx.warp_map(scene, receivers.camera, light, warp), resolution=resolution)


@lx.shadow_method
def own_distance(receivers, light, scene, *, power=1.0):
    """Importance by distance."""
    return np.where(receivers.covered, receivers.depth, 1.0) ** -power


@lx.shadow_method
def own_fault(receivers, light, scene, *, kind=KeyError):
    raise kind("what went wrong")


@lx.shadow_method(name="own_answer", lights=(lx.DirectionalLight,))
def answers(receivers, light, scene, *, answer=None):
    return answer


def test_a_function_has_the_pictures_of_the_built_in_methods(engine):
    for own, built_in in (
        (own_lispsm(resolution=128), lx.LightSpacePerspective(resolution=128)),
        (own_notw(), lx.NonOrthogonalWarp(resolution=128, function_count=4)),
        (
            own_notw(lookup="depth"),
            lx.NonOrthogonalWarp(resolution=128, function_count=4, lookup="depth"),
        ),
    ):
        got, want = (lx.render(*VIEW, method) for method in (own, built_in))
        np.testing.assert_array_equal(got.visibility, want.visibility)
        assert got.method == own
        assert got.timings["python"] > 0
        assert "python" not in want.timings


def test_an_array_is_what_each_pixel_is_worth(engine):
    weights = 1.0 / np.where(
        np.isnan(lx.render(*VIEW, "exact").depth), 1.0, lx.render(*VIEW, "exact").depth
    )
    built_in = lx.RectilinearWarp(importance="desired_view", pixel_weights=weights, resolution=128)
    got, want = (
        lx.render_shadows(*VIEW, method) for method in (own_distance(resolution=128), built_in)
    )
    np.testing.assert_array_equal(got, want)
    flat = lx.render_shadows(*VIEW, "own_distance", power=0.0, resolution=128)
    assert (flat != got).any()


def test_several_lights_have_their_turns(engine):
    lights = [SUN, lx.DirectionalLight((-0.4, -1.0, 0.3))]
    both = lx.render_shadows(SCENE, CAMERA, lights, "own_lispsm", resolution=128)
    for light, image in zip(lights, both, strict=True):
        np.testing.assert_array_equal(
            image, lx.render_shadows(SCENE, CAMERA, light, "lispsm", resolution=128)
        )


def test_receivers_are_what_a_frame_has():
    seen: list[Any] = []

    def look(receivers, light, scene):
        seen.append(receivers)
        return np.ones(receivers.triangle_id.shape)

    method = lx.shadow_method(name="own_look")(look)
    frame = lx.render(*VIEW, method())
    [receivers] = seen
    for name in ("triangle_id", "position", "normal", "depth", "facing", "footprint", "covered"):
        np.testing.assert_array_equal(getattr(receivers, name), getattr(frame, name))
    for step in (1, 3, 8):
        some = receivers.every(step)
        first = step // 2
        for name in ("position", "depth", "normal", "footprint"):
            whole = getattr(receivers, name)[first::step, first::step]
            scale = step**2 if name == "footprint" else 1
            np.testing.assert_allclose(getattr(some, name), scale * whole, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("orthographic", [False, True])
def test_a_footprint_is_the_area_between_the_rays_of_a_pixels_corners(orthographic):
    floor = lx.Scene([(-50, 0, -50), (50, 0, -50), (0, 0, 90)], [(0, 1, 2)])
    sized = {"ymag": 2.0} if orthographic else {"yfov": 0.6}
    camera = lx.Camera.look_at((1, 3, 2), (0.3, 0, -2), width=64, height=48, **sized)
    fine = camera._replaced(
        focal=tuple(1000 * f for f in camera.focal),
        centre=tuple(1000 * (c - p) for c, p in zip(camera.centre, (20.5, 30.5), strict=True)),
        width=2,
        height=2,
    )
    frame = lx.render(floor, camera, SUN, "exact")
    tiny = lx.render(floor, fine._replaced(centre=tuple(c + 1 for c in fine.centre)), SUN, "exact")
    corners = tiny.position.reshape(4, 3)
    area = np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) * 1e6
    assert abs(frame.footprint[30, 20] / area - 1) < 1e-3


@pytest.mark.parametrize("kind", [KeyError, ValueError, ZeroDivisionError])
def test_what_a_function_raises_reaches_the_caller(kind):
    with pytest.raises(kind, match="what went wrong") as raised:
        lx.render_shadows(*VIEW, "own_fault", kind=kind)
    assert "own_fault" in [frame.name for frame in traceback.extract_tb(raised.tb)]
    # Nothing is left behind that a later frame trips over.
    assert lx.render_shadows(*VIEW, "own_distance").shape == (90, 160)


@pytest.mark.parametrize(
    ("answer", "error", "words"),
    [
        (None, TypeError, "own_answer must return a lixel.LightMatrix, a lixel.GivenWarp, another"),
        (
            np.ones((3, 4)),
            TypeError,
            "the shape of the image, (90, 160), got ndarray of shape (3, 4)",
        ),
        (np.full((90, 160), -1.0), ValueError, "pixel_weights must be an array (h, w) of finite"),
        (lx.Exact(), TypeError, "got Exact"),
        (own_lispsm(), TypeError, "own_answer must not return another method of one's own"),
        (
            lx.Uniform(resolution=64),
            ValueError,
            "resolution must be a parameter of the method 'own_answer' itself, as in def",
        ),
    ],
)
def test_wrong_answers_are_named(answer, error, words):
    with pytest.raises(error, match=re.escape(words)):
        lx.render_shadows(*VIEW, "own_answer", answer=answer)


def test_parameters_of_the_map_are_the_methods_own():
    assert lx.render(*VIEW, answers(answer=lx.Uniform(), resolution=64)).shadow_map.shape[1] == 64
    with pytest.raises(ValueError, match="resolution must be a whole number of texels from 1"):
        answers(resolution=0)
    with pytest.raises(TypeError, match="parameter of own_distance must be one of resolution"):
        lx.method_from("own_distance", powr=2.0)
    assert own_notw().resolution == 128
    assert lx.method_from("own_notw", resolution=64).map_resolution == 64


def test_only_functions_with_names_of_their_own_are_methods():
    def right(receivers, light, scene):
        return None

    for name in ("uniform", "rtw", "auto", "min_sm", "light_matrix", "own_lispsm"):
        with pytest.raises(ValueError, match=f"name must not be another method's, got '{name}'"):
            lx.shadow_method(name=name)(right)
    with pytest.raises(ValueError, match="name must be an identifier, got 'a b'"):
        lx.shadow_method(name="a b")(right)

    def two(receivers, light):
        return None

    def without_default(receivers, light, scene, *, power):
        return None

    def by_place(receivers, light, scene, power=1.0):
        return None

    for wrong in (two, without_default, by_place):
        with pytest.raises(TypeError, match="must be a function \\(receivers, light, scene, \\*, "):
            lx.shadow_method(wrong)
        assert wrong.__name__ not in OWN_METHODS
    with pytest.raises(TypeError, match="a shadow method must be a function, got 3"):
        lx.shadow_method(3)
    with pytest.raises(ValueError, match=r"method must be one of .*'own_lispsm'.* did you mean"):
        lx.method_from("own_lispm")
    # A cell that runs again.
    assert lx.shadow_method(own_distance.function) is OWN_METHODS["own_distance"]
    globals()["own_distance"] = OWN_METHODS["own_distance"]


def test_a_study_takes_them_here_and_in_other_processes():
    asked: dict[str, Any] = {
        "methods": ["uniform", "own_distance", own_lispsm(), own_fault(kind=ValueError)],
        "parameters": {"resolution": [64, 128], "power": [1.0, 0.5]},
        "size": (64, 36),
        "device": "cpu",
        "repeats": 1,
        "progress": False,
    }
    table = lx.study("plane_and_box", lights=SUN, **asked)
    counts = table.groupby("method").size().to_dict()
    assert counts == {"uniform": 2, "own_distance": 4, "own_lispsm": 2, "own_fault": 2}
    assert (table[table.method == "own_distance"]["pass_ms.python"] > 0).all()
    failed = table[table.error.notna()]
    assert set(failed.method) == {"own_fault"}
    assert re.match(
        r"ValueError: what went wrong \(.*test_own.*, line \d+, in own_fault\)",
        failed.error.iloc[0],
    )
    asked |= {"methods": [own_distance()], "parameters": {"power": [1.0, 0.5]}}
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as executor:
        elsewhere = lx.study("plane_and_box", lights=SUN, executor=executor, **asked)
    here = lx.study("plane_and_box", lights=SUN, **asked)
    assert elsewhere.misclassified_count.tolist() == here.misclassified_count.tolist()
    assert elsewhere.error.isna().all()


def test_objects_are_equal_by_their_parameters_and_can_be_sent():
    assert own_distance(power=2.0) == own_distance(power=2.0) != own_distance()
    assert pickle.loads(pickle.dumps(own_distance(power=2.0))) == own_distance(power=2.0)
    matrices = [np.diag([1.0, 1.0, 1.0, scale]) for scale in (1, 2)]
    keys = {
        repr(canonical(method))
        for method in (
            own_distance(), own_distance(power=2.0), own_lispsm(),
            *(lx.LightMatrix(matrix) for matrix in matrices),
            *(lx.RectilinearWarp(fit=lx.LightMatrix(matrix)) for matrix in matrices),
        )
    }  # fmt: skip
    assert len(keys) == 7


def test_a_sequence_hands_each_frame_to_the_next(engine):
    heard: list[Any] = []

    def follow(receivers, light, scene, *, previous=None):
        heard.append(previous)
        return lx.DesiredView()

    method = lx.shadow_method(name="own_follow")(follow)
    cameras = [
        CAMERA._replaced(width=64, height=36),
        CAMERA.resized(64, 36),
        CAMERA.resized(64, 36),
    ]
    frames = list(lx.render_sequence(SCENE, cameras, SUN, method(), resolution=64))
    assert heard[0] is None
    assert [frame.camera for frame in heard[1:]] == cameras[:2]
    # No chain of all frames before.
    assert all(frame.method.previous is None for frame in heard[1:])
    assert [frame.camera for frame in frames] == cameras
    warp = lx.RectilinearWarp(resolution=64)
    first, second = list(
        lx.render_sequence(SCENE, CAMERA, [SUN, lx.DirectionalLight((0, -1, 0))], warp)
    )
    alone = lx.render(
        SCENE, CAMERA, second.light, lx.RectilinearWarp(resolution=64, previous=first)
    )
    np.testing.assert_array_equal(second.warp_map, alone.warp_map)
    assert (second.warp_map != lx.render(SCENE, CAMERA, second.light, warp).warp_map).any()


def test_a_function_is_told_what_the_last_frame_found_at_the_same_place():
    told: list[Any] = []

    def remember(receivers, light, scene, *, previous=None):
        told.append(None if previous is None else receivers.visibility_in(previous))
        return lx.DesiredView()

    method = lx.shadow_method(name="own_remember")(remember)
    still = CAMERA.resized(64, 36)
    across, down = still.centre
    # The image is a window that moves by three pixels to the right over a wide picture.
    aside = still._replaced(centre=(across - 3, down))
    first, _ = lx.render_sequence(SCENE, [still, aside], SUN, method(), resolution=256)
    assert told[0] is None
    expected = np.full((36, 64), np.nan, np.float32)
    expected[:, :-3] = first.visibility[:, 3:]
    np.testing.assert_array_equal(told[1], expected)
    assert np.unique(expected[:, :-3]).size > 1


def test_a_sequence_moves_vertices_and_names_what_is_wrong():
    scene = lx.scenes.plane_and_box()
    camera = scene.cameras["default"].resized(48, 32)
    path = (scene.vertices + np.array([0, 0.1 * i, 0]) for i in range(3))
    heights = [
        np.nanmin(frame.depth)
        for frame in lx.render_sequence(scene, camera, SUN, "exact", vertices=path)
    ]
    assert len(set(heights)) == 3
    with pytest.raises(ValueError, match="must be one for each frame, got single ones"):
        lx.render_sequence(scene, camera, SUN)
    with pytest.raises(
        TypeError, match=r"cameras must be a lixel\.Camera or an iterable of them, got int"
    ):
        lx.render_sequence(scene, 3, [SUN])
    with pytest.raises(TypeError, match="vertices must be an iterable of them, got int"):
        lx.render_sequence(scene, camera, SUN, vertices=3)
    with pytest.raises(ValueError, match="cameras, lights must be as many, got fewer lights"):
        list(lx.render_sequence(scene, [camera] * 3, [SUN] * 2, "exact"))
    with pytest.raises(TypeError, match="parameter of Exact must be one of"):
        lx.render_sequence(scene, [camera], SUN, "exact", colour=1)


def test_a_sequence_counts_what_flickers():
    still = list(lx.render_sequence(SCENE, CAMERA, [SUN] * 2, "exact", flicker=True))
    assert "changed_pixels" not in still[0].stats
    assert still[1].stats["changed_pixels"] == 0
    assert still[1].stats["matched_pixels"] == np.count_nonzero(still[1].covered)
    path = [CAMERA.posed(CAMERA.pose + 0.004 * i * np.eye(4, k=3)) for i in range(3)]
    counts = {}
    for snap in (False, True):
        method = lx.DesiredView(resolution=64, lookup="depth", snap=snap)
        frames = list(lx.render_sequence(SCENE, path, SUN, method, flicker=True))[1:]
        assert all(0 < f.stats["matched_pixels"] <= np.count_nonzero(f.covered) for f in frames)
        counts[snap] = sum(f.stats["changed_pixels"] for f in frames)
    # A map on texels that hold still.
    assert counts[True] < counts[False]


@pytest.mark.parametrize("method", ["rtw", "scene_optimized", "own_behind"])
def test_a_long_sequence_keeps_no_frames(method):
    if method == "own_behind":

        @lx.shadow_method
        def own_behind(receivers, light, scene, *, previous=None):
            return lx.DesiredView()

    path = [CAMERA.resized(32, 18)] * 6
    alive = []
    seen: list[weakref.ref[Any]] = []
    for frame in lx.render_sequence(SCENE, path, SUN, method, resolution=32, flicker=True):
        seen.append(weakref.ref(frame))
        gc.collect()
        alive.append(sum(ref() is not None for ref in seen))
    assert max(alive) <= 3


def test_a_long_sequence_shows_how_far_it_is(monkeypatch, capfd):
    lights = [SUN] * 3
    for progress in (False, True):
        list(lx.render_sequence(SCENE, CAMERA, lights, "exact", progress=progress))
        assert capfd.readouterr().err == ""
    monkeypatch.setattr(sequence, "SECONDS_BEFORE_BAR", 0.0)
    list(lx.render_sequence(SCENE, CAMERA, lights, "exact", progress=False))
    assert capfd.readouterr().err == ""
    list(lx.render_sequence(SCENE, CAMERA, lights, "exact"))
    assert re.search(r"frames: .* \d/3 ", capfd.readouterr().err)
    # Nobody knows how many a generator has.
    list(lx.render_sequence(SCENE, CAMERA, (SUN for _ in range(3)), "exact"))
    assert re.search(r"frames: \dit", capfd.readouterr().err)


def test_a_changed_function_is_another_case():
    keys = set()
    for answer in ("1.0", "2.0"):
        # As a person types it: its text is in no file.
        typed: dict[str, Any] = {"__name__": "typed"}
        exec(f"def own_typed(receivers, light, scene):\n    return {answer}", typed)
        keys.add(repr(canonical(lx.shadow_method(typed["own_typed"])())))
    assert len(keys) == 2
