"""Experiments of papers, on as little as shows that they run."""

from __future__ import annotations

import numpy as np
import pytest

from lixel import scenes
from lixel.paper_tables import chong_gortler


def test_lights_are_the_same_at_every_call_and_come_from_above():
    towards = np.array([-light.direction for light in chong_gortler.lights(200)])
    again = np.array([-light.direction for light in chong_gortler.lights(200)])
    assert np.array_equal(towards, again)
    assert (towards[:, 1] >= 0).all()
    # Evenly: heights on the sphere are.
    assert abs(towards[:, 1].mean() - 0.5) < 0.06


def test_percentages_and_the_worst_tenth():
    wrong = np.arange(1.0, 21.0)
    rows = chong_gortler.summary(["a", "uniform"], np.stack([wrong, 3 * wrong]))
    assert rows[0]["wrong pixels"] == 210
    assert rows[0]["% more"] == 0.0
    assert rows[1]["% more"] == pytest.approx(200.0)
    assert rows[1]["paper, % more"] == 186.60
    assert rows[0]["mean of the worst tenth"] == 19.5


def test_the_command_prints_a_row_for_each_method(monkeypatch, capsys):
    small = scenes.objects_on_floor(count=9, subdivisions=1)
    monkeypatch.setattr(chong_gortler, "objects_on_floor", lambda **_: small)
    chong_gortler.main(["--quick", "--lights", "1"])
    printed = capsys.readouterr().out
    for name in chong_gortler.methods(200):
        assert name in printed
    assert set(chong_gortler.PAPER) < set(chong_gortler.methods(200))
