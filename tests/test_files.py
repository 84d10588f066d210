"""Files as programs write them: the triangles are those of the file, or it is refused by name."""

from __future__ import annotations

import math
import struct
import warnings

import numpy as np
import pytest
from gltf_files import CASES, area
from hypothesis import given, settings, strategies as st

import lixel as lx

# Triangles and area, counted by hand.
TRIANGLES = {
    "camera_orthographic.gltf": (14, 106),
    "camera_znear_zero.gltf": (14, 106),
    "hidden_node.gltf": (2, 100),
    "masked_leaf.glb": (4, 160),
    "morph_mesh_weight_1.gltf": (14, 106),
    "obj_concave_L.obj": (4, 5),
    "obj_continuation.obj": (2, 1),
    "obj_latin1_name.obj": (2, 1),
    "obj_neg_blocks.obj": (4, 2),
    "obj_quad_vtvn_hexagon_vn.obj": (6, 13),
    "obj_tab_f_last.obj": (2, 1),
    "obj_trailing_comment_f.obj": (2, 1),
    "obj_utf8_bom.obj": (2, 1),
    "ply_bin_mixed_blender.ply": (3, 7.5),
    "ply_bin_tristrips.ply": (1, 2),
    "primitive_without_position.gltf": (14, 106),
    "skin_outside_armature.gltf": (14, 106),
    "spot_inner_equals_outer.gltf": (14, 106),
    "spot_outer_float32_half_pi.gltf": (14, 106),
    "stl_bin_trailing.stl": (2, 1),
    "stl_cr.stl": (1, 0.5),
    "stl_name_has_vertex.stl": (1, 0.5),
    "stl_second_without_end.stl": (2, 1),
    "sun_under_zero_scale.gltf": (14, 106),
    "uri_space in name.gltf": (14, 106),
}

REFUSED = {
    "gltf1.gltf": "it is glTF 1.0, and only glTF 2 is read",
    "ply_ascii_truncated.ply": "it is cut off: row 3 of 7 of 'face'",
}


