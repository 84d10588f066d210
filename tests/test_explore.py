"""The interactive view: what its controls do, without a browser."""

import io
import sys

import numpy as np
import pytest
from PIL import Image

import lixel as lx
from lixel.pictures.explore import explore

LIGHTS = [
    lx.DirectionalLight((1, -2, 0.5)),
    lx.PointLight((2, 5, 1)),
    lx.SpotLight((2, 5, 1), (-0.3, -1, 0)),
]


def controls(view):
    """The widgets that have a description, by it; the two pictures and the words."""
    found, rest = {}, []

    def walk(widget):
        for child in getattr(widget, "children", ()):
            walk(child)
        if getattr(widget, "description", ""):
            found[widget.description] = widget
        elif not getattr(widget, "children", ()):
            rest.append(widget)

    walk(view)
    return found, rest


def pixels(image):
    return np.asarray(Image.open(io.BytesIO(image.value)))


def test_every_control_changes_the_picture(view):
    found, (shadows, shadow_map, grid, words) = controls(explore(view.scene, width=96, height=54))
    assert pixels(shadows).shape == (54, 96, 3)
    assert pixels(shadow_map).shape[:2] == (54, 54)
    assert pixels(grid).shape[:2] == (54, 54)
    for name, value in [
        ("turn", 40.0), ("closer", 0.4), ("light turns", 90.0), ("light rises", 20.0),
        ("method", "uniform"), ("map, texels", 32),
    ]:  # fmt: skip
        before = (shadows.value, shadow_map.value)
        found[name].value = value
        assert (shadows.value, shadow_map.value) != before, name
    assert "misclassified" in words.value
    assert "shadow map" in words.value


def test_it_starts_with_the_view_it_was_given(view):
    scene, camera, light = view
    widgets, (shadows, _, _, _) = controls(explore(scene, camera, light, width=96, height=64))
    widgets["method"].value = "uniform"
    frame = lx.render(scene, camera, light, lx.Uniform(resolution=256))
    found = lx.compare(frame, lx.reference(scene, camera, light))
    differ = (pixels(shadows) != found.picture()).any(axis=-1)
    # The light's angles go through sliders with steps.
    assert differ.mean() < 0.02


@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: type(light).__name__)
def test_every_kind_of_light_moves(light, view):
    found, (shadows, _, _, words) = controls(explore(view.scene, light=light, width=64, height=36))
    name = next(name for name in found if name.startswith(("light turns", "light x")))
    before = shadows.value, words.value
    found[name].value += 1.0 if name == "light x" else 60.0
    assert (shadows.value, words.value) != before


@pytest.mark.parametrize("method", lx.METHODS)
def test_every_method_is_shown_or_says_why_not(method, view):
    found, (shadows, shadow_map, _, words) = controls(explore(view.scene, width=64, height=36))
    found["method"].value = method
    assert words.value
    assert pixels(shadows).shape == (36, 64, 3)
    assert pixels(shadow_map).shape[0] == 36


def test_without_ipywidgets_the_error_says_the_remedy(view, monkeypatch):
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    with pytest.raises(ImportError, match=r"package ipywidgets: pip install 'lixel\[notebook\]'"):
        explore(view.scene)
