"""Images as files: what stands in each kind, what made it, and that both are read again."""

from __future__ import annotations

import json
import math
import sys

import numpy as np
import OpenEXR
import pytest
from matplotlib.figure import Figure
from PIL import Image

import lixel as lx
from lixel import cli, image_files
from lixel.lab import report
from lixel.pictures import plots

SMALL = ["--size", "96x64"]


@pytest.fixture(scope="module")
def frame():
    scene = lx.scenes.plane_and_box()
    camera = scene.cameras["default"].resized(96, 64)
    soft = lx.RectilinearWarp(resolution=64, lookup=lx.Pcf(radius=3.0))
    return lx.render(scene, camera, scene.lights["default"], soft, device="cpu")


# --- What stands in them ---


@pytest.mark.parametrize("ending", image_files.VISIBILITY_ENDINGS)
def test_visibility_is_read_again(frame, ending, tmp_path):
    path = tmp_path / f"a{ending}"
    frame.save(path)
    found = lx.read_visibility(path)
    assert found.dtype == np.float32
    # A mask has 65534 steps between shadow and light.
    error = 0.5 / 65534 if ending == ".mask.png" else 0.0
    np.testing.assert_allclose(found, frame.visibility, rtol=0, atol=1.01 * error)


def test_a_mask_has_sixteen_bits(frame, tmp_path):
    frame.save(tmp_path / "a.MASK.PNG")
    mask = np.asarray(Image.open(tmp_path / "a.MASK.PNG"))
    assert mask.dtype in (np.uint16, np.int32)
    assert (mask[~frame.covered] == 0).all()
    assert (mask[frame.visibility == 0.0] == 1).all()
    assert (mask[frame.visibility == 1.0] == 65535).all()
    assert np.isin(mask, (0, 1, 65535)).mean() < 1.0
    # The byte of the header that says how many bits a sample has.
    assert (tmp_path / "a.MASK.PNG").read_bytes()[24] == 16


def test_layers_of_arrays_and_of_exr(frame, tmp_path):
    for name in ("a.npz", "a.exr"):
        frame.save(tmp_path / name)
    with np.load(tmp_path / "a.npz", allow_pickle=False) as arrays:
        assert set(arrays) == {
            "visibility", "triangle_id", "object_id", "depth", "normal", "lixel",
        }  # fmt: skip
        for name in set(arrays) - {"lixel"}:
            np.testing.assert_array_equal(arrays[name], getattr(frame, name))
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    assert set(channels) == {"Y", "Z", "N.X", "N.Y", "N.Z", "triangle", "object"}
    np.testing.assert_array_equal(channels["triangle"].astype(np.int32), frame.triangle_id)
    np.testing.assert_array_equal(channels["object"].astype(np.int32), frame.object_id)
    np.testing.assert_array_equal(channels["Z"], frame.depth.astype(np.float32))
    np.testing.assert_array_equal(channels["N.Y"], frame.normal[..., 1])


def test_a_scene_that_moved_has_fewer_layers(tmp_path, view):
    frame = lx.render(*view, "exact", device="cpu")
    view.scene.update_vertices(view.scene.vertices + 1.0)
    frame.save(tmp_path / "a.npz")
    frame.save(tmp_path / "a.exr")
    with np.load(tmp_path / "a.npz") as arrays:
        assert set(arrays) == {"visibility", "triangle_id", "object_id", "lixel"}
    assert lx.read_metadata(tmp_path / "a.npz")["scene"]["sha256"] is None
    np.testing.assert_array_equal(lx.read_visibility(tmp_path / "a.exr"), frame.visibility)


# --- What made them ---


@pytest.mark.parametrize("ending", [".png", ".mask.png", ".npz", ".exr"])
def test_what_made_a_frame_is_in_its_file(frame, ending, tmp_path):
    path = tmp_path / f"a{ending}"
    frame.save(path)
    found = lx.read_metadata(path)
    assert found["lixel"] == lx.__version__
    assert found["scene"]["name"] == "plane_and_box"
    assert found["scene"]["triangles"] == 14
    assert found["method"]["name"] == "rtw"
    parameters = found["method"]["parameters"]
    assert (parameters["resolution"], parameters["lookup"]["radius"]) == (64, 3.0)
    assert found["device"] == frame.adapter["name"]
    assert (image_files.camera_of(found), image_files.light_of(found)) == (
        frame.camera,
        frame.light,
    )


