"""What lies on the surface, and what past the edges of its islands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from km_makeup.bake import bake, islands, tiles
from km_makeup.bake.islands import carried_outwards, dilation, on_surface
from tests.bake.test_engine import request

RANDOM = np.random.default_rng(8)


def plainly_inside(triangles, height, width):
    """Each texel centre against each triangle, by barycentric coordinates."""
    y, x = np.mgrid[:height, :width]
    points = np.stack([(x + 0.5) / width, (y + 0.5) / height], axis=-1)
    mask = np.zeros((height, width), bool)
    for a, b, c in triangles:
        M = np.linalg.inv(np.stack([b - a, c - a], axis=1))
        s = (points - a) @ M.T
        mask |= (s[..., 0] >= 0) & (s[..., 1] >= 0) & (s.sum(axis=-1) <= 1)
    return mask


@pytest.mark.parametrize("size", [(16, 16), (33, 20), (64, 7)])
def test_texels_on_the_surface_are_those_whose_centres_are_in_a_triangle(size):
    triangles = RANDOM.random((12, 3, 2))
    small = 0.5 + 0.05 * RANDOM.random((30, 3, 2))
    both = np.concatenate([triangles, small])
    assert np.array_equal(on_surface(both, *size), plainly_inside(both, *size))


def test_chunks_do_not_matter(monkeypatch):
    triangles = RANDOM.random((40, 3, 2))
    whole = on_surface(triangles, 31, 17)
    monkeypatch.setattr(islands, "CHUNK", 50)
    assert np.array_equal(whole, on_surface(triangles, 31, 17))


def test_uvs_of_the_next_tile_come_in_again_behind():
    triangles = RANDOM.random((5, 3, 2))
    assert np.array_equal(on_surface(triangles + (1, -2), 24, 24), on_surface(triangles, 24, 24))


def test_every_texel_within_the_margin_takes_a_value_from_near_it_and_no_other_changes():
    mask = np.zeros((40, 50), bool)
    mask[10:20, 8:30] = mask[30, 40] = True
    found = carried_outwards(mask, 6)
    y, x = np.nonzero(mask)
    ty, tx = np.divmod(found.targets, 50)
    sy, sx = np.divmod(found.sources, 50)
    assert mask[sy, sx].all() and not mask[ty, tx].any()
    taken = (sy - ty) ** 2 + (sx - tx) ** 2
    nearest = ((ty[:, None] - y) ** 2 + (tx[:, None] - x) ** 2).min(axis=1)
    assert (np.sqrt(taken) <= np.sqrt(nearest) + 1).all() and (taken == nearest).mean() > 0.95
    every = np.abs(np.mgrid[:40, :50].reshape(2, -1, 1) - np.stack([y, x])[:, None]).max(axis=0).min(axis=1)
    assert set(found.targets) == set(np.flatnonzero((every > 0) & (every <= 6)))


def test_a_map_without_islands_or_without_room_is_left_as_it_is():
    for mask in (np.zeros((5, 4), bool), np.ones((5, 4), bool)):
        values = RANDOM.integers(0, 256, (5, 4)).astype(np.uint8)
        assert np.array_equal(carried_outwards(mask, 8).fill(values), values)


def test_filled_maps_bake_the_same_in_any_tiles(monkeypatch):
    triangles = np.array([[[0.1, 0.1], [0.6, 0.1], [0.1, 0.7]], [[0.7, 0.7], [0.9, 0.7], [0.9, 0.9]]])
    asked = request()
    filler = dilation(triangles, *asked.maps[0].shape, margin=5)
    filled = replace(asked, maps=[filler.fill(one) for one in asked.maps])
    whole = bake(filled)
    monkeypatch.setattr(tiles, "TILE_TEXELS", 50)
    parts = bake(filled)
    assert np.array_equal(whole.R, parts.R) and np.array_equal(whole.T2, parts.T2)
    past = whole.R.reshape(-1, 4)[filler.targets]
    assert len(past) > 50 and np.array_equal(past, whole.R.reshape(-1, 4)[filler.sources])
