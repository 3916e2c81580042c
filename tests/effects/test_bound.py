"""The plan's bound on rendered pictures: a part of `tests.effects.bound` that changes with every commit, and a fault that it finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.effects.bound import commit_seed, measured
from tests.effects.cases import HEADS, Case, Painted, Stage, draw

SMALL = (48, 36)


def test_scenes_are_drawn_by_the_seed():
    products = ["a", "b"]
    assert draw(7, 14, products) == draw(7, 14, products) != draw(8, 14, products)
    assert {case.head for case in draw(7, 14, products)} == set(HEADS)
    assert np.mean([case.engine == "eevee" for case in draw(7, 40, products)]) == 0.8


@pytest.mark.blender
def test_a_scene_of_this_commit_keeps_its_tolerances(tmp_path, shared_data):
    from km_makeup.products import Library

    products = [product.id for product in Library.shipped().products]
    (case,) = draw(commit_seed(), 1, products)
    case = replace(case, head="mask", scattering="CLOSURES", highlight="LOBES", away=min(case.away, 2.5))
    for row in measured(Stage(case.head, tmp_path, SMALL), case, tolerances=(0.5,)):
        assert row["above"] <= row["tolerance"], f"seed {commit_seed()}: {row}"


@pytest.mark.blender
def test_a_visible_film_that_is_dropped_is_found(tmp_path, shared_data):
    """A planted fault: the topmost film that the plan kept is left out."""
    lips = (Painted("foundation-light", 8.0, "all", 1), Painted("lipstick-classic-red", 10.0, "blobs", 3))
    case = Case(0, "mask", "front", 1.0, "point", lips, "cycles", "LIVE", "CLOSURES", "LOBES")
    stage = Stage(case.head, tmp_path, SMALL, samples=256)
    rows = list(measured(stage, case, fault=True))
    assert all(row["above"] > row["tolerance"] for row in rows), rows
    assert all(row["bound"] < row["above"] for row in rows), rows
