"""The bake against a direct evaluation by the printed equations, and that it computes no more than it must."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from km_makeup.bake import Request, bake, engine
from km_makeup.errors import MakeupError
from km_makeup.makeup import Coat, coat
from km_makeup.optics import air_interface
from km_makeup.products import Library
from km_makeup.spectra import bands, to_rgb, upsample_skin
from tests.makeup import truth

AIR = air_interface(1.45)
SIZE = (24, 32)
REFERENCE = np.array([0.45, 0.27, 0.19])


@dataclass(frozen=True)
class Counting(Coat):
    """A coat that remembers how many values it was evaluated at."""

    count: list | None = None

    def at(self, value):
        self.count.append(np.size(value))
        return super().at(value)


@cache
def library() -> Library:
    return Library.shipped()


def products() -> list[tuple[str, float]]:
    return [("foundation-light", 20.0), ("eyeshadow-bronze", 12.0), ("lipstick-berry", 15.0)]


def painted_maps(seed: int = 1) -> list[np.ndarray]:
    """A byte map, a float map and a byte map, each painted on a part of the texels."""
    random = np.random.default_rng(seed)
    first = (random.random(SIZE) * 255).astype(np.uint8) * (random.random(SIZE) < 0.4)
    second = random.random(SIZE).astype(np.float32) * (random.random(SIZE) < 0.3)
    third = np.zeros(SIZE, np.uint8)
    third[4:9, 10:20] = random.integers(0, 256, (5, 10))
    return [first, second, third]


def request(**changes) -> Request:
    coats = [coat(library().find(id_), um) for id_, um in products()]
    made = Request(coats, painted_maps(), AIR, bands(), strengths=(1.0, 0.8, 1.0))
    return replace(made, **changes)


def true_spectra(values: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """Reflectance (81) of the stack where the maps read ``values`` 0..1 (strength included), printed equations."""
    layers = []
    for (id_, um), value in zip(products(), values):
        product = library().find(id_)
        if product.form == "powder":
            R, T = truth.film(product.K, product.S, um / 1000)
            layers.append((value * R, 1 - value + value * T))
        elif value > 0:
            layers.append(truth.film(product.K, product.S, value * um / 1000))
    return truth.on_skin(layers, skin)


def painted_values(y: int, x: int) -> np.ndarray:
    first, second, third = painted_maps()
    return np.array([first[y, x] / 255, second[y, x] * 0.8, third[y, x] / 255])


def covered_mask() -> np.ndarray:
    return np.any([m > 0 for m in painted_maps()], axis=0)


def formula(baked, c: np.ndarray) -> np.ndarray:
    """What the textures' metadata promise."""
    return baked.R + baked.T2 * c / (1 - baked.R_up * c)


def some_texels() -> list[tuple[int, int]]:
    return list(zip(*np.nonzero(covered_mask())))[::7]


def test_every_texel_equals_the_printed_equations_over_black_and_over_the_reference_skin():
    baked = bake(request(reference=REFERENCE))
    skin = upsample_skin(REFERENCE)
    over_skin, over_black = formula(baked, REFERENCE), formula(baked, np.zeros(3))
    for y, x in some_texels():
        values = painted_values(y, x)
        np.testing.assert_allclose(over_skin[y, x], to_rgb(true_spectra(values, skin)), atol=3e-6)
        np.testing.assert_allclose(over_black[y, x], to_rgb(true_spectra(values, np.zeros(81))), atol=1e-6)


def test_the_finished_albedo_is_exact_for_every_texel_of_the_skin_texture():
    texture = np.random.default_rng(4).uniform([0.3, 0.15, 0.08], [0.7, 0.45, 0.35], (*SIZE, 3)).astype(np.float32)
    baked = bake(request(skin=texture))
    for y, x in some_texels():
        skin = upsample_skin(texture[y, x].astype(np.float64))
        np.testing.assert_allclose(baked.albedo[y, x], to_rgb(true_spectra(painted_values(y, x), skin)), atol=3e-6)
    bare = ~covered_mask()
    assert np.array_equal(baked.albedo[bare], texture[bare])


