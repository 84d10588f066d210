"""Files: geometry, transforms, cameras and lights, and what is wrong with a file."""

from __future__ import annotations

import base64
import json
import math
import struct

import numpy as np
import pytest
import trimesh
from hypothesis import given, strategies as st

import lixel as lx
from lixel.files.gltf.nodes import parent_from_node

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)


def gltf(nodes, *, roots=(0,), **members) -> dict:
    """A glTF document with one triangle as mesh 0."""
    data = TRIANGLE.tobytes()
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(roots)}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "buffers": [
            {
                "byteLength": len(data),
                "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
            }
        ],
        **members,
    }


def glb(document: dict) -> bytes:
    """The same as one binary file."""
    document = document | {"buffers": [{"byteLength": TRIANGLE.nbytes}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data = TRIANGLE.tobytes()
    return (
        struct.pack("<5I", 0x46546C67, 2, 28 + len(text) + len(data), len(text), 0x4E4F534A)
        + text
        + struct.pack("<2I", len(data), 0x004E4942)
        + data
    )


def write(path, document):
    if path.suffix == ".glb":
        path.write_bytes(glb(document))
    else:
        path.write_text(json.dumps(document))
    return path


@pytest.fixture(params=[".gltf", ".glb"])
def path(request, tmp_path):
    return tmp_path / f"scene{request.param}"


@pytest.mark.parametrize("suffix", [".glb", ".gltf", ".obj", ".ply", ".stl"])
def test_every_format(suffix, tmp_path):
    box = trimesh.creation.box((1, 2, 3))
    box.apply_translation((4, 5, 6))
    file = tmp_path / f"box{suffix}"
    if suffix == ".gltf":
        for name, content in box.scene().export(file_type="gltf").items():
            (tmp_path / name.replace("model", "box")).write_bytes(content)
    else:
        box.export(file)
    scene = lx.load(file)
    assert scene.triangle_count == 12
    assert np.allclose(scene.bounds, box.bounds)
    assert (scene.cameras, scene.lights, scene.unsupported) == ({}, {}, ())
    assert lx.load(str(file)).triangle_count == 12


def test_float64_coordinates_are_neither_rounded_nor_merged(tmp_path):
    vertices = TRIANGLE.astype(float) + np.array([1e6 + 0.1, 0.2, 0.3])
    vertices = np.vstack([vertices, vertices[2] + np.array([0, 1e-9, 0])])
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    (tmp_path / "far.obj").write_text("\n".join([*rows, "f 1 2 3", "f 1 2 4"]))
    assert np.array_equal(lx.load(tmp_path / "far.obj").vertices, vertices)


def test_node_transforms_are_applied(path):
    half = math.sqrt(0.5)
    nodes = [
        {"translation": [10, 0, 0], "scale": [2, 2, 2], "children": [1, 2]},
        # 90 degrees about z: x turns to y.
        {"rotation": [0, 0, half, half], "mesh": 0},
        {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1], "mesh": 0},
    ]
    scene = lx.load(write(path, gltf(nodes)))
    corners = scene.vertices[scene.faces].tolist()
    turned = [[10, 0, 0], [10, 2, 0], [8, 0, 0]]
    moved = [[10, 0, 10], [12, 0, 10], [10, 2, 10]]
    assert any(np.allclose(c, turned) for c in corners)
    assert any(np.allclose(c, moved) for c in corners)
    assert len(corners) == 2


def test_cameras_and_lights_of_a_file(path):
    half = math.sqrt(0.5)
    nodes = [
        {"translation": [0, 0, 3], "scale": [2, 2, 2], "children": [1, 2, 3, 4, 5, 6, 8, 9]},
        {"name": "Eye", "camera": 0, "translation": [1, 0, 0], "mesh": 0, "children": [7]},
        {"camera": 0},
        {"name": "Plan", "camera": 1},
        # Turned about x by -90 degrees: looks down.
        {
            "name": "Sun",
            "rotation": [-half, 0, 0, half],
            "extensions": {"KHR_lights_punctual": {"light": 0}},
        },
        {"extensions": {"KHR_lights_punctual": {"light": 1}}, "translation": [0, 0, 5]},
        {"name": "Eye", "camera": 2},
        {"mesh": 0, "translation": [0, 0, 1]},
        {
            "name": "Torch",
            "rotation": [-half, 0, 0, half],
            "extensions": {"KHR_lights_punctual": {"light": 2}},
        },
        {"extensions": {"KHR_lights_punctual": {"light": 3}}},
    ]
    cameras = [
        {
            "type": "perspective",
            "perspective": {"yfov": 0.7, "aspectRatio": 2.0, "znear": 0.1, "zfar": 9.0},
        },
        {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "znear": 0, "zfar": 9}},
        {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.2}},
    ]
    lights = [
        {"type": "directional", "name": "sun"},
        {"type": "point", "name": "Lamp"},
        {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}},
        {"type": "area", "name": "Panel"},
    ]
    document = gltf(nodes, cameras=cameras, extensions={"KHR_lights_punctual": {"lights": lights}})
    with pytest.warns(UserWarning, match="without area light"):
        scene = lx.load(write(path, document), height=100)
    assert list(scene.cameras) == ["Eye", "camera", "Plan", "Eye_1"]
    eye = scene.cameras["Eye"]
    assert np.allclose(eye.eye, (2, 0, 3))
    assert np.allclose(eye.pose[:3, :3], np.eye(3))  # the scale above it is not its own
    assert (eye.width, eye.height, eye.znear, eye.zfar) == (200, 100, 0.1, 9.0)
    assert eye.yfov == pytest.approx(0.7)
    assert scene.cameras["Eye_1"].width == 178
    assert scene.cameras["Eye_1"].zfar == math.inf
    plan = scene.cameras["Plan"]
    assert plan.is_orthographic
    assert (plan.width, plan.height, plan.znear, plan.zfar) == (150, 100, 0.0, 9.0)
    assert plan.focal == (25.0, 25.0)
    assert list(scene.lights) == ["Sun", "Lamp", "Torch"]
    sun, lamp, torch = scene.lights.values()
    assert np.allclose(sun.direction, (0, -1, 0))
    assert isinstance(lamp, lx.PointLight)
    assert isinstance(torch, lx.SpotLight)
    assert np.allclose(torch.direction, (0, -1, 0))
    assert (torch.inner, torch.outer) == (0.1, 0.5)
    assert scene.unsupported == ("area light 'Panel'",)
    # Meshes at and below a camera's node are there, and where they belong.
    least = sorted(scene.vertices[scene.faces].min(axis=1).tolist())
    assert np.allclose(least, [[2, 0, 3], [2, 0, 5]])


