"""Which finishes are one, which share a lobe, and what is dimmed below a film."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.makeup import coat
from km_makeup.makeup.finish import (
    Finish,
    Gloss,
    covered,
    dimming,
    distinct,
    finish_texture,
    merged,
    two_lobes,
)
from km_makeup.optics import film
from km_makeup.products import Library
from km_makeup.spectra import bands

SATIN, GLOSS, MATTE = Finish(0.5, 0.034), Finish(0.2, 0.034), Finish(0.7, 0.034)


def test_equal_finishes_are_one_and_each_film_knows_its_own() -> None:
    found, kinds = distinct([SATIN, GLOSS, SATIN, Finish(0.505, 0.034), MATTE])
    assert kinds == (0, 1, 0, 0, 2)
    assert len(found) == 3
    assert found[1:] == (GLOSS, MATTE)
    assert found[0].roughness == pytest.approx(0.5017, abs=1e-3)


def test_the_same_roughness_with_another_reflectance_is_another_finish() -> None:
    assert len(distinct([SATIN, Finish(0.5, 0.08)])[0]) == 2


def test_beyond_the_most_the_nearest_are_merged() -> None:
    found, kinds = distinct([Finish(r, 0.034) for r in (0.2, 0.3, 0.32, 0.5, 0.7)], most=4)
    assert kinds == (0, 1, 1, 2, 3)
    assert found[1].roughness == pytest.approx(((0.3**4 + 0.32**4) / 2) ** 0.25)


def test_merging_keeps_slope_variance_and_reflectance() -> None:
    found = merged([GLOSS, Finish(0.6, 0.08)], [3, 1])
    assert found.roughness**4 == pytest.approx((3 * 0.2**4 + 0.6**4) / 4)
    assert found.f0 == pytest.approx((3 * 0.034 + 0.08) / 4)


def test_the_gloss_gets_the_second_lobe_and_satin_goes_with_the_skin() -> None:
    assert two_lobes([0.45, 0.5, 0.2, 0.55], [1, 1, 0.1, 0.5]) == ((0, 1, 3), (2,))
    assert two_lobes([0.3, 0.7, 0.6], [1, 1, 1]) == ((0,), (1, 2))


def test_one_lobe_is_enough_for_what_is_nearly_the_same() -> None:
    assert two_lobes([0.45, 0.46], [1, 1]) == ((0, 1), ())
    assert two_lobes([0.45], [1]) == ((0,), ())


def test_the_texture_holds_the_films_joint_lobe() -> None:
    """Share, and variance and F0 as sums: divided by what is covered they are the lobe merged by weights."""
    low, high = np.array([0.8]), np.array([0.25])
    share, variance, f0 = finish_texture([Gloss(*SATIN, low), Gloss(0.25, 0.08, high)])[0]
    weights = [0.8 * 0.75, 0.25]
    assert share == pytest.approx(0.2 * 0.75)
    joint = merged([SATIN, Finish(0.25, 0.08)], weights)
    assert (variance / (1 - share)) ** 0.25 == pytest.approx(joint.roughness)
    assert f0 / (1 - share) == pytest.approx(joint.f0)


def test_a_film_as_thick_as_the_relief_covers_two_thirds() -> None:
    assert covered(np.array([1.0]), 0.005, powder=False)[0] == pytest.approx(1 - np.exp(-1))
    assert covered(np.array([0.5]), 0.005, powder=True)[0] == pytest.approx(0.5 * (1 - np.exp(-1)))


def test_what_lies_below_is_dimmed_by_the_films_own_transmittance() -> None:
    product = Library.shipped().find("lipstick-classic-red")
    space = bands("D65", "Linear Rec.709")
    found = dimming(coat(product, 10.0), space)
    alone = film(product.K, product.S, 0.01).T @ space.weights
    assert found[0] == pytest.approx([1, 1, 1], abs=1e-6)
    assert found[-1] == pytest.approx(np.clip(alone, 0, 1), abs=1e-12)
    assert np.all(np.diff(found[:, 0]) <= 0)
