"""The parts that every colour path hands to the renderers."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from km_makeup.makeup.contract import parts, split_albedo

colours = arrays(np.float64, (5, 3), elements=st.floats(-0.05, 1.0))
skins = arrays(np.float64, (5, 3), elements=st.floats(0.01, 1.0))


@given(colours, colours, skins)
def test_the_parts_add_up_to_the_whole_and_no_root_is_of_a_negative(total, film, skin):
    found = parts(total, film, skin)
    assert np.isfinite(found.T_in).all() and (found.T_in >= 0).all() and np.array_equal(found.T_in, found.T_out)
    np.testing.assert_allclose(found.film + found.T_in * found.T_out * found.skin, total, atol=1e-14)


def test_a_skin_part_below_zero_goes_to_the_film_part():
    found = parts([0.2, -0.013, 0.1], [0.05, 0.004, 0.02], [0.5, 0.3, 0.2])
    np.testing.assert_allclose(found.film, [0.05, -0.013, 0.02])
    np.testing.assert_allclose(found.T_in[1], 0)


def test_black_skin_passes_nothing_and_divides_nothing():
    found = parts([0.1, 0.1, 0.1], [0.05, 0.05, 0.05], [0.0, 0.2, 0.0])
    assert np.isfinite(np.concatenate(found)).all()
    np.testing.assert_allclose(found.film, [0.1, 0.05, 0.1])


@given(skins, st.floats(0, 1))
def test_the_albedo_before_and_after_the_blur_is_the_whole_albedo(skin, before):
    inner, outer = split_albedo(skin, before)
    np.testing.assert_allclose(inner * outer, skin, rtol=1e-12)
