"""The air interface against Fresnel's equations, published constants and itself."""

from __future__ import annotations

import json
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from km_makeup.errors import MakeupError
from km_makeup.optics import (
    Interface,
    air_interface,
    apparent,
    film,
    fresnel_diffuse,
    internal,
    over,
    saunderson,
    stack,
    unsaunderson,
)


def fresnel_integral(n_in: float, n_out: float) -> float:
    """2 mu F(mu) dmu over the hemisphere, Fresnel's equations as they stand, 30 digits."""
    ratio = mp.mpf(n_in) / mp.mpf(n_out)

    def share(mu: mp.mpf) -> mp.mpf:
        sin2 = ratio**2 * (1 - mu * mu)
        if sin2 >= 1:
            return 2 * mu
        other = mp.sqrt(1 - sin2)
        R_s = ((ratio * mu - other) / (ratio * mu + other)) ** 2
        R_p = ((mu - ratio * other) / (mu + ratio * other)) ** 2
        return mu * (R_s + R_p)

    critical = mp.sqrt(1 - 1 / ratio**2) if ratio > 1 else mp.mpf(0)
    with mp.workdps(30):
        return float(mp.quad(share, [0, critical, critical + (1 - critical) / 4, 1] if ratio > 1 else [0, 0.25, 1]))


@pytest.mark.parametrize("n", [1.01, 1.33, 1.4, 1.5, 2.4, 3.9, 4.0, 4.1, 30.0])
def test_diffuse_fresnel_reflectance_is_the_integral_over_the_hemisphere(n: float) -> None:
    ours = fresnel_diffuse(n)
    assert ours.external == pytest.approx(fresnel_integral(1.0, n), rel=1e-11, abs=0)
    assert ours.internal == pytest.approx(fresnel_integral(n, 1.0), rel=1e-9, abs=0)
    assert ours.normal == pytest.approx(((n - 1) / (n + 1)) ** 2, rel=1e-14, abs=0)


def test_published_diffuse_fresnel_constants_come_out(shared_data: Path) -> None:
    for row in json.loads((shared_data / "reference" / "fresnel_diffuse.json").read_text())["rows"]:
        ours = fresnel_diffuse(row["n"])
        assert ours.external == pytest.approx(row["external_diffuse"], rel=1e-12, abs=0)
        assert ours.internal == pytest.approx(row["internal_diffuse"], rel=1e-12, abs=0)
        assert ours.normal == pytest.approx(row["external_normal"], rel=1e-12, abs=0)


def test_an_index_below_one_turns_the_sides_round() -> None:
    rare, dense = fresnel_diffuse(1 / 1.5), fresnel_diffuse(1.5)
    assert rare.external == pytest.approx(dense.internal, rel=1e-14, abs=0)
    assert rare.internal == pytest.approx(dense.external, rel=1e-14, abs=0)
    assert rare.normal == pytest.approx(dense.normal, rel=1e-14, abs=0)


def test_no_step_of_index_reflects_nothing_and_a_small_one_little() -> None:
    assert tuple(fresnel_diffuse(1.0)) == (0, 0, 0)
    exact = mp.mpf(1 + 1e-6)
    with mp.workdps(60):
        assert float(judd(exact)) == pytest.approx(fresnel_diffuse(1 + 1e-6).external, rel=1e-12, abs=0)


def judd(n: mp.mpf) -> mp.mpf:
    """Judd 1942, Eq 4, which cancels near n = 1: for many digits only."""
    return (
        mp.mpf(1) / 2
        + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
        + n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * mp.log((n - 1) / (n + 1))
        - 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
        + 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * mp.log(n)
    )


@pytest.mark.parametrize("n", [1 + 1e-9, 1.0001, 1.2, 1.5, 3.999999, 4.0, 4.000001, 17.0, 1e4])
def test_quadrature_and_closed_form_meet(n: float) -> None:
    with mp.workdps(80):
        assert fresnel_diffuse(n).external == pytest.approx(float(judd(mp.mpf(n))), rel=3e-14, abs=0)


def test_indices_in_float32_or_whole_are_worked_in_double_precision() -> None:
    n = np.array([1.1, 1.5], np.float32)
    np.testing.assert_array_equal(fresnel_diffuse(n).external, fresnel_diffuse(n.astype(np.float64)).external)
    assert fresnel_diffuse(2) == fresnel_diffuse(2.0)


def test_indices_come_in_any_shape() -> None:
    n = np.array([[1.0, 1.33], [1.5, 5.0]])
    ours = fresnel_diffuse(n)
    for index in np.ndindex(n.shape):
        one = fresnel_diffuse(n[index])
        assert (ours.external[index], ours.internal[index], ours.normal[index]) == tuple(one)


