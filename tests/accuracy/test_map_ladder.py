"""The ladder of maps and textures: finer is nearer, and a byte's first step is what its largest error is."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.accuracy import maps
from km_makeup.spectra import delta_e


@pytest.fixture(scope="module")
def found():
    return {rung.name: rung.error() for rung in maps.map_ladder(maps.painted(128)).rungs}


@pytest.mark.parametrize(
    "falling",
    [
        ["map at 1/8 size", "map at 1/4 size", "map at 1/2 size", "float maps, float textures"],
        ["17 levels", "byte maps, float textures", "float maps, float textures"],
        ["byte maps, half textures", "byte maps, float textures"],
        ["float maps, half textures", "float maps, float textures", "float maps, no short cut"],
    ],
)
def test_finer_rungs_are_nearer(found, falling):
    means = [found[name].mean for name in falling]
    assert means == sorted(means, reverse=True), dict(zip(falling, means))


def test_without_short_cut_there_is_no_error(found):
    assert found["float maps, no short cut"].max == 0


def test_the_short_cut_of_float_maps_keeps_its_tolerance(found):
    assert 0 < found["float maps, float textures"].max <= 0.05


def test_bytes_are_coarsest_where_there_is_least_product():
    work = maps.painted(128)
    truth = maps.over(maps.bake(maps.request(work.maps, tolerance=0)), work.skin)
    error = delta_e(maps.over(maps.bake(maps.request(maps.as_bytes(work.maps))), work.skin), truth)
    thinnest = np.where(work.maps > 0, work.maps, 1).min(axis=0)
    assert error[thinnest < 0.05].max() == error.max()
    assert error[thinnest < 0.05].mean() > 3 * error[(thinnest > 0.5) & (work.maps.max(axis=0) > 0)].mean()


def test_minified_maps_keep_their_mean():
    values = np.random.default_rng(0).random((2, 16, 16))
    small = maps.minified(values, 4)
    np.testing.assert_allclose(small.mean(axis=(1, 2)), values.mean(axis=(1, 2)))
    assert (small[:, :4, :4] == small[:, :1, :1]).all()
