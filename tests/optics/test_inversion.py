"""K and S from one film: exact where they are determined, a status where they are not, errors that are true."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from km_makeup.optics import (
    Status,
    air_interface,
    film,
    film_over,
    free_film,
    invert,
    invert_backings,
    opaque_reflectance,
    saunderson,
)
from km_makeup.optics.sensitivity import opaque_sensitivity, over_sensitivity
from tests.optics import oracle

k_values = st.floats(1e-4, 20.0)
X_values = st.floats(1e-3, 5.0)
AIR = air_interface(1.5)


def backings(K, S, X, g_1=0.05, g_2=0.85):
    """Two-backing inversion of exact readings."""
    return invert_backings(film_over(K, S, X, g_1), g_1, film_over(K, S, X, g_2), g_2, X)


@given(k=k_values, s=k_values, X=X_values, Rg=st.floats(0.0, 1.0))
@settings(max_examples=200, deadline=None)
def test_inversion_of_an_exact_film_gives_it_back(k: float, s: float, X: float, Rg: float) -> None:
    K, S = k / X, s / X
    result = invert(opaque_reflectance(K, S), film_over(K, S, X, Rg), Rg, X)
    assume(max(result.K_condition, result.S_condition) < 1e11)
    assert result.status == Status.OK
    assert result.K == pytest.approx(K, rel=1e-15 * float(result.K_condition) * 50, abs=0)
    assert result.S == pytest.approx(S, rel=1e-15 * float(result.S_condition) * 50, abs=0)


@given(k=k_values, s=k_values, X=X_values, g_1=st.floats(0.0, 0.45), g_2=st.floats(0.55, 1.0), turn=st.booleans())
@settings(max_examples=200, deadline=None)
def test_inversion_over_two_backings_gives_the_film_back_in_either_order(k, s, X, g_1, g_2, turn) -> None:
    K, S = k / X, s / X
    result = backings(K, S, X, *((g_2, g_1) if turn else (g_1, g_2)))
    assume(max(result.K_condition, result.S_condition) < 1e11)
    assert result.status == Status.OK
    assert result.K == pytest.approx(K, rel=5e-14 * float(result.K_condition), abs=0)
    assert result.S == pytest.approx(S, rel=5e-14 * float(result.S_condition), abs=0)


def test_both_above_the_opaque_reflectance_has_a_real_answer() -> None:
    """A dark film on white: the printed arc hyperbolic cotangents are NaN here."""
    K, S, X = 8.0, 2.0, 0.05
    R_inf, R = opaque_reflectance(K, S), film_over(K, S, X, 0.9)
    assert R > R_inf
    result = invert(R_inf, R, 0.9, X)
    assert (result.K, result.S) == (pytest.approx(K, rel=1e-14, abs=0), pytest.approx(S, rel=1e-14, abs=0))


def test_films_without_scattering_or_absorption_are_found() -> None:
    """R_inf = 0: S = 0, K X = ln(Rg/R)/2. R_inf = 1: K = 0, S X = (R - Rg)/((1 - R)(1 - Rg))."""
    dye = invert(0.0, 0.2, 0.8, 0.5)
    assert (dye.status, dye.S) == (Status.OK, 0)
    assert dye.K == pytest.approx(np.log(4) / 2 / 0.5, rel=1e-15, abs=0)
    white = invert(1.0, 0.7, 0.4, 0.5)
    assert (white.status, white.K) == (Status.OK, 0)
    assert white.S == pytest.approx(0.3 / (0.3 * 0.6) / 0.5, rel=1e-14, abs=0)
    for K, S in ((3.0, 0.0), (0.0, 3.0)):
        both = backings(K, S, 0.2)
        assert both.status == Status.OK
        assert both.K == pytest.approx(K, rel=1e-13, abs=1e-13)
        assert both.S == pytest.approx(S, rel=1e-13, abs=1e-13)


def test_white_on_white_keeps_its_digits() -> None:
    """1 - Rg R_inf written as such loses up to 3e-9 here."""
    K, S, X, Rg = 1e-9, 50.0, 0.02, 1 - 1e-9
    R_inf, R = opaque_reflectance(K, S), film_over(K, S, X, Rg)
    result = invert(R_inf, R, Rg, X)
    assert abs(result.S / S - 1) < 5e-15 * result.S_condition


@pytest.mark.parametrize("power", [10, 20, 30, 40])
def test_white_on_white_is_exact_for_the_numbers_that_are_given(power: int) -> None:
    """All differences of these readings are exact in binary; 1 - Rg R_inf multiplied out is not (5e-10 off at 30)."""
    step = 2.0**-power
    R_inf, R, Rg = 1 - step, 1 - 1.25 * step, 1 - 1.5 * step
    with mp.workdps(50):
        a, r, g = (mp.mpf(v) for v in (R_inf, R, Rg))
        w = mp.log((a - g) * (1 - r * a) / ((a - r) * (1 - g * a))) / (1 - a * a)
        S, K = float(a * w), float((1 - a) ** 2 * w / 2)
    result = invert(R_inf, R, Rg, 1.0)
    assert result.S == pytest.approx(S, rel=2e-15, abs=0)
    assert result.K == pytest.approx(K, rel=2e-15, abs=0)


class TestStatus:
    """What cannot be inverted says so, with finite values that mean something."""

    def test_an_opaque_film_gives_the_ratio_and_a_lower_bound(self) -> None:
        K, S, X = 30.0, 20.0, 3.0
        R_inf = opaque_reflectance(K, S)
        for result in (invert(R_inf, R_inf, 0.05, X), invert_backings(R_inf, 0.05, R_inf, 0.9, X)):
            assert result.status == Status.OPAQUE
            assert result.K / result.S == pytest.approx(K / S, rel=1e-12, abs=0)
            assert 1e-8 < film(result.K, result.S, X).T < 1e-6 or film(result.K, result.S, X).T < 1e-12
            assert result.K < K
            assert result.K_error == result.K
            assert result.K_condition == np.finfo(float).max

    def test_an_opaque_film_over_a_backing_of_its_own_colour_is_opaque(self) -> None:
        result = invert(0.3, 0.3, 0.3, 1.0)
        assert result.status == Status.OPAQUE
        assert result.K / result.S == pytest.approx(0.7**2 / 0.6, rel=1e-14, abs=0)

    def test_a_film_that_changes_nothing_is_no_film(self) -> None:
        for result in (invert(0.6, 0.2, 0.2, 1.0), invert_backings(0.1, 0.1, 0.8, 0.8, 1.0)):
            assert (result.status, result.K, result.S) == (Status.NO_FILM, 0, 0)

    @pytest.mark.parametrize(
        ("R_inf", "R", "Rg", "opaque"),
        [
            (0.6, 0.7, 0.2, True),
            (0.6, 0.1, 0.2, False),
            (0.2, 0.1, 0.6, True),
            (0.2, 0.7, 0.6, False),
            (0.4, 0.5, 0.4, False),
        ],
    )
    def test_a_reading_beyond_either_end_is_inconsistent(self, R_inf, R, Rg, opaque) -> None:
        result = invert(R_inf, R, Rg, 0.5)
        assert result.status == Status.INCONSISTENT
        if opaque:
            assert film_over(result.K, result.S, 0.5, Rg) == pytest.approx(R_inf, abs=1e-9)
        else:
            assert (result.K, result.S) == (0, 0)

    def test_two_backings_that_no_film_explains_are_inconsistent(self) -> None:
        crossed = invert_backings(0.5, 0.1, 0.4, 0.8, 0.5)  # darker over white than over black
        too_dark = invert_backings(0.01, 0.2, 0.5, 0.8, 0.5)  # needs R0 < 0
        too_bright = invert_backings(0.5, 0.1, 0.9, 0.85, 0.5)  # needs A < 0
        assert [r.status for r in (crossed, too_dark, too_bright)] == [Status.INCONSISTENT] * 3
        assert film(crossed.K, crossed.S, 0.5).R == pytest.approx(0.45, abs=1e-9)
        assert too_dark.S == 0
        assert too_dark.K > 0
        assert too_bright.K == 0
        assert too_bright.S > 0

    @pytest.mark.parametrize("wrong", [-0.01, 1.01, np.nan, np.inf])
    def test_what_is_no_reflectance_is_out_of_range(self, wrong: float) -> None:
        good = [0.6, 0.4, 0.1]
        for place in range(3):
            values = [wrong if i == place else v for i, v in enumerate(good)]
            result = invert(*values, 1.0)
            assert (result.status, result.K, result.S) == (Status.OUT_OF_RANGE, 0, 0)
        good = [0.3, 0.05, 0.6, 0.9]
        for place in range(4):
            values = [wrong if i == place else v for i, v in enumerate(good)]
            result = invert_backings(*values, 1.0)
            assert (result.status, result.K, result.S) == (Status.OUT_OF_RANGE, 0, 0)

    @pytest.mark.parametrize("X", [0.0, -1.0, np.nan, np.inf])
    def test_what_is_no_thickness_is_out_of_range(self, X: float) -> None:
        for result in (invert(0.6, 0.4, 0.1, X), invert_backings(0.3, 0.05, 0.6, 0.9, X)):
            assert (result.status, result.K, result.S) == (Status.OUT_OF_RANGE, 0, 0)
            assert (result.K_error, result.S_error) == (0, 0)

    def test_two_backings_alike_are_out_of_range(self) -> None:
        result = invert_backings(0.3, 0.5, 0.3, 0.5, 1.0)
        assert (result.status, result.K, result.S) == (Status.OUT_OF_RANGE, 0, 0)

    def test_a_film_of_the_colour_of_one_backing_is_still_a_film(self) -> None:
        R_inf = float(opaque_reflectance(0.5, 40.0))
        for g_1, g_2 in ((0.05, R_inf), (R_inf, 0.99)):
            result = backings(0.5, 40.0, 0.05, g_1, g_2)
            assert result.status == Status.OK
            assert result.K == pytest.approx(0.5, rel=1e-9)

    def test_what_noise_alone_makes_unphysical_is_taken_as_the_nearest_film(self) -> None:
        """Backings near each other spread the noise: R0 = -.02 or A = -.02 are nothing then, and much without noise."""
        dark = [0.3 * (0.9 / 1.0), 0.3, 0.5 * 0.96, 0.5]
        clear = [0.322, 0.3, 0.517, 0.5]
        for readings in (dark, clear):
            assert invert_backings(*readings, 0.1, noise=0.004).status == Status.OK
            assert invert_backings(*readings, 0.1).status == Status.INCONSISTENT
        assert invert_backings(*dark, 0.1, noise=0.004).S == 0
        assert invert_backings(*clear, 0.1, noise=0.004).K == 0

    def test_a_reading_below_the_first_reflection_is_out_of_range(self) -> None:
        assert invert(0.5, 0.3, 0.03, 1.0, interface=AIR).status == Status.OUT_OF_RANGE
        assert invert(0.5, 0.3, 0.03, 1.0, interface=AIR, specular_included=False).status == Status.OK

    def test_one_bad_wavelength_does_not_touch_the_others(self) -> None:
        R_inf, R = np.array([0.6, np.nan, 0.6]), np.array([0.4, 0.4, 0.4])
        result = invert(R_inf, R, 0.1, 0.5)
        np.testing.assert_array_equal(result.status, [Status.OK, Status.OUT_OF_RANGE, Status.OK])
        assert result.K[0] == result.K[2] == invert(0.6, 0.4, 0.1, 0.5).K

    def test_equality_is_judged_by_the_noise_that_is_given(self) -> None:
        assert invert(0.6, 0.59, 0.1, 1.0).status == Status.OK
        assert invert(0.6, 0.59, 0.1, 1.0, noise=0.01).status == Status.OPAQUE
        assert invert(0.6, 0.61, 0.1, 1.0, noise=0.01).status == Status.OPAQUE
        assert invert(0.6, 0.11, 0.1, 1.0, noise=0.01).status == Status.NO_FILM
        assert invert(0.6, 0.59, 0.1, 1.0, noise=0.01 / 4.3).status == Status.OK
        assert invert(0.6, 0.59, 0.1, 1.0, noise=0.01 / 4.2).status == Status.OPAQUE
        assert invert_backings(0.5, 0.1, 0.49, 0.8, 1.0, noise=0.01).status == Status.OPAQUE
        assert invert_backings(0.11, 0.1, 0.79, 0.8, 1.0, noise=0.01).status == Status.NO_FILM
        assert invert_backings(0.11, 0.1, 0.79, 0.8, 1.0).status == Status.OK


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_everything_broadcasts_and_keeps_its_dtype(dtype: type) -> None:
    K = np.array([[2.0], [5.0]], dtype)
    S = np.array([[4.0, 8.0, 1.0]], dtype)
    X = np.full((), 0.1, dtype)
    g = np.array([0.1, 0.2, 0.3], dtype)
    one = invert(opaque_reflectance(K, S), film_over(K, S, X, g), g, X)
    two = invert_backings(film_over(K, S, X, g), g, film_over(K, S, X, g + dtype(0.5)), g + dtype(0.5), X)
    for result in (one, two):
        assert result.status.shape == (2, 3)
        assert result.status.dtype == np.uint8
        for values in (result.K, result.S, result.K_condition, result.S_condition, result.K_error, result.S_error):
            assert (values.shape, values.dtype) == ((2, 3), dtype)
        np.testing.assert_allclose(result.K, np.broadcast_to(K, (2, 3)), rtol=3e-4 if dtype is np.float32 else 1e-12)


def test_no_input_gives_a_warning_nan_or_negative_value() -> None:
    rng = np.random.default_rng(3)
    edges = np.array([0.0, 1e-300, 1e-17, 1e-9, 0.5, 1 - 1e-16, 1.0])
    beyond = np.array([-np.inf, -1e30, 0.5, 1e30, np.inf, np.nan])
    values = np.concatenate(
        [
            rng.uniform(-0.1, 1.1, (4, 10_000)),
            *(np.array(np.meshgrid(*[e] * 4)).reshape(4, -1) for e in (edges, beyond)),
        ],
        axis=1,
    )
    with np.errstate(divide="raise", invalid="raise", over="raise"):
        for noise, interface in ((0.0, None), (0.003, None), (0.003, AIR)):
            for dtype in (np.float64, np.float32):
                v = values.astype(dtype)
                X = np.resize(np.array([0.1, 0.1, 0.1, 0.0, -1.0, np.inf, np.nan], dtype), v.shape[1])
                for result in (
                    invert(*v[:3], X, noise=noise, interface=interface),
                    invert_backings(*v, X, noise=noise, interface=interface),
                ):
                    for part in (
                        result.K,
                        result.S,
                        result.K_error,
                        result.S_error,
                        result.K_condition,
                        result.S_condition,
                    ):
                        assert np.all(np.isfinite(part))
                        assert np.all(part >= 0)


@pytest.mark.parametrize("specular_included", [True, False])
def test_the_interface_is_taken_off_all_readings(specular_included: bool) -> None:
    K, S, X = np.array([2.0, 10.0]), np.array([20.0, 5.0]), 0.05

    def read(R):
        return saunderson(R, AIR, specular_included=specular_included)

    options = {"interface": AIR, "specular_included": specular_included}
    if specular_included:
        del options["specular_included"]  # it is what is taken unless said otherwise
    one = invert(read(opaque_reflectance(K, S)), read(film_over(K, S, X, 0.1)), read(0.1), X, **options)
    two = invert_backings(
        read(film_over(K, S, X, 0.1)), read(0.1), read(film_over(K, S, X, 0.9)), read(0.9), X, **options
    )
    for result in (one, two):
        np.testing.assert_allclose(result.K, K, rtol=1e-12)
        np.testing.assert_allclose(result.S, S, rtol=1e-12)


@pytest.mark.parametrize("interface", [None, AIR])
@pytest.mark.parametrize("method", ["invert", "invert_backings"])
def test_standard_errors_are_the_scatter_of_repeated_readings(method: str, interface) -> None:
    K, S, X, noise = 4.0, 25.0, 0.03, 2e-4
    rng = np.random.default_rng(11)

    def read(R):
        exact = R if interface is None else saunderson(R, interface)
        return exact + rng.normal(0, noise, 20_000)

    def look(*readings):
        call = invert if method == "invert" else invert_backings
        return call(*readings, X, noise=noise, interface=interface)

    R_b, R_w = film_over(K, S, X, 0.05), film_over(K, S, X, 0.85)
    if method == "invert":
        result = look(read(opaque_reflectance(K, S)), read(R_b), read(0.05))
    else:
        result = look(read(R_b), read(0.05), read(R_w), read(0.85))
    assert np.all(result.status == Status.OK)
    for values, errors in ((result.K, result.K_error), (result.S, result.S_error)):
        assert 0.93 < np.median(errors) / np.std(values) < 1.07


@pytest.mark.parametrize(("K", "S", "X"), [(4.0, 25.0, 0.03), (0.2, 60.0, 0.02), (50.0, 3.0, 0.01)])
def test_the_condition_is_the_sum_of_the_sensitivities_to_every_reading(K: float, S: float, X: float) -> None:
    """On a black backing there is nothing but R_inf, R and X; on others the backing's share joins that of its reading."""
    with mp.workdps(60):
        on_black = oracle.conditions(lambda k, s: (oracle.opaque(k, s), oracle.film_over(k, s, X, 0.0)), K, S, [])
        both = oracle.conditions(
            lambda k, s: (oracle.film_over(k, s, X, 0.0), oracle.film_over(k, s, X, 0.9)), K, S, []
        )
    one = invert(opaque_reflectance(K, S), film_over(K, S, X, 0.0), 0.0, X)
    assert one.K_condition == pytest.approx(float(on_black[0]), rel=1e-6, abs=0)
    assert one.S_condition == pytest.approx(float(on_black[1]), rel=1e-6, abs=0)
    two = backings(K, S, X, 0.0, 0.9)
    assert 1 < two.K_condition / float(both[0]) < 2.5
    assert 1 < two.S_condition / float(both[1]) < 2.5


