"""A bake's texels by the graphics card against NumPy's."""

from __future__ import annotations

import time
from dataclasses import replace

import bpy
import numpy as np
import pytest

from km_makeup.bake import ArrayRows, Request, bake, engine
from km_makeup.bake.fewer import Ground, full
from km_makeup.bake.levels import painted
from km_makeup.bake.stream import baking_to_files
from km_makeup.bake.texels import Work
from km_makeup.blender import gpu_bake
from km_makeup.blender.gpu_images import array_of
from km_makeup.makeup import Coat, coat
from km_makeup.optics import air_interface
from km_makeup.products import Library
from km_makeup.spectra import bands
from tests.bake.steps import drained

pytestmark = pytest.mark.blender

SAME = 2e-6
REFERENCE = np.array([0.45, 0.27, 0.19])
STACK = ("foundation-light", "eyeshadow-bronze", "lipstick-berry", "blush-rose", "foundation-deep")


def request(maps, **changes) -> Request:
    coats = [coat(Library.shipped().find(name), um) for name, um in zip(STACK, (20.0, 12.0, 15.0))]
    made = Request(coats, maps, air_interface(1.45), bands(), strengths=(1.0, 0.8, 1.0), reference=REFERENCE)
    return replace(made, **changes)


@pytest.fixture(scope="module", autouse=True)
def context():
    """A graphics context, as a render makes it; after `gpu.init` later renders of 5.2 would crash."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.object.camera_add()
    bpy.context.scene.camera = bpy.context.object
    render = bpy.context.scene.render
    render.engine, render.resolution_x, render.resolution_y = "BLENDER_EEVEE", 4, 4
    bpy.ops.render.render()
    yield
    gpu_bake.forget()


def work(layers: int, reference: bool, interface: bool, levels: int = 300) -> Work:
    library = Library.shipped()
    coats = [coat(library.find(name), 25.0) for name in STACK[:layers]]
    # As white as can be, at the bottom and at the top: much light bounces between them.
    coats[0] = coats[-1] = Coat(np.full(81, 1e-9), np.full(81, 3000.0), 1.0)
    asked = request([], reference=REFERENCE if reference else None)
    ground = Ground(coats, air_interface(1.45) if interface else None, bands(), engine._reference(asked))
    maps = [painted(np.zeros((1, 1), np.float32), 1.0, f"m{i}", levels + i) for i in range(layers)]
    return Work(maps, ground, full(ground, maps), (), np.dtype(np.float32))


@pytest.mark.parametrize(
    ("layers", "reference", "interface"),
    [(1, True, True), (2, False, True), (3, True, False), (4, True, True), (5, False, False), (5, True, True)],
)
def test_the_card_computes_what_numpy_does(layers, reference, interface):
    given = work(layers, reference, interface)
    random = np.random.default_rng(layers)
    levels = [random.integers(0, layer.levels, 3001) for layer in given.layers]
    for level in levels:
        level[random.random(3001) < 0.3] = 0
    levels[0][:5], levels[-1][:5] = 0, 0
    right, found = given.textures(levels), gpu_bake.on_card(given).textures(levels)
    assert found.shape == right.shape == (3, 3, 3001)
    assert np.abs(right).max() > 0.3 and np.ptp(right[0]) > 0.3
    assert np.abs(found - right).max() < SAME


def test_a_buffer_is_read_in_its_order():
    import gpu

    right = np.arange(3 * 5 * 4, dtype=np.float32)
    data = gpu.types.Buffer("FLOAT", right.size, right)
    texture = gpu.types.GPUTexture((5, 3), format="RGBA32F", data=data)
    assert np.array_equal(array_of(texture.read()), right.reshape(3, 5, 4))


def test_a_bake_on_the_card_is_the_same(monkeypatch):
    random = np.random.default_rng(5)
    maps = [random.random((70, 90)).astype(np.float32) * (random.random((70, 90)) < 0.6) for _ in range(3)]
    asked = request(maps, tolerance=0.2)
    right = bake(asked)
    assert right.bands < 81
    prepared = drained(engine.preparing(asked))
    monkeypatch.setattr(gpu_bake, "available", lambda: True)
    monkeypatch.setattr(gpu_bake, "ahead", lambda *_: 1.5)
    gpu_bake._ahead.clear()
    computed, real = [], gpu_bake.Card.textures
    monkeypatch.setattr(gpu_bake.Card, "textures", lambda card, levels: (computed.append(1), real(card, levels))[1])
    canvas = engine.MemoryCanvas(asked, 70, 90)
    assert drained(engine.filling(gpu_bake.elsewhere(prepared), [(0, 40), (40, 70)], canvas)) is None
    for name, plane in zip(("R", "T2", "R_up"), canvas.planes()):
        assert np.abs(plane - getattr(right, name)).max() < SAME
    assert len(computed) >= 8  # four combinations of layers in each of two tiles
    monkeypatch.setattr(gpu_bake, "ahead", lambda *_: 0.5)
    gpu_bake._ahead.clear()
    assert gpu_bake.elsewhere(prepared) is prepared
    gpu_bake._ahead.clear()


def test_bakes_to_files_go_elsewhere_when_told_to(tmp_path):
    maps = [np.random.default_rng(5).random((32, 32)).astype(np.float32) for _ in range(3)]
    asked = request([ArrayRows(m) for m in maps], tolerance=0.2)
    called = []

    def elsewhere(prepared):
        called.append(prepared)
        return prepared

    drained(baking_to_files(asked, {t: tmp_path / f"{t}.exr" for t in asked.textures}, None, elsewhere))
    assert len(called) == 1 and called[0].found is None


def test_the_card_is_left_alone_where_there_is_none_and_for_bakes_it_does_not_do(monkeypatch):
    maps = [np.random.default_rng(5).random((16, 16)).astype(np.float32) for _ in range(3)]
    floats, exact = (drained(engine.preparing(request(maps, tolerance=t))) for t in (0.2, 0))
    byte = drained(engine.preparing(request([np.uint8(255 * m) for m in maps])))
    assert gpu_bake.available() is not bpy.app.background
    monkeypatch.setattr(gpu_bake, "available", lambda: False)
    assert gpu_bake.elsewhere(floats) is floats
    monkeypatch.setattr(gpu_bake, "available", lambda: True)
    monkeypatch.setattr(gpu_bake, "ahead", lambda *_: pytest.fail("timed for nothing"))
    for one in (exact, byte):
        assert gpu_bake.elsewhere(one) is one


def test_the_measure_says_how_far_ahead_the_card_is(monkeypatch):
    given = work(2, True, True)
    card = gpu_bake.on_card(given)
    slow = replace(given, elsewhere=lambda levels: time.sleep(0.5) or card.textures(levels))
    monkeypatch.setattr(gpu_bake, "SAMPLE", 2048)
    assert gpu_bake.ahead(given, slow) < 1
    monkeypatch.setattr(gpu_bake, "cores", lambda: 1)
    assert gpu_bake.ahead(slow, given) > 1
