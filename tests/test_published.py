"""The methods as the papers have them: names, values, and that nothing else decides the picture."""

from __future__ import annotations

import dataclasses
import inspect

import numpy as np
import pytest

import lixel as lx
from lixel.cli import main
from lixel.methods import PAPERS, PUBLISHED, PublishedValue, published_values

RUNS = [(name, paper) for name, papers in PUBLISHED.items() for paper in papers]

# What no paper has, or what a paper's other values leave unread. Their defaults do nothing.
UNREAD = {
    "slope_bias", "snap", "previous", "blend", "pixel_weights", "map_weights", "boundary_weight",
    "sample_resolution", "normal_bonus", "analysis_resolution", "edge_bias", "edge_floor",
    "traversal",
}  # fmt: skip

MAP = {"rasterization": "linear", "lookup": "depth", "bias": "constant"}
ROSEN = {
    "importance": "desired_view*distance", "analysis": "backward", "fit": "uniform", "blur": 3.0,
    "importance_resolution": 512, "rotation": 0.0,
}  # fmt: skip
NOTW = {
    "importance": "count", "importance_resolution": None, "function_count": None,
    "exponent": 1.0, "even_share": 0.0, "smoothing": None, "tessellation": 0.01,
}  # fmt: skip
SPELLED_OUT = {
    "uniform@published": lx.Uniform(resolution=2048, rotation=0.0, **MAP),
    "uniform@chong-2007": lx.Uniform(resolution=400, rotation=0.0, **MAP),
    "desired_view@published": lx.DesiredView(resolution=512, rotation=0.0, **MAP),
    "min_sm@published": lx.MinimalShadowMap(resolution=512, **MAP),
    "focused@published": lx.Focused(resolution=400, fit="frustum", **MAP),
    "lispsm@published": lx.LightSpacePerspective(resolution=400, fit="frustum", **MAP),
    "plane_optimal@published": lx.PlaneOptimal(resolution=400, fit="frustum", **MAP),
    "psm@published": lx.PerspectiveShadowMap(resolution=512, fit="frustum", **MAP),
    "scene_optimized@published": lx.SceneOptimized(
        resolution=400,
        samples="boundary",
        optimizer="paper",
        sample_resolution=180,
        every=3,
        boundaries="previous",
        **MAP,
    ),
    "cascades@published": lx.Cascades(
        resolution=2048,
        layers=4,
        splits="practical",
        weight=0.5,
        boxes="slabs",
        rotation=0.0,
        **MAP,
    ),
    "rtw@published": lx.RectilinearWarp(resolution=2048, tessellation=0.025, **ROSEN, **MAP),
    "rtw@milet-2015": lx.RectilinearWarp(resolution=512, tessellation=0.01, **ROSEN, **MAP),
    "notw@published": lx.NonOrthogonalWarp(resolution=512, rotation=0.0, **NOTW, **MAP),
    "cube+notw@published": lx.NonOrthogonalWarp(resolution=512, fit="cube", **NOTW, **MAP),
    "min_sm+notw@navratil": lx.NonOrthogonalWarp(resolution=512, fit="min_sm", **NOTW, **MAP),
    "improved_paraboloid@published": lx.ImprovedParaboloid(
        resolution=1024, cut="frustum", tessellation=0.01, **MAP
    ),
    "cube@published": lx.Cube(resolution=512, cut="face", turned=False, **MAP),
    "dual_paraboloid@navratil": lx.DualParaboloid(
        resolution=512, cut="hemisphere", tessellation=0.01, **MAP
    ),
    "shadow_volumes@published": lx.ShadowVolumes(),
    "ray_traced@published": lx.RayTraced(),
}


def default_of(name):
    fit, _, warp = name.rpartition("+")
    return lx.METHODS[warp](**({"fit": fit} if fit else {}))


@pytest.mark.parametrize("name", SPELLED_OUT)
def test_a_name_is_the_method_with_the_papers_values(name):
    assert lx.method_from(name) == SPELLED_OUT[name]