@pytest.mark.parametrize(("g_1", "g_2"), [(0.0, 0.9), (0.2, 0.7), (0.05, 0.4)])
def test_the_condition_over_two_backings_is_by_differences(g_1: float, g_2: float) -> None:
    """1 for the thickness, and of every backing's two readings the root of the sum of squares of their slopes."""
    K, S, X, h = 4.0, 25.0, 0.03, 1e-6
    exact = np.array([film_over(K, S, X, g_1), g_1, film_over(K, S, X, g_2), g_2])

    def logarithms(readings) -> np.ndarray:
        result = invert_backings(*readings, X)
        return np.log([result.K, result.S])

    steps = np.exp(h * np.eye(4))
    slope = np.array([(logarithms(exact * s) - logarithms(exact / s)) / (2 * h) for s in steps])
    total = 1 + np.hypot(slope[0], slope[1]) + np.hypot(slope[2], slope[3])
    found = backings(K, S, X, g_1, g_2)
    np.testing.assert_allclose([found.K_condition, found.S_condition], total, rtol=1e-5)


def test_readings_at_and_beyond_the_ends_of_an_interface() -> None:
    black = float(AIR.k1)  # internally 0
    assert invert(0.5, 0.3, black, 1.0, interface=AIR).status == Status.OK
    assert invert_backings(0.2, black, 0.6, 0.8, 1.0, interface=AIR).status == Status.OK
    assert invert(0.5, 0.3, 0.99, 1.0, interface=AIR, specular_included=False).status == Status.OUT_OF_RANGE
    single = invert(*np.array([[0.5], [0.3], [0.1]], np.float32), 1.0, interface=AIR, noise=0.001)
    assert single.K.dtype == single.K_error.dtype == single.S_condition.dtype == np.float32
    double = invert(np.array([0.5]), 0.3, 0.1, 1.0, interface=AIR, noise=0.001)
    assert single.K_error == pytest.approx(double.K_error, rel=1e-4, abs=0)


