"""glTF's ways to store geometry, and what is out of range in it."""

from __future__ import annotations

import json
import math
import struct
import sys
import warnings

import DracoPy
import numpy as np
import pytest
import trimesh
from gltf_files import GltfFile

import lixel as lx

BOX = trimesh.creation.box((1, 2, 3))
POINTS = np.array(BOX.vertices, dtype=np.float64)
FACES = np.array(BOX.faces, dtype=np.int64)
HALF = math.sqrt(0.5)


def box(file: GltfFile, **members) -> dict:
    """A box of plain arrays as a primitive."""
    return {
        "attributes": {"POSITION": file.accessor(POINTS, "f4")},
        "indices": file.accessor(FACES.reshape(-1), "u2"),
    } | members


def loaded(file: GltfFile, path, *unsupported: str) -> lx.Scene:
    """The scene of a file, of which just this is unsupported."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = lx.load(file.write(path / "scene.gltf"))
    assert len(caught) == bool(unsupported)
    assert len(scene.unsupported) == len(unsupported), scene.unsupported
    for words, expected in zip(scene.unsupported, unsupported, strict=True):
        assert expected in words
    return scene


def same_triangles(scene: lx.Scene, *parts) -> bool:
    """Whether a scene has these triangles, in this order, whatever its vertices are."""
    expected = np.concatenate([points[faces] for points, faces in parts])
    corners = scene.vertices[scene.faces]
    return corners.shape == expected.shape and np.allclose(corners, expected, atol=1e-6)


# --- Arrays ---


def test_interleaved_and_sparse(tmp_path):
    file = GltfFile()
    rows = np.concatenate([POINTS, POINTS + 100], axis=1).astype("<f4")
    view = file.view(rows.tobytes(), byteStride=24)
    moved = POINTS.copy()
    moved[[1, 6]] = [[7, 8, 9], [1, 1, 1]]
    sparse = {
        "count": 2,
        "indices": {"bufferView": file.view(struct.pack("<2H", 1, 6)), "componentType": 5123},
        "values": {"bufferView": file.view(moved[[1, 6]].astype("<f4").tobytes())},
    }
    plain = {"componentType": 5126, "count": 8, "type": "VEC3"}
    first = file.add("accessors", plain | {"bufferView": view, "sparse": sparse})
    second = file.add("accessors", plain | {"bufferView": view, "byteOffset": 12})
    zeros = file.add("accessors", plain | {"sparse": sparse})
    indices = file.accessor(FACES.reshape(-1), "u1")
    primitives = [
        {"attributes": {"POSITION": i}, "indices": indices} for i in (first, second, zeros)
    ]
    file.node(mesh=file.mesh(*primitives))
    nearly_zero = np.zeros((8, 3))
    nearly_zero[[1, 6]] = moved[[1, 6]]
    parts = [(moved, FACES), (POINTS + 100, FACES), (nearly_zero, FACES)]
    assert same_triangles(loaded(file, tmp_path), *parts)


@pytest.mark.parametrize(
    ("dtype", "normalized", "scale"),
    [("i1", False, 1), ("u1", True, 1 / 255), ("i2", True, 1 / 32767), ("u2", False, 1)],
)
def test_quantized(dtype, normalized, scale, tmp_path):
    file = GltfFile()
    whole = np.round(POINTS * 20 + 40)
    rows = np.zeros((8, 4), dtype="<" + dtype)
    rows[:, :3] = whole
    view = file.view(rows.tobytes(), byteStride=rows.itemsize * 4)
    code = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123}[dtype]
    entry = {"bufferView": view, "componentType": code, "count": 8, "type": "VEC3"}
    position = file.add("accessors", entry | {"normalized": normalized})
    indices = file.accessor(FACES.reshape(-1), "u4")
    mesh = file.mesh({"attributes": {"POSITION": position}, "indices": indices})
    file.node(mesh=mesh, scale=[2, 2, 2])
    file.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    assert same_triangles(loaded(file, tmp_path), (2 * whole * scale, FACES))


@pytest.mark.parametrize(
    ("mode", "faces"),
    [
        (4, [[0, 1, 2], [3, 4, 0]]),
        (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 0, 4], [4, 0, 1]]),
        (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 0, 0], [0, 1, 0]]),
    ],
)
@pytest.mark.parametrize("indexed", [True, False])
def test_modes(mode, faces, indexed, tmp_path):
    file = GltfFile()
    corners = np.array([0, 1, 2, 3, 4, 0, 1])
    primitive = {"mode": mode}
    if indexed:
        primitive["indices"] = file.accessor(corners, "u1")
    points = POINTS if indexed else POINTS[corners]
    primitive["attributes"] = {"POSITION": file.accessor(points, "f4")}
    lines = {"attributes": {"POSITION": file.accessor(POINTS, "f4")}, "mode": 1}
    file.node(mesh=file.mesh(primitive, lines, lines))
    scene = loaded(file, tmp_path, "points and lines, which cast no shadow")
    assert same_triangles(scene, (POINTS, np.array(faces)))


def test_draco(tmp_path):
    content = DracoPy.encode(POINTS.astype(np.float32), FACES.astype(np.uint32), 20)
    decoded = DracoPy.decode(content)
    file = GltfFile()
    view = file.view(content)
    extension = {"bufferView": view, "attributes": {"POSITION": 0}}
    file.tree["accessors"] = [
        {"componentType": 5126, "count": 8, "type": "VEC3"},
        {"componentType": 5125, "count": 36, "type": "SCALAR"},
        {"componentType": 5125, "count": 39, "type": "SCALAR"},
    ]
    primitive = {
        "attributes": {"POSITION": 0},
        "indices": 1,
        "extensions": {"KHR_draco_mesh_compression": extension},
    }
    file.node(mesh=file.mesh(primitive, primitive | {"indices": 2}))
    scene = loaded(file, tmp_path, "its Draco data have 36 of 39 indices")
    assert same_triangles(scene, (np.asarray(decoded.points, float), decoded.faces))
    assert np.allclose(scene.bounds, BOX.bounds, atol=1e-4)


@pytest.mark.skipif(sys.version_info < (3, 11), reason="meshopt takes Python 3.11")
@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_meshopt(name, tmp_path):
    import meshopt

    file = GltfFile()
    rows = np.zeros((8, 4), dtype="<u2")
    rows[:, :3] = np.round(POINTS * 100 + 300)
    count = FACES.size

    def compressed(values, size, stride, mode, **more):
        content = meshopt.encode_gltf_buffer(values, mode)
        start = file.view(content)
        extension = file.tree["bufferViews"].pop(start) | {
            "count": size, "byteStride": stride, "mode": mode, **more,
        }  # fmt: skip
        return file.add(
            "bufferViews",
            {"buffer": 1, "byteLength": size * stride, "extensions": {name: extension}},
        )

    entry = {"componentType": 5123, "count": 8, "type": "VEC3"}
    points = compressed(rows, 8, 8, "ATTRIBUTES")
    file.tree["bufferViews"][points]["byteStride"] = 8
    position = file.add("accessors", entry | {"bufferView": points})
    corners = compressed(FACES.reshape(-1).astype("<u4"), count, 2, "TRIANGLES")
    indices = {"bufferView": corners, "componentType": 5123, "count": count, "type": "SCALAR"}
    indices = file.add("accessors", indices)
    good = {"attributes": {"POSITION": position}, "indices": indices}
    bomb = compressed(rows, 1 << 31, 8, "ATTRIBUTES")
    bomb = file.add("accessors", entry | {"bufferView": bomb})
    file.node(mesh=file.mesh(good, {"attributes": {"POSITION": bomb}}))
    scene = loaded(file, tmp_path, f"{name} promises 17179869184 bytes out of")
    corners = scene.vertices[scene.faces]
    expected = rows[:, :3][FACES].astype(float)
    # The codec may begin a triangle with another corner.
    assert np.array_equal(np.sort(corners, axis=1), np.sort(expected, axis=1))


# --- Nodes ---


def test_instances(tmp_path):
    file = GltfFile()
    attributes = {
        "TRANSLATION": file.accessor([[5, 0, 0], [0, 6, 0]], "f4"),
        "ROTATION": file.accessor([[0, 0, 0, 127], [0, 0, 90, 90]], "i1", normalized=True),
        "SCALE": file.accessor([[1, 1, 1], [2, 2, 2]], "f4"),
    }
    extensions = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    file.node(mesh=file.mesh(box(file)), extensions=extensions, translation=[0, 0, 1])
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    parts = [(np.add(POINTS, (5, 0, 1)), FACES), (2 * POINTS @ turn.T + (0, 6, 1), FACES)]
    assert same_triangles(loaded(file, tmp_path), *parts)


def test_hidden_nodes_hide_what_is_below_them(tmp_path):
    file = GltfFile()
    mesh = file.mesh(box(file))
    light = {"KHR_lights_punctual": {"light": 0}}
    file.tree["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}
    below = file.node(mesh=mesh, root=False, extensions=light, name="lamp")
    shown = {"KHR_node_visibility": {"visible": True}}
    hidden = {"KHR_node_visibility": {"visible": False}}
    file.node(mesh=mesh, extensions=hidden, children=[below])
    file.node(mesh=mesh, extensions=shown | light, translation=[0, 9, 0])
    scene = loaded(file, tmp_path, "point light 'lamp': its node is hidden")
    assert same_triangles(scene, (np.add(POINTS, (0, 9, 0)), FACES))
    assert list(scene.lights) == ["light"]


def test_a_skin_at_rest(tmp_path):
    """Two joints, one below the other, and one of them outside of the scene's nodes."""
    file = GltfFile()
    weights = np.zeros((8, 4))
    weights[:, 0], weights[:, 1] = 0.5, 0.25  # they sum to 0.75: shares of 2/3 and 1/3
    joints = np.tile([0, 1, 9, 9], (8, 1))
    primitive = box(file)
    primitive["attributes"] |= {
        "JOINTS_0": file.accessor(joints, "u1"),
        "WEIGHTS_0": file.accessor(weights, "f4"),
    }
    first = file.node(root=False, translation=[1, 0, 0], scale=[2, 2, 2], children=[1])
    second = file.node(root=False, translation=[0, 1, 0], rotation=[0, 0, HALF, HALF])
    inverse = np.array([np.eye(4), np.eye(4)])
    inverse[1, :3, 3] = 0, 0, 3
    matrices = file.accessor(inverse.transpose(0, 2, 1).reshape(2, 16), "f4")
    skin = file.add("skins", {"joints": [first, second], "inverseBindMatrices": matrices})
    file.node(mesh=file.mesh(primitive), skin=skin, translation=[99, 99, 99])
    file.tree["scenes"][0]["nodes"].append(first)
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    by_first = np.add(2 * POINTS, (1, 0, 0))
    by_second = 2 * ((np.add(POINTS, (0, 0, 3))) @ turn.T + (0, 1, 0)) + (1, 0, 0)
    scene = loaded(file, tmp_path)
    assert same_triangles(scene, (by_first * 2 / 3 + by_second / 3, FACES))


