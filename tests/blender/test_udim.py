"""Tiled (UDIM) skins: their tiles are gathered on a UV map of the makeup's own, and all else is as on any head."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from tests.blender import scenes, tiled

pytestmark = pytest.mark.blender


@pytest.fixture
def pair(clean_scene, tmp_path):
    return tiled.pair(tmp_path)


def test_set_up_gathers_the_tiles_and_remove_leaves_the_mesh_as_it_was(pair):
    from km_makeup.blender import makeup, udim

    plain, split = pair
    before, own = scenes.file_text(), tiled.uvs(split, "UVMap")
    makeup.set_up(plain)
    assert plain.km_makeup.uv_map == "UVMap" and len(plain.data.uv_layers) == 1  # one tile is a single image
    makeup.remove(plain)
    makeup.set_up(split)
    assert split.km_makeup.uv_map == udim.UV_MAP
    assert udim.layout_of(split.data, udim.UV_MAP).tiles == (1001, 1002)
    assert split.data.uv_layers["UVMap"].active_render and split.data.uv_layers.active.name == "UVMap"
    np.testing.assert_array_equal(tiled.uvs(split, "UVMap"), own)
    placed = tiled.uvs(split, udim.UV_MAP)
    assert placed.min() > 0 and placed.max() < 1
    right = np.repeat(scenes.right_half(split), [one.loop_total for one in split.data.polygons])
    assert placed[~right, 0].max() < 0.5 < placed[right, 0].min()
    makeup.remove(split)
    assert [one.name for one in split.data.uv_layers] == ["UVMap"] and not split.data.keys()
    assert scenes.file_text() == before


def test_a_tiled_head_looks_like_the_same_head_on_one_texture(pair, test_products, tmp_path):
    """Rendered with makeup and flattened: what was split in two tiles differs by filtering only."""
    from km_makeup.blender import update

    pictures = []
    scenes.studio()
    for obj in pair:
        tiled.make_up(obj, test_products[0], tiled.ramp())
        for one in pair:
            one.hide_render = one != obj
        pictures.append(scenes.picture("cycles", tmp_path, samples=16))
    bare = []
    for obj in pair:
        with update.paused():
            obj.km_makeup.show = False
        for entry in obj.km_makeup.slots:
            obj.material_slots[entry.index].material = entry.original
        for one in pair:
            one.hide_render = one != obj
        bare.append(scenes.picture("cycles", tmp_path, samples=16))
    made_up = np.abs(pictures[0] - bare[0]).mean()
    np.testing.assert_allclose(bare[0], bare[1], atol=2e-3)
    assert np.abs(pictures[0] - pictures[1]).mean() < 0.01 * made_up
    assert np.abs(pictures[0] - pictures[1]).max() < 0.1 * np.abs(pictures[0] - bare[0]).max()


def test_an_export_gathers_the_skin_and_shows_it_where_the_faces_lie(pair, test_products, tmp_path):
    import bpy
    import OpenImageIO

    from km_makeup.blender import exporting
    from km_makeup.makeup.maps import looked_up

    read = []
    for obj in pair:
        tiled.make_up(obj, test_products[0], tiled.ramp())
        folder = tmp_path / obj.name
        export = exporting.Export(folder, exr=True, resolution=512, place="OBJECT")
        uv = tiled.uvs(obj, obj.km_makeup.uv_map)
        name = obj.km_makeup.uv_map
        report = exporting.export_all(obj, bpy.context.scene, export)
        assert not report.left_out
        image = OpenImageIO.ImageInput.open(str(folder / f"{obj.name}_base_color.exr")).read_image("float")[::-1]
        corners = 0.9 * uv + 0.1 * np.array([uv[f.loop_start : f.loop_start + f.loop_total].mean(axis=0)
                                             for f in obj.data.polygons for _ in range(f.loop_total)])  # fmt: skip
        read.append(np.array([looked_up(image, np.array([v]), np.array([u]))[0, 0, :3] for u, v in corners]))
        assert name in obj.data.uv_layers  # the exported textures lie on it
    np.testing.assert_allclose(read[0], read[1], atol=0.012)
    assert np.ptp(read[0], axis=0).min() > 0.05


def test_a_tiled_normal_map_becomes_a_texture_of_the_export(pair, test_products, tmp_path):
    import bpy
    import OpenImageIO

    from km_makeup.blender import exporting

    split = pair[1]
    tree = split.data.materials[0].node_tree
    mapped, texture = tree.nodes.new("ShaderNodeNormalMap"), tree.nodes.new("ShaderNodeTexImage")
    flat, tilted = (
        np.tile(np.array(one, np.float32), (scenes.SIDE, scenes.SIDE, 1)) for one in ([0.5, 0.5, 1], [0.75, 0.5, 0.9])
    )
    texture.image = scenes.tiled("normal", {1001: flat, 1002: tilted}, tmp_path)
    tree.links.new(texture.outputs["Color"], mapped.inputs["Color"])
    tree.links.new(mapped.outputs["Normal"], scenes.principled_of(split.data.materials[0]).inputs["Normal"])
    tiled.make_up(split, test_products[0], tiled.ramp())
    exporting.export_all(
        split, bpy.context.scene, exporting.Export(tmp_path / "out", gltf=True, resolution=64, place="OBJECT")
    )
    image = OpenImageIO.ImageInput.open(str(tmp_path / "out" / "Split_normal.png")).read_image("uint8")[::-1]
    np.testing.assert_allclose(image[8, 8, :3], [128, 128, 255], atol=1)
    np.testing.assert_allclose(image[8, 40, :3], [191, 128, 230], atol=1)
    worn = split.material_slots[0].material.node_tree
    node = next(n for n in worn.nodes if n.bl_idname == "ShaderNodeNormalMap")
    assert node.inputs["Color"].links[0].from_node.image.name == "Split_normal"
    bpy.ops.import_scene.gltf(filepath=str(tmp_path / "out" / "Split.glb"))
    came = bpy.context.selected_objects[0].data
    assert any("normal" in one.name.lower() for one in _images(came.materials[0]))


def _images(material):
    return [n.image for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeTexImage"]


def test_a_bake_lies_on_the_gathered_map_and_shows_the_skin_of_each_tile(pair, test_products, tmp_path):
    import bpy
    import OpenImageIO

    from km_makeup.blender import baking
    from km_makeup.blender.update import paused

    read = []
    for obj in pair:
        tiled.make_up(obj, test_products[0], np.full((64, 64), 0.5, np.float32))
        with paused():
            obj.km_makeup.folder, obj.km_makeup.finished = str(tmp_path / obj.name), True
        report = baking.bake_all(obj, bpy.context.scene)
        read.append(OpenImageIO.ImageInput.open(str(report.files["albedo"])).read_image("float")[..., :3])
    half = read[1].shape[1] // 2
    whole, cells = (
        read[0].mean(axis=(0, 1)),
        [read[1][half:, :half].mean(axis=(0, 1)), read[1][half:, half:].mean(axis=(0, 1))],
    )
    np.testing.assert_allclose(cells, [whole, whole], rtol=0.02)  # the lower half, top row first


@pytest.mark.parametrize("path", ["live", "baked", "finished"])
def test_faces_of_tiles_left_out_are_bare_whatever_the_brush_left_at_their_corner(pair, test_products, tmp_path, path):
    import bpy

    from km_makeup.blender import baking, images
    from km_makeup.blender.update import paused

    scenes.studio()
    plain, split = pair
    plain.hide_render = True
    bare = scenes.picture("cycles", tmp_path)
    tiled.make_up(split, test_products[0], tiled.ramp())
    split.km_makeup.tiles = "1002"
    layer = split.km_makeup.layers[0]
    layer.map = images.image_from_map("Everywhere", np.ones(tuple(layer.map.size), np.float32))
    if path != "live":
        with paused():
            split.km_makeup.folder, split.km_makeup.finished = str(tmp_path), path == "finished"
        baking.bake_all(split, bpy.context.scene)
    changed = np.abs(scenes.picture("cycles", tmp_path) - bare).max(axis=(0, 2))
    assert changed[:16].max() < 0.02 < 0.05 < changed[24:32].max()  # tile 1002 is the right half


def test_a_map_of_one_texel_is_baked_where_tiles_are_left_out(pair, test_products, tmp_path):
    import bpy

    from km_makeup.blender import baking, images
    from km_makeup.blender.update import paused

    split = pair[1]
    tiled.make_up(split, test_products[0], tiled.ramp())
    split.km_makeup.tiles = "1002"
    split.km_makeup.layers[0].map = images.image_from_map("One", np.full((1, 1), 255, np.uint8))
    with paused():
        split.km_makeup.folder = str(tmp_path)
    assert baking.bake_all(split, bpy.context.scene).files


def test_plain_materials_are_refused_where_tiles_are_left_out(pair, test_products, tmp_path):
    import bpy

    from km_makeup.blender import exporting

    split = pair[1]
    tiled.make_up(split, test_products[0], tiled.ramp())
    split.km_makeup.tiles = "1002"
    for export in (exporting.Export(tmp_path / "out", gltf=True), exporting.Export(tmp_path / "out", place="COPY")):
        tiled.refused(lambda one=export: exporting.export_all(split, bpy.context.scene, one), "clear Skin > Tiles")
    assert not (tmp_path / "out").exists()
    assert exporting.export_all(split, bpy.context.scene, exporting.Export(tmp_path / "out", resolution=64)).files


def test_faces_of_other_slots_have_no_place_under_the_brush(pair):
    from km_makeup.blender import makeup, udim

    split = pair[1]
    split.data.materials.append(scenes.skin("Eye"))
    eye = np.array([one.center.z > 0.05 for one in split.data.polygons])
    split.data.polygons.foreach_set("material_index", eye.astype(np.int32))
    makeup.set_up(split)
    corners = np.repeat(eye, [one.loop_total for one in split.data.polygons])
    assert np.all(tiled.uvs(split, udim.UV_MAP)[corners] == 0) and tiled.uvs(split, udim.UV_MAP)[~corners].min() > 0


@pytest.mark.parametrize("state", ["files", "packed", "painted", "packed and painted"])
def test_every_tile_is_read_wherever_its_pixels_are(clean_scene, tmp_path, state):
    import bpy

    from km_makeup.blender import udim

    tiles = {number: scenes.albedo(number) for number in (1001, 1002, 1013)}
    image = scenes.tiled("Skin", tiles, tmp_path)
    if "packed" in state:
        image.pack()
        for file in tmp_path.iterdir():
            file.unlink()
    if "painted" in state:
        image.tiles.active_index = 1
        with bpy.context.temp_override(edit_image=image):
            bpy.ops.image.tile_fill(color=(0.25, 0.5, 0.75, 1), generated_type="BLANK", width=4, height=8, float=True)
        tiles[1002] = np.tile(np.array([0.25, 0.5, 0.75], np.float32), (8, 4, 1))
    count = len(bpy.data.images)
    for number, values in tiles.items():
        np.testing.assert_allclose(udim.tile_pixels(image, number)[..., :3], values, atol=1e-3)
    assert len(bpy.data.images) == count
    with pytest.raises(MakeupError, match="has no tile 1005"):
        udim.tile_pixels(image, 1005)


def test_a_mesh_that_takes_no_further_uv_map_is_refused_as_it_is(pair):
    from km_makeup.blender import makeup

    split = pair[1]
    for number in range(7):
        split.data.uv_layers.new(name=f"More {number}")
    tiled.refused(lambda: makeup.set_up(split), "as many UV maps as Blender takes")
    assert not split.km_makeup.slots


def test_a_uv_map_of_the_same_name_is_left_alone(pair):
    from km_makeup.blender import makeup, udim

    split = pair[1]
    split.data.uv_layers.new(name=udim.UV_MAP)
    split.data.uv_layers.active_index = 0
    tiled.refused(lambda: makeup.set_up(split), "of its own; rename it")


@pytest.mark.parametrize("behind", ["colour", "group"])
def test_a_skin_that_became_tiled_is_refused_until_it_is_set_up_again(clean_scene, painted_look, tmp_path, behind):
    import bpy

    from km_makeup.blender import adding, baking, looks, makeup, udim
    from km_makeup.blender.update import paused

    head = scenes.head()
    head.data.materials.append(scenes.skin(textured=True))
    scenes.to_tile(head, scenes.right_half(head), (1, 0))
    looks.apply_look(head, painted_look)
    with paused():
        head.km_makeup.folder = str(tmp_path / "baked")
    tree = head.km_makeup.slots[0].original.node_tree
    image = scenes.tiled("Tiles", {1001: scenes.albedo(1), 1002: scenes.albedo(2)}, tmp_path)
    if behind == "colour":
        next(n for n in tree.nodes if n.bl_idname == "ShaderNodeTexImage").image = image
    else:
        group = bpy.data.node_groups.new("Details", "ShaderNodeTree")
        group.nodes.new("ShaderNodeTexImage").image = image
        tree.nodes.new("ShaderNodeGroup").node_tree = group
    tiled.refused(lambda: adding.add_layer(bpy.context, head, "test-red"), "tiled .UDIM.*press Set Up Makeup again")
    tiled.refused(lambda: baking.bake_all(head, bpy.context.scene), "tiled .UDIM.*press Set Up Makeup again")
    assert not (tmp_path / "baked").exists()
    makeup.set_up(head)
    assert head.km_makeup.uv_map == udim.UV_MAP
    assert adding.add_layer(bpy.context, head, "test-red")


def test_a_tiled_map_is_refused_in_the_bake(clean_scene, painted_look, tmp_path):
    import bpy

    from km_makeup.blender import baking, looks
    from km_makeup.blender.update import paused

    head = scenes.head()
    head.data.materials.append(scenes.skin(textured=True))
    looks.apply_look(head, painted_look)
    with paused():
        head.km_makeup.folder = str(tmp_path / "baked")
        head.km_makeup.layers[1].map = scenes.tiled("Painted Tiles", {1001: scenes.albedo(1)}, tmp_path)
    tiled.refused(
        lambda: baking.bake_all(head, bpy.context.scene), "The image 'Painted Tiles.*tiled .UDIM., and a map of makeup"
    )
    assert not (tmp_path / "baked").exists()


def test_slots_of_a_tile_each_with_single_textures_are_gathered_too(clean_scene):
    """As Daz and Poser figures have them: one map would show on both otherwise."""
    from km_makeup.blender import makeup, udim

    head = scenes.head()
    for name in ("Face", "Torso"):
        head.data.materials.append(scenes.skin(name, textured=True))
    right = scenes.right_half(head)
    head.data.polygons.foreach_set("material_index", right.astype(np.int32))
    scenes.to_tile(head, right, (1, 0))
    makeup.set_up(head)
    assert udim.layout_of(head.data, head.km_makeup.uv_map).tiles == (1001, 1002)
    makeup.remove(head)
    makeup.set_up(head, [0])
    assert head.km_makeup.uv_map == "UVMap"  # the torso's own tile does not matter to a face in the first one


def test_the_uv_map_that_the_colour_is_drawn_on_is_taken(clean_scene):
    from km_makeup.blender import makeup

    head = scenes.head()
    head.data.materials.append(scenes.skin(textured=True))
    head.data.uv_layers.new(name="Baked")
    tree = head.data.materials[0].node_tree
    place = tree.nodes.new("ShaderNodeUVMap")
    place.uv_map = "Baked"
    texture = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeTexImage")
    tree.links.new(place.outputs["UV"], texture.inputs["Vector"])
    makeup.set_up(head)
    assert head.km_makeup.uv_map == "Baked"


def test_an_attribute_of_the_name_is_left_alone(pair):
    from km_makeup.blender import makeup, udim

    split = pair[1]
    split.data.color_attributes.new(udim.UV_MAP, "BYTE_COLOR", "CORNER")
    tiled.refused(lambda: makeup.set_up(split), "of its own; rename it")
    assert [one.name for one in split.data.uv_layers] == ["UVMap"]


def test_a_look_that_fails_leaves_no_uv_map(pair, painted_look, monkeypatch):
    from km_makeup.blender import looks

    split = pair[1]

    def fail(*_: object, **__: object) -> None:
        raise MakeupError("No.")

    monkeypatch.setattr(looks, "_fill", fail)
    tiled.refused(lambda: looks.apply_look(split, painted_look), "No.")
    assert [one.name for one in split.data.uv_layers] == ["UVMap"] and not split.data.keys()
