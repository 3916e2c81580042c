"""The bake against a direct evaluation by the printed equations, and that it computes no more than it must."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from km_makeup.bake import Request, Shine, bake, engine, finished, texels, tiles
from km_makeup.errors import MakeupError
from km_makeup.makeup import Coat, coat
from km_makeup.makeup.finish import Gloss, covered, finish_texture
from km_makeup.optics import air_interface
from km_makeup.products import Library
from km_makeup.spectra import bands, delta_e, to_rgb, upsample_skin
from tests.bake.steps import drained
from tests.makeup import truth

AIR = air_interface(1.45)
SIZE = (24, 32)
REFERENCE = np.array([0.45, 0.27, 0.19])


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
    """Three layers, computed without short cuts unless a test asks for one."""
    coats = [coat(library().find(id_), um) for id_, um in products()]
    made = Request(coats, painted_maps(), AIR, bands(), strengths=(1.0, 0.8, 1.0), tolerance=0)
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


def same_texels(baked, where: np.ndarray) -> bool:
    """Whether the textures are those of no product there, alpha included."""
    bare = {"R": (0, 0, 0, 1), "T2": (1, 1, 1, 1), "R_up": (0, 0, 0, 1)}
    return all((getattr(baked, name)[where] == value).all() for name, value in bare.items())


def covered_mask() -> np.ndarray:
    return np.any([m > 0 for m in painted_maps()], axis=0)


def formula(baked, c: np.ndarray) -> np.ndarray:
    """What the textures' metadata promise."""
    R, T2, R_up = (texture[..., :3].astype(np.float64) for texture in (baked.R, baked.T2, baked.R_up))
    return R + T2 * c / (1 - R_up * c)


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
    assert same_texels(baked, bare)


def byte_maps() -> list[np.ndarray]:
    """The painted maps as bytes, all of them: few combinations, each computed once."""
    first, second, third = painted_maps()
    return [first, np.rint(second * 8).astype(np.uint8) * 30, third]


def float_maps() -> list[np.ndarray]:
    """Three float maps that meet in many places."""
    random = np.random.default_rng(7)
    return [(random.random(SIZE) ** 2 * (random.random(SIZE) < 0.6)).astype(np.float32) for _ in range(3)]


METHODS = {
    "each combination once": lambda: request(maps=byte_maps(), reference=REFERENCE),
    "each combination once, half floats": lambda: request(maps=byte_maps(), reference=REFERENCE, half=True),
    "texel by texel at fewer bands": lambda: request(maps=float_maps(), reference=REFERENCE, tolerance=0.1),
    "texel by texel, exact": lambda: request(maps=float_maps(), reference=REFERENCE),
}


def test_equal_texels_are_computed_once(monkeypatch):
    computed: list[int] = []
    original = texels.optics

    def counting(tables, levels, interface):
        computed.append(len(levels[0]))
        return original(tables, levels, interface)

    monkeypatch.setattr(texels, "optics", counting)
    maps = [np.zeros((200, 200), np.uint8) for _ in products()]
    for i, values in enumerate(maps):
        values[50:60, 50:100] = 40 + np.arange(50) % 5 * (i + 1)
    baked = bake(request(maps=maps, strengths=()))
    assert (baked.covered, baked.distinct) == (500, 5)
    assert computed == [6]  # and the one without product


def test_equal_texels_of_a_tile_are_computed_once_where_each_is_computed_by_itself(monkeypatch):
    computed: list[int] = []
    original = texels.optics

    def counting(tables, levels, interface):
        computed.append(len(levels[0]))
        return original(tables, levels, interface)

    maps = [np.zeros((200, 200), np.float32) for _ in products()]
    for i, values in enumerate(maps):
        values[50:60, 50:100] = (0.5 + np.arange(50) % 5 * (i + 1) / 50) ** 2  # levels, whatever their number
    asked = request(maps=maps, strengths=(), reference=REFERENCE, tolerance=0.5)
    prepared = drained(engine.preparing(asked))
    monkeypatch.setattr(texels, "optics", counting)
    canvas = engine.MemoryCanvas(asked, 200, 200)
    assert drained(engine.filling(prepared, [(0, 200)], canvas)) is None
    assert computed[3:] == [5]  # after each layer alone
    exact = bake(replace(asked, tolerance=0))
    assert delta_e(canvas.planes()[0][50:60, 50:100, :3], exact.R[50:60, 50:100, :3]).max() < 0.5
    assert len(np.unique(canvas.planes()[0][50:60, 50:100].reshape(-1, 4), axis=0)) == 5


@pytest.mark.parametrize("half", [False, True])
def test_a_bake_into_the_textures_of_another_is_the_same_and_gets_no_memory_for_them(half):
    asked = request(maps=byte_maps(), reference=REFERENCE, half=half, shines=[Shine(0.3, 0.04)] * 3)
    earlier = bake(replace(asked, maps=painted_maps()))
    fresh = bake(asked)
    again = bake(asked, into=earlier)
    for name in ("R", "T2", "R_up", "finish"):
        assert np.shares_memory(getattr(again, name), getattr(earlier, name))
    assert everything(again) == everything(fresh)


def test_a_bake_of_another_size_or_type_is_not_written_over():
    other = bake(request(maps=byte_maps(), half=True))
    before = everything(other)
    for asked in (request(maps=byte_maps()), request(maps=[m[:8] for m in byte_maps()], half=True)):
        assert everything(bake(asked, into=other)) == everything(bake(asked))
    assert everything(other) == before