def loaded(path):
    """A scene, and what its warning names."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = lx.load(path)
    assert len(caught) == bool(scene.unsupported)
    return scene


def test_every_case_is_known():
    names = {path.name for path in CASES.iterdir() if path.suffix != ".bin"}
    assert names == {*TRIANGLES, *REFUSED}


@pytest.mark.parametrize("name", TRIANGLES)
def test_cases_have_their_triangles(name):
    scene = loaded(CASES / name)
    count, expected = TRIANGLES[name]
    assert scene.triangle_count == count
    assert area(scene) == pytest.approx(expected)


@pytest.mark.parametrize("name", REFUSED)
def test_cases_are_refused_in_words(name):
    with pytest.raises(ValueError, match=f"{name}.*{REFUSED[name]}"):
        lx.load(CASES / name)


def test_a_notch_is_not_covered():
    corners = loaded(CASES / "obj_concave_L.obj").vertices[:, [0, 2]]
    faces = loaded(CASES / "obj_concave_L.obj").faces
    assert not any(inside((2, 2), corners[face]) for face in faces)
    assert sum(inside((0.4, 2.1), corners[face]) for face in faces) == 1


def inside(point, triangle):
    turns = [np.linalg.det([b - a, point - a]) for a, b in zip(triangle, np.roll(triangle, -1, 0))]  # noqa: B905
    return min(turns) > 0 or max(turns) < 0


# --- Polygons, in OBJ files as they are found ---


@st.composite
def polygons(draw):
    """Corners around a point, so that the area is known, on any plane, from any corner."""
    count = draw(st.integers(3, 12))
    radii = draw(st.lists(st.floats(0.2, 3.0), min_size=count, max_size=count))
    angles = 2 * math.pi * np.arange(count) / count
    flat = np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1) * np.array(radii)[:, None]
    turn, _ = np.linalg.qr(np.random.default_rng(draw(st.integers(0, 99))).normal(size=(3, 3)))
    x, y, _ = np.roll(flat, draw(st.integers(0, count)), axis=0).T
    size = abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2
    return np.stack([x, y, 0 * x], 1) @ turn.T, size


@settings(deadline=None, max_examples=40)
@given(
    shapes=st.lists(polygons(), min_size=1, max_size=4),
    relative=st.booleans(),
    comments=st.sampled_from(["", " # it's \\", "\t#"]),
    continued=st.sampled_from([" ", "\t", " \\\n ", "\\\n"]),
    corner=st.sampled_from(["{0}", "{0}/{0}", "{0}//{0}", "{0}/{0}/{0}"]),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"]),
)
def test_obj_in_every_style(
    shapes, relative, comments, continued, corner, end, encoding, tmp_path_factory
):
    lines, count = ["# C:\\models\\", "mtllib größe.mtl\\", "o Körper #1"], 0
    for points, _ in shapes:
        lines += [f"v {x!r}\t{y!r} {z!r}{comments}" for x, y, z in points.tolist()]
        count += len(points)
        lines += ["vt 0 0", "vn 0 1 0", "usemtl a#b"] * len(points)
        indices = np.arange(-len(points), 0) + (0 if relative else count + 1)
        words = [corner.format(i) for i in indices]
        lines.append("f" + "\t" + continued.join(words) + comments)
    path = tmp_path_factory.mktemp("obj") / "scene.obj"
    path.write_bytes("\n".join(lines).replace("\n", end).encode(encoding))
    scene = loaded(path)
    assert scene.triangle_count == sum(len(points) - 2 for points, _ in shapes)
    assert area(scene) == pytest.approx(sum(size for _, size in shapes), rel=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "v 0 0 0\nv 1 0\n",
            "line 2: v must be followed by three numbers, got 'v 1 0'; mend that line",
        ),
        ("v 0 0 0\nv 1,5 0 0\n", "line 2: v must be followed by three numbers"),
        ("v 0 0 0\n\nf 1 2 3\n", "line 3: f refers to vertex 2, and the file has 1"),
        ("v 0 0 0\nf -1 -2 -1\nv 0 0 1", "line 2: f refers to vertex -2, .* 1 of them before"),
        ("v 0 0 0\nf 1 0 1\n", "line 2: f refers to vertex 0"),
        ("v 0 0 0\nf 1 a 1\n", "line 2: f must be followed by indices of vertices"),
        ("v 0 0 0\nf 99999999999999999999 1 1\n", "path must be a .obj file"),
        (
            "v 0 0 0\nl 1 1\n",
            "at least one triangle, and has none that can be read: points and lines",
        ),
        ("v 0 0 nan\nf 1 1 1\n", "finite"),
        ("<html>", "has none; export its surfaces, too$"),
    ],
)
def test_obj_that_is_wrong_is_refused_with_its_line(text, words, tmp_path):
    path = tmp_path / "bad.obj"
    path.write_text(text)
    with pytest.raises(ValueError, match=words):
        lx.load(path)


def test_a_bent_polygon_keeps_all_of_its_corners(tmp_path):
    path = tmp_path / "bent.obj"
    path.write_text("v -5 0 5\nv 5 0 5\nv 5 0 -5\nv -5 0 -5\nv 0 5 -5\nf 1// 2// 3// 4// 5//\n")
    scene = loaded(path)
    assert scene.triangle_count == 3
    assert len(np.unique(scene.faces)) == 5


# --- PLY ---

SQUARE = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [-2, 1, 0]], dtype=float)


def ply(layout, rows, *, declared=None, kinds=("uchar", "int"), element="face", end="\n"):
    """A PLY file with the five points, and some rows of indices."""
    header = f"""ply\nformat {layout} 1.0\ncomment made by a test\nobj_info 3 4
