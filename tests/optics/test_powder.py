"""Powder: area fractions, finer and coarser than the skin's scatter."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from km_makeup.errors import MakeupError
from km_makeup.optics import (
    PowderRule,
    air_interface,
    apparent,
    film,
    film_over,
    lay,
    over,
    powder,
    powder_difference,
    powder_over,
    stack,
)

BLUSH, SHADOW = film(20.0, 40.0, 0.02), film(80.0, 10.0, 0.01)
AIR = air_interface(1.5)


@given(share=st.floats(0.0, 1.0), K=st.floats(0, 100), S=st.floats(0, 100))
@settings(max_examples=60, deadline=None)
def test_powder_keeps_all_light(share: float, K: float, S: float) -> None:
    grains = powder(film(K, S, 0.02), share)
    assert grains.R_top + grains.T + grains.A_top == pytest.approx(1, rel=1e-14, abs=0)
    assert grains.R_bottom + grains.T_up + grains.A_bottom == pytest.approx(1, rel=1e-14, abs=0)
    under_air = powder(stack([film(K, S, 0.02), AIR.as_stack]), share)
    assert under_air.R_bottom + under_air.T_up + under_air.A_bottom == pytest.approx(1, rel=1e-14, abs=0)
    assert under_air.R_top + under_air.T + under_air.A_top == pytest.approx(1, rel=1e-14, abs=0)


@pytest.mark.parametrize("rule", list(PowderRule))
@pytest.mark.parametrize("interface", [None, AIR])
def test_full_cover_is_the_film_and_none_is_the_skin(rule: PowderRule, interface) -> None:
    def seen(R):
        return R if interface is None else apparent(R, interface)

    full = powder_over([BLUSH, SHADOW], [1.0, 1.0], 0.4, rule, interface)
    whole = lay(SHADOW, BLUSH)
    assert full == pytest.approx(seen(over(whole.R_top, whole.T**2, whole.R_bottom, 0.4)), rel=1e-14, abs=0)
    assert powder_over([BLUSH, SHADOW], [0.0, 0.0], 0.4, rule, interface) == pytest.approx(seen(0.4), rel=1e-15, abs=0)
    assert powder_over([], [], 0.4, rule, interface) == pytest.approx(seen(0.4), rel=1e-15, abs=0)


def test_the_fine_rule_averages_layers_then_stacks() -> None:
    share, Rg = 0.3, 0.5
    R, T = share * BLUSH.R, share * BLUSH.T + 1 - share
    assert powder_over([BLUSH], [share], Rg) == pytest.approx(R + T * T * Rg / (1 - R * Rg), rel=1e-14, abs=0)


def test_the_coarse_rule_averages_all_stacks() -> None:
    a, b, Rg = 0.3, 0.6, 0.5
    skin, blush, shadow = Rg, film_over(20.0, 40.0, 0.02, Rg), film_over(80.0, 10.0, 0.01, Rg)
    both = film_over(80.0, 10.0, 0.01, blush)
    wanted = (1 - a) * (1 - b) * skin + a * (1 - b) * blush + (1 - a) * b * shadow + a * b * both
    assert powder_over([BLUSH, SHADOW], [a, b], Rg, PowderRule.COARSE) == pytest.approx(wanted, rel=1e-14, abs=0)
    air = (1 - a) * apparent(skin, AIR) + a * apparent(blush, AIR)
    assert powder_over([BLUSH], [a], Rg, PowderRule.COARSE, AIR) == pytest.approx(air, rel=1e-14, abs=0)


@given(share=st.floats(0.01, 0.99), Rg=st.floats(0.0, 1.0), K=st.floats(0.1, 100), S=st.floats(0.1, 100))
@settings(max_examples=80, deadline=None)
def test_coarse_powder_is_never_darker_than_fine(share: float, Rg: float, K: float, S: float) -> None:
    """R + T^2 Rg/(1 - R Rg) is convex along the line from no film to film, so the mean of the ends lies above."""
    difference = powder_difference([film(K, S, 0.02)], [share], Rg)
    assert difference >= -1e-15
    assert difference == pytest.approx(
        float(
            powder_over([film(K, S, 0.02)], [share], Rg, PowderRule.COARSE)
            - powder_over([film(K, S, 0.02)], [share], Rg)
        ),
        abs=1e-16,
    )


def test_the_choice_of_rule_matters_for_a_dark_powder_on_pale_skin() -> None:
    assert 0.02 < powder_difference([film(150.0, 5.0, 0.02)], [0.5], 0.6) < 0.2
    for interface in (None, AIR):
        coarse = powder_over([BLUSH, SHADOW], [0.5, 0.3], 0.5, PowderRule.COARSE, interface)
        fine = powder_over([BLUSH, SHADOW], [0.5, 0.3], 0.5, PowderRule.FINE, interface)
        assert powder_difference([BLUSH, SHADOW], [0.5, 0.3], 0.5, interface) == pytest.approx(
            coarse - fine, rel=1e-12, abs=0
        )


@pytest.mark.parametrize("rule", list(PowderRule))
def test_maps_and_wavelengths_broadcast_and_keep_float32(rule: PowderRule) -> None:
    K = np.linspace(1, 50, 81, dtype=np.float32)
    share = np.linspace(0, 1, 5, dtype=np.float32)[:, None]
    ours = powder_over([film(K, 20.0, 0.02), film(K, 5.0, 0.01)], [share, 1.0], np.full(81, 0.4, np.float32), rule, AIR)
    assert ours.shape == (5, 81)
    assert ours.dtype == np.float32
    alone = powder_over([film(50.0, 20.0, 0.02), film(50.0, 5.0, 0.01)], [0.5, 1.0], 0.4, rule, AIR)
    assert ours[2, -1] == pytest.approx(float(alone), rel=2e-6, abs=0)
    assert powder(film(K, 20.0, 0.02), 0.5).R_top.dtype == np.float32


def test_lists_of_unequal_length_and_too_many_coarse_powders_are_refused() -> None:
    with pytest.raises(MakeupError, match="2 films need as many area fractions, not 1"):
        powder_over([BLUSH, SHADOW], [0.5], 0.4)
    many = [film(1.0, 1.0, 0.001)] * 13
    with pytest.raises(MakeupError, match="More than 12 powders"):
        powder_over(many, [0.5] * 13, 0.4, PowderRule.COARSE)
    assert 0 < powder_over(many, [0.5] * 13, 0.4) < 1
    assert 0 < powder_over(many, [1.0] * 12 + [0.5], 0.4, PowderRule.COARSE) < 1
    assert 0 < powder_over([film(1.0, 1.0, 0.001)] * 12, [0.5] * 12, 0.4, PowderRule.COARSE) < 1


@pytest.mark.parametrize("share", [1.5, -0.5])
def test_what_is_no_area_fraction_is_refused(share: float) -> None:
    said = f"^The area fraction of a powder must be a number from 0 to 1, not {share}; mend its source.$"
    for call in (
        lambda: powder(BLUSH, share),
        lambda: powder_over([BLUSH], [share], 0.4),
        lambda: powder_over([BLUSH], [share], 0.4, PowderRule.COARSE),
    ):
        with pytest.raises(MakeupError, match=said):
            call()


@pytest.mark.parametrize("rule", list(PowderRule))
def test_a_backing_of_other_length_than_the_films_is_refused(rule: PowderRule) -> None:
    with pytest.raises(MakeupError, match="do not go together"):
        powder_over([film(np.ones(3), 1.0, 0.1)], [0.5], np.full(4, 0.4), rule)
