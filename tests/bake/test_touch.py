"""Textures kept up with strokes: the patch is what a whole bake puts there, and nothing else changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from km_makeup.bake import bake, engine, tiles
from km_makeup.bake.touch import Kept, Rectangle, changed
from km_makeup.spectra import delta_e
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
    kept, textures = Kept(asked, 0), list(vars_of(bake(asked)))
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


def seen_over(textures, skin):
    """The colour of textures R, T2, R_up over a skin."""
    R, T2, R_up = (np.asarray(one, np.float64)[..., :3] for one in textures)
    return R + T2 * skin / (1 - R_up * skin)


def painted_by_strokes(kept: Kept, order) -> list[np.ndarray]:
    """The textures of a kept stack after strokes in some order, patched together."""
    strokes = [(1, Rectangle(7, 30, 5, 41), 255), (0, Rectangle(20, 21, 3, 4), 0), (2, Rectangle(2, 50, 1, 40), 90)]
    textures = list(kept.patch(Rectangle(0, HEIGHT, 0, WIDTH)).textures)
    for number in order:
        layer, place, value = strokes[number]
        patch = kept.touch(layer, stroke(kept.maps[layer], place, value))
        for texture, part in zip(textures, patch.textures):
            texture[patch.place.slices] = part
    return textures


def test_strokes_keep_the_tolerance_of_the_bake_and_say_their_error():
    asked = request(maps=maps(False), reference=REFERENCE)
    kept, exact = (Kept(asked, tolerance) for tolerance in (0.05, 0))
    assert exact.error == 0 < kept.error <= 0.05
    quick, right = (painted_by_strokes(one, (0, 1, 2)) for one in (kept, exact))
    assert not np.array_equal(quick[0], right[0])
    for skin in (REFERENCE, 1.3 * REFERENCE, np.array([0.45, 0.27, 0.19])):
        assert delta_e(seen_over(quick, skin), seen_over(right, skin)).max() <= 0.05


@pytest.mark.parametrize("tolerance", [0, 0.05])
def test_a_texel_depends_on_its_values_and_not_on_strokes_tiles_or_cores(monkeypatch, tolerance):
    asked = request(maps=maps(False), reference=REFERENCE, half=True)
    wanted = painted_by_strokes(Kept(asked, tolerance), (0, 1, 2))
    for order, texels, cores in (((1, 2, 0), 1 << 17, 1), ((2, 0, 1), 100, 3), ((0, 1, 2), 7, 2)):
        monkeypatch.setattr(tiles, "TILE_TEXELS", texels)
        monkeypatch.setattr(tiles, "cores", lambda cores=cores: cores)
        monkeypatch.setattr("km_makeup.bake.texels.BLOCK", 81 * texels)
        for right, texture in zip(wanted, painted_by_strokes(Kept(asked, tolerance), order)):
            assert np.array_equal(right, texture)


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
