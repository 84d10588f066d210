"""Maps in pages: levels that match pixels, a bound on pages, pages that are kept, pictures."""

from __future__ import annotations

import matplotlib as mpl
import matplotlib.figure
import numpy as np
import pytest
from views import write_folder

import lixel as lx
from lixel import cli
from lixel.lab import pages
from lixel.lab.result_tables import read
from lixel.pictures import page_plots

mpl.use("Agg")

PLACE = (0.4, 3.4, -6.3)
LIGHTS = {
    "directional": lx.DirectionalLight((0.5, -1.0, 0.3)),
    "far away": lx.PointLight((-5e3, 1e4, -3e3)),
    "point": lx.PointLight(PLACE),
    "spot": lx.SpotLight(PLACE, (0.1, -1.0, 0.4), 1.0),
    "wide spot": lx.SpotLight(PLACE, (0.1, -1.0, 0.4), 1.5),
    "hemisphere": lx.HemisphereLight(PLACE, (0, -1, 0)),
}


@pytest.fixture(scope="module")
def colonnade():
    scene = lx.scenes.colonnade(columns=8, detail=16)
    return scene, scene.cameras["default"].resized(320, 180)


def check_who_looks(frame):
    """All that face the light. What float32 finds within rounding of a cone's rim looks, too,
    before float64 decides it."""
    beside = (frame.page_levels >= 0) != frame.facing
    assert not (beside & frame.facing).any()
    assert beside.sum() <= (2 if frame.adapter["type"] != "Cpu engine" else 0)


@pytest.mark.parametrize("kind", LIGHTS)
def test_a_pixel_looks_into_texels_as_wide_as_it_is(engine, colonnade, kind):
    """By the aliasing error, which shares nothing with the choice of a level."""
    frame = lx.render(*colonnade, LIGHTS[kind], "virtual")
    check_who_looks(frame)
    looks = (frame.page_levels >= 0) & frame.facing
    coarsest = frame.page_levels.max()
    between = looks & (frame.page_levels > 0) & (frame.page_levels < coarsest)
    assert between.sum() > 0.3 * looks.sum()
    # Across their beams, whatever the surface.
    to_light = LIGHTS[kind].vectors_from(frame.position[between])
    sight = colonnade[1].sights_of(frame.position[between])
    cosines = [
        np.abs(np.einsum("nc,nc->n", ray, frame.normal[between])) / np.linalg.norm(ray, axis=1)
        for ray in (to_light, sight)
    ]
    widths = frame.aliasing_error[between] * cosines[0] / cosines[1]
    assert widths.min() > 0.4999
    assert widths.max() < 1.0001
    truth = lx.reference(*colonnade, LIGHTS[kind])
    wrong = lx.compare(frame, truth).misclassified_count
    assert wrong <= 0.004 * truth.covered.sum()


@pytest.mark.parametrize("kind", LIGHTS)
def test_threads_and_pages_change_nothing_but_what_they_are_for(colonnade, kind):
    scene, camera = colonnade
    view = scene, camera.resized(160, 90), LIGHTS[kind]
    answers = [
        lx.render_shadows(*view, "virtual", device="cpu", threads=threads) for threads in (1, 2, 7)
    ]
    for other in answers[1:]:
        assert answers[0].tobytes() == other.tobytes()


def test_a_bias_moves_levels_and_pages_follow(engine, colonnade):
    light = LIGHTS["directional"]
    frames = {
        bias: lx.render(*colonnade, light, "virtual", level_bias=bias) for bias in (-1, 0, 0.5, 1)
    }
    looks = frames[0].page_levels >= 0
    levels = {bias: frame.page_levels[looks] for bias, frame in frames.items()}
    # 16384 / 2^7 is a page.
    coarsest = 7
    np.testing.assert_array_equal(levels[1], np.minimum(levels[0] + 1, coarsest))
    assert (levels[0.5] <= levels[1]).all()
    between = (levels[0] > 0) & (levels[0] < coarsest)
    assert between.sum() > 0.5 * looks.sum()
    np.testing.assert_array_equal(levels[-1][between], levels[0][between] - 1)
    assert set(np.unique(levels[0.5] - levels[0])) == {0, 1}
    counts = [len(frame.pages) for frame in frames.values()]
    assert counts == sorted(counts, reverse=True)


@pytest.mark.parametrize("most", [6, 12, 25])
@pytest.mark.parametrize("kind", ["directional", "point"])
def test_where_pages_are_few_levels_are_coarser(engine, colonnade, kind, most):
    method = lx.VirtualShadowMap(page_size=64, pages=most)
    frame = lx.render(*colonnade, LIGHTS[kind], method)
    assert 0 < len(frame.pages) <= most
    check_who_looks(frame)
    assert frame.stats["level_bias"] > 0
    assert frame.stats["level_bias"] % 0.25 == 0
    # A quarter of a level less would have needed more.
    less = frame.stats["level_bias"] - 0.25
    method = lx.VirtualShadowMap(page_size=64, level_bias=less)
    finer = lx.render(*colonnade, LIGHTS[kind], method)
    assert len(finer.pages) > most


