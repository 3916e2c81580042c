"""The ladder of the two-flux model: its finer rungs are right by themselves, and each is nearer to the truth than the one before."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from km_makeup.accuracy import two_flux
from km_makeup.accuracy.commands import ladders


def slab(g: float, albedo: float, depth: float) -> np.recarray:
    return np.rec.fromarrays([np.array([v]) for v in (g, albedo, depth)], names="g,albedo,optical_thickness")


@pytest.fixture(scope="module")
def ladder():
    return ladders()["two-flux"]()


def test_rungs_fall_as_the_ladder_says(ladder):
    found = {rung.name: rung.error().mean for rung in ladder.rungs}
    assert {name for chain in ladder.falling for name in chain} == set(found)
    for chain in ladder.falling:
        means = [found[name] for name in chain]
        assert means == sorted(means, reverse=True), dict(zip(chain, means))


def test_many_directions_are_adding_doubling():
    """Two programs by different hands agree to the digits that the table has."""
    slabs = two_flux.table()
    found = two_flux.many_fluxes(slabs, 16)
    for values, column in zip(found, ("URU", "UTU", "UR1", "UT1")):
        np.testing.assert_allclose(values, slabs[column], atol=1e-5)


@pytest.mark.parametrize("directions", [3, 8])
@pytest.mark.parametrize("g", [0.0, 0.6, 0.9])
def test_what_does_not_absorb_keeps_all_light(directions, g):
    R, T, R_normal, T_normal = two_flux.many_fluxes(slab(g, 1.0, 3.0), directions)
    assert R + T == pytest.approx(1, abs=1e-10)
    assert R_normal + T_normal == pytest.approx(1, abs=1e-10)


def test_without_scattering_it_is_beers_law():
    _, T, R_normal, T_normal = two_flux.many_fluxes(slab(0.0, 0.0, 1.3), 8)
    assert (R_normal[0], T_normal[0]) == (0, pytest.approx(np.exp(-1.3), rel=1e-3, abs=0))
    assert T[0] == pytest.approx(float(2 * mp.expint(3, 1.3)), rel=1e-4, abs=0)


def test_radaus_points_integrate_what_they_must():
    x, w = two_flux._radau(5)
    assert x[-1] == 1
    for power in range(9):
        assert np.sum(w * x**power) == pytest.approx(1 / (power + 1), rel=1e-13, abs=0)
