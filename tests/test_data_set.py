"""A folder of pictures with masks, and COCO's list of the shadows on each object."""

import json

import numpy as np
import pytest

import lixel as lx
from lixel import cli
from lixel.image_files import camera_of, light_of
from lixel.lab.data_set import run_lengths


def decoded(segmentation):
    """A mask of COCO's run lengths, written out pixel by pixel."""
    height, width = segmentation["size"]
    pixels, is_inside = [], False
    for length in segmentation["counts"]:
        pixels += [is_inside] * length
        is_inside = not is_inside
    return np.array(pixels).reshape(width, height).T


@pytest.mark.parametrize(
    ("mask", "counts"),
    [
        ([[0, 1], [0, 1]], [2, 2]),
        ([[1, 0], [0, 0]], [0, 1, 3]),
        ([[0, 0]], [2]),
        ([[1, 1]], [0, 2]),
        ([[0, 1, 1], [1, 0, 1]], [1, 2, 1, 2]),
    ],
)
def test_run_lengths_go_down_the_columns(mask, counts):
    mask = np.array(mask, bool)
    assert run_lengths(mask) == counts
    assert np.array_equal(decoded({"size": mask.shape, "counts": counts}), mask)


@pytest.fixture
def scene_file(tmp_path):
    # Two objects: the floor, and the box above it.
    boxed = lx.scenes.plane_and_box()
    lines = [f"v {x} {y} {z}" for x, y, z in boxed.vertices]
    faces = [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in boxed.faces]
    path = tmp_path / "two.obj"
    path.write_text("\n".join([*lines, "o floor", *faces[:2], "o box", *faces[2:]]))
    return path


def test_an_orbit_with_masks_of_each_object(scene_file, tmp_path, capsys):
    given = [str(scene_file), "--sequence", "orbit:3", "--size", "48x36", "--method", "exact"]
    folder = tmp_path / "masks"
    assert cli.main(["render", *given, "-o", str(folder)]) == 0
    assert capsys.readouterr().out == f"{folder}: 3 pictures and masks, coco.json\n"
    coco = json.loads((folder / "coco.json").read_text())
    assert [category["name"] for category in coco["categories"]] == ["floor", "box"]
    assert [image["file_name"] for image in coco["images"]] == [
        "0000.png", "0001.png", "0002.png",
    ]  # fmt: skip
    scene = lx.load(scene_file)
    eyes = []
    for image in coco["images"]:
        record = lx.read_metadata(folder / image["file_name"])
        camera = camera_of(record)
        eyes.append(camera.eye)
        truth = lx.reference(scene, camera, light_of(record))
        mask = lx.read_visibility(folder / image["file_name"].replace(".png", ".mask.png"))
        assert lx.compare(mask, truth).misclassified_count == 0
        own = [a for a in coco["annotations"] if a["image_id"] == image["id"]]
        found = np.zeros(mask.shape, bool)
        for annotation in own:
            part = decoded(annotation["segmentation"])
            assert (truth.object_id[part] == annotation["category_id"] - 1).all()
            rows, columns = np.nonzero(part)
            left, top, width, height = annotation["bbox"]
            assert (left, top) == (columns.min(), rows.min())
            assert (left + width - 1, top + height - 1) == (columns.max(), rows.max())
            assert annotation["area"] == len(rows)
            found |= part
        assert np.array_equal(found, mask == 0.0)
    middle = scene.bounds.mean(axis=0)
    reach = [np.hypot(*(eye - middle)[[0, 2]]) for eye in eyes]
    assert np.allclose(reach, reach[0])
    # Evenly around it.
    assert np.allclose(np.sum(eyes, axis=0)[[0, 2]] / 3, middle[[0, 2]])


def test_a_light_goes_round_and_views_are_taken_in_turn(tmp_path):
    small = ["plane_and_box", "--size", "24x18", "--method", "exact"]
    folder = tmp_path / "light"
    assert cli.main(["render", *small, "--sequence", "light:4", "-o", str(folder)]) == 0
    lights = [
        light_of(lx.read_metadata(path)).direction for path in sorted(folder.glob("000?.png"))
    ]
    assert np.allclose(lights[0] + lights[2], lights[1] + lights[3])
    assert np.allclose(np.array(lights)[:, 1], lights[0][1])
    views = {
        "cameras": [{"eye": [x, 5, 8], "target": [0, 0, 0], "fov_y_deg": 50} for x in (-4, 4)],
        "lights": [{"kind": "directional", "direction": [x, -1, 0]} for x in (-1, 1)],
    }
    (tmp_path / "views.json").write_text(json.dumps(views))
    given = ["--views", str(tmp_path / "views.json"), "--sequence", "views"]
    folder = tmp_path / "views"
    assert cli.main(["render", *small, *given, "-o", str(folder)]) == 0
    names = {path.name for path in folder.glob("*.mask.png")}
    assert names == {f"{camera}-{light}.mask.png" for camera in "01" for light in "01"}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--sequence", "orbit", "-o", "x"], "sequence must be orbit:N, light:N or views"),
        (["--sequence", "orbit:0", "-o", "x"], "got 'orbit:0'"),
        (["--sequence", "orbit:3", "-o", "x.png"], "--output must be a folder for a sequence"),
        (["-o", "x"], "argument -o/--output: must end in .png, .npy, .npz or .exr, got 'x'"),
    ],
)
def test_mistakes_are_one_line(given, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["render", "plane_and_box", *given]) == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