@pytest.mark.parametrize(
    "light",
    [
        lx.DirectionalLight((1, -2, 0.3), intensity=3.0),
        lx.PointLight((1, 2, 3), range=7.0),
        lx.SpotLight((1, 2, 3), (0, -1, 0.1), 0.6, 0.2),
        lx.HemisphereLight((0, 4, 0), (0, -1, 0)),
    ],
)
@pytest.mark.parametrize("is_orthographic", [False, True])
def test_views_are_the_same_to_the_last_bit(light, is_orthographic):
    lens = {"ymag": 2.0} if is_orthographic else {"yfov": 0.7, "znear": 0.1, "zfar": 99.0}
    camera = lx.Camera.look_at((1, 2, 3), (0, 0.1, 0), width=31, height=17, **lens)
    scene = lx.scenes.plane_and_box()
    # What JSON has: nothing that is infinite.
    text = json.dumps(image_files.view_record(scene, camera, light), allow_nan=False)
    found = json.loads(text)
    assert image_files.camera_of(found) == camera
    assert image_files.light_of(found) == light


def test_large_and_infinite_parameters_are_written_in_words():
    method = lx.RectilinearWarp(pixel_weights=np.ones((90, 160)))
    found = image_files.method_record(method)["parameters"]
    assert found["pixel_weights"] == "array (90, 160) float32"
    assert image_files._plain(math.inf) == "inf"


def test_a_plot_tells_its_command(tmp_path):
    figure = Figure((1, 1))
    for name in ("a.png", "a.svg"):
        plots.save(figure, tmp_path / name, "lixel lab study colonnade")
    found = lx.read_metadata(tmp_path / "a.png")
    assert found == {"lixel": lx.__version__, "command": "lixel lab study colonnade"}


def test_a_picture_of_a_failed_test_tells_the_view(view, truth, tmp_path):
    wrong = np.where(np.isnan(truth.visibility), np.nan, 1.0)
    with pytest.raises(AssertionError):
        lx.testing.assert_shadows_match(wrong, truth, picture=tmp_path / "a.png")
    found = lx.read_metadata(tmp_path / "a.png")
    assert found["misclassified"] == lx.compare(wrong, truth).misclassified_count
    assert image_files.camera_of(found) == view.camera


# --- What is refused ---


def test_files_of_others_are_refused(frame, tmp_path):
    Image.new("L", (4, 4)).save(tmp_path / "a.mask.png")
    np.savez(tmp_path / "a.npz", visibility=np.zeros(3))
    np.savez(tmp_path / "two.npz", a=np.zeros((3, 3)), b=np.zeros((3, 3)))
    (tmp_path / "a.npy").write_text("nothing")
    for name, words in (
        ("a.mask.png", "must hold 16 bits of grey, got uint8"),
        ("a.npz", r"must hold an image \(H, W\) of visibility, got float64 \(3,\)"),
        ("two.npz", "must hold .* of visibility, got none"),
        ("a.npy", "must be an array, got"),
        ("a.png", r"must end in .mask.png, .npy, .npz or .exr, got '.*a.png'"),
    ):
        with pytest.raises(ValueError, match=f"path {words}"):
            lx.read_visibility(tmp_path / name)
    for name in ("a.mask.png", "a.npz"):
        with pytest.raises(ValueError, match="path must be a file that lixel wrote"):
            lx.read_metadata(tmp_path / name)
    with pytest.raises(ValueError, match=r"must end in .png, .npz or .exr"):
        lx.read_metadata(tmp_path / "a.npy")
    with pytest.raises(ValueError, match=r"must end in .png, .npy, .npz or .exr, got '.*a.jpg'"):
        frame.save(tmp_path / "a.jpg")


