"""Diffusion profiles: published values, energy, fits and the widening by a film."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from km_makeup.errors import MakeupError
from km_makeup.optics import (
    SKIN,
    GaussianProfile,
    burley,
    burley_distance,
    burley_within,
    fit_gaussians,
    reduced,
    widened,
)
from km_makeup.optics.diffusion import _positive_weights, diffuse_distance

R = np.geomspace(1e-3, 60, 4000)
RGB = np.array([1.0, 0.4, 0.2])


def energy(profile, r=R) -> np.ndarray:
    """2 pi r dr of a radial profile."""
    values = profile(r)
    values = values if values.ndim == 2 else values[:, None]
    return (
        np.trapezoid(2 * np.pi * r[:, None] * values, r, axis=0)
        if hasattr(np, "trapezoid")
        else np.trapz(2 * np.pi * r[:, None] * values, r, axis=0)
    )


def test_skin_is_the_published_table() -> None:
    """d'Eon and Luebke 2007: six Gaussians, each channel's weights add up to 1, red spreads widest."""
    assert SKIN.weights.shape == (6, 3)
    np.testing.assert_allclose(SKIN.weights.sum(axis=0), 1, atol=1e-12)
    np.testing.assert_array_equal(SKIN.variances, [0.0064, 0.0484, 0.187, 0.567, 1.99, 7.41])
    np.testing.assert_array_equal(SKIN.weights[0], [0.233, 0.455, 0.649])
    np.testing.assert_array_equal(SKIN.weights[4], [0.358, 0.004, 0.0])
    red, green, blue = SKIN.mean_variance
    assert red > 10 * green > 10 * blue > 0
    assert red == pytest.approx(
        0.233 * 0.0064 + 0.1 * 0.0484 + 0.118 * 0.187 + 0.113 * 0.567 + 0.358 * 1.99 + 0.078 * 7.41
    )


@pytest.mark.parametrize("profile", [SKIN, fit_gaussians(0.7)])
def test_profile_share_within_and_spectrum_belong_together(profile: GaussianProfile) -> None:
    np.testing.assert_allclose(energy(profile), 1, atol=2e-3)
    step = R[1:] - R[:-1]
    middle = np.sqrt(R[1:] * R[:-1])
    rings = np.cumsum((2 * np.pi * middle * step)[:, None] * profile(middle), axis=0)
    np.testing.assert_allclose(rings[::400], (profile.within(R[1:]) - profile.within(R[0]))[::400], atol=2e-3)
    np.testing.assert_allclose(profile.spectrum(0.0), 1, atol=1e-12)
    f = 1e-3
    np.testing.assert_allclose((1 - profile.spectrum(f)) / (f * f / 2), profile.mean_variance, rtol=1e-5)


def test_one_gaussian_has_its_textbook_values() -> None:
    one = GaussianProfile([4.0], [[1.0]])
    assert one(2.0)[0] == pytest.approx(np.exp(-0.5) / (8 * np.pi), rel=1e-14, abs=0)
    assert one.within(2.0)[0] == pytest.approx(1 - np.exp(-0.5), rel=1e-14, abs=0)
    assert one.spectrum(0.5)[0] == pytest.approx(np.exp(-0.5), rel=1e-14, abs=0)
    assert one.mean_variance[0] == 4


@pytest.mark.parametrize("d", [0.1, 1.0, 3.0])
def test_burley_keeps_all_light_and_its_share_within_is_its_integral(d: float) -> None:
    r = np.geomspace(1e-6, 200, 20_000)
    assert energy(lambda x: burley(x, d), r)[0] == pytest.approx(1, abs=1e-4)
    assert burley(1.0, 1.0) == pytest.approx((np.exp(-1) + np.exp(-1 / 3)) / (8 * np.pi), rel=1e-15, abs=0)
    assert burley_within(2 * d, d) == pytest.approx(1 - np.exp(-2) / 4 - 3 * np.exp(-2 / 3) / 4, rel=1e-14, abs=0)
    inside = np.geomspace(1e-6, d, 20_000)
    assert energy(lambda x: burley(x, d), inside)[0] == pytest.approx(burley_within(d, d), abs=1e-4)
    assert burley_within(1e-12, 1.0) == pytest.approx(5e-13, rel=1e-9, abs=0)


def test_float32_and_whole_numbers_are_worked_in_double_precision() -> None:
    r, d = np.array([1, 0.5], np.float32), np.array([1, 3], np.float32)
    for call in (burley, burley_within, burley_distance):
        assert call(r, d).dtype == np.float64
        np.testing.assert_array_equal(call(r, d), call(r.astype(float), d.astype(float)))
        np.testing.assert_array_equal(call([1, 1], [1, 3]), call([1.0, 1.0], [1.0, 3.0]))
    tenth = np.array([0.1], np.float32)
    for call in (SKIN, SKIN.within, SKIN.spectrum):
        np.testing.assert_array_equal(call(tenth), call(tenth.astype(float)))
    wide, same = widened(SKIN, np.full(3, 0.1, np.float32)), widened(SKIN, np.full(3, 0.1, np.float32).astype(float))
    np.testing.assert_array_equal(wide.weights, same.weights)
    np.testing.assert_array_equal(fit_gaussians(tenth, 2).variances, fit_gaussians(tenth.astype(float), 2).variances)


def test_burley_distance_is_the_published_fit() -> None:
    """Christensen and Burley 2015: s = 1.85 - A + 7 |A - 0.8|^3."""
    assert burley_distance(0.8, 1.05) == pytest.approx(1.0, rel=1e-14, abs=0)
    assert burley_distance(0.3, 1.0) == pytest.approx(1 / (1.55 + 7 * 0.125), rel=1e-14, abs=0)
    assert burley_distance(1.0, 2.0) == pytest.approx(2 / (0.85 + 7 * 0.008), rel=1e-13, abs=0)


@pytest.mark.parametrize(("count", "alone", "together"), [(4, 0.020, 0.055), (6, 0.0081, 0.022), (8, 0.0035, 0.007)])
def test_fits_follow_burley_as_closely_as_is_written(count: int, alone: float, together: float) -> None:
    one = fit_gaussians(0.3, count)
    assert np.abs(one.within(R)[:, 0] - burley_within(R, 0.3)).max() < alone
    three = fit_gaussians(RGB, count)
    assert three.weights.shape == (count, 3)
    assert np.all(three.weights >= 0)
    np.testing.assert_allclose(three.weights.sum(axis=0), 1, atol=1e-12)
    assert np.abs(three.within(R) - burley_within(R[:, None], RGB)).max() < together


@pytest.mark.parametrize(("count", "alone", "together"), [(4, 0.015, 0.17), (6, 0.005, 0.04), (8, 0.005, 0.005)])
def test_fits_carry_light_as_far_as_burley_does(count: int, alone: float, together: float) -> None:
    """The mean of r^2 is 14 d^2; along one axis half of it."""
    for distances, least in ((0.3, alone), (RGB, together)):
        assert fit_gaussians(distances, count).mean_variance / np.square(distances) == pytest.approx(7, rel=least)


def test_a_fit_scales_with_the_distance() -> None:
    small, large = fit_gaussians(0.5, 5), fit_gaussians(2.0, 5)
    np.testing.assert_allclose(large.variances, 16 * small.variances, rtol=1e-9)
    np.testing.assert_allclose(large.weights, small.weights, atol=1e-9)


def test_six_gaussians_are_fitted_where_none_are_asked_for_at_the_ends_of_the_range_too() -> None:
    for distance in (1e-9, 1.0, 1e9):
        assert fit_gaussians(distance).variances.size == 6


def test_weights_of_a_fit_are_those_of_non_negative_least_squares() -> None:
    """Against Lawson and Hanson's NNLS in scipy, where a narrower target wants less than nothing of the wider one."""
    r = np.geomspace(0.01, 20, 200)[:, None]
    columns, wanted = -np.expm1(-(r**2) / [[2, 8]]), -np.expm1(-(r**2) / [[1.2, 4, 30]])
    found = _positive_weights(columns, wanted)
    firm = np.vstack([columns, 1e4 * np.ones(2)])
    for weights, target in zip(found.T, wanted.T):
        np.testing.assert_allclose(weights, nnls(firm, np.append(target, 1e4))[0], atol=1e-4)
    assert found[1, 0] == found[0, 2] == 0 < found.T[1].min()