def test_the_order_of_the_backings_makes_no_difference_to_errors_either() -> None:
    R_1, R_2 = saunderson(film_over(4.0, 25.0, 0.03, 0.05), AIR), saunderson(film_over(4.0, 25.0, 0.03, 0.85), AIR)
    g_1, g_2 = saunderson(0.05, AIR), saunderson(0.85, AIR)
    one = invert_backings(R_1, g_1, R_2, g_2, 0.03, noise=0.003, interface=AIR)
    other = invert_backings(R_2, g_2, R_1, g_1, 0.03, noise=0.003, interface=AIR)
    for name in ("K", "S", "K_error", "S_error", "K_condition", "S_condition"):
        assert getattr(one, name) == getattr(other, name)
    assert 0 < one.S_error < one.S


@pytest.mark.parametrize(("T", "gap"), [(0.5, 0.2), (0.3, 0.5)])
def test_noise_may_push_the_absorptance_as_far_below_zero_as_is_written(T: float, gap: float) -> None:
    """Three sigma of the contrast move R by (g1 + g2)/gap of them and T by 1/(gap T); beyond both it is no film."""
    noise, g_1, g_2 = 1e-3, 0.6 - gap, 0.6
    three_sigma = 3 * np.hypot(noise, noise)
    most = three_sigma * ((g_1 + g_2) / gap + 1 / (gap * T))
    for share, status in ((0.95, Status.OK), (1.05, Status.INCONSISTENT)):
        R = 1 - T + share * most  # so that A = 1 - R - T is below 0
        R_1, R_2 = (R + T * T * g / (1 - R * g) for g in (g_1, g_2))
        assert invert_backings(R_1, g_1, R_2, g_2, 1.0, noise=noise).status == status