def test_the_only_array_of_a_file_is_taken_for_visibility(tmp_path):
    np.savez(tmp_path / "a.npz", shadows=np.eye(3))
    np.testing.assert_array_equal(lx.read_visibility(tmp_path / "a.npz"), np.eye(3))


# --- On the command line ---


def test_two_images_are_compared(frame, tmp_path, capsys):
    truth = (frame.visibility >= 0.5).astype(np.float32)
    truth[~frame.covered] = np.nan
    wrong = truth.copy()
    wrong[np.nonzero(frame.covered)[0][:1], np.nonzero(frame.covered)[1][:1]] = 0.0
    np.save(tmp_path / "mine.npy", wrong)
    np.save(tmp_path / "theirs.npy", truth)
    given = [str(tmp_path / "mine.npy"), str(tmp_path / "theirs.npy")]
    assert cli.main(["compare", *given, "-o", str(tmp_path / "out")]) == 0
    out = capsys.readouterr().out
    found = lx.compare(wrong, truth)
    assert out.startswith(str(found))
    for name in ("misclassified_count", "ssim", "hausdorff", "rate_covered"):
        assert f"{name} " in out
    record = lx.read_metadata(tmp_path / "out" / "mine-misclassified.png")
    assert record["misclassified"] == found.misclassified_count
    assert record["command"] == "lixel compare mine.npy theirs.npy -o out"


def test_an_image_is_compared_with_the_reference_of_the_view_that_its_file_tells(tmp_path, capsys):
    scene = lx.scenes.plane_and_box()
    camera = lx.Camera.look_at((5, 6, 5), (0, 1, 0), yfov=0.8, width=80, height=60)
    frame = lx.render(scene, camera, lx.PointLight((2, 5, 1)), lx.Uniform(resolution=32))
    frame.save(tmp_path / "a.npz")
    np.save(tmp_path / "a.npy", frame.visibility)
    assert cli.main(["compare", str(tmp_path / "a.npz"), "plane_and_box"]) == 0
    expected = lx.compare(frame, lx.reference(scene, camera, frame.light))
    assert capsys.readouterr().out.startswith(str(expected))
    # The array says nothing of its view.
    assert cli.main(["compare", str(tmp_path / "a.npy"), "plane_and_box"]) == 2
    assert "must see surfaces in the same pixels" in capsys.readouterr().err
    others = ["--other-surfaces", "count"]
    assert cli.main(["compare", str(tmp_path / "a.npy"), "plane_and_box", *others]) == 0
    assert cli.main(["compare", str(tmp_path / "a.npz"), "needles", *others]) == 0
    assert "was made of another scene than needles" in capsys.readouterr().err
    assert cli.main(["compare", str(tmp_path / "a.npy")]) == 2
    assert "TRUTH must be an image or a scene" in capsys.readouterr().err


def test_info_tells_what_made_a_file(tmp_path, capsys):
    path = tmp_path / "a.mask.png"
    assert cli.main(["render", "plane_and_box", *SMALL, "--method", "rtw", "-o", str(path)]) == 0
    capsys.readouterr()
    assert cli.main(["info", str(path)]) == 0
    out = capsys.readouterr().out
    assert '\n  scene: {"name": "plane_and_box"' in out
    assert '\n  method: {"name": "rtw"' in out
    np.save(tmp_path / "a.npy", np.eye(2))
    assert cli.main(["info", str(tmp_path / "a.npy")]) == 2
    assert "must end in .png, .npz or .exr" in capsys.readouterr().err


def test_without_openexr_the_remedy_is_told_before_the_work(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    monkeypatch.setattr(cli, "view_of", None)
    assert cli.main(["render", "plane_and_box", "-o", "x.exr"]) == 2
    assert "pip install 'lixel[exr]'" in capsys.readouterr().err


def test_long_work_says_what_it_is(capsys):
    with report.waiting("loading", patience=60.0):
        pass
    assert capsys.readouterr().err == ""
    with report.waiting("loading", patience=0.0):
        while not (err := capsys.readouterr().err):
            pass
    assert err == "loading ...\n"