@pytest.mark.parametrize("of_node", [True, False])
def test_morph_targets_at_their_default_weights(of_node, tmp_path):
    file = GltfFile()
    offsets = np.arange(24.0).reshape(8, 3)
    targets = [{"POSITION": file.accessor(k * offsets, "f4")} for k in (1, 10, 100)]
    weights = {"weights": [0.5, 0, -0.25]}
    mesh = file.mesh(box(file, targets=targets), **({"weights": [9, 9, 9]} if of_node else weights))
    file.node(mesh=mesh, **(weights if of_node else {}))
    assert same_triangles(loaded(file, tmp_path), (POINTS + (0.5 - 25) * offsets, FACES))


# --- Out of range: it costs itself ---


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p, f: p["attributes"].clear(), "primitive 1 of mesh 'node 0': it has no POSITION"),
        (lambda p, f: p.clear(), "it has no 'attributes'"),
        (lambda p, f: p.update(indices=f.accessor([0, 1, 8], "u2")), "index 8, and 8 vertices"),
        (lambda p, f: p.update(indices=f.accessor([0, 1, 2], "f4")), "unsigned whole numbers"),
        (lambda p, f: p.update(indices=77), "accessors[77], and the file has"),
        (lambda p, f: p.update(mode=9), "its mode must be a whole number from 0 to 6, got 9"),
        (lambda p, f: p.update(mode="x"), "its mode must be a whole number from 0 to 6, got 'x'"),
        (lambda p, f: p["attributes"].update(POSITION=f.accessor([[0, math.nan, 0]], "f4")),
         "vertex 0 is not finite"),
        (lambda p, f: f.tree["accessors"][-1].update(count=10**9), "an accessor ends at byte"),
        (lambda p, f: f.tree["accessors"][-1].update(byteOffset=-4), "byteOffset must be a whole"),
        (lambda p, f: f.tree["accessors"][-1].update(componentType=1), "componentType must be one"),
        (lambda p, f: f.tree["bufferViews"][-1].update(byteLength=10**9), "ends at byte"),
        (lambda p, f: (f.tree["accessors"][-1].pop("bufferView"),
                       f.tree["accessors"][-1].update(count=10**9)), "no bytes in the file"),
    ],
    ids=range(13),
)  # fmt: skip
def test_a_broken_primitive_costs_itself(change, words, tmp_path):
    file = GltfFile()
    good, bad = box(file), box(file)
    file.node(mesh=file.mesh(good, bad))
    change(bad, file)
    assert same_triangles(loaded(file, tmp_path, words), (POINTS, FACES))