@pytest.mark.parametrize(("name", "paper"), RUNS)
def test_every_value_is_that_of_the_table(name, paper):
    values, default = published_values(name, paper), default_of(name)
    method = lx.method_from(f"{name}@{paper}")
    for parameter, value in default.parameters().items():
        expected = values.get(parameter, PublishedValue(value, "the default")).value
        assert getattr(method, parameter) == expected, parameter
    assert set(default.parameters()) - set(values) - UNREAD == set()
    assert type(method).published(paper=paper, **({"fit": method.fit} if "+" in name else {})) == (
        method
    )


@pytest.mark.parametrize(("name", "paper"), RUNS)
def test_every_value_cites_a_place_or_says_what_is_open(name, paper):
    assert paper in PAPERS
    for parameter, given in published_values(name, paper).items():
        assert given.source, parameter


def test_every_method_of_a_paper_is_there():
    without = {"exact", "spot", "trapezoidal", "log_psm", "virtual"}
    assert {name.split("+")[-1] for name in PUBLISHED} == set(lx.METHODS) - without
    for name in without:
        with pytest.raises(ValueError, match=f"no paper runs '{name}'; those that one runs: unif"):
            lx.METHODS[name].published()


def test_changes_differ_from_the_paper_alone():
    method = lx.NonOrthogonalWarp.published(smoothing=8, resolution=256)
    expected = dataclasses.replace(SPELLED_OUT["notw@published"], smoothing=8, resolution=256)
    assert method == expected
    assert lx.RectilinearWarp.published(paper="milet-2015").tessellation == 0.01
    with pytest.raises(ValueError, match="rotation must come with one of the fits"):
        lx.RectilinearWarp.published(fit="cube")


def test_a_method_knows_where_it_is_published():
    for name, method in SPELLED_OUT.items():
        if method.map_resolution is not None:
            small = dataclasses.replace(method, resolution=99)
            assert small.spelling == method.spelling, name
            assert dataclasses.replace(lx.method_from(small.spelling), resolution=99) == small
    assert lx.RectilinearWarp.published().spelling == "rtw@published"
    assert lx.method_from("cube+notw@navratil").spelling == "cube+notw@published"
    assert lx.RectilinearWarp().spelling == "rtw"
    assert lx.ShadowVolumes.published().published_in is None


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("rtw@vanek-2011", "paper of 'rtw' must be 'published' or one of 'rosen-2012', .*'vanek"),
        ("rtw@", "paper of 'rtw' must be 'published' or one of"),
        ("exact@published", "no paper runs 'exact'"),
        ("lispsm+rtw@published", r"no paper runs 'lispsm\+rtw'"),
        ("wrap@published", "method must be one of .*, got 'wrap'"),
    ],
)
def test_unknown_papers_are_named(name, words):
    with pytest.raises(ValueError, match=words):
        lx.method_from(name)


def test_the_docstring_names_the_papers():
    assert "@published" in inspect.getdoc(lx.Uniform.published)


@pytest.mark.parametrize("name", ["uniform@published", "rtw@published", "notw@published"])
def test_a_picture_is_that_of_the_values(name, view):
    scene, camera, light = view
    small = {"resolution": 128}
    method = dataclasses.replace(lx.method_from(name), **small)
    expected = dataclasses.replace(SPELLED_OUT[name], **small)
    found = lx.render_shadows(scene, camera, light, method)
    assert np.array_equal(found, lx.render_shadows(scene, camera, light, expected), equal_nan=True)
    default = dataclasses.replace(default_of(name.split("@")[0]), **small)
    assert (found != lx.render_shadows(scene, camera, light, default))[~np.isnan(found)].any()


def test_studies_and_commands_take_the_name(tmp_path, capsys):
    table = lx.study(
        "plane_and_box",
        methods=["notw", "notw@published"],
        parameters={"resolution": [64]},
        size=(48, 27),
        repeats=1,
        progress=False,
    )
    assert table["published"].fillna("").tolist() == ["", "milet-2015"]
    assert table["exponent"].tolist() == [0.5, 1.0]
    command = ["compare", "plane_and_box", "--size", "48x27", "--resolution", "64"]
    assert main([*command, "--method", "notw", "--method", "notw@published"]) == 0
    assert "notw@published" in capsys.readouterr().out
