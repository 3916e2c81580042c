"""Which combinations of levels occur and where, against a plain look at every texel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from km_makeup.bake import combinations as module
from km_makeup.bake.levels import painted, read_tiles
from km_makeup.bake.tiles import row_tiles
from km_makeup.errors import MakeupError

SHAPE = (5, 9)


def find(layers, most: int = 1000):
    steps = module.combinations(layers, row_tiles(*SHAPE, texels=20), most)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


@st.composite
def stacks_of_maps(draw):
    """One to five maps, bytes or floats, of few levels so that texels are alike."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    maps = []
    for is_float in draw(st.lists(st.booleans(), min_size=1, max_size=5)):
        levels = random.integers(0, draw(st.integers(1, 4)) + 1, SHAPE)
        maps.append((levels / 5).astype(np.float32) if is_float else (levels * 60).astype(np.uint8))
    return maps


@settings(max_examples=80, deadline=None)
@given(stacks_of_maps(), st.sampled_from([1 << 14, 1 << 17, 1 << 24]), st.sampled_from([1, 1 << 17]))
def test_combinations_are_those_that_a_plain_look_finds(maps, span, cached):
    layers = [painted(m, 1.0, f"m{i}", 16) for i, m in enumerate(maps)]
    before, (module.SPAN, module.CACHED) = (module.SPAN, module.CACHED), (span, cached)
    try:
        found = find(layers)
    finally:
        module.SPAN, module.CACHED = before
    plain = np.stack([layer.level(m.reshape(-1)) for layer, m in zip(layers, maps)]).astype(int)
    assert found is not None
    assert set(map(tuple, found.levels.T)) == {*map(tuple, plain.T), (0,) * len(maps)}
    assert len(set(map(tuple, found.levels.T))) == found.levels.shape[1]
    assert not found.levels[:, 0].any()
    code = np.concatenate([found.of(tile) for tile in read_tiles(layers, row_tiles(*SHAPE, texels=9))])
    assert np.array_equal(found.levels[:, code], plain)


def test_keys_of_layers_with_few_and_with_many_levels_do_not_overflow():
    random = np.random.default_rng(0)
    maps = [random.random(SHAPE, np.float32), *(random.integers(0, 256, SHAPE).astype(np.uint8) for _ in range(2))]
    layers = [painted(m, 1.0, "m", 16) for m in maps]
    found = find(layers)
    plain = np.stack([layer.level(m.reshape(-1)) for layer, m in zip(layers, maps)])
    code = np.concatenate([found.of(tile) for tile in read_tiles(layers, row_tiles(*SHAPE, texels=9))])
    assert np.array_equal(found.levels[:, code], plain)


def test_the_table_of_numbers_is_as_large_as_what_occurs():
    """Three maps of bytes have 2**24 possible keys, whose numbers would take 128 MB, nearly all of them never read."""
    random = np.random.default_rng(0)
    layers = [painted(random.integers(0, 256, SHAPE).astype(np.uint8), 1.0, "m", 16) for _ in range(3)]
    assert find(layers).number.size <= 256 * (SHAPE[0] * SHAPE[1] + 1)


def test_more_combinations_than_wanted_are_not_kept():
    random = np.random.default_rng(0)
    layers = [painted(random.integers(0, 256, SHAPE).astype(np.uint8), 1.0, "m", 16) for _ in range(2)]
    assert find(layers, most=10) is None
    assert find(layers, most=46) is not None


def test_a_layer_with_more_levels_than_may_be_marked_is_not_looked_at(monkeypatch):
    monkeypatch.setattr(module, "SPAN", 100)
    assert find([painted(np.zeros(SHAPE, np.uint8), 1.0, "m", 16)]) is None


@pytest.mark.parametrize("strength", [1.5, -0.1, float("nan")])
def test_a_strength_beyond_one_is_refused(strength):
    with pytest.raises(MakeupError, match="between 0 and 1"):
        painted(np.ones((2, 2), np.uint8), strength, "m", 16)


def test_levels_of_floats_are_the_nearest_and_end_at_nothing_and_full():
    layer = painted(np.zeros((1, 1), np.float32), 0.5, "m", 1024)
    values = layer.values()
    assert values[0] == 0 and values[-1] == 0.5
    stored = np.random.default_rng(0).random(1000).astype(np.float32)
    root = np.sqrt(stored)
    assert np.abs(root - np.sqrt(2 * values[layer.level(stored)])).max() <= 0.5001 / 1023