element vertex 5\nproperty uchar flags\nproperty double x\nproperty double y\nproperty double z
element {element} {len(rows) if declared is None else declared}
property float quality\nproperty list {kinds[0]} {kinds[1]} vertex_index
property list uchar uchar rest
element edge 1\nproperty int vertex1\nend_header\n""".replace("\n", end).encode()
    if layout == "ascii":
        lines = [f"7 {x} {y} {z}" for x, y, z in SQUARE]
        lines += [f"0.5 {len(row)} {' '.join(map(str, row))} 2 8 9" for row in rows]
        return header + "\n".join([*lines, "3", ""]).replace("\n", end).encode()
    order = "<" if "little" in layout else ">"
    codes = {"uchar": "B", "char": "b", "int": "i", "uint": "I", "ushort": "H"}
    body = b"".join(struct.pack(order + "B3d", 10, *point) for point in SQUARE)
    for row in rows:
        pattern = f"{order}f{codes[kinds[0]]}{len(row)}{codes[kinds[1]]}3B"
        body += struct.pack(pattern, 0.5, len(row), *row, 2, 8, 9)
    return header + body + struct.pack(order + "i", 3)


LAYOUTS = ["ascii", "binary_little_endian", "binary_big_endian"]


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize(
    ("rows", "kinds", "triangles", "size"),
    [
        ([[0, 1, 2], [0, 2, 3]], ("uchar", "int"), 2, 4),
        ([[0, 1, 2, 3]], ("int", "uint"), 2, 4),
        ([[0, 1, 2], [0, 1, 2, 3], [0, 1, 2, 3, 4]], ("char", "ushort"), 6, 2 + 4 + 6),
    ],
)
def test_ply_of_every_layout(layout, end, rows, kinds, triangles, size, tmp_path):
    path = tmp_path / "scene.ply"
    path.write_bytes(ply(layout, rows, kinds=kinds, end=end))
    scene = loaded(path)
    assert scene.triangle_count == triangles
    assert area(scene) == pytest.approx(size)
    assert np.array_equal(scene.vertices, SQUARE)


def test_ply_lines_may_hold_more_than_is_declared(tmp_path):
    path = tmp_path / "more.ply"
    text = ply("ascii", [[0, 1, 2], [0, 1, 2, 3]]).replace(b" 2 8 9\n", b" 2 8 9 1 1 1\n")
    path.write_bytes(text)
    assert loaded(path).triangle_count == 3
    # And a row may take more lines than one.
    path.write_bytes(ply("ascii", [[0, 1, 2], [0, 1, 2, 3]]).replace(b" 2 8 9\n", b"\n2\n8 9\n"))
    assert loaded(path).triangle_count == 3


@pytest.mark.parametrize("layout", LAYOUTS)
def test_ply_strips_begin_anew(layout, tmp_path):
    rows = [[0, 1, 3, 2, -1, 0, 3, 4], [1, 2], [-1, 0, 1, 2]]
    path = tmp_path / "strips.ply"
    path.write_bytes(ply(layout, rows, kinds=("int", "int"), element="tristrips"))
    scene = loaded(path)
    assert sorted(map(sorted, scene.faces.tolist())) == [[0, 1, 2], [0, 1, 3], [0, 3, 4], [1, 2, 3]]
    normals = np.cross(
        *(scene.vertices[scene.faces[:, i]] - scene.vertices[scene.faces[:, 0]] for i in (1, 2))
    )
    assert (normals[:, 2] > 0).all()


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: c[:-12], "cut off"),
        (lambda c: c.replace(b"face 2", b"face 20000000000"), "cut off: it promises 20000000000"),
        (lambda c: c.replace(b"vertex 5", b"vertex 99999999"), "cut off: it promises 99999999"),
        (lambda c: c.replace(b"vertex 5", b"vertex -5"), "a line that cannot be understood"),
        (lambda c: c.replace(b"property double y", b"property double w"), "no vertices with x, y"),
        (lambda c: c.replace(b"end_header", b"end of it"), "no PLY header"),
        (lambda c: c.replace(b"vertex 5", b"vertex 5\nMade by me"), "line .* 'Made by me'; exp"),
        (lambda c: c.replace(b"face 2", b"face 0").replace(b"edge 1", b"edge 0"), "a cloud of 5"),
    ],
)  # fmt: skip
def test_ply_that_is_wrong_is_refused(layout, change, words, tmp_path):
    path = tmp_path / "bad.ply"
    path.write_bytes(change(ply(layout, [[0, 1, 2], [0, 2, 3]])))
    with pytest.raises(ValueError, match=f"bad.ply.*{words}"):
        lx.load(path)


def test_ply_of_old_blender_has_a_line_without_its_word(tmp_path):
    path = tmp_path / "old.ply"
    path.write_bytes(ply("ascii", [[0, 1, 2]]).replace(b"comment made", b"Created by Blender3D"))
    assert loaded(path).triangle_count == 1


def test_ply_with_a_word_among_its_numbers_names_the_row(tmp_path):
    path = tmp_path / "bad.ply"
    path.write_bytes(ply("ascii", [[0, 1, 2]]).replace(b"7 2.0 2.0 0.0", b"7 2.0 two 0.0"))
    with pytest.raises(
        ValueError, match=r"row 2 after .* is no number: '7 2.0 two 0.0'; export it"
    ):
        lx.load(path)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_ply_with_an_index_beyond_its_vertices_names_the_row(layout, tmp_path):
    path = tmp_path / "bad.ply"
    path.write_bytes(ply(layout, [[0, 1, 2], [0, 5, 3]]))
    with pytest.raises(ValueError, match="row 1 of 'face', counted from 0, has index 5"):
        lx.load(path)


# --- Axes ---


@pytest.mark.parametrize("name", ["obj_concave_L.obj", "spot_inner_equals_outer.gltf"])
def test_up_turns_all_of_a_scene(name):
    scene, turned = lx.load(CASES / name), lx.load(CASES / name, up="z")
    x, y, z = scene.vertices.T
    assert np.array_equal(turned.vertices, np.stack([x, z, -y], 1))
    for light, other in zip(scene.lights.values(), turned.lights.values(), strict=True):
        for old, new in ((light.position, other.position), (light.direction, other.direction)):
            assert np.allclose(new, (old[0], old[2], -old[1]))
    with pytest.raises(ValueError, match="up must be 'y' or 'z', got 'x'"):
        lx.load(CASES / name, up="x")


# --- STL ---

FACET = """facet normal 0 0 1
 outer loop
  vertex {z} 0 0
  vertex 1e0 0 0
  vertex 0 +1.0 0