def test_one_gaussian_is_enough_to_ask_for() -> None:
    one = fit_gaussians(1.0, 1)
    assert one.variances.size == 1
    np.testing.assert_allclose(one.weights, 1)
    half = one.within(np.sqrt(one.variances[0] * 2 * np.log(2)))[0]
    assert half == pytest.approx(0.5, rel=1e-12, abs=0)
    assert 0.1 < one.variances[0] < 3


@pytest.mark.parametrize("terms", [1, 2, 3, 4])
def test_widening_is_the_series_of_passes_through_the_skin(terms: int) -> None:
    """The exact transform is (1 - q) P/(1 - q P); what is left out is at most q^terms."""
    q = np.array([0.5, 0.3, 0.1])
    f = np.linspace(0, 30, 60)
    P = SKIN.spectrum(f)
    exact = (1 - q) * P / (1 - q * P)
    series = sum((1 - q) * q**j * P ** (j + 1) for j in range(terms - 1)) + q ** (terms - 1) * P**terms
    wide = widened(SKIN, q, terms)
    np.testing.assert_allclose(wide.spectrum(f), series, atol=1e-12)
    assert np.all(np.abs(wide.spectrum(f) - exact).max(axis=0) < q**terms)
    np.testing.assert_allclose(wide.weights.sum(axis=0), 1, atol=1e-12)
    assert np.all(wide.mean_variance >= SKIN.mean_variance * (1 - 1e-12))


