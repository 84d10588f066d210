"""The table of misclassified pixels: its command, its random lights, and the table that is kept."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from views import write_folder

import lixel as lx
from lixel import cli
from lixel.lab import accuracy, aligned
from lixel.lab.random_views import is_in_view, random_camera, random_lights
from lixel.lab.result_tables import PROVENANCE, read
from lixel.lab.views import Views

RESULTS = Path(__file__).parents[1] / "docs" / "results"


@pytest.fixture
def folder(tmp_path, view):
    """A scene of two boxes as a file, and one camera and light in a scenes.json."""
    write_folder(tmp_path, view.scene, [{"kind": "directional", "direction": [1, -1.5, -0.5]}])
    return tmp_path


def test_accuracy_command_writes_every_view_and_resumes(folder, capfd):
    path = folder / "table.csv"
    arguments = [
        "lab",
        "accuracy",
        str(folder),
        "--size",
        "96x64",
        "--random",
        "2",
        "-o",
        str(path),
    ]
    assert cli.main(arguments) == 0
    table = read(path)
    assert set(table["method"]) == {*accuracy.METHODS, accuracy.EMBREE}
    assert table["light"].unique().tolist() == ["0", "random 0", "random 1"]
    assert table["light_kind"].unique().tolist() == ["DirectionalLight", "PointLight"]
    assert not table.loc[table["method"] != accuracy.EMBREE, "misclassified"].any()
    assert (table["misclassified"] == table["false_lit"] + table["false_shadow"]).all()
    assert "misclassified" in capfd.readouterr().out
    # Another command's random lights and methods have the same names; its table is left alone.
    assert cli.main([*arguments, "--kind", "point"]) == 2
    error = capfd.readouterr().err
    assert re.search(r"table\.csv must be the table of .*--kind point", error)
    # Half of it is lost, and measured again to the same.
    whole = path.read_text()
    lines = whole.splitlines(keepends=True)
    path.write_text("".join(lines[:9]))
    assert cli.main(arguments) == 0
    assert path.read_text() == whole


def test_aligned_command_compares_lights_with_turned_ones_and_resumes(folder, monkeypatch, capsys):
    few = {"uniform": lx.Uniform(resolution=128), "cube": lx.Cube(), "exact": lx.Exact()}
    monkeypatch.setattr(aligned, "all_methods", lambda: few)
    for name, few_of in (("AZIMUTHS", (90,)), ("ELEVATIONS", (15.0,)), ("WALLS", 1), ("LAMPS", 1)):
        monkeypatch.setattr(aligned, name, few_of)
    path = folder / "aligned.csv"
    line = ["lab", "aligned", str(folder), "--size", "96x64", "-o", str(path)]
    assert cli.main(line) == 0
    table = read(path)
    suns = table[table["kind"] == "sun"]
    assert len(suns["light"].unique()) == 2
    assert set(suns["method"]) == {"uniform", "exact"}
    assert set(table[table["kind"] == "point"]["method"]) == {"uniform", "cube", "exact"}
    assert not table.loc[table["method"] == "exact", ["aligned", "turned"]].any(axis=None)
    sums = aligned.summary(table).set_index(["scene", "kind", "method"])
    assert sums.loc[("all", "sun", "uniform"), "turned"] == suns["turned"].sum() > 0
    assert "ratio" in capsys.readouterr().out
    whole = path.read_text()
    path.write_text("".join(whole.splitlines(keepends=True)[:7]))
    assert cli.main(line) == 0
    assert path.read_text() == whole


def test_aligned_lights_lie_along_walls_and_turned_ones_a_degree_off(view):
    pairs = list(aligned.pairs_of(view.scene, view.camera))
    suns = [pair for pair in pairs if pair[0].startswith("sun")]
    assert len(suns) == 33
    for name, lights, turned in suns:
        for sun in lights:
            between = np.degrees(np.arccos(np.clip(sun.direction @ turned.direction, -1, 1)))
            assert between <= 1.0 + 1e-6, name
        # Along an axis, once with all that is rounded and once without.
        is_exact = [np.isin(sun.direction, 0.0).any() for sun in lights]
        assert len(lights) == 1 or is_exact == [False, True] or "sun at 0 degrees" in name
    truth = lx.reference(view.scene, view.camera, suns[0][2])
    normals = truth.normal[truth.covered].astype(float)
    heights = (truth.position[truth.covered] * normals).sum(axis=1)
    for _, [lamp], turned in pairs[33:]:
        # In the plane of many pixels; the turned one is before them.
        off = np.abs(normals @ lamp.position - heights)
        assert (off < 1e-6).sum() > 20
        moved = turned.position - lamp.position
        assert np.linalg.norm(moved) > 0.0


def test_methods_kinds_and_scenes_can_be_named(folder, capfd):
    path = folder / "table.csv"
    method = "cube+notw:lookup=depth,resolution=128"
    arguments = [
        "lab",
        "accuracy",
        str(folder),
        "--size",
        "96x64",
        "--random",
        "2",
        "--kind",
        "point",
    ]
    arguments += [
        "--method",
        method,
        "--method",
        "spot",
        "--scene",
        "boxes",
        "--camera",
        "0",
        "-o",
        str(path),
    ]
    assert cli.main(arguments) == 0
    table = read(path)
    # The listed light is directional, and no point light is a spot's.
    assert table["light_kind"].unique().tolist() == ["PointLight"]
    assert table["method"].unique().tolist() == [method]
    assert len(table) == 2
    assert 0 < table["misclassified"].sum() < 0.05 * table["covered"].sum()
    assert cli.main([*arguments[:-1], str(folder / "none.csv"), "--scene", "other"]) == 0
    assert cli.main([*arguments, "--method", "cube:looks=depth"]) == 2
    assert "parameter of Cube must be one of" in capfd.readouterr().err


@pytest.mark.of_checkout("it compares with another renderer")
def test_embree_stops_at_the_light(view):
    """A lid above the light takes nothing from the floor."""
    scene, camera, _ = view
    low, high = scene.bounds
    lid = np.array([[low[0], 9, low[2]], [high[0], 9, low[2]], [high[0], 9, high[2]]])
    faces = np.concatenate([scene.faces, [[len(scene.vertices) + i for i in range(3)]]])
    covered = lx.Scene(np.concatenate([scene.vertices, lid]), faces)
    point_light = lx.PointLight((1.3, 6.0, 2.0))
    found = accuracy.Embree(covered).shadows(lx.render(covered, camera, point_light, "exact"))
    result = lx.compare(found, lx.reference(covered, camera, point_light))
    assert result.misclassified_count == 0
    assert np.nansum(found) > 1000


def test_random_lights_are_the_same_again_and_of_every_kind(view):
    scene, camera, _ = view
    first = random_lights(np.random.default_rng(3), scene, camera, 12)
    assert repr(first) == repr(random_lights(np.random.default_rng(3), scene, camera, 12))
    kinds = [lx.DirectionalLight, lx.PointLight, lx.SpotLight]
    assert [type(light) for light in first] == kinds * 4
    assert all(light.direction[1] < 0 for light in first[::3])

    placed = [(number, light) for number, light in enumerate(first) if number % 3]
    assert [is_in_view(camera, point_light.position) for _, point_light in placed] == [
        number % 2 == 0 for number, _ in placed
    ]


def test_lights_without_shadow_edges_are_drawn_again(folder, view):
    listed = Views.read(folder / "scenes.json", "boxes.obj")

    def drawn(shadow_edges: bool) -> list[lx.Light]:
        kinds = [lx.DirectionalLight]
        found = accuracy.views_of(
            "boxes.obj", listed, view.scene, (96, 64), 40, kinds, shadow_edges
        )
        return [light for _, _, name, light in found if name.startswith("random")]

    camera = listed.cameras["0"]
    some, all_of_them = drawn(False), drawn(True)
    has_edges = [accuracy.casts_shadow_edges(view.scene, camera, light) for light in some]
    assert 0 < sum(has_edges) < 40
    for light, has_edge, other in zip(some, has_edges, all_of_them, strict=True):
        assert accuracy.casts_shadow_edges(view.scene, camera, other)
        # Those that are drawn again are drawn after all others.
        assert not has_edge or repr(light) == repr(other)


def test_what_is_in_view_is_seen(view):
    camera = view.camera
    seen = lx.render(*view, "exact").position.reshape(-1, 3)
    seen = seen[~np.isnan(seen).any(axis=1)]
    assert all(is_in_view(camera, point) for point in seen[::97])
    assert not any(is_in_view(camera, 2 * camera.eye - point) for point in seen[::97])
    beside = camera.resized(camera.width // 2, camera.height)
    assert 0.1 < np.mean([is_in_view(beside, point) for point in seen[::97]]) < 1


def test_a_view_of_the_whole_scene_leaves_places_behind_the_eye(view):
    scene = view.scene
    camera = lx.Camera.look_at((0, 300, 0.1), (0, 0, 0), yfov=1.0, width=64, height=64)
    placed = random_lights(np.random.default_rng(0), scene, camera, 4, [lx.PointLight])
    assert [is_in_view(camera, point_light.position) for point_light in placed] == [
        True,
        False,
        True,
        False,
    ]


def test_random_cameras_look_at_the_scene(view):
    for seed in range(20):
        camera = random_camera(np.random.default_rng(seed), view.scene, 64, 48)
        low, high = view.scene.bounds
        centre, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
        towards = -camera.pose[:3, 2] @ (centre - camera.eye)
        assert towards > -radius
        assert (camera.width, camera.height) == (64, 48)


KEPT = sorted(path for path in RESULTS.rglob("*.*") if path.suffix in (".csv", ".parquet"))


@pytest.mark.parametrize("path", KEPT, ids=lambda path: str(path.relative_to(RESULTS)))
def test_kept_tables_name_device_date_and_command(path):
    table = read(path)
    assert list(table.attrs) == list(PROVENANCE)
    assert not set(PROVENANCE) & set(table.columns)
    assert table.attrs["command"].startswith(("lixel ", "python tests/tools/"))


def test_kept_tables_are_small():
    assert sum(path.stat().st_size for path in RESULTS.rglob("*.*")) < 1_000_000


@pytest.mark.parametrize("name", ["480x270", "exact-1080p"])
def test_kept_accuracy_tables_have_no_misclassified_pixel(name):
    table = read(RESULTS / "accuracy" / f"{name}.parquet")
    wrong = table.groupby("method")["misclassified"].sum()
    assert wrong["exact"] == wrong["ray_traced"] == 0
    assert table.groupby("method")["covered"].nunique().nunique() == 1
