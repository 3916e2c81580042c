"""Stated errors of simulated measurements: a small part of the sweep, another noise and other products every day."""

from __future__ import annotations

import datetime

import numpy as np
import pytest

from km_makeup.optics import Status as Known
from km_makeup.products import Library
from km_makeup.products.measurement import _without_flukes
from tests.products.round_trips import NOISES, PRODUCTS, cramer_rao, setups, simulate, summary

DAY = datetime.datetime.now(datetime.UTC).timetuple().tm_yday


@pytest.mark.parametrize("setup", setups(Library.shipped().find(PRODUCTS[0])))
def test_intervals_hold_the_truth_and_are_nearly_as_narrow_as_can_be(setup: str) -> None:
    two = (PRODUCTS[DAY % len(PRODUCTS)], PRODUCTS[(DAY + 1) % len(PRODUCTS)])
    found = simulate(setup, NOISES[DAY % 2], trials=6, products=two)
    count, known, coverage, width, every = summary(found, 0.0, np.inf)
    print(
        f"{setup}: {two}: {count} values, {known:.1%} known, coverage {coverage:.1%}, width {width:.2f}, of all {every:.1%}"
    )
    assert 0.90 <= coverage <= 0.98
    assert width <= 1.5
    assert every >= 0.90


def test_the_bound_is_that_of_independent_readings() -> None:
    """Twice the noise is twice the bound; four equal films have half of it."""
    product = Library.shipped().find("foundation-medium")
    films = setups(product)["one film on two backings"]
    once, noisy, often = (cramer_rao(product, *case) for case in ((films, 0.001), (films, 0.002), (films * 4, 0.001)))
    sure = np.isfinite(once[0])
    assert np.allclose(noisy[0][sure], 2 * once[0][sure])
    assert np.allclose(often[1][sure], once[1][sure] / 2)


def test_a_wavelength_that_seems_known_among_opaque_ones_is_not() -> None:
    status = np.full(81, Known.OK, dtype=np.uint8)
    status[20:40] = Known.OPAQUE
    status[30] = Known.OK
    found = _without_flukes(status)
    assert found[30] == Known.OPAQUE
    assert (np.delete(found, 30) == np.delete(status, 30)).all()
    assert (_without_flukes(np.full(81, Known.OK, dtype=np.uint8)) == Known.OK).all()