def test_combinations_computed_once_equal_the_printed_equations():
    maps = byte_maps()
    baked = bake(request(maps=maps, reference=REFERENCE))
    skin = upsample_skin(REFERENCE)
    for y, x in some_texels():
        values = np.array([maps[0][y, x] / 255, maps[1][y, x] / 255 * 0.8, maps[2][y, x] / 255])
        np.testing.assert_allclose(formula(baked, REFERENCE)[y, x], to_rgb(true_spectra(values, skin)), atol=3e-6)


@pytest.mark.parametrize("tolerance", [0.02, 0.1, 0.5])
def test_a_short_cut_costs_no_more_than_the_tolerance(tolerance):
    maps = float_maps()
    exact = bake(request(maps=maps, reference=REFERENCE))
    short = bake(request(maps=maps, reference=REFERENCE, tolerance=tolerance))
    error = delta_e(formula(short, REFERENCE), formula(exact, REFERENCE))
    assert short.bands < exact.bands == 81 and exact.error == 0
    assert error.max() <= tolerance
    assert short.error <= tolerance
    assert short.error <= 8 * error.max() and error.max() <= 2 * short.error  # the sample says what it is


def test_many_combinations_of_bytes_are_computed_at_fewer_bands_within_the_tolerance(monkeypatch):
    monkeypatch.setattr(engine, "MOST", 100)
    random = np.random.default_rng(3)
    maps = [(random.random((64, 64)) * 255).astype(np.uint8) for _ in range(3)]
    exact = bake(request(maps=maps, reference=REFERENCE))
    assert exact.bands == 81
    short = bake(request(maps=maps, reference=REFERENCE, tolerance=0.1))
    assert short.bands < 81
    assert delta_e(formula(short, REFERENCE), formula(exact, REFERENCE)).max() <= 0.1


def test_half_floats_are_the_rounded_ones():
    whole, half = (bake(request(maps=byte_maps(), reference=REFERENCE, half=h)) for h in (False, True))
    for name in ("R", "T2", "R_up"):
        assert getattr(half, name).dtype == np.float16
        assert np.array_equal(getattr(half, name), getattr(whole, name).astype(np.float16))


@pytest.mark.parametrize("maps", [byte_maps, float_maps])
def test_the_finish_is_that_of_the_painted_values(maps):
    shines = [Shine(0.5, 0.03), Shine(0.3, 0.05), Shine(0.2, 0.04)]
    baked = bake(request(maps=maps(), shines=shines, tolerance=0.05))
    coats = request().coats
    values = [
        np.float32(m.reshape(-1) / (255 if m.dtype == np.uint8 else 1) * s) for m, s in zip(maps(), (1.0, 0.8, 1.0))
    ]
    glosses = [Gloss(s.roughness, s.f0, covered(v, c.thickness_mm, c.powder)) for s, v, c in zip(shines, values, coats)]
    right = finish_texture(glosses).reshape(*SIZE, 3)
    # A level of a float map is off by half a step, of which there are a thousand.
    np.testing.assert_allclose(baked.finish[..., :3], right, atol=2e-6 if maps is byte_maps else 4e-3)


def test_the_finished_albedo_at_fewer_bands_keeps_the_tolerance():
    texture = np.random.default_rng(4).uniform([0.3, 0.15, 0.08], [0.7, 0.45, 0.35], (*SIZE, 3)).astype(np.float32)
    exact, short = (bake(request(maps=float_maps(), skin=texture, tolerance=t)).albedo for t in (0, 0.1))
    assert not np.array_equal(exact, short)
    assert delta_e(exact, short).max() <= 0.1


def test_the_colour_outside_the_working_space_is_counted():
    pure = Coat(np.where(np.arange(81) < 40, 2000.0, 0.01), np.full(81, 0.5), 0.03)
    painted = np.zeros(SIZE, np.uint8)
    painted[:2] = 255
    baked = bake(Request([pure], [painted], AIR, bands(), reference=REFERENCE))
    assert formula(baked, REFERENCE)[0, 0].min() < -0.001
    assert baked.out_of_gamut == 2 * SIZE[1]


def everything(baked) -> bytes:
    """All that was baked, as bytes."""
    return b"".join(
        one.tobytes() for one in (baked.R, baked.T2, baked.R_up, baked.albedo, baked.finish) if one is not None
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("tile", "block", "threads"), [(1, 81, 1), (200, 1000, 2), (1 << 20, 1 << 20, 5)])
def test_the_result_does_not_depend_on_tiles_blocks_or_threads(monkeypatch, method, tile, block, threads):
    texture = np.random.default_rng(4).uniform(0.1, 0.6, (*SIZE, 3)).astype(np.float32)
    asked = replace(METHODS[method](), skin=texture, shines=[Shine(0.3, 0.04)] * 3)
    whole = bake(asked)
    monkeypatch.setattr(tiles, "TILE_TEXELS", tile)
    monkeypatch.setattr(tiles, "cores", lambda: threads)
    monkeypatch.setattr(texels, "BLOCK", block)
    monkeypatch.setattr(finished, "BLOCK", block // 81)
    steps = []
    parts = bake(asked, lambda done, total: steps.append((done, total)))
    assert everything(whole) == everything(parts)
    assert steps[-1][0] == steps[-1][1] == len(steps)
    assert all(done <= total for done, total in steps)


DIGEST = """
import hashlib, numpy as np
from tests.bake import test_engine as t
for method in t.METHODS.values():
    print(hashlib.sha256(t.everything(t.bake(method()))).hexdigest())
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
    found.add("\n".join(hashlib.sha256(everything(bake(method()))).hexdigest() for method in METHODS.values()))
    assert len(found) == 1


def test_nothing_painted_gives_bare_textures():
    baked = bake(request(maps=[np.zeros(SIZE, np.uint8)] * 3, reference=REFERENCE))
    assert baked.covered == baked.distinct == 0
    assert same_texels(baked, np.ones(SIZE, bool))


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