endloop\nendfacet\n"""


def binary_stl(header, triangles, declared=None, more=b""):
    body = b"".join(struct.pack("<12fH", *[0] * 3, *np.ravel(t), 0xFFFF) for t in triangles)
    count = len(triangles) if declared is None else declared
    return header.ljust(80, b"\0") + struct.pack("<I", count) + body + more


TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("content", "triangles"),
    [
        (binary_stl(b"solid facet vertex", [TRIANGLE] * 3), 3),
        (binary_stl(b"solid named so", [TRIANGLE] * 3, more=b"COLOR=" + bytes(7)), 3),
        (binary_stl(b"\xff\xfe\r\n", [TRIANGLE] * 2), 2),
        (("SOLID x y\n" + FACET.upper().replace("{Z}", "0") + "ENDSOLID\n").encode(), 1),
        ("\ufeffsolid\r\n" + FACET.format(z=0).replace("\n", "\r\n"), 1),
        ("solid a facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop "
         "endfacet endsolid a", 1),
        ("solid vertex 1 2 3\n" + 2 * FACET.format(z=0) + "endsolid facet normal\n" + "solid b\n"
         + FACET.format(z=0) + "endsolid", 3),
        ("solid quad\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex .5 0 0\nvertex .5 1 0\n"
         "vertex 0 1 0\nendloop\nendfacet\nendsolid", 2),
    ],
    ids=range(8),
)  # fmt: skip
def test_stl_as_programs_write_it(content, triangles, tmp_path):
    path = tmp_path / "part.stl"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    scene = loaded(path)
    assert scene.triangle_count == triangles
    assert area(scene) == pytest.approx(
        0.5 * (1 if triangles == 2 and b"quad" in path.read_bytes() else triangles)
    )


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (binary_stl(b"x", [TRIANGLE] * 3)[:-1], "it promises 3 triangles, and has 2"),
        (binary_stl(b"x", [TRIANGLE], declared=0xFFFFFFFF), "promises 4294967295 triangles"),
        (b"x" * 50, "cut off: a binary STL file starts with 84 bytes"),
        (("solid a\n" + (2 * FACET.format(z=0))[:-30]).encode(), "'a' begins 2 facets and ends 1"),
        (("solid a\n" + FACET.format(z="x")).encode(), "a vertex of solid 'a' is no number"),
        (("solid a\n" + FACET.format(z="nan")).encode(), "a vertex of facet 0, .* is not finite"),
        (b"solid empty\nendsolid empty\n", "at least one triangle"),
    ],
    ids=range(7),
)  # fmt: skip
def test_stl_that_is_wrong_is_refused(content, words, tmp_path):
    path = tmp_path / "bad.stl"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=f"bad.stl.*{words}"):
        lx.load(path)
