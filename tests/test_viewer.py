"""The page of `lixel view` by what it asks for: pictures, numbers, maps, and who may ask."""

from __future__ import annotations

import io
import json
import threading
from http.client import HTTPConnection
from urllib.parse import quote, urlsplit

import numpy as np
import pytest
from PIL import Image

import lixel as lx
from lixel import cli
from lixel.compare import FALSE_LIT
from lixel.lab import viewer
from lixel.lab.viewer.server import Server
from lixel.lab.viewer.views import Viewer


@pytest.fixture(scope="module")
def server():
    scene = lx.scenes.plane_and_box()
    scene.lights["lamp"] = lx.PointLight((2, 5, 1))
    made = Viewer("plane_and_box", scene, scene.cameras["default"], scene.lights["default"])
    with Server(made) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server
        server.shutdown()


@pytest.fixture
def ask(server):
    def ask(path, view=None, token=server.token):
        query = "" if view is None else "?view=" + quote(json.dumps(view))
        connection = HTTPConnection(*server.server_address)
        connection.request("GET", path + query, headers={"Authorization": f"Bearer {token}"})
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, answer.headers, content

    return ask


@pytest.fixture
def view(ask):
    scene = json.loads(ask("/scene")[2])
    camera = scene["camera"] | {"width": 96, "height": 64}
    return {"camera": camera, "light": scene["lights"]["default"], "method": "exact"}


def pixels(content):
    return np.asarray(Image.open(io.BytesIO(content)))


def test_only_this_machine_with_the_token_is_served(server, ask):
    assert server.server_address[0] == "127.0.0.1"
    assert len(server.token) >= 32
    for path in ("/", "/scene", "/frame", "/map"):
        assert ask(path, token="wrong")[0] == 403
        assert ask(path, token="")[0] == 403
    address = urlsplit(server.address)
    connection = HTTPConnection(address.hostname, address.port)
    connection.request("GET", f"{address.path}?{address.query}")
    answer = connection.getresponse()
    assert answer.status == 200
    page = answer.read().decode()
    connection.close()
    # The page's own script runs, and no other one.
    policy = answer.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    nonce = policy.split("'nonce-")[1].split("'")[0]
    assert f'<script nonce="{nonce}">' in page
    assert server.token not in page


def test_the_scene_says_what_there_is_to_choose_from(ask):
    scene = json.loads(ask("/scene")[2])
    assert set(scene["lights"]) == {"light", "default", "lamp"}
    assert scene["methods"]["cube"]["lights"] == ["PointLight", "SpotLight", "HemisphereLight"]
    assert scene["methods"]["ray_traced"]["resolution"] is None
    assert set(scene["methods"]) == set(lx.METHODS)


def test_a_frame_is_the_picture_with_its_times(ask, view):
    status, headers, content = ask("/frame", view)
    assert status == 200
    numbers = json.loads(headers["X-Lixel"])
    assert numbers["method"] == "exact"
    assert sum(numbers["passes"].values()) > 0.0
    assert "misclassified" not in numbers
    shown = pixels(content).astype(int)
    camera = lx.Camera.look_at(**view["camera"])
    scene = lx.scenes.plane_and_box()
    frame = lx.render(scene, camera, scene.lights["default"], "exact")
    # The shades are the frame's own but for what JPEG loses.
    difference = np.abs(shown - frame.to_image().astype(int)).max(axis=-1)
    assert np.median(difference[frame.covered]) <= 6
    assert shown[frame.visibility == 1.0].mean() > shown[frame.visibility == 0.0].mean() + 60
    assert shown[~frame.covered].min() > 225


@pytest.mark.parametrize("truth", ["exact", "reference"])
def test_wrong_pixels_are_red_and_counted(ask, view, truth):
    asked = view | {"method": "uniform", "resolution": 16, "truth": truth}
    _, headers, content = ask("/frame", asked)
    numbers = json.loads(headers["X-Lixel"])
    scene, camera = lx.scenes.plane_and_box(), lx.Camera.look_at(**view["camera"])
    light = scene.lights["default"]
    found = lx.compare(
        lx.render_shadows(scene, camera, light, lx.Uniform(resolution=16)),
        lx.reference(scene, camera, light),
    )
    assert (numbers["misclassified"], numbers["truth"]) == (found.misclassified_count, truth)
    assert numbers["covered"] == found.covered_count
    is_red = np.abs(pixels(content).astype(int) - FALSE_LIT).max(axis=-1) < 60
    assert is_red[found.false_lit].mean() > 0.5
    assert is_red[~found.misclassified].mean() < 0.02


def test_maps_come_with_the_grid_and_the_call(ask, view):
    scene = json.loads(ask("/scene")[2])
    asked = view | {"method": "rtw", "resolution": 64, "lookup": "depth"}
    maps = json.loads(ask("/map", asked)[2])
    assert maps["layers"] == 1
    assert maps["shadow_map"].startswith("data:image/png;base64,")
    assert maps["importance_map"].startswith("data:image/png;base64,")
    lines = [np.array(line) for line in maps["lines"]]
    assert all(((line >= 0) & (line <= 1)).all() for line in lines)
    assert not maps["call"].count("blur")
    names = {}
    exec(maps["call"], names)  # the program that the page gives away
    assert names["method"] == lx.RectilinearWarp(resolution=64, lookup="depth")
    assert names["visibility"].shape == (64, 96)
    lamp = asked | {"light": scene["lights"]["lamp"], "method": "cube"}
    maps = json.loads(ask("/map", lamp)[2])
    assert (maps["layers"] > 1, maps["importance_map"]) == (True, None)
    assert json.loads(ask("/map", view)[2])["lines"] == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"method": "unifrom"}, "did you mean 'uniform'"),
        ({"method": "cube"}, "light"),
        ({"truth": "mine"}, "truth must be 'exact' or 'reference', got 'mine'"),
        ({"camera": {"eye": [0, 1, 5], "target": [0, 0, 0], "yfov": 1, "width": 1 << 20,
                     "height": 9}}, "at most 4096"),
        ({"resolution": -1, "method": "rtw"}, "resolution must be"),
    ],
)  # fmt: skip
def test_a_wrong_view_is_refused_in_words(ask, view, changes, words):
    status, _, content = ask("/frame", view | changes)
    assert status == 400
    assert words in json.loads(content)["error"]
    assert ask("/nothing")[0] == 404


def test_the_command_prints_the_address_and_opens_it(monkeypatch, capsys):
    opened = []
    monkeypatch.setattr(viewer.webbrowser, "open", opened.append)

    def stop(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(Server, "serve_forever", stop)
    assert cli.main(["view", "plane_and_box"]) == 0
    (address,) = opened
    assert capsys.readouterr().out == f"{address}\n"
    assert address.startswith("http://127.0.0.1:")
    assert cli.main(["view", "plane_and_box", "--no-browser"]) == 0
    assert len(opened) == 1
