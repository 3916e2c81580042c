"""A few random stacks and painted edges from rendered pixels, as the long commands read thousands; and that they can fail."""

from __future__ import annotations

import numpy as np
import pytest

from tests.live_colours import edges, stacks
from tests.live_colours.__main__ import MEAN, P99, difference

pytestmark = pytest.mark.usefixtures("shared_data")


WORST_PART = 0.025
"""Largest error of a film's or a skin's part on any texel; the bound of .01 is passed on one in a hundred (live_colours.md)."""


@pytest.fixture(scope="module")
def chosen():
    return stacks.random_stacks(8, 20)


@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_random_stacks_render_as_81_bands_say(engine, chosen, clean_scene, tmp_path):
    from tests.live_colours import tiles

    found = difference(tiles.measured(chosen, [engine], tmp_path)[engine], chosen)
    assert found.colour.mean() <= MEAN and np.quantile(found.colour, 0.99) <= P99
    assert max(found.film.max(), found.skin.max()) <= WORST_PART


def test_a_film_of_another_thickness_is_a_fault(chosen):
    rendered = np.array([stacks.expected(stack) for stack in chosen])
    assert difference(rendered, chosen).faults() == []
    for part in range(2):
        spoilt = rendered.copy()
        spoilt[:, part] *= 1.05
        assert difference(spoilt, chosen).faults()


def test_no_pixel_at_a_painted_edge_leaves_the_colours_of_its_neighbours(clean_scene):
    found = edges.measure(["eevee"], ["16x"], ["front", "4 texels a pixel"])
    assert [one for one in found if one.outside or one.pixels < 500] == []


def test_a_pixel_outside_its_neighbours_is_seen():
    curve = np.linspace([0.4, 0.3, 0.2], [0.2, 0.1, 0.1], 256)
    low, high = edges.ranges(curve)
    assert edges.excess(curve[100], low[90, 110], high[90, 110]) == 0
    assert edges.excess(curve[100], low[110, 120], high[110, 120]) > edges.TOLERANCE