def test_pages_are_told_with_their_texels(engine, colonnade):
    frame = lx.render(*colonnade, LIGHTS["point"], "virtual", page_size=64)
    found = frame.pages
    assert frame.shadow_map.shape == (len(found), 64, 64)
    assert {"pages": len(found), "kept_pages": 0}.items() <= frame.stats["shadow map"].items()
    assert len(np.unique(found[["face", "level", "column", "row"]])) == len(found)
    assert set(found["layer"]) == set(range(len(frame.light_matrix)))
    # A receiver's texel, by the matrix of its layer, lies in a page that is there.
    layers = {(page["face"], page["level"]): page["layer"] for page in found}
    known = {(page["layer"], page["column"], page["row"]) for page in found}
    points, levels = frame.position[frame.facing], frame.page_levels[frame.facing]
    from_light = points - PLACE
    axis = np.abs(from_light).argmax(axis=1)
    face = 2 * axis + (np.take_along_axis(from_light, axis[:, None], 1)[:, 0] < 0)
    # Faces that no receiver falls in are left out.
    face = np.unique(face, return_inverse=True)[1].ravel()
    for point, level, side in zip(points[::97], levels[::97], face[::97], strict=True):
        layer = layers[side, level]
        x, y, _, w = frame.light_matrix[layer] @ [*point, 1]
        assert (layer, x / w // 64, y / w // 64) in known


def test_a_scene_that_moved_keeps_no_page():
    scene = lx.scenes.colonnade(columns=8, detail=16)
    camera = lx.Camera.look_at(
        scene.cameras["default"].eye, (0, 1, 0), yfov=1.0, width=160, height=90
    )
    seen = camera, LIGHTS["directional"], "virtual"
    lx.render(scene, *seen, cut="scene", device="cpu")
    # What is as large as before has the same map.
    vertices = scene.vertices.copy()
    low, high = scene.bounds
    inside = ((vertices > low + 0.1) & (vertices < high - 0.1)).all(axis=1)
    vertices[inside] += (0.05, 0.0, 0.0)
    scene.update_vertices(vertices)
    assert np.array_equal(scene.bounds, (low, high))
    found = lx.render(scene, *seen, cut="scene", device="cpu")
    anew = lx.render(lx.Scene(vertices, scene.faces), *seen, cut="scene", device="cpu")
    assert found.stats["shadow map"]["kept_pages"] == 0
    assert found.visibility.tobytes() == anew.visibility.tobytes()


def test_a_moving_camera_keeps_pages(colonnade):
    scene, camera = colonnade
    start, size = camera.eye, {"width": 160, "height": 90}
    eyes = [start + np.array((0.1 * i, 0, 0)) for i in range(4)]
    path = [lx.Camera.look_at(eye, (0, 1, 0), yfov=1.0, **size) for eye in eyes]
    light = LIGHTS["directional"]
    frames = list(lx.render_sequence(scene, path, light, "virtual", cut="scene", device="cpu"))
    for i, frame in enumerate(frames):
        kept = frame.stats["shadow map"]["kept_pages"]
        assert kept == frame.pages["is_kept"].sum()
        assert kept == 0 if i == 0 else kept > 0.5 * len(frame.pages)
        fresh = lx.scenes.colonnade(columns=8, detail=16)
        again = lx.render(fresh, path[i], light, "virtual", cut="scene", device="cpu")
        assert again.stats["shadow map"]["kept_pages"] == 0
        assert again.visibility.tobytes() == frame.visibility.tobytes()
        assert again.shadow_map.tobytes() == frame.shadow_map.tobytes()
    # Not under another light, and not over the receivers, whose map moves.
    for other, parameters in ((LIGHTS["spot"], {"cut": "scene"}), (light, {})):
        frame = lx.render(scene, path[-1], other, "virtual", device="cpu", **parameters)
        assert frame.stats["shadow map"]["kept_pages"] == 0


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"page_size": 32}, "page_size must be a power of two from 64 to 4096, got 32"),
        ({"page_size": 100}, "page_size must be a power of two from 64 to 4096, got 100"),
        ({"pages": 0}, "pages must be a whole number of pages from 1 to 262144, got 0"),
        ({"level_bias": np.inf}, "level_bias must be a finite number, got inf"),
        ({"cut": "cone"}, "cut must be one of 'receivers', 'scene', got 'cone'"),
        ({"rasterization": "linear"}, "rasterization must be 'exact' with method 'virtual'"),
        ({"lookup": "revectorized"}, "lookup must be a depth test, triangles or a lixel.Pcf"),
        ({"lookup": lx.Variance()}, "lookup must be a depth test, triangles or a lixel.Pcf"),
    ],
)
def test_what_it_cannot_be_is_refused(parameters, words):
    with pytest.raises(ValueError, match=words):
        lx.VirtualShadowMap(**parameters)


def test_each_face_needs_a_page(engine, colonnade):
    with pytest.raises(ValueError, match=r"pages must be at least \d, one for each map"):
        lx.render_shadows(*colonnade, LIGHTS["point"], "virtual", pages=1)


