"""The ladders of highlights, mixed light, powder and mip-maps: finer is nearer, and what they are judged by is what it says."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from km_makeup.accuracy import highlights, maps, mip, mixed_light, powder
from km_makeup.optics import PowderRule
from tests.accuracy import make_more, reference
from tests.optics import oracle

LADDERS = {
    "highlights": highlights.highlight_ladder,
    "light": mixed_light.mixed_light_ladder,
    "mip": lambda: mip.mip_ladder(maps.painted(128)),
}


@pytest.mark.parametrize("name", list(LADDERS))
def test_rungs_fall_as_the_ladder_says(name):
    ladder = LADDERS[name]()
    found = {rung.name: rung.error().mean for rung in ladder.rungs}
    assert ladder.falling
    for chain in ladder.falling:
        means = [found[rung] for rung in chain]
        assert means == sorted(means, reverse=True), dict(zip(chain, means))


def test_highlights_are_those_of_the_oracle():
    some, truth = highlights.cases()
    for i in range(0, len(truth), 97):
        value = sum(
            w * oracle.kelemen(some.normal[i], some.light[i], some.view[i], one.roughness**2, one.f0)
            for w, one in zip(some.weights[i], some.finishes)
        )
        assert float(value) * float(some.normal[i] @ some.light[i]) == pytest.approx(truth[i], rel=1e-12)


def test_our_form_of_eq_5_is_right_to_the_last_digits():
    found = {rung.name: rung.error() for rung in highlights.highlight_ladder().rungs}
    assert found["Kelemen per finish"].max < 1e-9
    assert found["Kelemen per finish, float32"].max < found["Eq 5 as printed, float32"].max


def test_a_renderers_ggx_reflects_what_its_integral_says():
    """Seen along the normal with F = 1: 1 - ln 2 where the slope is 1 (the integral in closed form), nearly 1 where it is small."""
    cosine = (np.arange(20000) + 0.5) / 20000
    light = np.stack([np.sqrt(1 - cosine**2), np.zeros_like(cosine), cosine], axis=1)
    up = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
    patches = highlights.Patches(up, light, up, np.ones((len(up), 1)), ())
    ones = np.ones(len(up))
    albedo = [float((highlights.ggx(patches, m * ones, ones) * cosine).mean() * 2 * np.pi) for m in (1.0, 0.05)]
    assert albedo[0] == pytest.approx(1 - np.log(2), abs=1e-6)
    assert 0.99 < albedo[1] < 1


def test_mixed_light_is_what_the_reference_computes():
    content = highlights.more_reference()["mixed_light"]
    white = [mp.mpf(1)] * len(reference.WAVELENGTHS)
    with mp.workdps(reference.DIGITS):
        np.testing.assert_allclose(make_more._raw(white, "A"), content["white_fill"], atol=1e-11)
    lit = mixed_light.cases()
    np.testing.assert_allclose(lit.white_key, 1, atol=2e-3)
    assert np.abs(mixed_light.own_lights(lit, 1.0) - lit.seen_key).max() < 2e-3


@pytest.mark.parametrize(("grain", "rule"), [(1e-4, PowderRule.FINE), (1e4, PowderRule.COARSE)])
def test_transport_between_grains_ends_in_the_two_rules(grain, rule):
    """The rules come from `powder_over`; the transport knows neither."""
    one = powder.powders()[1]
    share = round(0.5 * powder.CELLS**2) / powder.CELLS**2
    by_rule = powder._by_rule(one, np.array([share]), rule)[0]
    np.testing.assert_allclose(powder.transported(one, share, grain), by_rule, atol=2e-5)


def test_each_rule_is_nearer_at_its_own_end():
    fine, coarse = ([powder._judge(rule, powder.powders(), [g])().mean for g in (0.05, 2.5)] for rule in PowderRule)
    assert fine[0] < coarse[0] and coarse[1] < fine[1]


def test_averaged_pixels_keep_their_mean():
    pixels = np.random.default_rng(0).random((16, 16, 3))
    np.testing.assert_allclose(mip.averaged(pixels, 4).mean(axis=(0, 1)), pixels.mean(axis=(0, 1)))
