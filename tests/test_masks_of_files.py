"""Holes of triangles in files: glTF materials whose alpha is tested, and textures of trimesh."""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
import pytest
import trimesh
from gltf_files import CASES, GltfFile, data_uri
from PIL import Image
from PIL.PngImagePlugin import PngInfo

import lixel as lx

# Asymmetric, so that a flip or a turn shows.
ALPHA = np.array([[255, 0, 0], [255, 255, 0]], np.uint8)
POSITIONS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
UV = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)


def png(alpha: np.ndarray, words: str = "") -> bytes:
    """An image, and a text in it that is compressed."""
    image = np.concatenate([np.full((*alpha.shape, 3), 90, np.uint8), alpha[..., None]], axis=2)
    content = io.BytesIO()
    texts = PngInfo()
    if words:
        texts.add_text("words", words, zip=True)
    Image.fromarray(image, "RGBA").save(content, "PNG", pnginfo=texts)
    return content.getvalue()


def card(
    material: dict[str, object],
    image: bytes | None = None,
    *,
    sampler: dict[str, int] | None = None,
    **attributes: np.ndarray,
) -> GltfFile:
    """A square with a material."""
    file = GltfFile()
    arrays = {"POSITION": POSITIONS, "TEXCOORD_0": UV, **attributes}
    primitive = {
        "attributes": {name: file.accessor(array, "f4") for name, array in arrays.items()},
        "indices": file.accessor([0, 1, 2, 0, 2, 3], "u4"),
        "material": file.add("materials", material),
    }
    file.node(mesh=file.mesh(primitive))
    file.add("textures", {"source": 0} | ({"sampler": 0} if sampler else {}))
    file.add("samplers", sampler or {})
    file.add("images", {"uri": data_uri(png(ALPHA) if image is None else image)})
    return file


def textured(**more: object) -> dict[str, object]:
    return {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, **more}}, "alphaMode": "MASK"}


def loaded(path: Path, file: GltfFile) -> lx.Scene:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return lx.load(file.write(path / "card.gltf"))


def holes(scene: lx.Scene) -> np.ndarray:
    """(6, 6) of the square, row 0 at the top: where the eye sees through it."""
    camera = lx.Camera.look_at(
        (0.5, 0.5, 5.0), (0.5, 0.5, 0.0), yfov=2 * np.arctan(0.1), width=6, height=6
    )
    return lx.reference(scene, camera, lx.DirectionalLight((0, 0, -1))).triangle_id < 0


def of_texels(texels: np.ndarray) -> np.ndarray:
    """The holes in six by six pixels of an image of two by three texels, each taken as it is."""
    return np.kron(texels, np.ones((3, 2))) == 0


NEAREST = {"magFilter": 9728}


def test_the_leaf_of_the_file_has_its_holes():
    scene = lx.load(CASES / "masked_leaf.glb")
    assert scene.masked_count == 2
    assert scene.unsupported == ()
    camera = lx.Camera.look_at((7, 6, 8), (0, 0, 0), yfov=0.8, width=480, height=270)
    truth = lx.reference(scene, camera, lx.DirectionalLight((0.3, -1, 0.2)))
    dark = np.count_nonzero((truth.triangle_id < 2) & (truth.visibility == 0))
    # 3,554 with the nearest texel, 6,434 where the card is solid.
    assert dark == 3630


def test_texels_are_where_the_standard_has_them(tmp_path):
    found = holes(loaded(tmp_path, card(textured(), sampler=NEAREST)))
    assert np.array_equal(found, of_texels(ALPHA))


