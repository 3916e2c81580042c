"""The scenes of `tests.effects.bound` are those of its seed."""

from __future__ import annotations

import numpy as np

from tests.effects.cases import HEADS, draw


def test_scenes_are_drawn_by_the_seed():
    products = ["a", "b"]
    assert draw(7, 14, products) == draw(7, 14, products) != draw(8, 14, products)
    assert {case.head for case in draw(7, 14, products)} == set(HEADS)
    assert np.mean([case.engine == "eevee" for case in draw(7, 40, products)]) == 0.8
