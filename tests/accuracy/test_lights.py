"""What light a scene has by kind, and what a picture's error is expected to be in it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from km_makeup.accuracy import kept
from km_makeup.accuracy.lights import HARD_SR, KINDS, light_shares, mean_error
from km_makeup.effects import LampFacts

ERRORS = {"hard": 1.0, "soft": 2.0, "world": 5.0}


def lamp(watts: float, solid_angle: float, real: bool = True) -> LampFacts:
    return LampFacts("lamp", (watts, watts, watts), solid_angle, real)


def test_shares_go_by_irradiance_and_solid_angle():
    found = light_shares([lamp(3.0, HARD_SR / 2), lamp(1.0, HARD_SR * 2)], (4 / math.pi,) * 3)
    assert found == pytest.approx({"hard": 3 / 8, "soft": 1 / 8, "world": 4 / 8})
    assert list(found) == list(KINDS)


def test_shares_of_numbers_from_numpy_can_be_kept_with_the_head():
    found = light_shares([], np.full(3, 0.25, np.float32))
    made = kept.Kept((), shares=found)
    assert {type(share) for share in found.values()} == {float}
    assert kept.read_kept(made.as_json(), "a test") == made


def test_light_that_is_not_known_counts_as_the_world():
    assert light_shares([lamp(1.0, 1e-3, real=False)], (0, 0, 0)) == {"hard": 0, "soft": 0, "world": 1}


def test_darkness_has_no_shares_and_no_expectation():
    dark = light_shares([lamp(0.0, 1.0)], (0, 0, 0))
    assert not any(dark.values())
    assert math.isnan(mean_error(ERRORS, dark))


def test_the_error_in_mixed_light_is_the_mean_by_share():
    assert mean_error(ERRORS, {"hard": 0.5, "soft": 0.25, "world": 0.25}) == pytest.approx(2.25)
    assert math.isnan(mean_error({"hard": 1.0}, {"hard": 0.5, "soft": 0.5}))


def test_an_expectation_follows_the_light(monkeypatch):
    monkeypatch.setattr(kept, "shipped", lambda: kept.Kept((), lights=ERRORS))
    made = kept.Kept((), shares={"hard": 0.0, "soft": 1.0, "world": 0.0})
    assert kept.light_scale(made, {"world": 1.0}) == pytest.approx(2.5)
    assert kept.light_scale(made, {"soft": 1.0}) == 1
    assert kept.light_scale(kept.Kept(()), {"world": 1.0}) == 1, "a measurement without its light is taken as it is"
    assert kept.light_scale(made, {}) == 1
