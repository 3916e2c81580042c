"""The highlight of a stack: from skin's to the films', by coverage."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.makeup.finish import RELIEF_DEPTH_MM, Gloss, covered, finish_texture


def test_bare_skin_keeps_its_own_highlight():
    bare = finish_texture([Gloss(0.3, 0.05, np.zeros(4)), Gloss(0.7, 0.04, np.zeros(4))])
    assert np.array_equal(bare, np.tile([1.0, 0.0, 0.0], (4, 1)))


def test_a_thick_film_shows_its_own_highlight_alone():
    top = finish_texture([Gloss(0.9, 0.02, np.ones(1)), Gloss(0.3, 0.05, covered(np.ones(1), 1.0, False))])
    np.testing.assert_allclose(top, [[0, 0.3**4, 0.05]], atol=1e-12)


def test_slope_variances_and_reflectances_add_by_the_visible_shares():
    lower, upper = 0.4, 0.25
    texture = finish_texture([Gloss(0.5, 0.03, np.array([lower])), Gloss(0.2, 0.06, np.array([upper]))])
    skin_share = (1 - lower) * (1 - upper)
    variance = lower * (1 - upper) * 0.5**4 + upper * 0.2**4
    f0 = lower * (1 - upper) * 0.03 + upper * 0.06
    np.testing.assert_allclose(texture, [[skin_share, variance, f0]], rtol=1e-14)


@pytest.mark.parametrize("value", [0.0, 0.1, 0.5, 1.0])
def test_a_film_covers_by_its_thickness_and_a_powder_by_its_area(value):
    thickness = 0.012
    film, powder = (covered(np.array([value]), thickness, is_powder)[0] for is_powder in (False, True))
    assert film == pytest.approx(1 - np.exp(-value * thickness / RELIEF_DEPTH_MM), abs=1e-15)
    assert powder == pytest.approx(value * (1 - np.exp(-thickness / RELIEF_DEPTH_MM)), abs=1e-15)


def test_floats_keep_their_precision():
    assert covered(np.ones(2, np.float32), 0.01, False).dtype == np.float32
    assert finish_texture([Gloss(0.5, 0.04, np.ones(2, np.float32))]).dtype == np.float32