def test_frames_of_other_methods_have_no_pages(view):
    frame = lx.render(*view, "desired_view")
    assert frame.pages.shape == (0,)
    assert (frame.page_levels == -1).all()
    for plot in (page_plots.page_levels, page_plots.page_table):
        with pytest.raises(ValueError, match=r"frame must be one of lixel\.VirtualShadowMap"):
            plot(frame)


def test_pictures_of_levels_and_pages(colonnade):
    frame = lx.render(*colonnade, LIGHTS["point"], "virtual", device="cpu")
    ax = page_plots.page_levels(frame)
    assert ax.images
    assert page_plots.page_levels(frame, ax) is ax
    face = frame.pages["face"][0]
    ax = page_plots.page_table(frame, face=face)
    assert len(ax.patches) == (frame.pages["face"] == face).sum()
    assert [text.get_text() for text in ax.get_legend().get_texts()]
    with pytest.raises(ValueError, match=r"face must be one of .*, which have pages, got 7"):
        page_plots.page_table(frame, face=7)


LOOKUPS = (
    "auto", "auto_5x5", "triangle", "triangle_1x1", "depth", lx.Pcf(radius=5.0),
    lx.Pcf(radius=0.1, space="unwarped", jitter=True),
)  # fmt: skip


@pytest.mark.not_on_cpu("it compares with the GPU engine")
@pytest.mark.parametrize("kind", LIGHTS)
def test_both_engines_ask_for_the_same_pages(engine, colonnade, kind):
    """But for what float32 rounds: a level or a page more or less."""
    scene, camera = colonnade
    view = scene, camera.resized(160, 90), LIGHTS[kind]
    truth = lx.reference(*view)
    for lookup in LOOKUPS if kind == "point" else LOOKUPS[:1]:
        method = lx.VirtualShadowMap(page_size=64, level_bias=-1, lookup=lookup)
        frames = [lx.render(*view, method, device=device) for device in ("cpu", "gpu")]
        levels = [frame.page_levels for frame in frames]
        assert (levels[0] != levels[1]).mean() < 1e-3
        texels = [
            {tuple(page)[1:5]: own for page, own in zip(frame.pages, frame.shadow_map, strict=True)}
            for frame in frames
        ]
        shared = texels[0].keys() & texels[1].keys()
        assert len(shared) >= 0.99 * max(map(len, texels))
        # What both drew holds the same depths, but where a triangle ends.
        apart = [np.abs(texels[0][page] - texels[1][page]) > 1e-4 for page in shared]
        assert np.mean(apart) < 1e-3
        visible = [frame.visibility[frame.facing] for frame in frames]
        assert (np.abs(visible[0] - visible[1]) > 0.01).mean() < 2e-3
        wrong = [lx.compare(frame, truth).misclassified_count for frame in frames]
        assert abs(wrong[0] - wrong[1]) <= 2 + 0.02 * wrong[0]


@pytest.mark.not_on_cpu("the CPU engine keeps them")
def test_the_gpu_engine_draws_all_pages_anew(engine, colonnade):
    scene, camera = colonnade
    light = LIGHTS["directional"]
    method = lx.VirtualShadowMap(cut="scene")
    path = [camera.resized(96, 54)] * 2
    frames = list(lx.render_sequence(scene, path, light, method, device="gpu"))
    for frame in frames:
        assert frame.stats["shadow map"]["kept_pages"] == 0
        assert not frame.pages["is_kept"].any()
    assert frames[0].visibility.tobytes() == frames[1].visibility.tobytes()


@pytest.mark.not_on_cpu("it meets a limit of the device")
def test_pages_of_a_level_fit_into_one_buffer_of_the_device(engine, view):
    most = lx.info().device["limits"]["storage_binding_bytes"]
    if most >= 16 * 4096**2 * 8:
        pytest.skip("sixteen of the largest pages fit into one buffer")
    method = lx.VirtualShadowMap(page_size=4096, level_bias=-20)
    with pytest.raises(lx.DeviceError, match=r"pages of one level need \d+ bytes .* store no more"):
        lx.render_shadows(*view, method, device="gpu")


def test_it_is_measured_beside_cascades(tmp_path, view, capfd, monkeypatch):
    monkeypatch.setenv("LIXEL_DEVICE", "cpu")
    write_folder(tmp_path, view.scene, [])
    path = tmp_path / "pages.csv"
    line = ["lab", "pages", str(tmp_path), "--size", "96x64", "--random", "2",
            "--set", "page_size=64", "-o", str(path)]  # fmt: skip
    assert cli.main(line) == 0
    table = read(path)
    assert table["method"].tolist() == ["virtual", *pages.CASCADES] * 2
    paged = table[table["method"] == "virtual"]
    np.testing.assert_array_equal(paged["texels"], paged["pages"] * 64**2)
    for name in pages.CASCADES:
        texels = table[table["method"] == name]["texels"]
        np.testing.assert_allclose(texels, paged["texels"], rtol=0.02)
    assert "ratio" in capfd.readouterr().out
    # A view that was lost is measured again.
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-3]))
    assert cli.main(line) == 0
    again = read(path).drop(columns="milliseconds")
    assert again.equals(table.drop(columns="milliseconds"))
