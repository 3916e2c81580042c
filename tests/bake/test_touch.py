"""Textures kept up with strokes: the patch is what a whole bake puts there, and nothing else changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from km_makeup.bake import bake, engine, touch
from km_makeup.bake.touch import Kept, Rectangle, changed
from tests.bake.test_engine import METHODS, REFERENCE, request

HEIGHT, WIDTH = 60, 48


def maps(floats: bool) -> list[np.ndarray]:
    random = np.random.default_rng(9)
    made = [
        random.integers(0, 200, (HEIGHT, WIDTH)).astype(np.uint8) * (random.random((HEIGHT, WIDTH)) < 0.5)
        for _ in range(3)
    ]
    return [one.astype(np.float32) / 255 if floats else one.astype(np.uint8) for one in made]


def stroke(values: np.ndarray, place: Rectangle, value: float) -> np.ndarray:
    painted = values.copy()
    painted[place.slices] = value if values.dtype == np.uint8 else value / 255
    return painted


@pytest.mark.parametrize("method", ["bytes", "exact", "fewer bands"])
def test_a_patch_is_what_a_whole_bake_puts_there(method):
    floats = method != "bytes"
    asked = request(maps=maps(floats), reference=REFERENCE, half=True, tolerance=0.1 if method == "fewer bands" else 0)
    kept, textures = Kept(asked), list(vars_of(bake(asked)))
    for layer, place, value in (
        (1, Rectangle(7, 30, 5, 41), 255),
        (0, Rectangle(20, 21, 3, 4), 0),
        (1, Rectangle(0, 60, 0, 48), 90),
    ):
        painted = stroke(kept.maps[layer], place, value)
        patch = kept.touch(layer, painted)
        assert patch is not None and patch.textures
        for texture, part in zip(textures, patch.textures):
            texture[patch.place.slices] = part
    whole = bake(replace(asked, maps=kept.maps))
    for texture, right in zip(textures, vars_of(whole)):
        if method == "fewer bands":  # a whole bake fits its weights to the new maps
            np.testing.assert_allclose(texture, right, atol=3e-3)
        else:
            assert np.array_equal(texture, right)


def vars_of(baked):
    return baked.R, baked.T2, baked.R_up


def test_a_stroke_that_changes_nothing_makes_no_patch():
    kept = Kept(request(maps=maps(False)))
    assert kept.touch(2, kept.maps[2].copy()) is None


def test_a_patch_says_when_a_whole_bake_would_take_another_method(monkeypatch):
    kept = Kept(request(maps=maps(False)))
    monkeypatch.setattr(touch, "MOST", len(kept._seen))
    patch = kept.patch(Rectangle(0, 9, 0, 9))
    assert patch.same_method and patch.textures
    patch = kept.touch(0, stroke(kept.maps[0], Rectangle(0, 9, 0, 9), 251))
    assert patch is not None and not patch.same_method and len(patch.textures) == 3


@pytest.mark.parametrize("shape", [(16, 16), (17, 13), (1, 1), (5, 8)])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_the_smallest_rectangle_of_a_change_is_found(shape, dtype):
    random = np.random.default_rng(3)
    old = (random.random(shape) * 200).astype(dtype)
    assert changed(old, old.copy()) is None
    for _ in range(20):
        y, x = (np.sort(random.integers(0, n, 2)) for n in shape)
        new = old.copy()
        new[y, x] += 1
        assert changed(old, new) == Rectangle(int(y[0]), int(y[1]) + 1, int(x[0]), int(x[1]) + 1)


def test_rectangles_are_joined_to_the_smallest_around_both():
    assert Rectangle(1, 3, 5, 6).joined(Rectangle(2, 9, 0, 2)) == Rectangle(1, 9, 0, 6)


@pytest.mark.parametrize("method", METHODS)
def test_what_is_kept_is_a_copy(method):
    asked = METHODS[method]()
    kept = Kept(asked)
    assert not any(np.shares_memory(mine, given) for mine, given in zip(kept.maps, asked.maps))
    assert engine.size_of(asked) == kept.maps[0].shape
