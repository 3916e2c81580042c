"""Rendered colours of films that leave the working space, and of two materials in one: what no shipped product shows."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blender import scenes
from tests.flat_field import render

pytestmark = pytest.mark.blender
SKIN = (0.45, 0.27, 0.19)


@pytest.fixture
def vivid_product(tmp_path, monkeypatch) -> str:
    """A red so pure that its green lies below zero in Rec.709, over black as well as over skin."""
    from km_makeup.products import Product, Provenance
    from km_makeup.products.files import write_product
    from km_makeup.spectra import WAVELENGTHS

    K = 2000 / (1 + np.exp((WAVELENGTHS - 610) / 3)) + 0.01
    made = Product("vivid", "Vivid", "test", "cream", K, np.full(81, 30.0), Provenance("computed", "a test"))
    (tmp_path / "products").mkdir()
    write_product(made, tmp_path / "products" / "vivid.json")
    monkeypatch.setenv("KM_MAKEUP_PRODUCTS", str(tmp_path / "products"))
    return made.id


def expected(thickness_um: float) -> tuple[np.ndarray, np.ndarray]:
    """Linear RGB over the skin and over black, at 81 bands."""
    from km_makeup.blender.library import library
    from km_makeup.makeup import coat, interface_of, on_skin
    from km_makeup.spectra import to_rgb, upsample_skin

    product = library().find("vivid")
    optics = on_skin([coat(product, thickness_um).at(np.float64(1))], interface_of([product]))
    return to_rgb(optics.over(upsample_skin(np.array(SKIN)))), to_rgb(optics.R)


@pytest.mark.parametrize("path", ["live", "baked"])
def test_a_film_outside_the_working_space_adds_no_light_where_it_is_clamped(vivid_product, tmp_path, path):
    thicknesses = (3.0, 8.0, 20.0)
    total, own = (np.array(colours) for colours in zip(*(expected(um) for um in thicknesses)))
    assert total[:, 1].min() < -0.004 and own[:, 1].min() < -0.001
    prediction = {
        "skins": {"medium": list(SKIN)},
        "cases": [
            {"name": str(um), "skin": "medium", "films": [{"product": "vivid", "thickness_um": um, "value": 255}]}
            for um in thicknesses
        ],
    }
    found = render.measure(prediction, path, ["cycles", "eevee"], tmp_path, {"cycles": 256, "eevee": 4})
    for engine, step in (("cycles", 0), ("eevee", 1 / 1023)):
        seen = np.array(found[engine]["rgb"])
        np.testing.assert_allclose(seen, np.clip(total, 0, 1), rtol=0.01, atol=5e-4 + step, err_msg=engine)
        assert seen[:, 1].max() < 2e-4 + step


def test_a_mix_of_two_skins_gets_the_films_on_both(test_products, tmp_path):
    """A film that hides everything: both halves of a mixed material show it, and no part of either skin."""
    from km_makeup.blender import looks
    from km_makeup.blender.update import paused
    from km_makeup.makeup import Layer, Look

    def build(tree):
        mix = tree.nodes.new("ShaderNodeMixShader")
        for i, colour in enumerate([(1, 0, 0, 1), (0, 0, 1, 1)]):
            node = tree.nodes.new("ShaderNodeBsdfPrincipled")
            node.inputs["Base Color"].default_value = colour
            node.inputs["Specular IOR Level"].default_value = 0
            tree.links.new(node.outputs[0], mix.inputs[i + 1])
        return mix.outputs[0]

    render.empty_scene()
    obj = render.plane(0, 1, scenes.mixed("Mix", build))
    with paused():
        obj.km_makeup.finish = "OFF"
    looks.apply_look(obj, Look("Opaque", (Layer("test-base", 3000.0),)))
    render.camera_over(1, 1)
    for engine, samples in (("cycles", 64), ("eevee", 4)):
        file = tmp_path / f"{engine}.exr"
        render.render(engine, samples, file)
        (colour,) = render.read_tiles(file, 1, 1)
        assert colour[0] > colour[1] > colour[2] > 0.1, engine
        assert colour[0] / colour[2] < 2.5, engine


def test_live_and_baked_films_have_the_same_highlight_and_it_is_not_the_skins(test_products, tmp_path):
    """A half covered glossy skin under a rough powder and a smooth cream, seen where the lamp is mirrored."""
    import bpy

    from km_makeup.blender import baking, looks
    from km_makeup.blender.update import one_update, paused
    from km_makeup.makeup import Layer, Look

    render.empty_scene()
    material = render.skin_material(list(SKIN), as_texture=False)
    node = scenes.principled_of(material)
    node.inputs["Specular IOR Level"].default_value, node.inputs["Roughness"].default_value = 0.5, 0.3
    obj = render.plane(0, 1, material)
    render.camera_over(1, 1)

    def seen(engine: str, samples: int) -> np.ndarray:
        file = tmp_path / f"{engine}.exr"
        render.render(engine, samples, file)
        return render.read_tiles(file, 1, 1)[0]

    half = scenes.write_map(tmp_path, "half", np.full((8, 8), 128, np.uint8))
    layers = (
        Layer("test-red", 6.0, half),
        Layer("test-red", 4.0, half),
    )  # one finish: baked textures join those of films
    for engine, samples in (("cycles", 128), ("eevee", 4)):
        looks.apply_look(obj, Look("Glossy", layers))
        live = seen(engine, samples)
        with one_update(obj):
            obj.km_makeup.finish = "OFF"
        skins_own = seen(engine, samples)
        with paused():
            obj.km_makeup.finish, obj.km_makeup.folder = "AUTO", str(tmp_path / "baked")
        baking.bake_all(obj, bpy.context.scene)
        baked = seen(engine, samples)
        assert np.abs(skins_own / live - 1).max() > 0.1, engine
        np.testing.assert_allclose(baked, live, rtol=0.01, err_msg=engine)