def test_many_passes_widen_by_one_over_one_minus_q() -> None:
    """The variance of a geometric number of passes is that of one over 1 - q."""
    one = GaussianProfile([1.0, 3.0], [[0.5], [0.5]])
    assert widened(one, 0.4, 30).mean_variance[0] == pytest.approx(2 / 0.6, rel=1e-9, abs=0)
    assert widened(SKIN, 0.3).variances.size == 6 + 21 + 56


def test_a_film_that_sends_nothing_back_leaves_the_profile_as_it_is() -> None:
    same = widened(SKIN, 0.0)
    np.testing.assert_allclose(same(R), SKIN(R), rtol=1e-13)


def test_a_reduced_profile_is_near_with_fewer_gaussians() -> None:
    wide = widened(SKIN, [0.4, 0.25, 0.15])
    few = reduced(wide, 6)
    assert few.variances.size == 6
    assert np.abs(few.within(R) - wide.within(R)).max() < 0.02
    assert np.abs(reduced(wide, 10).within(R) - wide.within(R)).max() < 0.006
    assert reduced(SKIN, 1).variances.size == 1
    two = fit_gaussians(1.0, 2)
    assert np.abs(two.within(R)[:, 0] - burley_within(R, 1.0)).max() < 0.07
    assert reduced(SKIN, 6) is SKIN
    assert reduced(SKIN, 7) is SKIN
    assert np.abs(reduced(SKIN, 4).within(R) - SKIN.within(R)).max() < 0.06
    part = GaussianProfile([0.001, 0.01, 0.04, 0.25], [[0.2], [0.3], [0.3], [0.2]])
    thin = reduced(part, 3)
    assert thin.variances.size == 3
    assert 0 < thin.variances.max() < 1
    assert np.abs(thin.within(R) - part.within(R)).max() < 0.1


@pytest.mark.parametrize(
    ("variances", "weights", "message"),
    [
        ([1.0, 2.0], [[1.0]], "weights of shape"),
        ([1.0], [1.0], "weights of shape"),
        ([-1.0], [[1.0]], "^The variances of a profile must be more than 0 mm"),
        ([0.0], [[1.0]], "0 mm"),
        ([1.0, 2.0], [[0.5], [0.6]], "add up to 1"),
    ],
)
def test_what_is_no_profile_is_refused(variances: list, weights: list, message: str) -> None:
    with pytest.raises(MakeupError, match=message):
        GaussianProfile(variances, weights)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fit_gaussians(0.0), "must be positive numbers of mm.* not 0.0"),
        (lambda: fit_gaussians([1.0, np.nan]), "must be positive"),
        (lambda: fit_gaussians(np.inf), "must be positive"),
        (lambda: fit_gaussians([[1.0]]), "must be positive"),
        (lambda: fit_gaussians([]), "must be positive"),
        (lambda: fit_gaussians(1.0, 2.5), "number of Gaussians must be .* not 2.5"),
        (lambda: widened(SKIN, [0.1, 0.2]), "each of the 3 channels"),
        (lambda: fit_gaussians(1.0, 0), "number of Gaussians must be .* not 0"),
        (lambda: reduced(SKIN, 0), "number of Gaussians must be .* not 0"),
        (lambda: widened(SKIN, 1.0), "must be less than 1 .* not 1.0"),
        (lambda: widened(SKIN, -0.1), "must be less than 1"),
        (lambda: widened(SKIN, [0.1, np.nan, 0.1]), "must be less than 1"),
        (lambda: widened(SKIN, 0.1, 0), "number of terms must be .* not 0"),
    ],
)
def test_what_cannot_be_fitted_or_widened_is_refused(call, message: str) -> None:
    with pytest.raises(MakeupError, match=message):
        call()


def test_the_distance_of_diffuse_light_is_the_published_fit() -> None:
    """Christensen and Burley 2015, Eq 6, by hand at three albedos; larger the brighter the medium."""
    albedo = np.array([0.0, 0.8, 1.0])
    np.testing.assert_allclose(diffuse_distance(albedo, 2.0), 2 / np.array([4.14, 1.1, 1.04]), rtol=1e-14)
    assert diffuse_distance(1 + 1e-7, 1.0) == pytest.approx(1 / 1.04, rel=1e-5, abs=0)
    for values, said in (((1.5, 1.0), "The albedo of a medium"), ((0.5, -1.0), "The mean free path in mm")):
        with pytest.raises(MakeupError, match=f"^{said} must be a number from "):
            diffuse_distance(*values)
    with pytest.raises(MakeupError, match="do not go together"):
        diffuse_distance(np.full(2, 0.5), np.full(3, 1.0))


def test_a_reduced_profile_has_no_more_gaussians_than_asked() -> None:
    assert [reduced(SKIN, count).variances.size for count in (1, 2)] == [1, 2]
