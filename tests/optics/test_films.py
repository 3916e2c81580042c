"""Films and stacks of films: exact, physical, and the same however they are asked for."""

from __future__ import annotations

import json
from datetime import date
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from km_makeup.errors import MakeupError
from km_makeup.optics import (
    Stack,
    air_interface,
    arrays,
    as_stack,
    film,
    film_over,
    lay,
    opaque_reflectance,
    over,
    stack,
)
from tests.optics import sweep

EPS = np.finfo(np.float64).eps
coefficient = st.one_of(st.just(0.0), st.floats(1e-6, 1e4))
thickness = st.one_of(st.just(0.0), st.floats(1e-6, 10.0))
layer = st.tuples(coefficient, coefficient, thickness)
reflectance = st.floats(0.0, 1.0)


def close(a, b, times: float = 16) -> bool:
    """Equal to a few units in the last place, and in absolute terms below 1."""
    return np.allclose(a, b, rtol=times * EPS, atol=times * EPS)


@pytest.mark.parametrize("seed", [date.today().toordinal(), 7])
def test_films_stacks_and_inversions_are_right_to_the_last_digits(seed: int) -> None:
    """A part of the full sweep that changes every day, and one that does not, with all edge values."""
    broken = [row for row in sweep.run(250, seed, edges=seed == 7) if row.ratio > 1 or row.not_finite]
    assert not broken, f"seed {seed}\n{sweep.table(broken)}"


def test_a_film_solves_the_two_flux_equations() -> None:
    """dI/dx = -(K + S) I + S J and dJ/dx = (K + S) J - S I, carried through the film by the matrix exponential."""
    rng = np.random.default_rng(5)
    for K, S, X in 10 ** rng.uniform([-2, -2, -2], [1, 1, 0], (60, 3)):
        through = np.array(mp.expm(mp.matrix([[-(K + S), S], [-S, K + S]]) * X).tolist(), dtype=float)
        # J = 0 below: J_bottom = m21 I + m22 J_top = 0
        R = -through[1, 0] / through[1, 1]
        T = through[0, 0] + through[0, 1] * R
        ours = film(K, S, X)
        assert ours.R == pytest.approx(R, rel=1e-11, abs=0)
        assert ours.T == pytest.approx(T, rel=1e-11, abs=0)
        assert ours.A == pytest.approx(1 - R - T, abs=1e-11)


def test_published_films_over_backings_come_out(shared_data: Path) -> None:
    cases = json.loads((shared_data / "reference" / "painty_km_layer.json").read_text())
    for case in cases["cases"]:
        ours = film_over(case["K"], case["S"], case.get("d", cases["d"]), case["R0"])
        assert ours == pytest.approx(case["R"], abs=cases["tolerance"])
        assert ours == pytest.approx(case["mpmath"], rel=1e-14, abs=0)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_film_of_no_material_or_no_thickness_lets_all_light_pass(dtype: type) -> None:
    for K, S, X in ((0, 0, 1), (5, 7, 0), (0, 0, np.inf), (0, 0, 0)):
        ours = film(*(np.array([v], dtype=dtype) for v in (K, S, X)))
        assert (ours.R[0], ours.T[0], ours.A[0]) == (0, 1, 0)
        assert film_over(*(np.array([v], dtype=dtype) for v in (K, S, X, 0.3)))[0] == dtype(0.3)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_an_infinite_film_is_opaque(dtype: type) -> None:
    K, S = (np.array(v, dtype=dtype) for v in ([0.5, 0, 3, 1e-12], [2, 4, 0, 1e6]))
    ours = film(K, S, np.full(4, np.inf, dtype))
    np.testing.assert_array_equal(ours.R, opaque_reflectance(K, S))
    np.testing.assert_array_equal(ours.T, 0)
    assert ours.R.dtype == ours.T.dtype == ours.A.dtype == dtype
    white = mp.sqrt(mp.mpf(float(K[3])) ** 2 + 2 * mp.mpf(float(K[3])) * mp.mpf(float(S[3]))) / mp.mpf(float(S[3]))
    assert ours.A[3] == pytest.approx(float(white), rel=1e-6 if dtype is np.float32 else 1e-8, abs=0)
    np.testing.assert_allclose(ours.A[:3], [1 - ours.R[0], 0, 1], rtol=4 * np.finfo(dtype).eps)
    over_white = film_over(K, S, np.full(4, np.inf, dtype), np.ones(4, dtype))
    np.testing.assert_array_equal(over_white, ours.R)
    mixed = film_over(K[:2], S[:2], np.array([np.inf, 0.25], dtype), np.full(2, 0.5, dtype))
    assert mixed[0] == ours.R[0]
    assert mixed[1] == film_over(K[1:2], S[1:2], np.array([0.25], dtype), np.full(1, 0.5, dtype))[0]


