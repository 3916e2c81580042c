"""What is painted on a UDIM skin stays where it is on the face when tiles, slots, meshes or the file change."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from tests.blender import scenes, tiled

pytestmark = pytest.mark.blender


@pytest.fixture
def pair(clean_scene, tmp_path):
    return tiled.pair(tmp_path)


def test_paint_follows_its_tile_when_tiles_are_left_out_and_taken_back(pair, test_products):
    import bpy

    from km_makeup.blender import images, udim

    split = pair[1]
    tiled.make_up(split, test_products[0], tiled.ramp())
    layer = split.km_makeup.layers[0]
    whole, first = images.map_values(layer.map, "R").copy(), layer.map
    split.km_makeup.tiles = "1002"
    assert udim.layout_of(split.data, udim.UV_MAP).tiles == (1002,)
    alone = images.map_values(layer.map, "R")
    np.testing.assert_array_equal(alone, whole[:64, 64:])
    assert first.use_fake_user and first.name in bpy.data.images  # what tile 1001 held is there
    placed = tiled.uvs(split, udim.UV_MAP)
    right = np.repeat(scenes.right_half(split), [one.loop_total for one in split.data.polygons])
    assert np.all(placed[~right] == 0) and placed[right].min() > 0
    split.km_makeup.tiles = ""
    back = images.map_values(layer.map, "R")
    np.testing.assert_array_equal(back[:64, 64:], whole[:64, 64:])
    assert not back[:64, :64].any()
    split.km_makeup.tiles = "1007"
    assert "no skin in the tiles 1007" in split.km_makeup["problem"] and "1001, 1002" in split.km_makeup["problem"]
    np.testing.assert_array_equal(images.map_values(layer.map, "R"), back)


def test_a_copy_of_the_mesh_keeps_its_own_uvs(pair, test_products):
    split = pair[1]
    tiled.make_up(split, test_products[0], tiled.ramp())
    twin = split.copy()
    twin.data = split.data.copy()
    pair[0].users_collection[0].objects.link(twin)
    before = tiled.uvs(split, "KM Makeup").copy()
    twin.km_makeup.tiles = "1002"
    assert not np.array_equal(tiled.uvs(twin, "KM Makeup"), before)
    np.testing.assert_array_equal(tiled.uvs(split, "KM Makeup"), before)


def test_undo_brings_back_uvs_with_the_map(pair, test_products):
    import bpy

    split = pair[1]
    tiled.make_up(split, test_products[0], tiled.ramp())
    bpy.ops.ed.undo_push(message="Painted")
    before, painted = tiled.uvs(split, "KM Makeup").copy(), tiled.painted_at(split, split.km_makeup.layers[0].map)
    split.km_makeup.tiles = "1002"
    bpy.ops.ed.undo_push(message="Tiles")
    bpy.ops.ed.undo()
    split = bpy.data.objects["Split"]
    np.testing.assert_array_equal(tiled.uvs(split, "KM Makeup"), before)
    np.testing.assert_array_equal(tiled.painted_at(split, split.km_makeup.layers[0].map), painted)


def test_textures_baked_for_other_tiles_are_not_shown(pair, test_products, tmp_path):
    import bpy

    from km_makeup.blender import baking
    from km_makeup.blender.update import paused

    split = pair[1]
    tiled.make_up(split, test_products[0], tiled.ramp())
    with paused():
        split.km_makeup.folder = str(tmp_path)
    baking.bake_all(split, bpy.context.scene)
    assert split.km_makeup.path == "BAKED"
    split.km_makeup.tiles = "1002"
    assert split.km_makeup.path == "LIVE"


def test_makeup_on_one_mesh_of_two_objects_lies_on_the_same_tiles(pair, test_products, tmp_path):
    import bpy

    from km_makeup.blender import exporting

    split = pair[1]
    tiled.make_up(split, test_products[0], tiled.ramp())
    other = split.copy()
    split.users_collection[0].objects.link(other)
    before = tiled.uvs(split, "KM Makeup").copy()
    other.km_makeup.tiles = "1002"
    assert "shares its mesh with 'Split'" in other.km_makeup["problem"] and other.km_makeup.tiles == ""
    np.testing.assert_array_equal(tiled.uvs(split, "KM Makeup"), before)
    export = exporting.Export(tmp_path / "out", resolution=64, place="OBJECT")
    with pytest.raises(MakeupError, match="shares its mesh with"):
        exporting.export_all(split, bpy.context.scene, export)
    assert not (tmp_path / "out").exists()


def test_paint_follows_when_a_skin_becomes_tiled_and_single_again(pair, test_products, tmp_path):
    from km_makeup.blender import makeup

    split = pair[1]
    to_plain = scenes.skin("Plain skin")
    tiled_skin = split.data.materials[0]
    split.data.materials[0] = to_plain
    tiled.make_up(split, test_products[0], tiled.ramp())
    assert split.km_makeup.uv_map == "UVMap"
    painted = tiled.painted_at(split, split.km_makeup.layers[0].map)
    makeup.refresh(split)
    split.material_slots[0].material = tiled_skin
    makeup.set_up(split)
    assert split.km_makeup.uv_map == "KM Makeup"
    np.testing.assert_allclose(tiled.painted_at(split, split.km_makeup.layers[0].map), painted, atol=0.01)
    split.material_slots[0].material = to_plain
    makeup.set_up(split)
    assert split.km_makeup.uv_map == "UVMap" and len(split.data.uv_layers) == 1
    np.testing.assert_allclose(tiled.painted_at(split, split.km_makeup.layers[0].map), painted, atol=0.02)


@pytest.mark.parametrize("wrong", ["tiled", "empty"])
def test_a_map_that_cannot_follow_leaves_all_as_it_was(pair, test_products, tmp_path, wrong):
    import bpy

    from km_makeup.blender import adding
    from km_makeup.blender.update import paused

    split = pair[1]
    tiled.make_up(split, test_products[0], tiled.ramp())
    layer = adding.add_layer(bpy.context, split, test_products[1])
    with paused():
        if wrong == "tiled":
            layer.map = scenes.tiled("Mine", {1001: scenes.albedo(3)}, tmp_path)
        else:
            layer.map = bpy.data.images.load(str(tmp_path / "skin.1001.exr"))
            layer.map.filepath = str(tmp_path / "gone.exr")
    before, first = tiled.uvs(split, "KM Makeup").copy(), split.km_makeup.layers[0].map
    split.km_makeup.tiles = "1002"
    assert split.km_makeup["problem"] and split.km_makeup.tiles == ""
    np.testing.assert_array_equal(tiled.uvs(split, "KM Makeup"), before)
    assert split.km_makeup.layers[0].map == first


def test_a_look_painted_on_one_tile_goes_on_every_tile_as_the_textures_do(pair, test_products, tmp_path):
    from km_makeup.blender import looks
    from km_makeup.makeup.look_file import read_look

    plain, split = pair
    tiled.make_up(plain, test_products[0], tiled.ramp())
    looks.save_look(plain, tmp_path / "look.json", with_head=False)
    looks.apply_look(split, read_look(tmp_path / "look.json"))
    wanted, found = (tiled.painted_at(obj, obj.km_makeup.layers[0].map) for obj in pair)
    np.testing.assert_allclose(found / 255, wanted, atol=0.02)


def test_a_look_of_a_tiled_head_goes_on_the_same_head_elsewhere_as_it_is(pair, test_products, tmp_path):
    from km_makeup.blender import heads, images, looks, makeup
    from km_makeup.makeup.look_file import read_look

    split = pair[1]
    fingerprint = heads.uv_layout_of(split)
    tiled.make_up(split, test_products[0], tiled.ramp())
    assert heads.uv_layout_of(split) == fingerprint  # before Set Up it says what it will be
    path = tmp_path / "look.json"
    looks.save_look(split, path)
    painted = images.map_values(split.km_makeup.layers[0].map, "R").copy()
    makeup.remove(split)
    choice = looks.apply_look(split, read_look(path))
    assert choice.method is looks.Method.AS_THEY_ARE and "UV layout" in choice.reason
    np.testing.assert_allclose(images.map_values(split.km_makeup.layers[0].map, "R") / 255, painted, atol=0.5 / 255)


def test_tiles_that_the_textures_lack_are_left_out_and_edit_mode_is_refused(pair, test_products):
    import bpy

    from km_makeup.blender import makeup, udim

    split = pair[1]
    stray = np.zeros(len(split.data.polygons), bool)
    stray[3] = True
    scenes.to_tile(split, stray, (4, 0))
    makeup.set_up(split)
    assert udim.layout_of(split.data, udim.UV_MAP).tiles == (1001, 1002)
    assert udim.left_out(split.data, udim.UV_MAP)
    tiled.make_up(split, test_products[0], tiled.ramp())
    bpy.context.view_layer.objects.active = split
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        split.km_makeup.tiles = "1001"
        assert "Edit Mode" in split.km_makeup["problem"] and split.km_makeup.tiles == ""
        split.km_makeup.layers[0].strength = 0.5  # no traceback
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