@pytest.mark.parametrize(
    ("transform", "texels"),
    [
        ({"offset": [1 / 3, 0]}, np.roll(ALPHA, -1, axis=1)),
        ({"offset": [0, 0.5]}, np.roll(ALPHA, -1, axis=0)),
        ({"scale": [-1, 1]}, ALPHA[:, ::-1]),
        ({"rotation": np.pi}, ALPHA[::-1, ::-1]),
        # (u, v) shows what stands at (v, -u).
        ({"rotation": np.pi / 2, "scale": [0.5, 1 / 3]}, None),
    ],
)
def test_textures_are_moved(tmp_path, transform, texels):
    info = {"extensions": {"KHR_texture_transform": transform}}
    found = holes(loaded(tmp_path, card(textured(**info), sampler=NEAREST)))
    if texels is None:
        y, x = (np.mgrid[0:6, 0:6] + 0.5) / 6
        u, v = y / 3 % 1, -x / 2 % 1
        expected = ALPHA[(v * 2).astype(int), (u * 3).astype(int)] == 0
    else:
        expected = of_texels(texels)
    assert np.array_equal(found, expected)


def test_another_set_of_coordinates_is_taken(tmp_path):
    mirrored = UV * [-1, 1] + [1, 0]
    attributes = {"TEXCOORD_1": mirrored.astype(np.float32)}
    for info in (
        {"texCoord": 1},
        {"extensions": {"KHR_texture_transform": {"texCoord": 1}}},
    ):
        file = card(textured(**info), sampler=NEAREST, **attributes)
        assert np.array_equal(holes(loaded(tmp_path, file)), of_texels(ALPHA[:, ::-1]))


@pytest.mark.parametrize(
    ("code", "texels"), [(10497, [1, 0]), (33648, [0, 1]), (33071, [0, 0])], ids=str
)
def test_wraps_are_those_of_the_sampler(tmp_path, code, texels):
    """One row of two texels, the first one solid, seen from u = 1 to u = 2."""
    alpha = np.array([[255, 0]], np.uint8)
    info = {"extensions": {"KHR_texture_transform": {"offset": [1, 0]}}}
    sampler = {**NEAREST, "wrapS": code, "wrapT": 10497}
    found = holes(loaded(tmp_path, card(textured(**info), png(alpha), sampler=sampler)))
    assert np.array_equal(found, np.kron([texels], np.ones((6, 3))) == 0)


def test_factors_of_alpha_count(tmp_path):
    whole = png(np.full((1, 1), 200, np.uint8))
    material = textured()
    assert not holes(loaded(tmp_path, card(material, whole))).any()
    material["pbrMetallicRoughness"] |= {"baseColorFactor": [1, 1, 1, 0.6]}
    assert holes(loaded(tmp_path, card(material, whole))).all()
    material["alphaCutoff"] = 0.4
    assert not holes(loaded(tmp_path, card(material, whole))).any()
    # Of vertices, without an image: solid on the left.
    colors = np.array([[1, 1, 1, 1], [1, 1, 1, 0], [1, 1, 1, 0], [1, 1, 1, 1]], np.float32)
    found = holes(loaded(tmp_path, card({"alphaMode": "MASK"}, COLOR_0=colors)))
    assert np.array_equal(found, np.tile([False] * 3 + [True] * 3, (6, 1)))


def test_blending_is_taken_for_a_mask_and_named(tmp_path):
    material = {**textured(), "alphaMode": "BLEND", "name": "glass"}
    scene = loaded(tmp_path, card(material, sampler=NEAREST))
    assert np.array_equal(holes(scene), of_texels(ALPHA))
    assert "half transparency of material 'glass'" in scene.unsupported[0]
    assert not holes(loaded(tmp_path, card({**material, "alphaMode": "OPAQUE"}))).any()


@pytest.mark.parametrize(
    "image",
    [b"no picture at all", png(ALPHA)[:60], b"", png(ALPHA, "x" * (1 << 21))],
    ids=["text", "cut off", "empty", "too many words"],
)
def test_an_image_that_cannot_be_read_is_named(tmp_path, image):
    scene = loaded(tmp_path, card(textured(), image))
    assert scene.masked_count == 0
    assert "holes of material 0: image 0 cannot be read" in scene.unsupported[0]


