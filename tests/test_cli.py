"""The command line: what its arguments mean, what it writes, and its errors in one line."""

import importlib.metadata
import json
import math
import re
import shlex

import numpy as np
import pytest
from gltf_files import CASES, GltfFile

import lixel as lx
from lixel import cli
from lixel.default_view import DEFAULT_LIGHT, see_all
from lixel.lab import options, peers, report
from lixel.lab.result_tables import PROVENANCE, read

SMALL = ["--size", "96x64"]


def parsed_view(*arguments):
    return options.view_of(cli.parser().parse_args(cli._with_vectors_joined(arguments)))


@pytest.fixture
def views_file(tmp_path):
    path = tmp_path / "views.json"
    camera = {"eye": [1, 2, 3], "target": [0, 0, 0], "up": [0, 1, 0], "fov_y_deg": 60}
    lights = [
        {"kind": "area", "position": [0, 9, 0]},
        {"kind": "directional", "direction": [0, -2, 0]},
    ]
    entry = {"file": "plane_and_box", "cameras": [camera], "lights": lights}
    path.write_text(json.dumps([{"file": "other.glb"}, entry]))
    return str(path)


# --- Cameras and lights ---


def test_scene_brings_its_camera_and_light():
    scene, camera, light = parsed_view("render", "plane_and_box", "-o", "x.png")
    assert camera == scene.cameras["default"]
    assert light == scene.lights["default"]


@pytest.mark.parametrize("given", ["default", "0"])
def test_camera_and_light_go_by_name_or_index(given):
    scene, camera, light = parsed_view(
        "render", "plane_and_box", "--camera", given, "--light", given, *SMALL, "-o", "x.png"
    )
    assert camera == scene.cameras["default"].resized(96, 64)
    assert light == scene.lights["default"]


def test_camera_and_light_are_described():
    _, camera, light = parsed_view(
        *("render", "plane_and_box", *SMALL, "-o", "x.png"),
        *("--camera", "-1,2,5;0,1e-1,0;60deg", "--light", "-1,-2,0"),
    )
    expected = lx.Camera.look_at((-1, 2, 5), (0, 0.1, 0), yfov=math.pi / 3, width=96, height=64)
    assert camera.pose == pytest.approx(expected.pose)
    assert camera.focal == pytest.approx(expected.focal)
    assert light == lx.DirectionalLight((-1, -2, 0))


def test_camera_takes_radians_and_up():
    _, camera, _ = parsed_view(
        "render", "plane_and_box", "-o", "x.png", "--camera", "0,5,0;0,0,0;1;1,0,0"
    )
    assert camera.yfov == pytest.approx(1.0)
    assert camera.pose[:3, 1] == pytest.approx((1, 0, 0))


def test_views_replace_the_scenes_own(views_file):
    _, camera, light = parsed_view(
        "render", "plane_and_box", "-o", "x.png", "--views", views_file, "--light", "1"
    )
    assert camera.eye == pytest.approx((1, 2, 3))
    assert camera.yfov == pytest.approx(math.radians(60))
    assert light == lx.DirectionalLight((0, -1, 0))


def test_a_scene_without_camera_is_seen_whole():
    scene = lx.scenes.plane_and_box()
    camera = see_all(scene)
    low, high = scene.bounds
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    local = (corners - camera.eye) @ camera.pose[:3, :3]
    pixels = local[:, :2] * camera.focal / -local[:, 2:] * (1, -1) + camera.centre
    assert (local[:, 2] < 0).all()
    assert ((pixels > 0) & (pixels < (camera.width, camera.height))).all()


# --- Files whose cameras or lights cannot be used ---


@pytest.mark.parametrize(
    ("name", "given", "words"),
    [
        ("camera_znear_zero.gltf", [], "--camera must say .*'camera': znear and zfar must"),
        ("camera_znear_zero.gltf", ["--camera", "0"], "camera must be described: .*znear"),
        ("sun_under_zero_scale.gltf", [], "--light must say .*'light': its node is scaled"),
        ("sun_under_zero_scale.gltf", ["--light", "light"], "got 'light'; .*scaled to nothing"),
    ],
)
def test_another_view_than_that_of_the_file_is_never_drawn(name, given, words, tmp_path, capsys):
    picture = tmp_path / "x.png"
    assert cli.main(["render", str(CASES / name), *given, "-o", str(picture)]) == 2
    warning, error = capsys.readouterr().err.splitlines()
    assert warning.startswith(f"lixel: warning: {name} is read without ")
    assert re.search(f"^lixel: error: .*{words}", error)
    assert not picture.exists()


