"""UDIM tiles gathered on one square: what a tile shows is found again at the same place of the skin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from km_makeup.errors import MakeupError
from km_makeup.makeup.maps import looked_up
from km_makeup.makeup.udim import LARGEST, MARGIN, NO_TILE, TileLayout, loses, moved, parsed, tile_numbers

TILE_SETS = st.sets(st.integers(1001, 1040), min_size=1, max_size=10).map(lambda one: tuple(sorted(one)))


def corners_in(tiles: tuple[int, ...], seed: int, inset: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    numbers = rng.choice(tiles, 200)
    origin = np.stack([(numbers - 1001) % 10, (numbers - 1001) // 10], axis=-1)
    return origin + rng.uniform(inset, 1 - inset, (200, 2)), numbers


def test_tiles_are_numbered_from_1001_ten_to_a_row():
    uv = np.array([[0.5, 0.5], [1.5, 0.2], [9.9, 0.0], [0.1, 1.0], [2.5, 3.5], [-0.1, 0.5], [10.0, 0.5], [0.5, -0.2]])
    assert tile_numbers(uv).tolist() == [1001, 1002, 1010, 1011, 1033, NO_TILE, NO_TILE, NO_TILE]


@given(tiles=TILE_SETS, seed=st.integers(0, 2**16))
def test_what_a_tile_shows_is_found_where_its_corner_was_placed(tiles, seed):
    """Pictures that are linear in u and v are told exactly by bilinear filtering, half a texel inside their edges."""
    uv, numbers = corners_in(tiles, seed, inset=0.07)
    layout = TileLayout(tiles)
    side = 64

    def ramp(number: int) -> np.ndarray:
        axis = (np.arange(16) + 0.5) / 16
        return np.stack(np.broadcast_arrays(number + axis[None, :], 2 * axis[:, None]), axis=-1).astype(np.float32)

    picture = layout.gathered(ramp, (side * layout.columns, side * layout.columns))
    placed = layout.placed(uv, numbers)
    inside = uv - np.floor(uv)
    read = np.array([looked_up(picture, np.array([v]), np.array([u]))[0, 0] for u, v in placed])
    wanted = np.stack([numbers + inside[:, 0], 2 * inside[:, 1]], axis=-1)
    np.testing.assert_allclose(read, wanted, atol=2e-3)


@given(tiles=TILE_SETS, seed=st.integers(0, 2**16))
def test_no_two_tiles_share_a_place_and_none_reaches_the_border_of_its_cell(tiles, seed):
    uv, numbers = corners_in(tiles, seed)
    layout = TileLayout(tiles)
    cells = layout.placed(uv, numbers) * layout.columns
    row, column = np.divmod(np.searchsorted(tiles, numbers), layout.columns)
    np.testing.assert_array_equal(np.floor(cells), np.stack([column, row], axis=-1))
    within = cells - np.floor(cells)
    assert within.min() >= MARGIN - 1e-9 and within.max() <= 1 - MARGIN + 1e-9


def test_corners_of_other_tiles_lie_on_the_corner_of_the_square():
    placed = TileLayout((1001, 1002)).placed(np.array([[5.5, 0.5], [-3.0, 0.2]]), np.array([1006, NO_TILE]))
    np.testing.assert_array_equal(placed, 0)


@given(old=TILE_SETS, new=TILE_SETS, side=st.integers(20, 40), dtype=st.sampled_from([np.uint8, np.float32]))
def test_a_map_follows_its_tiles_texel_by_texel_and_new_tiles_are_empty(old, new, side, dtype):
    before, after = TileLayout(old), TileLayout(new)
    rng = np.random.default_rng(side)
    values = (rng.random((side * before.columns,) * 2) * 255).astype(dtype)
    moved = after.rearranged(values, before)
    assert moved.shape == (side * after.columns,) * 2 and moved.dtype == dtype
    kept = {number: cell(values, before, number, side) for number in old}
    for number in new:
        np.testing.assert_array_equal(cell(moved, after, number, side), kept.get(number, 0))


def cell(values: np.ndarray, layout: TileLayout, number: int, side: int) -> np.ndarray:
    row, column = divmod(layout.tiles.index(number), layout.columns)
    return values[row * side : (row + 1) * side, column * side : (column + 1) * side]


def test_a_map_whose_size_the_grid_does_not_divide_follows_too():
    values = np.zeros((50, 50), np.uint8)
    values[:25] = 200
    moved = TileLayout((1001,)).rearranged(values, TileLayout((1001, 1002, 1003, 1004, 1005)))
    assert moved.shape == (16, 16) and set(np.unique(moved)) == {200}


def test_tiles_are_read_as_written_and_others_are_refused():
    assert parsed("1002, 1001 1002") == (1001, 1002) and parsed("  ") == ()
    for wrong in ("1000", "2001", "face", "1001-1003", "-1001"):
        with pytest.raises(MakeupError, match="is no UDIM tile"):
            parsed(f"1001 {wrong}")


@given(tiles=TILE_SETS, dtype=st.sampled_from([np.uint8, np.float32]))
def test_a_map_that_every_tile_repeats_is_found_on_each_and_comes_back(tiles, dtype):
    """A ramp, which bilinear filtering tells exactly half a texel inside its edges; bytes to half a step and the grid's."""
    ramp = np.tile(np.linspace(0, 1, 64)[:, None] * (255 if dtype == np.uint8 else 1), (1, 64)).astype(dtype)
    layout = TileLayout(tiles)
    there = moved(ramp, None, layout)
    assert there.dtype == ramp.dtype and there.shape == (64 * layout.columns,) * 2
    back = moved(there, layout, None)
    assert back.dtype == ramp.dtype and back.shape == ramp.shape
    np.testing.assert_allclose(back.astype(float), ramp, atol=2 if dtype == np.uint8 else 0.01)
    assert not loses(there, None, layout) and loses(there, layout, None) == (len(tiles) > 1)


def test_a_map_repeated_on_many_tiles_is_not_made_larger_than_memory_bears():
    layout = TileLayout(tuple(range(1001, 1026)))
    assert moved(np.zeros((2048, 8), np.uint8), None, layout).shape == (LARGEST, 40)
    assert moved(np.zeros((LARGEST * 2, 8), np.uint8), None, layout).shape == (LARGEST * 2, 40)


def test_a_map_of_one_texel_follows_too():
    assert moved(np.full((1, 1), 7, np.uint8), TileLayout((1001, 1002)), TileLayout((1001,))).tolist() == [[7]]