def test_an_image_that_is_not_there_is_named(tmp_path):
    file = card(textured())
    file.tree["images"] = [{"uri": "leaf.png"}]
    assert "holes of material 0: it refers to 'leaf.png'" in loaded(tmp_path, file).unsupported[0]


def test_a_broken_material_is_named_alike_at_every_node(tmp_path):
    file = card(textured())
    file.tree["textures"] = []
    file.node(mesh=0)
    why = r"it refers to textures\[0\]"
    with pytest.raises(ValueError, match=f"'node 0': {why}.*'node 1': {why}"):
        loaded(tmp_path, file)


@pytest.mark.parametrize("side", [12_000, 60_000])
def test_a_bomb_is_refused_before_it_is_decoded(tmp_path, side):
    def chunk(kind: bytes, content: bytes) -> bytes:
        checked = kind + content
        return struct.pack(">I", len(content)) + checked + struct.pack(">I", zlib.crc32(checked))

    header = struct.pack(">2I5B", side, side, 8, 6, 0, 0, 0)
    bomb = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")
    with pytest.raises(ValueError, match="alpha images must have at most 134217728 texels"):
        loaded(tmp_path, card(textured(), bomb))


# --- OBJ ---


def obj_card(folder: Path, material: str, image: bytes | None = None, faces: str = "") -> lx.Scene:
    """The square with a material, and what its warning names."""
    rows = [f"v {x} {y} {z}" for x, y, z in POSITIONS.astype(int)]
    # OBJ counts v from below, and a texture coordinate need not belong to one vertex.
    rows += [f"vt {u} {1 - v}" for u, v in UV.astype(int)[[1, 2, 3, 0]]]
    faces = faces or "f 1/4 2/1 3/2 4/3"
    (folder / "card.obj").write_text("\n".join(["mtllib my card.mtl", *rows, "usemtl leaf", faces]))
    (folder / "my card.mtl").write_text(f"# made\nnewmtl other\nd 0\nnewmtl leaf\n{material}\n")
    (folder / "the leaf.png").write_bytes(png(ALPHA) if image is None else image)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return lx.load(folder / "card.obj")


def grey(values: np.ndarray) -> bytes:
    content = io.BytesIO()
    Image.fromarray(values).save(content, "PNG")
    return content.getvalue()


BLOCKS = np.kron(ALPHA, np.ones((40, 40), np.uint8))
FRAMED = np.pad(ALPHA, ((1, 2), (1, 1)))


@pytest.mark.parametrize(
    ("material", "image", "texels"),
    [
        ("map_d the leaf.png", png(BLOCKS), ALPHA),
        ("map_d  the leaf.png", grey(BLOCKS), ALPHA),
        ("map_d the leaf.png", grey(BLOCKS.astype(np.uint16) * 257), ALPHA),
        ("map_d -imfchan m the leaf.png", grey(BLOCKS), ALPHA | 1),
        ("map_d -blendu on -s -1 1 1 the leaf.png", png(BLOCKS), ALPHA[:, ::-1]),
        ("map_d -o 0 0.5 the leaf.png", png(BLOCKS), ALPHA[::-1]),
        (
            "map_d -clamp on -s 2 the leaf.png",
            png(np.kron(FRAMED, np.ones((40, 40), np.uint8))),
            None,
        ),
        (
            "map_d -s 2 2 -o 0.4 0.4 1 -clamp off the leaf.png",
            png(np.kron(FRAMED, np.ones((40, 40), np.uint8))),
            None,
        ),
        ("Tr 0.4\nmap_d the leaf.png", png(BLOCKS), ALPHA),
        ("Tr 0.6\nmap_d the leaf.png", png(BLOCKS), 0 * ALPHA),
        ("Tr 0.6\nd 0.9\nmap_d the leaf.png", png(BLOCKS), ALPHA),
        ("d 0.4", b"", 0 * ALPHA),
        ("d 0.6", b"", ALPHA | 1),
        ("", b"", ALPHA | 1),
    ],
    ids=range(14),
)
def test_alpha_of_obj_materials(tmp_path, material, image, texels):
    found = holes(obj_card(tmp_path, material, image))
    if texels is None:
        # As the format has it: scaled, moved, v from below.
        y, x = (np.mgrid[0:6, 0:6] + 0.5) / 6
        if "clamp on" in material:
            u, v = np.minimum(2 * x, 0.999), 1 - y
        else:
            u, v = (2 * x + 0.4) % 1, (2 * (1 - y) + 0.4) % 1
        expected = FRAMED[((1 - v) * 5).astype(int), (u * 5).astype(int)] == 0
    else:
        expected = of_texels(texels)
    assert np.array_equal(found, expected)


