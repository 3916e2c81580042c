"""What a scene's error hangs on, and what it is expected to be."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from km_makeup.accuracy import kept
from km_makeup.accuracy.conditions import HARD_SR, KINDS, Conditions, ErrorModel, brightness, light_shares
from km_makeup.effects import LampFacts
from tests.effects import scenes

MODEL = ErrorModel(
    {"hard": (0.0, 2.0, 10.0, 5.0), "soft": (1.0, 0.0, 0.0, 20.0), "world": (5.0, 0.0, 0.0, 0.0)}, 0.5, (0.0625, 1.0)
)


def lamp(watts: float, solid_angle: float, real: bool = True) -> LampFacts:
    return LampFacts("lamp", (watts, watts, watts), solid_angle, real)


def test_shares_go_by_irradiance_and_solid_angle():
    found = light_shares([lamp(3.0, HARD_SR / 2), lamp(1.0, HARD_SR * 2)], (4 / math.pi,) * 3)
    assert found == pytest.approx({"hard": 3 / 8, "soft": 1 / 8, "world": 4 / 8})
    assert list(found) == list(KINDS)


def test_conditions_of_numbers_from_numpy_can_be_kept_with_the_head():
    found = light_shares([], np.full(3, 0.25, np.float32))
    made = kept.Kept((), conditions=Conditions(found, 0.5, 0.25), model=MODEL)
    assert {type(share) for share in found.values()} == {float}
    again = kept.read_kept(made.as_json(), "a test")
    assert again.conditions == made.conditions
    assert again.model.error(made.conditions) == MODEL.error(made.conditions)


def test_light_that_is_not_known_counts_as_the_world():
    assert light_shares([lamp(1.0, 1e-3, real=False)], (0, 0, 0)) == {"hard": 0, "soft": 0, "world": 1}


def test_darkness_has_no_shares_and_no_expectation():
    dark = light_shares([lamp(0.0, 1.0)], (0, 0, 0))
    assert not any(dark.values())
    assert math.isnan(MODEL.error(Conditions(dark, 1.0, 0.5)))


def test_the_error_is_the_mean_by_light_and_brightness_and_goes_with_the_scale_as_far_as_it_was_measured():
    mixed = {"hard": 0.5, "soft": 0.25, "world": 0.25}
    assert MODEL.error(Conditions(mixed, 1.0, 0.5, 0.1, 0.1)) == pytest.approx(0.5 * 1.45 + 0.25 * 2 + 0.25 * 5)
    assert MODEL.error(Conditions({"soft": 1.0}, 0.25, 0.0)) == pytest.approx(0.5)
    assert MODEL.error(Conditions({"soft": 1.0}, 9.0, 0.0)) == 1
    assert MODEL.error(Conditions({"soft": 1.0}, 0.01, 0.0)) == pytest.approx(0.25)
    assert math.isnan(MODEL.error(Conditions({"moon": 1.0}, 1.0, 0.5)))
    assert math.isnan(MODEL.error(Conditions({"soft": 1.0}, 0.0, 0.5)))


def test_an_expectation_follows_the_conditions(monkeypatch):
    monkeypatch.setattr(kept, "shipped", lambda: kept.Kept((), model=MODEL))
    there = Conditions({"soft": 1.0}, 1.0, 0.5, 0.5, 0.1)
    made = kept.Kept((), conditions=there)
    assert kept.error_scale(made, replace(there, shares={"world": 1.0})) == pytest.approx(2.5)
    assert kept.error_scale(made, replace(there, px_per_mm=0.25)) == pytest.approx(0.5)
    assert kept.error_scale(made, there) == 1
    assert kept.error_scale(kept.Kept(()), there) == 1, "a measurement without its conditions is taken as it is"
    assert kept.error_scale(made, Conditions()) == 1
    planned = kept.KeptRung("picture", "EEVEE, plan 0.5", kept.PLANNED, 0.8, 1.0, 1.0, 1.0)
    assert kept.error_scale(replace(made, rungs=(planned,)), there) == 1, "a head's own measurement is taken as it was"
    common = kept.error_scale(replace(made, rungs=(planned,), model=MODEL), there)
    assert common * planned.mean == pytest.approx(MODEL.error(there)), "the shipped one by many pictures"


def test_how_bright_a_head_is_and_how_bare_goes_by_what_is_painted_and_where():
    bare, of_skin = brightness(scenes.scene())
    assert bare == pytest.approx(np.dot(scenes.scene().skin.colours[0], (0.2126, 0.7152, 0.0722))) and of_skin == 1
    liner = scenes.film("eyeliner-black", 30)
    (all_over, little), (half, _) = (brightness(scenes.scene(replace(liner, coverage=share))) for share in (1.0, 0.5))
    assert all_over < 0.2 * bare and little < 0.1
    assert half == pytest.approx((all_over + bare) / 2)
    assert brightness(scenes.scene(replace(liner, coverage=1.0, enabled=False))) == (bare, 1)
    both = replace(liner, coverage=0.5), replace(scenes.film("foundation-fair", 60), coverage=0.5)
    found, from_skin = brightness(scenes.scene(*both))
    assert all_over < found < bare + 0.5 and 0.25 < from_skin < 1
    thin, see_through = brightness(scenes.scene(replace(scenes.film("foundation-fair", 0.5), coverage=1.0)))
    assert thin == pytest.approx(bare, rel=0.1) and 0.5 < see_through < 1
