"""Maps that hold still: texel snapping, importance blended with that of the frame before, and how
much flickers."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pandas as pd
import pytest

import lixel as lx
from lixel import cli
from lixel.lab import flicker

SNAPPING = [
    lx.DesiredView(resolution=128, snap=True),
    lx.Focused(resolution=128, snap=True),
    lx.Cascades(resolution=128, snap=True),
    lx.RectilinearWarp(resolution=128, snap=True),
    lx.NonOrthogonalWarp(resolution=128, snap=True),
]
AROUND_A_POINT_LIGHT = [
    lx.DesiredView(resolution=128, snap=True),
    lx.Focused(resolution=128, snap=True),
    lx.Cube(resolution=128, snap=True),
    lx.DualParaboloid(resolution=128, snap=True, cut="receivers"),
]
WARPS = [lx.RectilinearWarp, lx.NonOrthogonalWarp]
BY_NAME = {"ids": lambda method: method.name}


def walk(view, frames=12):
    """The view from places along a line."""
    for i in range(frames):
        pose = view.camera.pose.copy()
        pose[:3, 3] += (0.031 * i, 0.007 * i, -0.017 * i)
        yield view._replace(camera=view.camera.posed(pose))


def point_lit(view):
    return view._replace(light=lx.PointLight((0.3, 4.0, 0.6)))


# --- Texel snapping ---


@pytest.mark.parametrize("method", SNAPPING, **BY_NAME)
def test_snapped_texels_hold_still_while_the_camera_moves(view, method):
    """Of two maps over texels of one size, one is the other moved by whole texels."""
    sizes = set()
    pairs = 0
    frames = [lx.render(*moved, method) for moved in walk(view)]
    for old, new in itertools.pairwise(frames):
        for before, after in zip(old.light_matrix, new.light_matrix, strict=False):
            axes = np.abs(before[:2, :3] - after[:2, :3]).max()
            sizes.add(np.round(np.linalg.norm(after[:2, :3]), 6))
            if axes < 1e-9:
                pairs += 1
                shift = after[:2, 3] - before[:2, 3]
                assert np.abs(shift - np.round(shift)).max() < 1e-6
    assert pairs > 0.6 * len(frames) * len(frames[0].light_matrix)
    # Without snapping every frame has a size of its own.
    assert len(sizes) <= 4 * len(frames[0].light_matrix)


@pytest.mark.parametrize("method", AROUND_A_POINT_LIGHT, **BY_NAME)
def test_snapped_maps_around_a_point_light_hold_still(view, method):
    """The image is a window over a wider picture: what two frames both see has one answer."""
    here = point_lit(view)
    pictures = []
    for i in range(6):
        camera = lx.Camera(
            here.camera.pose,
            focal=here.camera.focal,
            centre=(here.camera.width / 2 - i, here.camera.height / 2),
            width=here.camera.width,
            height=here.camera.height,
        )
        pictures.append(lx.render_shadows(here.scene, camera, here.light, method))
    moved = sum(
        np.count_nonzero(
            ~np.isnan(old[:, 1:]) & ~np.isnan(new[:, :-1]) & (old[:, 1:] != new[:, :-1])
        )
        for old, new in itertools.pairwise(pictures)
    )
    assert moved <= 2, moved


@pytest.mark.parametrize("method", SNAPPING, **BY_NAME)
def test_snapped_maps_hold_all_receivers(view, method):
    """No more misclassified pixels than texels of 1.19 times the width explain."""
    truth = lx.reference(*view)
    plain = dataclasses.replace(method, snap=False)
    wrong = [
        lx.compare(lx.render_shadows(*view, tried), truth).misclassified_count
        for tried in (method, plain)
    ]
    assert wrong[0] <= 2.0 * wrong[1] + 5, wrong


def test_a_map_that_turns_cannot_snap():
    with pytest.raises(ValueError, match=r"snap must come with .* got 'min_sm'"):
        lx.RectilinearWarp(fit="min_sm", snap=True)
    with pytest.raises(TypeError, match="snap must be True or False, got 1"):
        lx.DesiredView(snap=1)


# --- Blended importance ---


@pytest.mark.parametrize("warp", WARPS, **BY_NAME)
def test_a_still_frame_is_its_own_blend(view, warp):
    first = lx.render(*view, warp(resolution=256, importance_resolution=64))
    again = lx.render(*view, dataclasses.replace(first.method, previous=first, blend=0.6))
    assert np.abs(again.importance_map - first.importance_map).max() <= 0.01
    assert np.abs(again.warp_map[:, 0] - first.warp_map[:, 0]).max() < 1e-3
    # Of old cells the middle alone is put through the functions along x: one that the warp widens
    # lends all of its count to one of the functions that it reaches.
    assert np.abs(again.warp_map[:, 1] - first.warp_map[:, 1]).max() < 0.1


@pytest.mark.parametrize("warp", WARPS, **BY_NAME)
def test_importance_is_blended_by_the_share(view, warp):
    """With the map held in place by snapping, cells are means of the two frames' cells."""
    method = warp(resolution=256, importance_resolution=64, snap=True)
    old, new = (lx.render(*moved, method) for moved in itertools.islice(walk(view), 2))
    blended = lx.render(
        new.scene, new.camera, new.light, dataclasses.replace(method, previous=old, blend=0.25)
    )
    assert np.allclose(old.light_matrix[:, :2, :3], new.light_matrix[:, :2, :3])
    shift = (new.light_matrix - old.light_matrix)[0, :2, 3] * 64 / 256
    there = np.indices((64, 64))[::-1].transpose(1, 2, 0) - shift
    column, row = (there[..., i] for i in (0, 1))
    x0, y0 = np.floor(column).astype(int), np.floor(row).astype(int)
    inside = (column >= -0.5) & (column < 63.5) & (row >= -0.5) & (row < 63.5)

    def at(y, x):
        return old.importance_map[0][np.clip(y, 0, 63), np.clip(x, 0, 63)]

    tx, ty = column - x0, row - y0
    moved = (1 - ty) * ((1 - tx) * at(y0, x0) + tx * at(y0, x0 + 1))
    moved += ty * ((1 - tx) * at(y0 + 1, x0) + tx * at(y0 + 1, x0 + 1))
    expected = 0.75 * new.importance_map[0] + 0.25 * np.where(inside, moved, 0.0)
    assert np.abs(blended.importance_map[0] - expected).max() <= 1e-3 * expected.max() + 0.01


