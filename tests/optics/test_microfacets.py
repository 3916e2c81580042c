"""Highlights: the formula, its extremes, its energy and how layers add up."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from scipy import integrate

from km_makeup.errors import MakeupError
from km_makeup.optics import HighlightRule, kelemen, kelemen_albedo, lay_highlights, schlick, unscattered

N = np.array([0.0, 0.0, 1.0])


def direction(theta: float, phi: float = 0.0) -> np.ndarray:
    """A unit vector at theta and phi degrees."""
    t, p = np.radians(theta), np.radians(phi)
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


def exact(normal, light, view, m: float, F0: float) -> float:
    """Eq 5 at 50 digits for just these numbers: Beckmann exp(-tan^2/m^2)/(pi m^2 cos^4), Schlick, over 2 (1 + L.V)."""
    with mp.workdps(50):
        n, light, view = ([mp.mpf(float(x)) for x in v] for v in (normal, light, view))
        h = [a + b for a, b in zip(light, view, strict=True)]
        hh, nh, nn = sum(x * x for x in h), sum(x * y for x, y in zip(n, h, strict=True)), sum(x * x for x in n)
        cos2 = nh**2 / (hh * nn)
        m, F0 = mp.mpf(m), mp.mpf(F0)
        beckmann = mp.exp(-(1 - cos2) / cos2 / m**2) / (mp.pi * m**2 * cos2**2)
        fresnel = F0 + (1 - F0) * (1 - mp.sqrt(hh) / 2) ** 5
        return float(beckmann * fresnel / hh)


@pytest.mark.parametrize("m", [1e-3, 0.01, 0.1, 0.35, 1.0])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_the_brdf_is_equation_5_at_all_angles(m: float, dtype: type) -> None:
    rng = np.random.default_rng(8)
    for theta in (0.0, 20.0, 45.0, 80.0, 89.9):
        for _ in range(12):
            view = direction(theta, rng.uniform(0, 360))
            mirror = view * [-1, -1, 1]
            light = mirror + rng.normal(0, 2 * m * max(view[2], 0.02), 3)
            light = light / np.linalg.norm(light)
            if light[2] <= 0:
                continue
            normal, light, view = N.astype(dtype), light.astype(dtype), view.astype(dtype)
            ours = kelemen(normal, light, view, m, 0.04)
            assert ours.dtype == dtype
            wanted = exact(normal, light, view, m, 0.04)
            close = 4e-7 if dtype is np.float32 else (1e-10 if m < 0.01 else 1e-12)
            assert ours == pytest.approx(wanted, rel=close, abs=1e-37 if dtype is np.float32 else 1e-290)


def test_a_mirror_view_along_the_normal_has_the_known_peak() -> None:
    """1/(pi m^2) F0/4: the 1/pi is there."""
    for m in (0.01, 0.3, 1.0):
        assert kelemen(N, N, N, m, 0.04) == pytest.approx(0.04 / (4 * np.pi * m * m), rel=1e-14, abs=0)
    assert kelemen(5 * N, direction(10), direction(30, 180), 0.3, 0.04) == pytest.approx(
        float(kelemen(N, direction(10), direction(30, 180), 0.3, 0.04)), rel=1e-13, abs=0
    )


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_no_direction_or_roughness_gives_nan_infinity_or_less_than_nothing(dtype: type) -> None:
    rng = np.random.default_rng(4)
    v = rng.normal(size=(3, 20_000, 3))
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    normal, light, view = v
    light[:2000] = -view[:2000]
    light[2000:4000] = view[2000:4000]
    normal[4000:6000] = view[4000:6000]
    light[6000:8000] = direction(89.9999)
    view[6000:8000] = direction(89.9999, 180)
    normal[6000:8000] = N
    light[8000:8100], view[8000:8100], normal[8000:8100] = [1, 0, 1e-9], [-1, 0, 1e-9], N
    roughness = np.where(rng.random(20_000) < 0.1, 0.0, 10 ** rng.uniform(-3, 0, 20_000))
    with np.errstate(all="raise", under="ignore"):
        ours = kelemen(*(x.astype(dtype) for x in (normal, light, view)), roughness.astype(dtype), 0.04)
    assert ours.shape == (20_000,)
    assert ours.dtype == dtype
    assert np.all(np.isfinite(ours))
    assert np.all(ours >= 0)
    assert ours.max() > 0


def test_below_the_surface_there_is_no_highlight() -> None:
    up, down, level = direction(30), direction(120), np.array([1.0, 0.0, 0.0])
    for light, view in ((down, up), (up, down), (down, down), (level, up), (up, level)):
        assert kelemen(N, light, view, 1.0, 0.04) == 0
    assert kelemen(N, up, up, 1.0, 0.04) > 0


def test_many_directions_at_once_are_each_alone() -> None:
    """Normals of any length, lights and eyes on both sides, in an array of two axes."""
    rng = np.random.default_rng(21)
    v = rng.normal(size=(3, 6, 5, 3))
    v[1:] /= np.linalg.norm(v[1:], axis=-1, keepdims=True)
    normal, light, view = v
    m, F0 = rng.uniform(0.1, 1, (6, 5)), rng.uniform(0.02, 0.5, 5)
    ours = kelemen(normal, light, view, m, F0)
    assert ours.shape == (6, 5)
    assert np.count_nonzero(ours) > 3
    for i, j in np.ndindex(6, 5):
        above = normal[i, j] @ light[i, j] > 0 and normal[i, j] @ view[i, j] > 0
        wanted = exact(normal[i, j], light[i, j], view[i, j], m[i, j], F0[j]) if above else 0
        assert ours[i, j] == pytest.approx(wanted, rel=1e-11, abs=1e-300)
    one_normal = kelemen(
        np.float32([0, 0, 1]), light.astype(np.float32), view.astype(np.float32), m.astype(np.float32), 0.04
    )
    assert (one_normal.shape, one_normal.dtype) == ((6, 5), np.float32)


def test_float32_and_whole_numbers_are_worked_in_double_precision() -> None:
    """Roughness and F0 in float32 mean the numbers they are; whole directions are directions."""
    light, view = direction(20), direction(40, 150)
    m, F0 = np.float32(0.013), np.float32(0.04)
    assert kelemen(N, light, view, np.array([m]), np.array([F0]))[0] == pytest.approx(
        exact(N, light, view, float(m), float(F0)), rel=1e-11, abs=0
    )
    assert kelemen([0, 0, 1], [0, 0, 1], [0, 0, 1], 1, 1) == pytest.approx(1 / (4 * np.pi), rel=1e-15, abs=0)
    single = kelemen_albedo(np.linspace(0.1, 1, 5, dtype=np.float32), np.float32(0.3), np.float32(0.04))
    double = kelemen_albedo(
        np.linspace(0.1, 1, 5, dtype=np.float32).astype(float), float(np.float32(0.3)), float(np.float32(0.04))
    )
    np.testing.assert_array_equal(single, double.astype(np.float32))


def test_light_and_eye_may_change_places() -> None:
    rng = np.random.default_rng(6)
    v = np.abs(rng.normal(size=(2, 200, 3)))
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    np.testing.assert_allclose(kelemen(N, v[0], v[1], 0.4, 0.04), kelemen(N, v[1], v[0], 0.4, 0.04), rtol=1e-13)


def test_roughness_below_the_least_is_drawn_as_the_least() -> None:
    assert (
        kelemen(N, N, N, 0.0, 0.04) == kelemen(N, N, N, 1e-3, 0.04) == pytest.approx(0.01e6 / np.pi, rel=1e-12, abs=0)
    )
    assert kelemen_albedo(0.5, 0.0, 0.04) == kelemen_albedo(0.5, 1e-3, 0.04)


def test_schlick_goes_from_f0_to_one() -> None:
    assert schlick(0.04, 1.0) == 0.04
    assert schlick(0.04, 0.0) == 1
    assert schlick(0.04, 0.5) == pytest.approx(0.04 + 0.96 / 32, rel=1e-15, abs=0)
    assert schlick(0.04, 1.0000001) == 0.04
    assert schlick(0.04, -0.1) == 1
    assert schlick(0.04, 2.0) == 0.04


@pytest.mark.parametrize(("m", "F0"), [(0.1, 0.04), (0.3, 0.04), (0.3, 1.0), (1.0, 0.04), (1.0, 1.0)])
@pytest.mark.parametrize("cos_view", [1.0, 0.6, 0.15])
def test_directional_albedo_is_the_integral_of_the_brdf(m: float, F0: float, cos_view: float) -> None:
    view = np.array([np.sqrt(1 - cos_view**2), 0.0, cos_view])
    phi = np.pi * (np.arange(200) + 0.5) / 200

    def ring(theta: float) -> float:
        light = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.full(200, np.cos(theta))], -1)
        return 2 * np.pi * np.mean(kelemen(N, light, view, m, F0)) * np.cos(theta) * np.sin(theta)

    mirror = np.arccos(cos_view)
    integral = integrate.quad(
        ring, 0, np.pi / 2, limit=300, points=[mirror] if 0 < mirror < 1.5 else None, epsrel=1e-5
    )[0]
    assert kelemen_albedo(cos_view, m, F0) == pytest.approx(integral, abs=3e-3)


def test_a_smooth_surface_reflects_its_fresnel_reflectance() -> None:
    for cos_view in (1.0, 0.7, 0.4):
        assert kelemen_albedo(cos_view, 1e-3, 0.04) == pytest.approx(schlick(0.04, cos_view), rel=1e-4, abs=0)


def test_the_albedo_never_makes_light() -> None:
    cos_view, m = np.meshgrid(np.linspace(0.001, 1, 40), np.geomspace(1e-3, 1, 20))
    albedo = kelemen_albedo(cos_view.astype(np.float32), m.astype(np.float32), 1.0)
    assert albedo.shape == cos_view.shape
    assert albedo.dtype == np.float32
    assert albedo.max() <= 1.0
    assert albedo.min() > 0.3


def test_unscattered_light_through_a_foundation_is_what_is_written_of_it() -> None:
    """OPTICS.md: through 20 um of foundation .19 at g = 0 and 2e-5 at g = .85."""
    K, S, X = 0.5, 30.0, 0.02
    assert unscattered(K, S, X, g=0.0) == pytest.approx(np.exp(-2 * (0.25 + 40) * 0.02), rel=1e-14, abs=0)
    assert unscattered(K, S, X, g=0.0) == pytest.approx(0.2, abs=0.02)
    assert unscattered(K, S, X) == pytest.approx(np.exp(-2 * (0.25 + 40 / 0.15) * 0.02), rel=1e-14, abs=0)
    assert unscattered(K, S, 0.0) == 1
    assert unscattered(0.0, 0.0, 1.0) == 1
    assert unscattered(4.0, 0.0, 0.5) == pytest.approx(np.exp(-2), rel=1e-15, abs=0)
    assert unscattered(np.float32([1, 2]), 1.0, 0.1).dtype == np.float32


@pytest.mark.parametrize("g", [1.0, -1.0, 2.0, np.nan])
def test_an_impossible_mean_cosine_is_refused(g: float) -> None:
    with pytest.raises(MakeupError, match="between -1 and 1"):
        unscattered(1.0, 1.0, 1.0, g)


def test_highlights_are_laid_bottom_to_top_by_either_rule() -> None:
    skin, first, second = 0.5, 2.0, 3.0
    T, coverage = [0.4, 0.9], [1.0, 0.25]
    paper = lay_highlights([skin, first, second], T, coverage, HighlightRule.PAPER)
    assert paper == pytest.approx((0.5 * 0.4 + 2.0) * 0.9 + 0.25 * 3.0, rel=1e-15, abs=0)
    physical = lay_highlights([skin, first, second], T, coverage)
    assert physical == pytest.approx((0.5 * 0 + 2.0) * 0.75 + 0.25 * 3.0, rel=1e-15, abs=0)
    assert physical == lay_highlights([skin, first, second], T, coverage, HighlightRule.COVERAGE)


def test_a_film_that_is_not_there_leaves_the_highlight_alone() -> None:
    for rule in HighlightRule:
        assert lay_highlights([0.7, 9.0], [1.0], [0.0], rule) == 0.7
        assert lay_highlights([0.7], [], [], rule) == 0.7
    maps = lay_highlights([np.full((4, 1), 0.7, np.float32), 9.0], [0.5], [np.linspace(0, 1, 3, dtype=np.float32)])
    assert maps.shape == (4, 3)
    assert maps.dtype == np.float32


@pytest.mark.parametrize(("T", "coverage"), [([], []), ([0.5], []), ([], [0.5]), ([0.5, 0.5], [1, 1])])
def test_lists_that_do_not_fit_are_refused(T: list, coverage: list) -> None:
    with pytest.raises(MakeupError, match=r"2 highlights .* need 1 transmittances and coverages"):
        lay_highlights([0.5, 0.5], T, coverage)