def test_an_index_does_not_count_past_what_cannot_be_used(tmp_path):
    file = GltfFile()
    mesh = file.mesh({"attributes": {"POSITION": file.accessor(np.eye(3), "f4")}})
    for camera in ({"znear": -1, "yfov": 1}, {"znear": 1, "yfov": 1}):
        index = file.add("cameras", {"type": "perspective", "perspective": camera})
        file.node(mesh=mesh, camera=index, name="Eye")
    path = str(file.write(tmp_path / "eyes.gltf"))
    with pytest.warns(UserWarning, match="camera 'Eye': znear"):
        *_, light = parsed_view("render", path, "--camera", "Eye_1", "-o", "x.png")
    assert light == DEFAULT_LIGHT
    for asked in ("Eye", "0"):
        with (
            pytest.warns(UserWarning, match="znear"),
            pytest.raises(ValueError, match=f"camera must be one of Eye_1, by name, got '{asked}'"),
        ):
            parsed_view("render", path, "--camera", asked, "-o", "x.png")


def test_up_turns_a_file():
    path = str(CASES / "obj_concave_L.obj")
    scene, *_ = parsed_view("render", path, "--up", "z", "-o", "x.png")
    assert scene.bounds.tolist() == [[0, 0, 0], [3, 3, 0]]
    with pytest.raises(ValueError, match="--up z is for files"):
        parsed_view("render", "plane_and_box", "--up", "z", "-o", "x.png")


# --- Errors: one line, exit code 2 ---


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "COMMAND"),
        (["render", "plane_and_box"], "--output"),
        (
            ["render", "plane_and_box", "-o", "x.jpg"],
            "must end in .png, .npy, .npz or .exr",
        ),
        (["render", "nothing", "-o", "x.png"], "plane_and_box"),
        (["render", "missing.glb", "-o", "x.png"], "missing.glb"),
        (["render", "plane_and_box", "-o", "x.png", "--size", "9"], "WIDTHxHEIGHT"),
        (["render", "plane_and_box", "-o", "x.png", "--size", "0x9"], "width"),
        (["render", "plane_and_box", "-o", "x.png", "--method", "magic"], "desired_view"),
        (["render", "plane_and_box", "-o", "x.png", "--resolution", "0"], "resolution"),
        (["render", "plane_and_box", "-o", "x.png", "--set", "x=1"], "slope_bias"),
        (["render", "plane_and_box", "-o", "x.png", "--set", "x"], "NAME=VALUE"),
        (["render", "plane_and_box", "-o", "x.png", "--camera", "7"], "default"),
        (["render", "plane_and_box", "-o", "x.png", "--camera", "1;2"], "eye;target;yfov"),
        (["render", "plane_and_box", "-o", "x.png", "--camera", "1,2,3;0,0;1"], "x,y,z"),
        (["render", "plane_and_box", "-o", "x.png", "--camera", "1,2,3;0,0,0;wide"], "60deg"),
        (["render", "plane_and_box", "-o", "x.png", "--light", "1,2"], "x,y,z"),
        (["render", "plane_and_box", "-o", "x.png", "--light", "0,0,0"], "zero length"),
        (["render", "plane_and_box", "-o", "x.png", "--views", "missing.json"], "missing.json"),
        (["lab"], "EXPERIMENT"),
        (["lab", "study", "plane_and_box", "--repeats", "0"], "repeats"),
        (["lab", "peers", "plane_and_box", "--repeats", "0"], "repeats"),
        (["lab", "peers", "plane_and_box", "city"], "city"),
        (["lab", "peers", "plane_and_box", "-o", "table.txt"], "output"),
        (["lab", "study", "plane_and_box", "--set", "x=1"], "parameters must be among"),
    ],
)
def test_a_mistake_is_one_line(arguments, message, capfd):
    assert cli.main(arguments) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("lixel: error: ")
    assert err.count("\n") == 1
    assert message in err


@pytest.mark.parametrize("content", ["{", "[]", "3", '{"cameras": [{"eye": [0, 0, 1]}]}'])
def test_a_bad_file_of_views_is_one_line(content, tmp_path, capfd):
    path = tmp_path / "views.json"
    path.write_text(content)
    assert cli.main(["render", "plane_and_box", "-o", "x.png", "--views", str(path)]) == 2
    err = capfd.readouterr().err
    assert err.count("\n") == 1
    assert "views" in err