def test_a_film_that_is_opaque_though_not_infinite_overflows_nowhere() -> None:
    """S X or X alone near the largest number."""
    for K, S, X in ((1.0, 1e307, 20.0), (0.5, 0.1, 1e308), (1e-3, 1e-3, 1.7e308)):
        ours = film(K, S, X)
        assert (ours.R, ours.T) == (opaque_reflectance(K, S), 0)
        assert film_over(K, S, X, 0.7) == ours.R


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_thick_films_are_reached_without_a_step(dtype: type) -> None:
    """At z = 40 (float32: 20) another formula takes over; both give the same to the last digits there."""
    z = (40 if dtype is np.float64 else 20) * (1 + np.linspace(-3, 3, 4001) * np.finfo(dtype).eps * 20)
    S = np.array([[0.0], [0.1], [3.0], [1e3]])
    K = 1 / (np.sqrt(S**2 + 1) + S)  # z = X
    with np.errstate(all="raise", under="ignore"):
        R, T, A = film(K.astype(dtype), S.astype(dtype), z.astype(dtype))
        over_black = film_over(K.astype(dtype), S.astype(dtype), z.astype(dtype), np.zeros(1, dtype))
    eps = np.finfo(dtype).eps
    for values, exact in ((R, S / (K + S + 1)), (A, (K + 1) / (K + S + 1)), (over_black, S / (K + S + 1))):
        np.testing.assert_allclose(values, np.broadcast_to(exact, values.shape), rtol=8 * eps)
        assert np.abs(np.diff(values, axis=1) / values[:, 1:].max()).max(initial=0) < 8 * eps
    slope = np.diff(np.log(T.astype(np.float64)), axis=1)
    assert slope.max() < 500 * eps


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_film_does_not_care_what_is_beside_it(dtype: type) -> None:
    """Infinite, as good as infinite, thick, white and absent films in one array are each as alone."""
    huge = dtype(np.finfo(dtype).max / 4)
    X = np.array([0.1, np.inf, 0.2, huge, huge, np.inf, np.inf, 800, 400, 1e-3, huge / 8, 3], dtype)
    K = np.array([2, 3, 0, 2, 0, 0, 0, 1, 1, 1e5, 5, 0], dtype)
    S = np.array([5, 7, 4, 5, 3, 3, 0, 0.5, 0.5, 1e5, 0.1, 9], dtype)
    with np.errstate(all="raise", under="ignore"):
        together, over_white = film(K, S, X), film_over(K, S, X, np.full(12, 0.75, dtype))
        for i in range(12):
            alone = film(K[i : i + 1], S[i : i + 1], X[i : i + 1])
            for name, one, beside in zip("RTA", alone, together, strict=True):
                assert one[0] == beside[i], (name, i)
            assert film_over(K[i : i + 1], S[i : i + 1], X[i : i + 1], np.full(1, 0.75, dtype))[0] == over_white[i]
    opaque = [1, 3, 4, 5, 10]
    np.testing.assert_array_equal(together.R[opaque], opaque_reflectance(K, S)[opaque])
    np.testing.assert_array_equal(together.T[opaque], 0)
    assert together.T[7] == 0
    assert np.all(together.T[[0, 2, 8, 9, 11] if dtype is np.float64 else [0, 2, 11]] > 0)
    np.testing.assert_allclose(together.A, 1 - together.R.astype(float) - together.T, atol=8 * np.finfo(dtype).eps)


