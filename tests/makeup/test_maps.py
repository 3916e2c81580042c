"""Cosmetic maps: what is usable, and the paper's RGB-coded form in both directions."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.makeup import maps

RANDOM = np.random.default_rng(3)


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_layers_survive_the_rgb_coded_map_in_both_directions(count, dtype):
    layers = [(RANDOM.random((4, 6)) * 255).astype(dtype) for _ in range(count)]
    coded = maps.join_rgb_coded(layers)
    assert coded.shape == (4, 6, 3) and coded.dtype == dtype
    back = maps.split_rgb_coded(coded)
    assert list(back) == ["R", "G", "B"]
    for channel, expected in zip("RGB", [*layers, *[np.zeros((4, 6), dtype)] * (3 - count)]):
        assert np.array_equal(back[channel], expected)
    assert np.array_equal(maps.join_rgb_coded(list(back.values())), coded)


def test_the_fourth_channel_of_an_rgb_coded_map_is_a_layer_too():
    image = RANDOM.random((3, 3, 4)).astype(np.float32)
    assert np.array_equal(maps.split_rgb_coded(image)["A"], image[..., 3])


@pytest.mark.parametrize("shape", [(4, 4), (4, 4, 1), (4, 4, 5)])
def test_an_image_without_three_or_four_channels_is_no_rgb_coded_map(shape):
    with pytest.raises(MakeupError, match="three or four channels"):
        maps.split_rgb_coded(np.zeros(shape, np.uint8))


def test_more_layers_than_channels_are_refused():
    with pytest.raises(MakeupError, match="one to three layers, not 4"):
        maps.join_rgb_coded([np.zeros((2, 2), np.uint8)] * 4)
    with pytest.raises(MakeupError, match="not 0"):
        maps.join_rgb_coded([])


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (np.nan, "1 values that are not numbers"),
        (np.inf, "1 values that are not numbers"),
        (1.5, "between 0 and 1"),
        (-0.2, "between 0 and 1"),
    ],
)
def test_a_map_with_values_that_cannot_be_is_refused_by_name(bad, message):
    values = np.full((3, 4), 0.5, np.float32)
    values[1, 2] = bad
    with pytest.raises(MakeupError, match=message) as caught:
        maps.check_map(values, "lips.exr")
    assert str(caught.value).startswith("lips.exr")


def test_rounding_beyond_the_ends_is_taken_as_the_ends():
    values = np.array([[-1e-7, 1 + 1e-7]], np.float32)
    assert np.array_equal(maps.check_map(values, "m"), [[0, 1]])


def test_bytes_are_kept_as_bytes():
    values = RANDOM.integers(0, 256, (3, 3), dtype=np.uint8)
    assert maps.check_map(values, "m") is values


def test_an_empty_or_coloured_array_is_no_map():
    for values in (np.zeros((0, 4), np.float32), np.zeros((2, 2, 3), np.float32)):
        with pytest.raises(MakeupError, match="one channel"):
            maps.check_map(values, "m")


def test_maps_of_different_sizes_are_refused_naming_both():
    named = [("a.png", np.zeros((4, 8))), ("b.png", np.zeros((4, 8))), ("c.png", np.zeros((8, 4)))]
    with pytest.raises(MakeupError, match=r"c\.png is 4x8 but a\.png is 8x4"):
        maps.check_same_size(named)
    assert maps.check_same_size(named[:2]) == (4, 8)


def test_coverage_counts_what_carries_product():
    assert maps.coverage(np.array([[0, 1], [0, 255]], np.uint8)) == 0.5