@pytest.mark.parametrize("n", [0.0, -1.5, np.nan, np.inf, 2e6, 5e-7, [1.5, 0.0]])
def test_what_is_no_index_is_refused(n: object) -> None:
    with pytest.raises(MakeupError, match=r"refractive index must be a positive number, .* not"):
        air_interface(n)


def test_the_usual_constants_of_a_binder() -> None:
    air = air_interface(1.5)
    assert air.k1 == pytest.approx(0.0400, abs=5e-5)
    assert air.k2 == pytest.approx(0.5963, abs=5e-5)
    assert air_interface() == air
    diffuse = air_interface(1.5, diffuse_light=True)
    assert diffuse.k1 == pytest.approx(0.0918, abs=5e-5)
    assert diffuse.k2 == air.k2


@given(R=st.floats(0.0, 1.0), n=st.floats(1.0, 3.0))
@settings(max_examples=150, deadline=None)
def test_saunderson_there_and_back_is_the_identity(R: float, n: float) -> None:
    air = air_interface(n)
    assert internal(apparent(R, air), air) == pytest.approx(R, rel=2e-15, abs=1e-300)
    for specular in (True, False):
        back = unsaunderson(saunderson(R, air, specular_included=specular), air, specular_included=specular)
        assert back == pytest.approx(R, rel=1e-14, abs=2e-16 / (1 - air.k2))


@given(K=st.floats(0, 100), S=st.floats(0, 100), skin=st.floats(0, 0.95))
@settings(max_examples=60, deadline=None)
def test_skin_freed_of_its_interface_and_given_it_back_is_the_same_skin(K: float, S: float, skin: float) -> None:
    """The pair is the identity at X = 0: nothing is counted twice."""
    air = air_interface(1.5)
    inner = internal(skin, air)
    whole = stack([film(K, S, 0.0), air.as_stack])
    assert over(whole.R_top, whole.T * whole.T_up, whole.R_bottom, inner) == pytest.approx(skin, rel=1e-15, abs=1e-300)
    bare = stack([film(K, S, 0.05), air.as_stack])
    body = film(K, S, 0.05)
    below = over(body.R, body.T**2, body.R, inner)
    assert over(bare.R_top, bare.T * bare.T_up, bare.R_bottom, inner) == pytest.approx(
        apparent(below, air), rel=1e-13, abs=0
    )


def test_saunderson_formula_is_the_published_one() -> None:
    """Saunderson 1942, Eq 4, with k1 = .04 and k2 = .6: a body of .5 reads .04 + .96 * .4 * .5/.7 with the specular."""
    air = Interface(0.04, 0.6)
    assert saunderson(0.5, air) == pytest.approx(0.04 + 0.96 * 0.4 * 0.5 / 0.7, rel=1e-15, abs=0)
    assert saunderson(0.5, air, specular_included=False) == pytest.approx(0.96 * 0.4 * 0.5 / 0.7, rel=1e-15, abs=0)
    assert saunderson(1.0, air) == pytest.approx(1, rel=1e-15, abs=0)
    assert saunderson(0.0, air) == 0.04
    assert unsaunderson(0.02, air) < 0
    assert unsaunderson(0.02, air, specular_included=False) > 0


def test_the_interface_is_worth_what_is_written_of_it() -> None:
    """OPTICS.md: k = .02, s = 1 over skin .2 gives .545 without and .370 with the interface; k = s = .5 .256 and .136."""
    air = air_interface(1.5)
    for k, s, without, with_air in ((0.02, 1.0, 0.545, 0.370), (0.5, 0.5, 0.256, 0.136)):
        body = film(k, s, 1.0)
        assert over(body.R, body.T**2, body.R, 0.2) == pytest.approx(without, abs=5e-4)
        inner = internal(0.2, air)
        assert apparent(over(body.R, body.T**2, body.R, inner), air) == pytest.approx(with_air, abs=5e-4)


def test_interfaces_keep_the_dtype_and_take_one_index_per_wavelength() -> None:
    R = np.linspace(0, 1, 5, dtype=np.float32)
    air = air_interface(1.5)
    for result in (apparent(R, air), internal(R, air), saunderson(R, air), unsaunderson(R, air)):
        assert result.dtype == np.float32
    each = air_interface(np.linspace(1.3, 1.6, 5))
    assert apparent(np.linspace(0, 1, 5), each)[2] == pytest.approx(
        apparent(0.5, air_interface(1.45)), rel=1e-15, abs=0
    )
    per_wavelength = stack([film(np.ones(5), np.ones(5), 0.1), each.as_stack])
    assert per_wavelength.R_top.shape == (5,)
    first = each.as_stack
    np.testing.assert_allclose(first.R_top + first.T + first.A_top, 1)
    np.testing.assert_allclose(first.R_bottom + first.T_up + first.A_bottom, 1)
    assert np.all(first.A_bottom == 0)
    assert np.all(first.R_top == 0)
