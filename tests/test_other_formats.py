"""OFF, COLLADA, 3MF and what else trimesh reads; files from strangers in them."""

from __future__ import annotations

import io
import zipfile

import pytest
import trimesh
from gltf_files import area

import lixel as lx

L_SHAPE = [[3, 0, 1], [1, 0, 1], [1, 0, 3], [0, 0, 3], [0, 0, 0], [3, 0, 0]]
ROWS = "\n".join(" ".join(map(str, point)) for point in L_SHAPE)


def written(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


# --- OFF ---


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n6 1 0\n{ROWS}\n6 0 1 2 3 4 5\n",
        f" \t OFF6 1 0 # so\n{ROWS}\n6 0 1 2 3 4 5 255 0 0 # red\n",
        f"\ufeff# made by hand\nOFF # so\n\n6 1\n{ROWS}\n\n6 0 1 2 3 4 5",
        "COFF\n6 1 0\n" + ROWS.replace("\n", " 255 0 0 255\n") + " 0 0 0 1\n6 0 1 2 3 4 5\n",
        "STCNOFF\n6 1 0\n" + ROWS.replace("\n", " 0 1 0 .5 .5\n") + " 0 1 0 1 1\n6 0 1 2 3 4 5\n",
    ],
    ids=range(5),
)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_off(text, end, tmp_path):
    scene = lx.load(written(tmp_path / "l.off", text.replace("\n", end)))
    assert scene.triangle_count == 4
    assert area(scene) == pytest.approx(5)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f"OFF\n6 2 0\n{ROWS}\n6 0 1 2 3 4 5\n", "cut off: it promises 6 vertices and 2 faces"),
        (f"OFF\n99999999999 1 0\n{ROWS}\n", "cut off: it promises 99999999999 vertices"),
        (f"OFF\n6 1 0\n{ROWS}\n6 0 1 2 3 4 6\n", "face 0 must be 6 indices below 6"),
        (f"OFF\n6 1 0\n{ROWS}\n6 0 1 2 3 4\n", "face 0 must be 6 indices below 6"),
        (f"OFF\n6 1 0\n{ROWS}\n3 0 1 -2\n", "face 0 must be 3 indices below 6"),
        (
            "OFF\n1 0 0\n0 0\n",
            "vertex 0, counted from 0, must have three numbers, got '0 0'; export",
        ),
        ("4OFF\n1 0 0\n0 0 0 1\n", "not in three dimensions"),
        ("OFF BINARY\n\0\0\0", "it is no text"),
        ("OFF\n", "ends after its first word"),
        ("solid", "does not start with the word OFF"),
    ],
    ids=range(10),
)
def test_off_that_is_wrong_is_refused(text, words, tmp_path):
    with pytest.raises(ValueError, match=f"bad.off.*{words}"):
        lx.load(written(tmp_path / "bad.off", text))


# --- COLLADA ---

DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><up_axis>{up}</up_axis></asset>
<library_geometries><geometry id="g" name="roof"><mesh>
<source id="s"><float_array id="a" count="18">{points}</float_array><technique_common>
<accessor source="#a" count="6" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/>
<vcount>6</vcount><p>0 1 2 3 4 {last}</p></polylist>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_nodes>{nodes}</library_nodes>
<library_visual_scenes><visual_scene id="scene"><node><translate>0 10 0</translate>
{instance}</node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene></COLLADA>"""

GEOMETRY = '<instance_geometry url="#g"/>'


def dae(up="Y_UP", last=5, nodes="", instance=GEOMETRY):
    points = " ".join(str(c) for point in L_SHAPE for c in point)
    return DAE.format(up=up, last=last, nodes=nodes, instance=instance, points=points)


def test_dae_polygons_stand_where_their_node_is(tmp_path):
    scene = lx.load(written(tmp_path / "l.dae", dae()))
    assert scene.triangle_count == 5
    assert area(scene) == pytest.approx(5 + 2)
    assert scene.bounds.tolist() == [[0, 10, 0], [3, 10, 3]]


@pytest.mark.parametrize("up", ["y", "z"])
def test_dae_says_which_axis_is_up(up, tmp_path):
    scene = lx.load(written(tmp_path / "l.dae", dae(up="Z_UP")), up=up)
    assert scene.bounds.tolist() == [[0, 0, -10], [3, 3, -10]]


def test_dae_that_is_wrong_is_refused(tmp_path):
    entity = dae().replace("<COLLADA", '<!DOCTYPE x [<!ENTITY a "b">]><COLLADA', 1)
    for content in (entity, entity.encode("utf-16")):
        with pytest.raises(ValueError, match="its XML defines entities, which are not read"):
            lx.load(written(tmp_path / "bad.dae", content))
    levels = "".join(
        f'<node id="n{i}">{10 * INSTANCE.format(i + 1)}</node>' for i in range(9)
    )  # 10^9 copies
    bomb = dae(nodes=levels + f'<node id="n9">{GEOMETRY}</node>', instance=INSTANCE.format(0))
    with pytest.raises(ValueError, match=r"bad.dae.*refer to one another"):
        lx.load(written(tmp_path / "bad.dae", bomb))
    with pytest.raises(ValueError, match=r"path must be a .dae file with triangles"):
        lx.load(written(tmp_path / "bad.dae", dae()[:900]))
    with pytest.raises(ValueError, match=r"has none that can be read: .*maxindex=6"):
        lx.load(written(tmp_path / "bad.dae", dae(last=6)))


INSTANCE = '<instance_node url="#n{}"/>'


# --- 3MF ---


def archive(**files):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as made:
        for name, text in files.items():
            made.writestr("3D/3dmodel.model" if name == "model" else name, text)
    return content.getvalue()


def test_3mf(tmp_path):
    scene = trimesh.Scene()
    box = trimesh.creation.box((1, 2, 3))
    scene.add_geometry(box)
    scene.add_geometry(box, transform=trimesh.transformations.translation_matrix((5, 0, 0)))
    found = lx.load(written(tmp_path / "two.3mf", scene.export(file_type="3mf")), up="z")
    assert found.triangle_count == 24
    assert found.bounds.tolist() == [[-0.5, -1.5, -1], [5.5, 1.5, 1]]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (archive(model=b"<!DOCTYPE a [<!ENTITY b 'c'>]><model/>"), "its XML defines entities"),
        (archive(model=bytes(1 << 28) + b"<model/>"), "it unpacks to 268,435,464 bytes"),
        (archive(model="<model>" + "".join(
            f'<object id="{i}">' + 10 * f'<component objectid="{i + 1}"/>' + "</object>"
            for i in range(12)) + "</model>"), "more than 1,048,576 copies"),
        (archive(model='<object id="1"><component objectid="2"/></object>'
                       '<object id="2"><component objectid="1"/></object>'), "in a circle"),
        (archive(other="nothing"), "path must be a .3mf file with triangles"),
        (b"no archive", "path must be a .3mf file with triangles"),
    ],
    ids=range(6),
)  # fmt: skip
def test_3mf_that_is_wrong_is_refused(content, words, tmp_path):
    with pytest.raises(ValueError, match=words):
        lx.load(written(tmp_path / "bad.3mf", content))


def test_a_missing_package_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(__import__("sys").modules, "collada", None)
    with pytest.raises(ValueError, match=r"pip install 'lixel\[formats\]'"):
        lx.load(written(tmp_path / "l.dae", dae()))
    monkeypatch.setattr(trimesh, "available_formats", lambda: set())
    with pytest.raises(ValueError, match=r"pip install 'lixel\[formats\]'"):
        lx.load(written(tmp_path / "l.3mf", b""))