def test_opaque_reflectance_of_nothing_is_zero() -> None:
    assert opaque_reflectance(0.0, 0.0) == 0
    np.testing.assert_array_equal(opaque_reflectance([0.0, 1.0], [0.0, 0.0]), [0, 0])
    assert opaque_reflectance(0.0, 3.0) == 1


@pytest.mark.parametrize("scale", [1e-9, 0.01, 1.0, 1e6])
def test_opaque_reflectance_is_one_of_the_ratio_alone(scale: float) -> None:
    np.testing.assert_allclose(opaque_reflectance(scale * 4, scale * 1), 1 / (5 + np.sqrt(24)), rtol=1e-15)


def test_large_arrays_are_worked_in_blocks_with_the_same_result() -> None:
    rng = np.random.default_rng(1)
    K, S = 10 ** rng.uniform(-2, 2, (2, 81, 1))
    X, g = 10 ** rng.uniform(-3, 0, (1, 1000)), rng.uniform(0, 1, (1, 1000))
    X[0, 3] = np.inf
    whole, whole_over = film(K, S, X), film_over(K, S, X, g)
    for part in (*whole, whole_over):
        assert part.shape == (81, 1000)
        assert part.size > arrays.BLOCK
    for row in (0, 40, 80):
        one = film(K[row], S[row], X[0])
        for part, single in zip(whole, one, strict=True):
            np.testing.assert_array_equal(part[row], single)
        np.testing.assert_array_equal(whole_over[row], film_over(K[row], S[row], X[0], g[0]))


@pytest.mark.parametrize("size", [10, 70_000])
def test_the_dtype_of_arrays_is_kept_and_numbers_follow_them(size: int) -> None:
    K = np.full(size, 2, np.float32)
    for S in (3, 3.0, np.float64(3), np.float32(3), np.array(3.0), np.full(size, 3, np.float32)):
        assert {v.dtype for v in film(K, S, 0.1)} == {np.dtype(np.float32)}
        assert film_over(K, S, 0.1, 0.5).dtype == np.float32
        assert opaque_reflectance(K, S).dtype == np.float32
    assert film(K, np.full(size, 3.0), 0.1).R.dtype == np.float64
    assert film(np.full(size, 2), 3, 1).R.dtype == np.float64
    assert film(2, 3, 1).R.dtype == np.float64
    assert film(np.float32(2), 3.0, 1).R.dtype == np.float64
    assert over(K, K, K, 0.5).dtype == np.float32
    shine = stack([film(K, K, 0.1), film(K, 3.0, 0.2), air_interface(1.5).as_stack])
    assert {v.dtype for v in shine} == {np.dtype(np.float32)}