def test_texture_coordinates_of_obj_may_count_back_or_be_missing(tmp_path):
    material = "map_d the leaf.png"
    for faces in ("f -4/-1 -3/-4 -2/-3 -1/-2", "f 1/4/1 2/1/1 3/2/1\nf 1/4 3/2 4/3"):
        assert np.array_equal(
            holes(obj_card(tmp_path, material, png(BLOCKS), faces)), of_texels(ALPHA)
        )
    # Every point shows one texel: the corner below, on the left.
    assert not holes(obj_card(tmp_path, material, png(BLOCKS), "f 1 2 3 4")).any()
    scene = obj_card(tmp_path, material, png(BLOCKS), "f 1/4 2/9 3/2 4/3")
    assert "texture coordinates that are no numbers or not in the file" in scene.unsupported


@pytest.mark.parametrize(
    ("material", "image", "words"),
    [
        ("map_d leaf.png", None, "holes of material 'leaf': it refers to 'leaf.png', and there is"),
        ("map_d ../leaf.png", None, "'leaf': it refers to '../leaf.png', outside its own folder"),
        ("map_d C:\\t\\leaf.png", None, "a URL or an absolute path"),
        ("map_d the leaf.png", b"nothing", "material 'leaf': 'the leaf.png' cannot be read"),
        ("map_d -mm 0.2 0.5 the leaf.png", None, "a change of its values (-mm) of the alpha image"),
        ("d nearly 1,5", None, "a line of materials that is no number: 'nearly 1,5'"),
        ("d 0.2", None, "half transparency of material 'leaf', taken for holes below 0.5"),
    ],
    ids=range(7),
)
def test_what_is_not_taken_of_obj_materials_is_named(tmp_path, material, image, words):
    found = obj_card(tmp_path, material, image).unsupported
    assert any(words in word for word in found), found


def test_missing_materials_of_obj_are_named(tmp_path):
    obj_card(tmp_path, "")
    (tmp_path / "my card.mtl").unlink()
    with pytest.warns(UserWarning, match="holes by the materials of 'my': it refers to 'my'"):
        lx.load(tmp_path / "card.obj")


def test_textures_of_trimesh_have_holes():
    image = Image.open(io.BytesIO(png(np.kron(ALPHA, np.ones((40, 40), np.uint8)))))
    faces = [[0, 1, 2], [0, 2, 3]]
    # trimesh counts v from below.
    uv = UV * [1, -1] + [0, 1]
    for material, is_masked in [
        (trimesh.visual.material.SimpleMaterial(image=image), True),
        (trimesh.visual.material.PBRMaterial(baseColorTexture=image, alphaMode="MASK"), True),
        (trimesh.visual.material.PBRMaterial(baseColorTexture=image, alphaMode="BLEND"), True),
        (trimesh.visual.material.PBRMaterial(baseColorTexture=image), False),
    ]:
        visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
        mesh = trimesh.Trimesh(POSITIONS, faces, visual=visual, process=False)
        for whole in (mesh, trimesh.Scene([mesh])):
            found = holes(lx.Scene.from_trimesh(whole))
            assert np.array_equal(found, of_texels(ALPHA) & is_masked)
