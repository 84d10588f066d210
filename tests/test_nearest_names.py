"""Messages that refuse a name say which known one is nearest, whatever kind of name it is."""

from __future__ import annotations

import copy
import pickle

import pytest

import lixel as lx
from lixel import cli
from lixel.arguments import did_you_mean
from lixel.lab import flicker, hard_views
from lixel.lab.papers import drawings, measure


@pytest.mark.parametrize(
    ("value", "known", "words"),
    [
        ("unifrom", ["uniform", "rtw"], "; did you mean 'uniform'?"),
        ("RTW", ["uniform", "rtw"], "; did you mean 'rtw'?"),
        ("exat", ["exact", "Exact"], "; did you mean 'exact'?"),
        ("magic", ["uniform", "rtw"], ""),
        ("rtw", ["rtw", "rtw2"], ""),
        ("", ["rtw"], ""),
        (7, ["rtw"], ""),
        ("rtw", [], ""),
    ],
)
def test_the_nearest_of_the_known_names(value, known, words):
    assert did_you_mean(value, known) == words


@pytest.mark.parametrize(
    ("call", "nearest"),
    [
        (lambda: lx.method_from("unifrom"), "uniform"),
        (lambda: lx.method_from("atuo"), "auto"),
        (lambda: lx.method_from("cube+rtww"), "rtw"),
        (lambda: lx.method_from("principal_axis+rtw"), "principal_axes"),
        (lambda: lx.method_from("rtw@rosen2012"), "rosen-2012"),
        (lambda: lx.RectilinearWarp(importance="distance*normel"), "normal"),
        (lambda: lx.RectilinearWarp(importance=["distance", "boundry"]), "boundary"),
        (lambda: lx.RectilinearWarp(fit="cubes"), "cube"),
        (lambda: lx.Uniform(lookup="triangel"), "triangle"),
        (lambda: lx.Pcf(space="wraped"), "warped"),
        (lambda: hard_views.cases(["edge_on"]), "edge-on"),
        (lambda: lx.study("plane_and_box", methods="rtw", parameters={"blurr": [1]}), "blur"),
        (lambda: flicker.measure(motions=["walkk"]), "walk"),
        (lambda: drawings.draw(["milet-figure7"], None), "milet-figure-7"),
        (lambda: measure(["rosen-3-warp"]), "rosen-3-warps"),
    ],
)
def test_every_kind_of_name(call, nearest):
    with pytest.raises(ValueError, match=f"; did you mean '{nearest}'\\?$"):
        call()


def test_a_parameter_that_a_method_does_not_have():
    with pytest.raises(TypeError, match=r"of Exact must be one of .*, got 'wrap'; did .* 'warp'"):
        lx.Exact(wrap=None)
    with pytest.raises(TypeError, match=r"of RayTraced must be one of traversal.*, got 'x'$"):
        lx.RayTraced(x=1)
    method = lx.RectilinearWarp(resolution=64, lookup=lx.Pcf(radius=3))
    assert pickle.loads(pickle.dumps(method)) == copy.deepcopy(method) == method


@pytest.mark.parametrize(
    ("given", "nearest"),
    [
        (["colonade"], "colonnade"),
        (["plane_and_box", "--camera", "defalt"], "default"),
        (["plane_and_box", "--light", "defult"], "default"),
        (["plane_and_box", "--set", "slope_bais=1"], "slope_bias"),
    ],
)
def test_on_the_command_line(given, nearest, tmp_path, capsys):
    assert cli.main(["render", *given, "-o", str(tmp_path / "x.png")]) == 2
    assert capsys.readouterr().err.endswith(f"; did you mean '{nearest}'?\n")