@pytest.mark.parametrize(
    ("light", "words"),
    [
        ({"type": "spot", "spot": {"outerConeAngle": 2.0}}, "spot light 'lamp': outer must be"),
        ({"type": "spot", "spot": {"innerConeAngle": 0.9, "outerConeAngle": 0.5}}, "inner must be"),
        ({"type": "spot", "spot": 3}, "spot light 'lamp': it cannot be understood"),
        ({"type": "point", "intensity": -1}, "intensity must be at least 0"),
        ({"type": "disk"}, "disk light 'lamp'"),
        ({}, "None light 'lamp'"),
    ],
)
def test_a_broken_light_costs_itself(light, words, tmp_path):
    file = GltfFile()
    good = {"type": "point", "intensity": 60, "range": 7, "name": "good"}
    file.tree["extensions"] = {"KHR_lights_punctual": {"lights": [good, light]}}
    file.node(mesh=file.mesh(box(file)))
    for index in (0, 1):
        name = {"name": "lamp"} if index else {}
        file.node(extensions={"KHR_lights_punctual": {"light": index}}, **name)
    scene = loaded(file, tmp_path, words)
    assert scene.lights == {"good": lx.PointLight((0, 0, 0), intensity=60, range=7)}


def test_cones_are_clamped_where_the_meaning_is_plain(tmp_path):
    file = GltfFile()
    cones = [(0.5, 0.5), (float(np.float32(math.pi) / 2), 0.1), (math.pi / 2, math.pi / 2)]
    lights = [
        {"type": "spot", "range": 0, "spot": {"outerConeAngle": o, "innerConeAngle": i}}
        for o, i in cones
    ]
    file.tree["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    file.node(mesh=file.mesh(box(file)))
    for index in range(3):
        file.node(extensions={"KHR_lights_punctual": {"light": index}})
    found = list(loaded(file, tmp_path).lights.values())
    assert [light.outer for light in found] == [0.5, math.pi / 2, math.pi / 2]
    assert [round(light.inner, 9) for light in found] == [0.5, 0.1, round(math.pi / 2, 9)]
    assert {light.range for light in found} == {math.inf}


# --- Files from strangers ---


@pytest.mark.parametrize(
    "uri",
    ["../secret.bin", "/etc/passwd", "https://example.com/a.bin", "file:///etc/passwd",
     "C:\\secret.bin", "\\\\host\\share\\a.bin", "below/../../secret.bin", "..%2fsecret.bin",
     "..\\secret.bin", "link.bin"],
)  # fmt: skip
def test_nothing_outside_the_folder_is_opened(uri, tmp_path):
    folder = tmp_path / "folder"
    (folder / "below").mkdir(parents=True)
    (tmp_path / "secret.bin").write_bytes(bytes(1000))
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    file = GltfFile()
    file.node(mesh=file.mesh(box(file)))
    file.tree["buffers"] = [{"byteLength": len(file.data), "uri": uri}]
    with pytest.raises(ValueError, match=r"it refers to .* which is not opened; put that file"):
        lx.load(file.write(folder / "scene.gltf"))


def test_missing_and_short_buffers_are_named(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(box(file)))
    file.tree["buffers"] = [{"byteLength": len(file.data), "uri": "a%20b/data.bin"}]
    path = file.write(tmp_path / "scene.gltf")
    with pytest.raises(ValueError, match=r"refers to 'a%20b/data.bin', and there is no such file"):
        lx.load(path)
    (tmp_path / "a b").mkdir()
    (tmp_path / "a b" / "data.bin").write_bytes(file.data[:-1])
    with pytest.raises(ValueError, match=f"it is cut off: .* has {len(file.data) - 1} of"):
        lx.load(path)
    (tmp_path / "a b" / "data.bin").write_bytes(file.data + b"more")
    assert same_triangles(lx.load(path), (POINTS, FACES))


def test_a_chain_of_thousands_of_nodes(tmp_path):
    file = GltfFile()
    mesh = file.mesh(box(file))
    count = 5_000
    file.node(translation=[1, 0, 0], children=[1])
    for i in range(1, count):
        more = {"children": [i + 1]} if i < count - 1 else {"mesh": mesh}
        file.node(root=False, translation=[1, 0, 0], **more)
    assert same_triangles(loaded(file, tmp_path), (np.add(POINTS, (count, 0, 0)), FACES))


def test_a_bomb_of_instances_is_refused(tmp_path):
    file = GltfFile()
    places = file.accessor(np.zeros((3000, 3)), "f4")
    primitive = box(file)
    primitive["indices"] = file.accessor(np.zeros(3 * 3000), "u2")
    mesh = file.mesh(*[primitive] * 10)
    extensions = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}
    file.node(mesh=mesh, extensions=extensions)
    with pytest.raises(ValueError, match="its nodes hold more than 33,554,432 triangles"):
        lx.load(file.write(tmp_path / "scene.gltf"))


