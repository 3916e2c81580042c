"""The error bounds that the docstrings of the small functions give, against 40 digits; films and inversions have their sweep."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from km_makeup import optics

EPS = float(np.finfo(np.float64).eps)
AIR = optics.Interface(*(float(k) for k in optics.air_interface(1.5)))


def exact(x: float) -> mp.mpf:
    return mp.mpf(float(x))


def unit(count: int = 60) -> np.ndarray:
    """Numbers of 0..1, half of them small."""
    rng = np.random.default_rng(3)
    return np.concatenate([10 ** rng.uniform(-6, 0, count), rng.uniform(0, 1, count)])


@pytest.fixture(autouse=True)
def _forty_digits():
    with mp.workdps(40):
        yield


def test_the_surface_is_right_to_four_roundings() -> None:
    k1, k2 = exact(AIR.k1), exact(AIR.k2)
    for r in unit():
        seen = (1 - k1) * (1 - k2) * exact(r) / (1 - k2 * exact(r))
        assert abs(exact(optics.apparent(r, AIR)) - seen) <= 4 * EPS * seen
        assert abs(exact(optics.saunderson(r, AIR)) - seen - k1) <= 4 * EPS * (seen + k1)
        inside = exact(r) / ((1 - k1) * (1 - k2) + k2 * exact(r))
        assert abs(exact(optics.internal(r, AIR)) - inside) <= 4 * EPS * inside
        less = exact(r) - k1
        inside = less / ((1 - k1) * (1 - k2) + k2 * less)
        assert abs(exact(optics.unsaunderson(r, AIR)) - inside) <= 4 * EPS * (abs(inside) + k1)


def test_burley_is_right_to_four_roundings() -> None:
    rng = np.random.default_rng(4)
    for r, d in zip(10 ** rng.uniform(-4, 1.5, 100), 10 ** rng.uniform(-2, 1, 100), strict=True):
        x = exact(r) / exact(d)
        profile = (mp.exp(-x) + mp.exp(-x / 3)) / (8 * mp.pi * exact(d) * exact(r))
        assert abs(exact(optics.burley(r, d)) / profile - 1) <= 4 * EPS * (1 + x)
        share = 1 - mp.exp(-x) / 4 - 3 * mp.exp(-x / 3) / 4
        assert abs(exact(optics.burley_within(r, d)) / share - 1) <= 4 * EPS


def test_a_free_film_and_schlick_are_right_to_four_roundings() -> None:
    rng = np.random.default_rng(5)
    for R, share, cosine in zip(unit(50), rng.uniform(1e-3, 1, 100), rng.uniform(0, 1, 100), strict=True):
        T = share * (1 - R)
        A = max(1 - R - T, 0.0)
        k, s = optics.free_film(R, T, A)
        r, t, a = exact(R), exact(T), exact(A)
        q = mp.sqrt(a * (1 - r + t) * (1 + r - t) * (1 + r + t)) / 2
        if q:
            z = mp.asinh(q / t)
            assert abs(exact(s) / (z / q * r) - 1) <= 4 * EPS
            assert abs(exact(k) / (z / q * a * (1 - r + t) / 2) - 1) <= 4 * EPS
        fresnel = r + (1 - r) * (1 - exact(cosine)) ** 5
        assert abs(exact(optics.schlick(R, cosine)) / fresnel - 1) <= 4 * EPS


def test_unscattered_light_is_right_to_the_rounding_of_its_exponent() -> None:
    rng = np.random.default_rng(6)
    for K, S, X in 10 ** rng.uniform([-2, -2, -4], [2, 2, 0], (100, 3)):
        exponent = 2 * (exact(K) / 2 + 4 * exact(S) / (3 * (1 - exact(0.85)))) * exact(X)
        if exponent < 700:
            assert abs(exact(optics.unscattered(K, S, X)) / mp.exp(-exponent) - 1) <= 4 * EPS * (1 + exponent)


@pytest.mark.parametrize("index", [1e-6, 0.02, 0.7, 1 + 1e-9, 1.33, 3.9, 4.1, 20.0, 1e3, 1e6])
def test_diffuse_fresnel_is_right_for_any_index(index: float) -> None:
    with mp.workdps(80):
        m = exact(max(index, 1 / index)) if index >= 1 else 1 / exact(index)
        m2, p, q = m * m, m * m + 1, m * m - 1
        outside = (
            mp.mpf(1) / 2
            + (m - 1) * (3 * m + 1) / (6 * (m + 1) ** 2)
            + m2 * q * q / p**3 * mp.log((m - 1) / (m + 1))
            - 2 * m * m2 * (m2 + 2 * m - 1) / (p * p * q)
            + 8 * m2 * m2 * (m2 * m2 + 1) / (p * p * p * q * q) * mp.log(m)
        )
        inside = 1 - (1 - outside) / m2
    found = optics.fresnel_diffuse(index)
    outside, inside = (outside, inside) if index >= 1 else (inside, outside)
    assert float(found.external) == pytest.approx(float(outside), rel=2e-14, abs=0)
    assert float(found.internal) == pytest.approx(float(inside), rel=2e-14, abs=0)