def test_counts_are_kept_when_the_map_grows(view):
    """A map over twice the width takes a quarter of the cells for what the old one had."""
    near = lx.render(*view, lx.NonOrthogonalWarp(importance_resolution=64))
    pose = view.camera.pose.copy()
    pose[:3, 3] *= 2.0
    far = view._replace(camera=view.camera.posed(pose))
    method = lx.NonOrthogonalWarp(importance_resolution=64, previous=near, blend=1.0)
    blended = lx.render(*far, method)
    assert blended.light_matrix[0, 0, 0] != near.light_matrix[0, 0, 0]
    assert blended.importance_map.sum() == pytest.approx(near.importance_map.sum(), rel=0.1)


@pytest.mark.parametrize("warp", WARPS, **BY_NAME)
@pytest.mark.parametrize("fit", ["desired_view", "min_sm", "lispsm", "cube"])
def test_every_fit_with_a_matrix_takes_the_frame_before(view, warp, fit):
    lit = point_lit(view) if fit == "cube" else view
    method = warp(fit=fit, importance_resolution=64)
    frame = lx.render(*lit, method)
    for moved in itertools.islice(walk(lit), 1, 3):
        frame = lx.render(*moved, dataclasses.replace(method, previous=frame))
        truth = lx.reference(*moved)
        plain = lx.compare(lx.render_shadows(*moved, method), truth).misclassified_count
        assert lx.compare(frame, truth).misclassified_count <= 2 * plain + 10


def test_a_frame_without_layers_leaves_nothing(view):
    below = view._replace(light=lx.DirectionalLight((0.1, 1.0, 0.2)))
    dark = lx.render(
        lx.Scene(view.scene.vertices[:3], [[0, 1, 2]]), view.camera, below.light, "rtw"
    )
    if len(dark.importance_map) == 0:
        assert lx.RectilinearWarp(previous=dark).previous is None


def test_a_previous_that_cannot_be_one_is_refused(view):
    frame = lx.render(*view, "rtw")
    with pytest.raises(TypeError, match=r"previous must be a frame .*, got \d+"):
        lx.RectilinearWarp(previous=3)
    with pytest.raises(
        ValueError, match="previous must be a frame of the method 'notw', got 'rtw'"
    ):
        lx.NonOrthogonalWarp(previous=frame)
    with pytest.raises(ValueError, match=r"blend must be a number from 0 to 1, got 1\.5"):
        lx.RectilinearWarp(blend=1.5)
    round_one = lx.RectilinearWarp(fit="dual_paraboloid", previous=frame)
    with pytest.raises(ValueError, match="not with paraboloids"):
        lx.render_shadows(*point_lit(view), round_one)


# --- Flicker ---


def test_snapped_maps_do_not_flicker_and_others_do():
    plain, snapped = lx.DesiredView(), lx.DesiredView(snap=True)
    tried = [(plain, False), (snapped, False), (lx.Uniform(), False), (lx.Exact(), False)]
    table = pd.DataFrame(flicker.measure(["pan"], tried, frames=6))
    restless = dict(zip(range(4), table["flicker"], strict=True))
    assert restless[0] > 3.0
    assert restless[1] < 0.2 * restless[0]
    assert restless[2] == restless[3] == 0.0
    assert (table["compared"] > 5000).all()
    # A window over a picture that stands still.
    assert (table["truth"] == 0.0).all()


def test_exact_shadows_change_as_the_reference_does():
    for motion in ("walk", "light"):
        tried = [(lx.Exact(), False), (lx.Uniform(), False)]
        exact, uniform = flicker.measure([motion], tried, frames=4)
        assert exact["truth"] == uniform["truth"] > 1.0
        assert exact["flicker"] == 0.0
        assert uniform["flicker"] > 0.0


def test_flicker_refuses_unknown_motions_and_few_frames():
    with pytest.raises(ValueError, match=r"motion must be one of pan, walk, light, got 'run'"):
        flicker.measure(["run"])
    with pytest.raises(ValueError, match=r"frames must be at least 2 .* got 1"):
        flicker.measure(frames=1)


def test_flicker_command_prints_and_writes_the_table(capsys, tmp_path):
    path = tmp_path / "flicker.csv"
    line = ["lab", "flicker", "--frames", "3", "--method", "uniform", "--method", "exact"]
    assert cli.main([*line, "-o", str(path)]) == 0
    assert "flicker" in capsys.readouterr().out
    assert len(path.read_text(encoding="utf-8").splitlines()) == 4 + 7


def test_a_quick_answer_is_of_few_frames(monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(flicker, "measure", lambda methods, frames: asked.append(frames) or [])
    for options in ([], ["--quick"], ["--quick", "--frames", "5"]):
        assert cli.main(["lab", "flicker", *options]) == 0
    assert asked == [120, 24, 5]
