"""The product picker: swatches on demand, choices that stick, nothing at registration."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.blender


@pytest.fixture
def layer(test_products):
    import bpy

    from tests.blender import scenes

    obj = scenes.head()
    obj.data.materials.append(scenes.skin())
    bpy.context.view_layer.objects.active = obj
    bpy.context.window_manager.km_makeup_kind = "ALL"
    bpy.ops.km_makeup.layer_add(product="test-base")
    return obj.km_makeup.layers[0]


def _items(layer):
    import bpy

    from km_makeup.blender.ui.products import picker

    return [item[0] for item in picker._items(layer, bpy.context)]


def test_the_picker_shows_the_product_of_the_layer_and_sets_it(layer):
    assert layer.pick == "test-base"
    layer.pick = "test-red"
    assert layer.product == "test-red"
    layer.product = "test-powder"
    assert layer.pick == "test-powder"


def test_name_and_thickness_follow_the_product_unless_the_artist_changed_them(layer):
    from km_makeup.blender.library import library

    layer.thickness_um = library().find("test-base").thickness_um
    layer.pick = "lipstick-berry"
    assert layer.name == library().find("lipstick-berry").name
    assert layer.thickness_um == pytest.approx(library().find("lipstick-berry").thickness_um)
    layer.name, layer.thickness_um = "Her lips", 7.0
    layer.pick = "eyeliner-black"
    assert (layer.name, layer.thickness_um) == ("Her lips", 7.0)


def test_other_shades_of_the_layers_own_kind_are_offered_first(layer):
    import bpy

    bpy.context.window_manager.property_unset("km_makeup_kind")
    layer.product = "lipstick-berry"
    offered = _items(layer)
    assert "lipstick-coral" in offered and "blush-berry" not in offered
    layer.product = "gone-product"
    assert {"lipstick-coral", "blush-berry"} <= set(_items(layer))


def test_a_kind_narrows_what_is_offered_and_keeps_the_layers_own(layer):
    import bpy

    bpy.context.window_manager.km_makeup_kind = "lipstick"
    offered = _items(layer)
    assert offered[0] == "test-base" or "test-base" in offered
    assert "lipstick-berry" in offered
    assert "foundation-fair" not in offered
    assert layer.pick == "test-base"
    layer.pick = "lipstick-berry"
    assert layer.product == "lipstick-berry"


def test_a_product_that_is_not_in_the_library_is_kept_and_said(layer):
    layer.product = "gone-product"
    assert "gone-product" in _items(layer)
    assert layer.pick == "gone-product"


def test_the_swatch_is_that_of_the_product_and_made_once(layer):
    """Without a window Blender gives all icons the number 0; the pictures are there all the same."""
    from km_makeup.blender.library import library
    from km_makeup.blender.ui.products import picker, previews
    from km_makeup.products.swatches import thumbnail

    product = library().find("test-red")
    number = picker.icon_of("test-red")
    picture = previews._pictures[previews._key(product)]
    assert picker.icon_of("test-red") == number == picture.icon_id
    size = previews.SIZE
    pixels = np.array(picture.image_pixels_float).reshape(size, size, 4)[::-1]
    expected = thumbnail(product, size) / 255
    expected[..., :3] *= expected[..., 3:]
    assert np.abs(pixels - expected).max() < 1 / 255
    assert picker.icon_of("no-such-product") == 0


def test_a_draw_makes_no_more_swatches_than_its_budget_allows(layer, monkeypatch):
    from km_makeup.blender.library import library
    from km_makeup.blender.ui.products import previews

    previews.clear()
    monkeypatch.setattr(previews, "BUDGET", -1.0)
    products = list(library().products)
    assert set(previews.icons(products)) == {0}
    assert not previews._icons
    monkeypatch.setattr(previews, "BUDGET", 60.0)
    assert previews._make_some() is None
    assert len(previews._icons) == len(products)


def test_a_product_that_changed_gets_a_new_swatch(layer):
    from dataclasses import replace

    from km_makeup.blender.library import library
    from km_makeup.blender.ui.products import previews

    product = library().find("test-red")
    assert previews._key(replace(product, K=2 * product.K)) != previews._key(product)
    assert previews._key(replace(product, name="Another name")) == previews._key(product)
