"""Statistics of cosmetic maps: right, quick to bring up to date, the same for bytes and floats."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.makeup.statistics import GRID, joint, statistics


@pytest.fixture
def painted():
    values = np.zeros((300, 200), np.uint8)
    values[10:50, 20:60] = 128
    values[200:220, 100:150] = 51
    return values


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_what_is_painted_is_counted(painted, kind):
    values = painted if kind is np.uint8 else (painted / 255).astype(np.float32)
    found = statistics(values)
    assert found.maximum == pytest.approx(128 / 255)
    assert found.covered == 40 * 40 + 20 * 50 == np.count_nonzero(painted)
    assert found.coverage == pytest.approx(np.count_nonzero(painted) / painted.size)


def test_the_grid_holds_every_painted_texel_and_little_else(painted):
    grid = statistics(painted).grid()
    rows, columns = np.nonzero(painted)
    assert grid.shape == (GRID, GRID)
    assert grid[rows * GRID // 300, columns * GRID // 200].all()
    assert not grid[GRID // 2].any() and not grid[:, : 10 * GRID // 200].any()


def test_small_maps_have_a_grid_too():
    values = np.zeros((8, 8), np.uint8)
    values[7, 0] = 1
    grid = statistics(values).grid()
    assert grid[-1, 0] and not grid[0].any() and not grid[:, -1].any()


def test_maps_meet_where_both_carry_product(painted):
    other = np.zeros_like(painted)
    other[40:60, 50:80] = 255
    assert joint([statistics(painted), statistics(other)]) == pytest.approx(10 * 10 / painted.size)
    other[:] = 0
    other[100:120] = 255
    assert joint([statistics(painted), statistics(other)]) == 0
    assert joint([statistics(painted), statistics(other[::2, ::2])]) == 0


def test_after_a_stroke_only_its_rows_are_read_and_the_result_is_the_same(painted):
    before = statistics(painted)
    painted[100:110, 5] = 255
    after = statistics(painted, before)
    kept = [a is b for a, b in zip(before.bands, after.bands)]
    assert kept == [True, False, True, True, True]
    fresh = statistics(painted)
    assert (after.maximum, after.covered, after.mark) == (
        fresh.maximum,
        fresh.covered,
        fresh.mark,
    ) and after.maximum == 1


def test_detail_is_what_boxes_lose(painted):
    flat, fine = np.full((128, 128), 200, np.uint8), np.zeros((128, 128), np.uint8)
    fine[:, ::2] = 255
    assert statistics(flat).detail == {2: 0, 4: 0, 8: 0}
    assert statistics(fine).detail == {2: 0.5, 4: 0.5, 8: 0.5}
    ramp = np.tile(np.arange(128, dtype=np.uint8), (128, 1))
    assert statistics(ramp).detail == pytest.approx({2: 0.5 / 255, 4: 1.5 / 255, 8: 3.5 / 255}, rel=1e-6)