def test_texels_without_product_are_exactly_bare():
    baked, bare = bake(request()), ~covered_mask()
    assert bare.any()
    assert (baked.R[bare] == 0).all() and (baked.T2[bare] == 1).all() and (baked.R_up[bare] == 0).all()


def test_only_covered_texels_are_computed_and_equal_ones_once():
    counts: list[int] = []
    coats = [Counting(c.K, c.S, c.thickness_mm, c.powder, c.name, counts) for c in request().coats]
    maps = [np.zeros((200, 200), np.uint8) for _ in coats]
    for i, values in enumerate(maps):
        values[50:60, 50:100] = 40 + np.arange(50) % 5 * (i + 1)
    baked = bake(request(coats=coats, maps=maps, strengths=()))
    assert (baked.covered, baked.distinct) == (500, 5)
    assert counts == [5, 5, 5]


def test_the_colour_outside_the_working_space_is_counted():
    pure = Coat(np.where(np.arange(81) < 40, 2000.0, 0.01), np.full(81, 0.5), 0.03)
    painted = np.zeros(SIZE, np.uint8)
    painted[:2] = 255
    baked = bake(Request([pure], [painted], AIR, bands(), reference=REFERENCE))
    assert formula(baked, REFERENCE)[0, 0].min() < -0.001
    assert baked.out_of_gamut == 2 * SIZE[1]


@pytest.mark.parametrize("chunk", [1, 7, 64])
def test_the_result_does_not_depend_on_how_the_texels_are_grouped(monkeypatch, chunk):
    texture = np.random.default_rng(4).uniform(0.1, 0.6, (*SIZE, 3)).astype(np.float32)
    whole = bake(request(reference=REFERENCE, skin=texture))
    monkeypatch.setattr(engine, "CHUNK", chunk)
    steps = []
    parts = bake(request(reference=REFERENCE, skin=texture), lambda done, total: steps.append((done, total)))
    for name in ("R", "T2", "R_up", "albedo"):
        assert getattr(whole, name).tobytes() == getattr(parts, name).tobytes(), name
    assert steps[-1][0] == steps[-1][1] == len(steps)


DIGEST = """
import hashlib, numpy as np
from tests.bake import test_engine as t
baked = t.bake(t.request(reference=t.REFERENCE))
print(hashlib.sha256(baked.R.tobytes() + baked.T2.tobytes() + baked.R_up.tobytes()).hexdigest())
"""


def test_the_result_does_not_depend_on_the_number_of_cores():
    found = set()
    for cores in ("1", "2", "4"):
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": cores, "OMP_NUM_THREADS": cores}
        ran = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", DIGEST],
            env=environment, cwd=Path(__file__).parents[2], capture_output=True, text=True, check=True,
        )  # fmt: skip
        found.add(ran.stdout.strip())
    baked = bake(request(reference=REFERENCE))
    found.add(hashlib.sha256(baked.R.tobytes() + baked.T2.tobytes() + baked.R_up.tobytes()).hexdigest())
    assert len(found) == 1


def test_nothing_painted_gives_bare_textures():
    baked = bake(request(maps=[np.zeros(SIZE, np.uint8)] * 3, reference=REFERENCE))
    assert baked.covered == baked.distinct == 0
    assert (baked.R == 0).all() and (baked.T2 == 1).all() and (baked.R_up == 0).all()


def test_the_reference_skin_may_be_black():
    baked = bake(request(reference=np.zeros(3)))
    assert np.isfinite(baked.T2).all() and np.isfinite(baked.R).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"maps": painted_maps()[:2]}, "3 layers and 2 maps"),
        ({"maps": []}, "one map a layer"),
        ({"maps": [*painted_maps()[:2], np.zeros((8, 8), np.uint8)]}, "map 3 is 8x8 but map 1 is 32x24"),
        ({"maps": [*painted_maps()[:2], np.full(SIZE, np.nan, np.float32)]}, "not numbers"),
        ({"skin": np.zeros((8, 8, 3), np.float32)}, "give both the same size"),
    ],
)
def test_maps_that_do_not_fit_are_refused(changes, message):
    with pytest.raises(MakeupError, match=message):
        bake(request(**changes))