def test_empty_arrays_stay_empty() -> None:
    nothing = np.zeros((0, 3), np.float32)
    assert film(nothing, 1.0, nothing).T.shape == (0, 3)
    assert film_over(nothing, nothing, nothing, 0.5).shape == (0, 3)


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ((-1.0, 1.0, 1.0), "K"),
        ((1.0, -1e-9, 1.0), "S"),
        ((1.0, 1.0, -0.1), "X"),
        ((np.nan, 1.0, 1.0), "K"),
        ((1.0, np.nan, 1.0), "S"),
        ((1.0, 1.0, np.nan), "X"),
        ((np.inf, 1.0, 1.0), "K"),
        ((1.0, np.inf, 1.0), "S"),
        ((-1.0, -1.0, 1.0), "K"),
        ((0.5, 0.5, -0.1), "X"),
        ((0.5, -0.5, 0.5), "S"),
        ((0.5, 0.5, np.nan), "X"),
    ],
)
def test_what_is_no_film_is_refused_with_its_name_and_value(values: tuple, name: str) -> None:
    wrong = {"K": values[0], "S": values[1], "X": values[2]}[name]
    for call in (
        lambda: film(*values),
        lambda: film_over(*values, 0.5),
        lambda: film(*(np.full(70_000, v) for v in values)),
    ):
        unit = "mm" if name == "X" else "1/mm"
        with pytest.raises(MakeupError, match=f"^{name} of a film must be a number of 0 {unit} or more, not {wrong}; "):
            call()
    if name != "X":
        with pytest.raises(MakeupError, match=f"^{name} of a film"):
            opaque_reflectance(*values[:2])
    with pytest.raises(MakeupError, match=f"^{name} of a film must .*, not {wrong}; "):
        film(*([0.5, 0.25, value] for value in values))  # the wrong one of three is the one that is named


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_white_on_white_neither_divides_by_zero_nor_makes_light(dtype: type) -> None:
    K, S = np.zeros(3, dtype), np.full(3, 1e6, dtype)
    X, g = np.array([1e3, np.inf, 1.0], dtype), np.ones(3, dtype)
    with np.errstate(all="raise", under="ignore"):
        np.testing.assert_allclose(film_over(K, S, X, g), 1, rtol=2 * np.finfo(dtype).eps)
        white = film(K, S, X)
        both = lay(white, white)
        np.testing.assert_allclose(both.R_top, 1, rtol=1e-5)
        assert np.all(np.isfinite(both))
        np.testing.assert_array_equal(over(g, 0 * g, g, g), 1)
    for S in (1e2, 3e4, 1e6):
        white = film(0.0, S, 1e3)
        assert lay(white, white).T == pytest.approx(1 / (1 + 2e3 * S), rel=2e-15, abs=0)


@given(K=coefficient, S=coefficient, X=thickness, Rg=reflectance)
@settings(max_examples=150, deadline=None)
def test_a_film_keeps_all_light_and_none_is_made(K: float, S: float, X: float, Rg: float) -> None:
    R, T, A = film(K, S, X)
    assert close(R + T + A, 1, 4)
    assert min(R, T, A) >= 0


@given(K=coefficient, S=coefficient, X=thickness, part=st.floats(0.0, 1.0))
@settings(max_examples=150, deadline=None)
def test_a_film_split_anywhere_is_the_whole_film(K: float, S: float, X: float, part: float) -> None:
    """A split 50/50 hides the misprinted Eq 3 (T1 R1 T1); a split anywhere does not."""
    whole, parts = film(K, S, X), stack([film(K, S, X * part), film(K, S, X * (1 - part))])
    conditioning = 1e-13 * (1 + np.sqrt(K * X) * np.sqrt((K + 2 * S) * X))
    for name in ("R_top", "R_bottom", "T", "T_up", "A_top", "A_bottom"):
        assert getattr(parts, name) == pytest.approx(getattr(as_stack(whole), name), rel=conditioning, abs=1e-300), name


@given(films=st.lists(layer, min_size=1, max_size=6))
@settings(max_examples=100, deadline=None)
def test_stacks_keep_all_light_and_pass_as_much_up_as_down(films: list) -> None:
    whole = stack([film(*one) for one in films])
    assert close(whole.R_top + whole.T + whole.A_top, 1, 64)
    assert close(whole.R_bottom + whole.T_up + whole.A_bottom, 1, 64)
    assert whole.T == pytest.approx(whole.T_up, rel=1e-13, abs=1e-300)