@pytest.mark.parametrize(
    "text", ["[" * 100_000, '{"asset": ' * 50_000, "{}", "[]", "7", '{"asset":{}}']
)
def test_json_of_any_kind_is_refused(text, tmp_path):
    (tmp_path / "scene.gltf").write_text(text)
    with pytest.raises(ValueError, match=r"path must be a .gltf file with triangles.*scene.gltf"):
        lx.load(tmp_path / "scene.gltf")


def test_an_extension_that_must_be_understood_is_named(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(box(file)))
    file.tree["extensionsRequired"] = ["KHR_texture_basisu", "ACME_bent_space"]
    scene = loaded(file, tmp_path, "the extension ACME_bent_space, which the file requires")
    assert same_triangles(scene, (POINTS, FACES))


def test_names_in_latin_1_and_zeros_after_the_text(tmp_path):
    file = GltfFile()
    file.node(mesh=file.mesh(box(file)), name="Kaempfer")
    path = file.write(tmp_path / "scene.gltf")
    path.write_bytes(path.read_bytes().replace(b"Kaempfer", "Kämpfer".encode("latin-1")) + b"\0\0")
    assert lx.load(path).triangle_count == len(FACES)


def test_a_glb_of_version_1_says_so(tmp_path):
    text = json.dumps({"asset": {}}).encode()
    content = struct.pack("<4s4I", b"glTF", 1, 20 + len(text), len(text), 0) + text
    (tmp_path / "old.glb").write_bytes(content)
    with pytest.raises(ValueError, match="it is glTF 1, and only glTF 2 is read; convert it"):
        lx.load(tmp_path / "old.glb")