def test_free_film_gives_back_any_film_from_reflectance_and_transmittance() -> None:
    rng = np.random.default_rng(2)
    k, s = 10 ** rng.uniform(-2, 0.7, (2, 500))
    R, T, A = film(k, s, 1.0)
    for given_A in (None, A):
        back = free_film(R, T, given_A)
        np.testing.assert_allclose(back[0], k, rtol=1e-9 if given_A is None else 1e-12)
        np.testing.assert_allclose(back[1], s, rtol=1e-9 if given_A is None else 1e-12)
    assert free_film(0.5, 0.5, 0.0) == (0, pytest.approx(1, rel=1e-15, abs=0))
    assert free_film(0.0, 0.25) == (pytest.approx(np.log(4), rel=1e-14, abs=0), 0)
    assert free_film(-1e-7, 0.25, 0.75) == free_film(0.0, 0.25, 0.75)  # a rounding, not less than nothing


@given(k=st.floats(1e-3, 8.0), s=st.floats(1e-3, 30.0), g=st.floats(0.0, 1.0))
@settings(max_examples=150, deadline=None)
def test_sensitivities_are_the_derivatives(k: float, s: float, g: float) -> None:
    h = 1e-5
    ours = over_sensitivity(k, s, g)
    assert ours.R == pytest.approx(film_over(k, s, 1.0, g), abs=1e-15 * (1 + k + s))

    def slope(f):
        return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)

    assert ours.k == pytest.approx(slope(lambda d: film_over(k * (1 + d), s, 1.0, g)), abs=2e-10)
    assert ours.s == pytest.approx(slope(lambda d: film_over(k, s * (1 + d), 1.0, g)), abs=2e-10)
    assert ours.g == pytest.approx(
        slope(lambda d: film_over(k, s, 1.0, g + 2 + d) if False else over_g(k, s, g + d)), abs=2e-10
    )
    to_K, to_S = opaque_sensitivity(k, s)
    assert to_K == pytest.approx(slope(lambda d: opaque_reflectance(k * (1 + d), s)), abs=2e-10)
    assert to_S == pytest.approx(slope(lambda d: opaque_reflectance(k, s * (1 + d))), abs=2e-10)