@given(a=layer, b=layer, c=layer)
@settings(max_examples=100, deadline=None)
def test_laying_films_is_associative(a: tuple, b: tuple, c: tuple) -> None:
    top, middle, bottom = film(*a), film(*b), film(*c)
    for left, right in zip(lay(lay(top, middle), bottom), lay(top, lay(middle, bottom)), strict=True):
        assert left == pytest.approx(right, rel=1e-12, abs=1e-300)


@given(one=layer, other=layer)
@settings(max_examples=60, deadline=None)
def test_a_film_of_no_thickness_is_exactly_the_identity(one: tuple, other: tuple) -> None:
    nothing = film(one[0], one[1], 0.0)
    for below in (as_stack(film(*other)), air_interface(1.5).as_stack):
        assert tuple(lay(nothing, below)) == tuple(below)
        assert tuple(lay(below, nothing)) == tuple(below)


@given(K=coefficient, S=coefficient, X=thickness, Rg=reflectance)
@settings(max_examples=150, deadline=None)
def test_reflectance_over_a_backing_goes_from_the_backing_to_the_opaque_film(
    K: float, S: float, X: float, Rg: float
) -> None:
    R_inf = float(opaque_reflectance(K, S)) if K + S > 0 else Rg
    R, further = float(film_over(K, S, X, Rg)), float(film_over(K, S, 1.5 * X, Rg))
    slack = 8 * EPS
    assert min(Rg, R_inf) - slack <= R <= max(Rg, R_inf) + slack
    assert abs(further - R_inf) <= abs(R - R_inf) + slack
    assert film_over(K, S, 0.0, Rg) == Rg


@given(K=coefficient, S=coefficient, X=thickness, Rg=reflectance)
@settings(max_examples=60, deadline=None)
def test_film_over_is_the_stack_over_the_backing(K: float, S: float, X: float, Rg: float) -> None:
    whole = as_stack(film(K, S, X))
    assert close(film_over(K, S, X, Rg), over(whole.R_top, whole.T * whole.T_up, whole.R_bottom, Rg))


def test_the_order_of_films_matters_from_above_and_below() -> None:
    """Foundation over lipstick: much is reflected from above, little from below."""
    foundation, lipstick = film(0.5, 30.0, 0.02), film(60.0, 3.0, 0.02)
    whole = stack([lipstick, foundation])
    assert whole.R_top > 2 * whole.R_bottom
    turned = stack([foundation, lipstick])
    assert turned.R_top == pytest.approx(whole.R_bottom, rel=1e-14, abs=0)
    assert turned.A_top == pytest.approx(whole.A_bottom, rel=1e-14, abs=0)


def test_a_stack_of_no_films_lets_all_light_pass() -> None:
    assert tuple(float(v) for v in stack([])) == (0, 0, 1, 0, 0, 1)
    one = film(1.0, 2.0, 0.1)
    assert stack([one]) == as_stack(one) == as_stack(as_stack(one))
    assert isinstance(stack([one]), Stack)


def test_an_interface_on_top_passes_different_shares_up_and_down() -> None:
    air = air_interface(1.5)
    whole = stack([film(0.5, 5.0, 0.1), air.as_stack])
    bare = film(0.5, 5.0, 0.1)
    d = 1 - air.k2 * bare.R
    assert whole.R_top == pytest.approx((1 - air.k1) * (1 - air.k2) * bare.R / d, rel=1e-14, abs=0)
    assert whole.T == pytest.approx((1 - air.k1) * bare.T / d, rel=1e-14, abs=0)
    assert whole.T_up == pytest.approx((1 - air.k2) * bare.T / d, rel=1e-14, abs=0)
    assert whole.R_bottom == pytest.approx(bare.R + bare.T**2 * air.k2 / d, rel=1e-14, abs=0)
    assert whole.R_top + whole.T + whole.A_top == pytest.approx(1, rel=1e-14, abs=0)
    assert whole.R_bottom + whole.T_up + whole.A_bottom == pytest.approx(1, rel=1e-14, abs=0)
