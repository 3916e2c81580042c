"""Which texels are covered and which are alike, against a plain look at every texel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from km_makeup.bake import texels
from km_makeup.errors import MakeupError

SHAPE = (5, 9)


@st.composite
def stacks_of_maps(draw):
    """One to four maps, bytes or floats, of few levels so that texels are alike, with strengths."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    maps, strengths = [], []
    for is_float in draw(st.lists(st.booleans(), min_size=1, max_size=4)):
        levels = random.integers(0, draw(st.integers(1, 4)) + 1, SHAPE)
        maps.append((levels / 5).astype(np.float32) if is_float else (levels * 60).astype(np.uint8))
        strengths.append(draw(st.sampled_from([0.0, 0.25, 1.0])))
    return maps, strengths


@settings(max_examples=60, deadline=None)
@given(stacks_of_maps(), st.sampled_from([1, 300, 1 << 24]))
def test_covered_and_distinct_texels_are_those_that_a_plain_look_finds(stack, span):
    maps, strengths = stack
    before, texels.SPAN = texels.SPAN, span
    try:
        found = texels.covered_texels(maps, strengths, [f"m{i}" for i in range(len(maps))])
        first, codes = found.distinct()
    finally:
        texels.SPAN = before
    columns = [m.reshape(-1) * np.float32(s / 255 if m.dtype == np.uint8 else s) for m, s in zip(maps, strengths)]
    plain = np.stack(columns, axis=-1).astype(np.float32)
    covered = [i for i in range(plain.shape[0]) if any(m.reshape(-1)[i] > 0 for m in maps)]
    assert found.index.tolist() == covered and found.shape == SHAPE
    values = found.values(slice(None))
    np.testing.assert_allclose(values, plain[covered], rtol=1e-6)
    assert np.array_equal(values[first][codes], values)
    stored = {tuple(m.reshape(-1)[i] for m in maps) for i in covered}
    assert len(first) == len(stored)


def test_a_strength_beyond_one_is_refused():
    with pytest.raises(MakeupError, match="between 0 and 1"):
        texels.covered_texels([np.ones((2, 2), np.uint8)], [1.5], ["m"])