def test_a_light_of_another_kind_is_refused(views_file, capfd):
    arguments = ["render", "plane_and_box", "-o", "x.png", "--views", views_file, "--light", "0"]
    assert cli.main(arguments) == 2
    assert "light must be directional, point or spot, got 0, a area" in capfd.readouterr().err


def test_a_machine_without_a_device_is_one_line(monkeypatch, capfd):
    def refuse(*_):
        raise lx.DeviceError("no adapter:\ninstall a driver")

    monkeypatch.setattr(cli, "render", refuse)
    assert cli.main(["render", "plane_and_box", "-o", "x.png"]) == 2
    assert capfd.readouterr().err == "lixel: error: no adapter: install a driver\n"


# --- What the commands do ---


def test_version(capfd):
    with pytest.raises(SystemExit) as end:
        cli.main(["--version"])
    assert end.value.code == 0
    assert capfd.readouterr().out == f"lixel {lx.__version__}\n"


def test_render_writes_an_array_and_a_picture(tmp_path, capfd):
    array, picture = tmp_path / "a.npy", tmp_path / "a.png"
    for path in (array, picture):
        assert cli.main(["render", "plane_and_box", *SMALL, "-o", str(path)]) == 0
    visibility = np.load(array)
    assert visibility.shape == (64, 96)
    assert visibility.dtype == np.float32
    assert set(np.unique(visibility[~np.isnan(visibility)])) == {0.0, 1.0}
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert " ms" in capfd.readouterr().out


def test_render_takes_parameters(tmp_path):
    path = tmp_path / "a.npy"
    method = ["--method", "uniform", "--resolution", "256"]
    bias = ["--set", "bias=constant", "--set", "constant_bias=0.01"]
    assert cli.main(["render", "plane_and_box", *SMALL, "-o", str(path), *method, *bias]) == 0
    scene = lx.scenes.plane_and_box()
    expected = lx.render_shadows(
        scene,
        scene.cameras["default"].resized(96, 64),
        scene.lights["default"],
        lx.Uniform(resolution=256, bias="constant", constant_bias=0.01),
    )
    np.testing.assert_array_equal(np.load(path), expected)


def test_compare_evaluates_every_method_and_writes_pictures(tmp_path, capfd):
    arguments = ["compare", "plane_and_box", *SMALL, "--resolution", "64", "--resolution", "512"]
    assert cli.main([*arguments, "-o", str(tmp_path / "red")]) == 0
    table = capfd.readouterr().out.splitlines()
    assert table[0].split()[:2] == ["method", "resolution"]
    maps = (*lx.methods.MAP_METHODS, *lx.methods.PAGED_METHODS)
    names = [(name, n) for name in maps for n in ("64", "512")]
    assert [tuple(line.split()[:2]) for line in table[2:-1]] == names
    assert table[-1].startswith(f"on {lx.info().device['name']}, driver ")
    written = {path.name for path in (tmp_path / "red").iterdir()}
    assert written == {f"{name}-{n}.png" for name, n in names}


def test_info_names_the_device(capfd):
    assert cli.main(["info"]) == 0
    out = capfd.readouterr().out
    assert out.startswith(f"lixel {lx.__version__}\n")
    assert "in use" in out


def test_demo_writes_pictures_and_a_table(tmp_path, capfd):
    file = tmp_path / "demo.csv"
    arguments = ["demo", "--out", str(tmp_path), "--size", "96x64"]
    assert cli.main([*arguments, "-o", str(file)]) == 0
    rows = read(file)
    light = lx.DirectionalLight((0, -1, 0))
    methods = [name for name in lx.METHODS if lx.METHODS[name]().takes(light)]
    assert list(rows["method"][rows["light"] == "directional"]) == methods
    assert rows.attrs["command"] == shlex.join(
        ["lixel", "demo", "--out", tmp_path.name, "--size", "96x64", "-o", "demo.csv"]
    )
    assert set(rows.attrs) == set(PROVENANCE)
    assert (tmp_path / "shadows.png").is_file()
    directional = {path.stem for path in (tmp_path / "directional").iterdir()}
    assert {"desired_view-1024", "notw-1024", "exact", "ray_traced"} <= directional
    point = {path.stem for path in (tmp_path / "point").iterdir()}
    assert {"cube-1024", "cube+rtw-1024", "dual_paraboloid-1024", "ray_traced"} <= point
    assert "misclassified" in capfd.readouterr().out