def over_g(k: float, s: float, g: float) -> float:
    """A film over a backing, any g."""
    R, T, _ = film(k, s, 1.0)
    return float(R + T * T * g / (1 - R * g))


def test_sensitivities_hold_where_the_film_vanishes() -> None:
    assert tuple(over_sensitivity(0.0, 0.0, 0.4)) == (0.4, 0, 0, 1)
    assert opaque_sensitivity(0.0, 0.0) == (0, 0)
    assert over_sensitivity(0.0, 2.0, 0.3).R == pytest.approx(film_over(0.0, 2.0, 1.0, 0.3), rel=1e-15, abs=0)
    assert over_sensitivity(np.float32([0, 1]), np.float32([2, 2]), 0.3).s.dtype == np.float32
    thin = over_sensitivity(1e-9, 1e-9, 0.4)
    assert thin.k == pytest.approx(-2 * 0.4 * 1e-9, rel=1e-6, abs=0)
    assert thin.s == pytest.approx((1 - 0.4) ** 2 * 1e-9, rel=1e-6, abs=0)
    for y in (0.0299999, 0.0300001):
        ours = over_sensitivity(np.sqrt(y), 1e-300, 0.5)
        k = np.sqrt(y)
        assert ours.k == pytest.approx(-2 * k * 0.5 * np.exp(-2 * k), rel=1e-10, abs=0)


@pytest.mark.parametrize("noise", [0.2, 0.4, 1.0])
def test_however_large_the_noise_an_opaque_film_is_some_film(noise: float) -> None:
    for found in (invert(0.5, 0.45, 0.1, 0.1, noise=noise), invert_backings(0.45, 0.1, 0.5, 0.9, 0.1, noise=noise)):
        assert found.status == Status.OPAQUE or found.status == Status.NO_FILM
        assert (found.K > 0 and found.S > 0) or found.status == Status.NO_FILM
    hides = invert(0.5, 0.45, 0.1, 0.1, noise=noise)
    assert (hides.status, hides.S / hides.K) == (Status.OPAQUE, pytest.approx(4, rel=1e-12, abs=0))