@given(quaternion=st.tuples(*4 * [st.floats(-1, 1)]).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_rotations_of_nodes_are_those_of_the_specification(quaternion):
    node = {"rotation": quaternion, "translation": [1, 2, 3], "scale": [2, 3, 4]}
    x, y, z, w = quaternion
    expected = trimesh.transformations.quaternion_matrix([w, x, y, z]) @ np.diag([2, 3, 4, 1])
    expected[:3, 3] = 1, 2, 3
    assert np.allclose(parent_from_node(node), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d["accessors"][0].update(sparse={"count": 1}), "it has no 'indices'"),
        (lambda d: d["meshes"][0]["primitives"][0].update(mode=0), "at least one triangle"),
        (lambda d: d["nodes"][0].update(children=[0]), "its own ancestor"),
        (lambda d: d["nodes"][0].update(mesh=5), "meshes.5., and the file has 1"),
        (lambda d: d["buffers"][0].update(uri="missing.bin"), "missing.bin', and there is no such"),
        (lambda d: d.update(scene=3), "scenes.3., and the file has 1"),
        (lambda d: d.pop("asset"), "no glTF asset"),
    ],
)
def test_gltf_that_would_be_misread_is_refused(change, words, tmp_path):
    document = gltf([{"mesh": 0}])
    assert lx.load(write(tmp_path / "good.gltf", document)).triangle_count == 1
    change(document)
    with pytest.raises(ValueError, match=rf"path must be a .gltf file .*bad.gltf.*{words}"):
        lx.load(write(tmp_path / "bad.gltf", document))


@pytest.mark.parametrize("suffix", [".glb", ".gltf", ".obj", ".ply", ".stl"])
@pytest.mark.parametrize("content", [b"", b"nonsense", bytes(range(256)) * 4], ids=len)
def test_corrupt_files_are_named(suffix, content, tmp_path):
    file = tmp_path / f"broken{suffix}"
    file.write_bytes(content)
    with pytest.raises(ValueError, match=rf"path must be a {suffix} file with triangles.*broken"):
        lx.load(file)


def test_a_file_cut_off_is_named(tmp_path):
    file = tmp_path / "cut.glb"
    file.write_bytes(glb(gltf([{"mesh": 0}]))[:-8])
    with pytest.raises(ValueError, match=r"cut.glb.*cut off"):
        lx.load(file)


def test_missing_and_foreign_files(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"nowhere.glb"):
        lx.load(tmp_path / "nowhere.glb")
    with pytest.raises(FileNotFoundError, match=r"got the folder .* name a file in it"):
        lx.load(tmp_path)
    (tmp_path / "town.glb").write_text("hello")
    with pytest.raises(FileNotFoundError, match=r"there is none; did you mean 'town.glb'"):
        lx.load(tmp_path / "twon.glb")
    (tmp_path / "scene.txt").write_text("hello")
    with pytest.raises(
        ValueError, match=r"path must end in .glb, .gltf, .*scene.txt.*; export it as"
    ):
        lx.load(tmp_path / "scene.txt")
