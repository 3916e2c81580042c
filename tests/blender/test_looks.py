"""Looks on an object: from files, to files, with one map a layer or one RGB-coded map for several."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blender import scenes

pytestmark = pytest.mark.blender
RANDOM = np.random.default_rng(12)


@pytest.fixture
def ball(clean_scene):
    obj = scenes.head()
    obj.data.materials.append(scenes.skin())
    return obj


def random_map() -> np.ndarray:
    return RANDOM.integers(1, 256, (16, 16), dtype=np.uint8)


def values_of(obj, index: int) -> np.ndarray:
    from km_makeup.blender import images

    layer = obj.km_makeup.layers[index]
    return images.map_values(layer.map, layer.channel)


def test_a_look_saved_and_put_on_another_head_is_the_same_makeup(ball, test_products, tmp_path):
    from km_makeup.blender import looks
    from km_makeup.makeup import Layer, Look

    painted = [random_map(), random_map()]
    paths = [scenes.write_map(tmp_path, f"m{i}", values) for i, values in enumerate(painted)]
    layers = (
        Layer("test-red", 12.5, paths[0], strength=0.75, solo=True),
        Layer("test-base", 21.0, paths[1], enabled=False, finish=(0.3, 0.05)),
    )
    looks.apply_look(ball, Look("Mine", layers))
    looks.save_look(ball, tmp_path / "saved.json")
    other = scenes.head("Other")
    other.data.materials.append(scenes.skin("Other skin"))
    again = Look.load(tmp_path / "saved.json")
    looks.apply_look(other, again)
    for index, layer in enumerate(layers):
        entry = other.km_makeup.layers[index]
        assert (entry.product, entry.thickness_um, entry.strength, entry.enabled, entry.solo, entry.own_finish) == (
            layer.product, layer.thickness_um, layer.strength, layer.enabled, layer.solo, layer.finish is not None,
        )  # fmt: skip
        assert np.array_equal(values_of(other, index), painted[index])
    assert (entry.roughness, entry.f0) == pytest.approx((0.3, 0.05))


@pytest.mark.parametrize("channels", [3, 4])
def test_one_rgb_coded_map_carries_a_layer_in_each_channel(ball, test_products, tmp_path, channels):
    import bpy

    from km_makeup.blender import looks
    from km_makeup.makeup import Layer, Look

    values = RANDOM.integers(1, 256, (16, 16, channels), dtype=np.uint8)
    path = scenes.write_map(tmp_path, "coded", values)
    products = [*test_products, "test-red"]
    looks.apply_look(ball, Look("Coded", tuple(Layer(products[i], 10.0, path, "RGBA"[i]) for i in range(channels))))
    for index in range(channels):
        assert np.array_equal(values_of(ball, index), values[..., index]), "RGBA"[index]
    (group,) = [g for g in bpy.data.node_groups if g.get("km_makeup_group") == "makeup"]
    assert len([n for n in group.nodes if n.bl_idname == "ShaderNodeTexImage"]) == 1


def test_a_map_that_changed_on_disk_is_read_again_with_its_look(ball, test_products, tmp_path):
    from km_makeup.blender import looks
    from km_makeup.makeup import Layer, Look

    first, second = random_map(), random_map()
    path = scenes.write_map(tmp_path, "m", first)
    look = Look("Changing", (Layer("test-red", 10.0, path),))
    looks.apply_look(ball, look)
    assert np.array_equal(values_of(ball, 0), first)
    scenes.write_map(tmp_path, "m", second)
    looks.apply_look(ball, look)
    assert np.array_equal(values_of(ball, 0), second)


def test_a_look_takes_the_place_of_the_layers_that_were_there(ball, painted_look, test_products):
    from km_makeup.blender import looks
    from km_makeup.makeup import Layer, Look

    looks.apply_look(ball, painted_look)
    looks.apply_look(ball, Look("One", (Layer("test-red", 7.0),)))
    assert [(x.product, x.thickness_um) for x in ball.km_makeup.layers] == [("test-red", 7.0)]
    assert (values_of(ball, 0) == 255).all()


def test_a_layer_that_changes_after_the_bake_is_seen(ball, painted_look, tmp_path):
    """The baked textures no longer show it, so the colour goes back to the live films."""
    import bpy

    from km_makeup.blender import baking, looks
    from km_makeup.blender.update import paused

    looks.apply_look(ball, painted_look)
    with paused():
        ball.km_makeup.folder = str(tmp_path / "baked")
    baking.bake_all(ball, bpy.context.scene)
    assert ball.km_makeup.path == "BAKED"
    ball.km_makeup.layers[2].thickness_um = 30
    assert ball.km_makeup.path == "LIVE"
    baking.bake_all(ball, bpy.context.scene)
    assert ball.km_makeup.path == "BAKED"


def test_the_baked_files_hold_what_the_engine_computes_and_say_what_made_them(ball, painted_look, tmp_path):
    import bpy
    import OpenImageIO

    from km_makeup.bake import Request, bake, read_image
    from km_makeup.blender import baking, looks
    from km_makeup.blender.library import library
    from km_makeup.blender.update import paused
    from km_makeup.makeup import coat, interface_of
    from km_makeup.spectra import bands

    looks.apply_look(ball, painted_look)
    with paused():
        ball.km_makeup.folder, ball.km_makeup.full_float = str(tmp_path / "baked"), True
    report = baking.bake_all(ball, bpy.context.scene)
    products = [library().find(layer.product) for layer in painted_look.layers]
    direct = bake(
        Request(
            [coat(p, 15.0) for p in products], [scenes.spots()] * 3, interface_of(products), bands(),
            reference=np.array([0.45, 0.27, 0.19], np.float32),
        )
    )  # fmt: skip
    assert set(report.files) == {"R", "T2", "R_up", "finish"}
    for name in ("R", "T2", "R_up"):
        pixels, _ = read_image(report.files[name])
        np.testing.assert_allclose(pixels[::-1], getattr(direct, name)[..., :3], atol=1e-6)
    source = OpenImageIO.ImageInput.open(str(report.files["R"]))
    layers = source.spec().getattribute("km_makeup/layers")
    source.close()
    assert layers == "test-base 15 um; test-powder 15 um; test-red 15 um"
    assert ball.km_makeup.baked_R.colorspace_settings.name == "Non-Color"


def test_a_look_put_on_while_the_bare_skin_is_shown_is_seen(ball, painted_look):
    from km_makeup.blender import looks

    looks.apply_look(ball, painted_look)
    ball.km_makeup.show = False
    looks.apply_look(ball, painted_look)
    assert ball.km_makeup.show and ball.material_slots[0].material == ball.km_makeup.slots[0].made


@pytest.mark.parametrize("name", ["", ".json"])
def test_a_look_is_not_saved_without_a_name(ball, painted_look, tmp_path, name):
    import bpy

    from km_makeup.blender import looks

    looks.apply_look(ball, painted_look)
    before = sorted(tmp_path.iterdir())
    with (
        bpy.context.temp_override(object=ball, active_object=ball),
        pytest.raises(RuntimeError, match="the file has no name"),
    ):
        bpy.ops.km_makeup.save_look(filepath=f"{tmp_path}/{name}", check_existing=False)
    assert sorted(tmp_path.iterdir()) == before