def test_demo_refuses_another_ending_before_the_work(tmp_path, capfd):
    assert cli.main(["demo", "--out", str(tmp_path), "-o", "demo.txt"]) != 0
    assert "must end in .csv or .parquet, got 'demo.txt'" in capfd.readouterr().err
    assert not list(tmp_path.iterdir())


# OpenGL's wrapper complains of what it does at exit.
@pytest.mark.of_checkout("it compares with another renderer")
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_peers_that_are_installed_are_timed(view):
    scene, camera, light = view
    rows = peers.measure(scene, camera, light, lx.Uniform(), repeats=1)
    wrong = {row["renderer"]: row["misclassified"] for row in rows}
    assert all(row["frames"] == 1 for row in rows)
    assert wrong["embreex"] <= 2
    assert wrong["trimesh with embreex"] <= 2
    # A shadow map, filtered, without a bias that fits.
    assert 0 < wrong["pyrender"] < 0.1 * camera.width * camera.height


@pytest.mark.of_checkout("it compares with another renderer")
def test_peers_write_a_table(tmp_path, monkeypatch):
    monkeypatch.setattr(peers, "PEERS", {"embreex": peers.PEERS["embreex"]})
    output = tmp_path / "peers.csv"
    given = ["lab", "peers", "plane_and_box", *SMALL, "--repeats", "2", "-o", str(output)]
    assert cli.main(given) == 0
    found = read(output)
    own = ["lixel exact", "lixel ray_traced", "lixel desired_view 2048"]
    assert list(found["renderer"]) == [*own, "embreex"]
    versions = [lx.__version__] * 3 + [importlib.metadata.version("embreex")]
    assert list(found["version"]) == versions
    # Building takes time.
    assert (found["ms with building, median"] > 0).all()
    assert (found["processor ms, median"] > 0).all()
    assert (found["least"] <= found["ms, median"]).all()
    assert (found["ms, median"] <= found["greatest"]).all()
    assert found["frames"].eq(2).all()
    assert set(zip(found["scene"], found["width"], found["height"], strict=True)) == {
        ("plane_and_box", 96, 64)
    }
    assert found.attrs["command"] == shlex.join(["lixel", *given[:-1], "peers.csv"])
    assert set(found.attrs) == set(PROVENANCE)


def test_a_peer_that_fails_is_left_out(view, monkeypatch, capfd):
    def broken(scene, light):
        raise AttributeError("no driver")

    renderers = {
        "broken": peers.Renderer("json", broken),
        "absent": peers.Renderer("not_here", broken),
    }
    monkeypatch.setattr(peers, "PEERS", renderers)
    rows = peers.measure(*view, lx.Uniform(resolution=64), repeats=1)
    assert [row["renderer"] for row in rows] == ["lixel uniform 64"]
    messages = capfd.readouterr().err
    assert "left out: broken: no driver" in messages
    assert "left out: absent, which needs the package not_here" in messages


@pytest.mark.of_checkout("it compares with another renderer")
def test_peers_take_directional_and_point_lights_only(view, monkeypatch, capfd):
    monkeypatch.setattr(peers, "PEERS", {n: peers.PEERS[n] for n in ("embreex", "pyrender")})
    lamp = lx.PointLight((0.5, 5, 1))
    rows = peers.measure(view.scene, view.camera, lamp, lx.Exact(), repeats=1)
    assert [row["renderer"] for row in rows] == ["lixel exact", "embreex"]
    assert rows[0]["misclassified"] == 0
    assert rows[1]["misclassified"] <= 2
    assert "left out: pyrender, which is tried with directional lights alone" in (
        capfd.readouterr().err
    )
    spot = lx.SpotLight((0, 5, 0), (0, -1, 0), 0.5)
    with pytest.raises(ValueError, match="light must be directional or a point to compare"):
        peers.measure(view.scene, view.camera, spot, lx.Exact())


# --- Tables ---


def test_table_aligns_numbers_on_the_right():
    rows = [{"name": "a", "count": 1234}, {"name": "bcd", "ms": 1.5}]
    assert report.table(rows).splitlines() == [
        "name  count    ms",
        "----  -----  ----",
        "a     1,234     -",
        "bcd       -  1.50",
    ]
