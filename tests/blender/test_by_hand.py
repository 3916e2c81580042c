"""What users do by hand between two operators: materials, slots, maps and UV maps deleted, moved or swapped."""

from __future__ import annotations

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from tests.blender import scenes

pytestmark = pytest.mark.blender


@pytest.fixture
def made_up(clean_scene, painted_look):
    """A head in makeup, the skin in its one slot."""
    from km_makeup.blender import looks

    obj = scenes.head()
    obj.data.materials.append(scenes.skin())
    looks.apply_look(obj, painted_look)
    return obj


def materials(obj) -> list[str | None]:
    return [slot.material.name if slot.material else None for slot in obj.material_slots]


def test_a_deleted_original_is_said_and_the_makeup_stays_on(made_up):
    import bpy

    from km_makeup.blender import makeup

    bpy.data.materials.remove(made_up.km_makeup.slots[0].original)
    with pytest.raises(MakeupError, match="original material of slot 1 of 'Head' was deleted"):
        makeup.refresh(made_up)
    with pytest.raises(MakeupError, match="original is not known"):
        makeup.set_up(made_up, slots=[0])
    makeup.remove(made_up)
    assert materials(made_up) == ["Skin with Makeup"]


def test_after_a_deleted_original_a_new_skin_can_be_set_up(made_up):
    import bpy

    from km_makeup.blender import makeup

    bpy.data.materials.remove(made_up.km_makeup.slots[0].original)
    made_up.material_slots[0].material = scenes.skin("New")
    makeup.set_up(made_up)
    makeup.refresh(made_up)
    assert materials(made_up) == ["New with Makeup"]
    makeup.remove(made_up)
    assert materials(made_up) == ["New"]


def test_removing_puts_the_original_back_where_the_copy_was_deleted(made_up):
    import bpy

    from km_makeup.blender import makeup

    bpy.data.materials.remove(made_up.km_makeup.slots[0].made)
    makeup.remove(made_up)
    assert materials(made_up) == ["Skin"]


def test_makeup_follows_its_slot_when_slots_are_moved(made_up):
    from km_makeup.blender import makeup

    other = scenes.skin("Eyes")
    made_up.data.materials.append(other)
    made_up.data.materials[0], made_up.data.materials[1] = other, made_up.data.materials[0]
    makeup.refresh(made_up)
    assert materials(made_up) == ["Eyes", made_up.km_makeup.slots[0].made.name]
    makeup.remove(made_up)
    assert materials(made_up) == ["Eyes", "Skin"]


def test_a_slot_that_is_gone_is_said_and_its_copy_is_cleaned_up(made_up):
    import bpy

    from km_makeup.blender import makeup

    made_up.data.materials.clear()
    with pytest.raises(MakeupError, match="no slot 1 any more"):
        makeup.refresh(made_up)
    makeup.remove(made_up)
    assert [m.name for m in bpy.data.materials] == ["Skin"]


def test_a_material_put_into_the_slot_by_hand_is_not_thrown_out(made_up):
    from km_makeup.blender import makeup

    made_up.material_slots[0].material = scenes.skin("Own")
    with pytest.raises(MakeupError, match="holds 'Own' now"):
        makeup.refresh(made_up)
    assert materials(made_up) == ["Own"]


def test_a_renamed_uv_map_is_said(made_up):
    from km_makeup.blender import makeup

    made_up.data.uv_layers[0].name = "Renamed"
    with pytest.raises(MakeupError, match=r"no UV map named .* any more .it has Renamed"):
        makeup.refresh(made_up)


def test_a_deleted_baked_texture_asks_for_another_bake(made_up, tmp_path):
    import bpy

    from km_makeup.blender import baking, makeup

    made_up.km_makeup.folder = str(tmp_path / "baked")
    baking.bake_all(made_up, bpy.context.scene)
    bpy.data.images.remove(made_up.km_makeup.baked_R_up)
    with pytest.raises(MakeupError, match="press Bake"):
        makeup.refresh(made_up)


@pytest.mark.parametrize("linked", [False, True], ids=["own mesh", "shared mesh"])
@pytest.mark.parametrize("refreshed", [False, True], ids=["copied", "copied and refreshed"])
@pytest.mark.parametrize("first", [False, True], ids=["off the copy", "off the first"])
def test_makeup_comes_off_one_of_two_copies_and_stays_on_the_other(made_up, linked, refreshed, first):
    import bpy

    from km_makeup.blender import makeup

    twin = made_up.copy()
    if not linked:
        twin.data = made_up.data.copy()
    bpy.context.collection.objects.link(twin)
    if refreshed:
        makeup.refresh(twin)
    gone, kept = (made_up, twin) if first else (twin, made_up)
    makeup.remove(gone)
    assert materials(gone) == ["Skin"]
    assert materials(kept) == [kept.km_makeup.slots[0].made.name]
    makeup.refresh(kept)
    makeup.remove(kept)
    assert materials(kept) == materials(gone) == ["Skin"]
    assert [m.name for m in bpy.data.materials] == ["Skin"]


def test_an_object_new_on_a_made_up_mesh_is_set_up_on_the_skin_itself(made_up):
    import bpy

    from km_makeup.blender import makeup

    other = bpy.data.objects.new("Other", made_up.data)
    makeup.set_up(other)
    assert other.km_makeup.slots[0].original.name == "Skin"


@pytest.fixture
def joined(made_up, painted_look):
    """The head in makeup, joined with another one in makeup of its own."""
    import bpy

    from km_makeup.blender import looks

    other = scenes.head("Neck")
    other.data.materials.append(scenes.skin("Neck Skin"))
    looks.apply_look(other, painted_look)
    with bpy.context.temp_override(
        active_object=made_up,
        object=made_up,
        selected_objects=[made_up, other],
        selected_editable_objects=[made_up, other],
    ):
        bpy.ops.object.join()
    bpy.data.orphans_purge(do_recursive=False)  # the mesh that was joined still held its material
    assert materials(made_up) == ["Skin with Makeup", "Neck Skin with Makeup"]
    return made_up


def test_after_a_join_the_makeup_lies_on_the_skins_of_both(joined):
    from km_makeup.blender import makeup

    makeup.refresh(joined)
    makeup.set_up(joined)
    makeup.refresh(joined)
    assert [entry.original.name for entry in joined.km_makeup.slots] == ["Skin", "Neck Skin"]
    assert [slot.material for slot in joined.material_slots] == [entry.made for entry in joined.km_makeup.slots]
    makeup.remove(joined)
    assert materials(joined) == ["Skin", "Neck Skin"]


def test_a_join_is_told_until_makeup_lies_on_all_skin(joined):
    from km_makeup.blender import copies, makeup

    assert [slot.material.name for slot in copies.joined_slots(joined)] == ["Neck Skin with Makeup"]
    makeup.set_up(joined)
    makeup.refresh(joined)
    assert copies.joined_slots(joined) == []


def test_removing_after_a_join_brings_both_skins_back(joined):
    import bpy

    from km_makeup.blender import makeup

    makeup.remove(joined)
    assert materials(joined) == ["Skin", "Neck Skin"]
    assert sorted(m.name for m in bpy.data.materials) == ["Neck Skin", "Skin"]


def baked(obj, folder) -> None:
    import bpy

    from km_makeup.blender import baking

    obj.km_makeup.folder = str(folder)
    baking.bake_all(obj, bpy.context.scene)


@pytest.mark.parametrize("change", ["layer_remove", "layer_move", "layer_add"])
def test_textures_baked_before_the_layers_changed_are_shown_no_more(made_up, tmp_path, change):
    import bpy

    baked(made_up, tmp_path / "baked")
    bpy.context.view_layer.objects.active = made_up
    options = {"layer_add": {"product": "test-red"}, "layer_move": {"direction": 1}}.get(change, {})
    assert getattr(bpy.ops.km_makeup, change)(**options) == {"FINISHED"}
    assert made_up.km_makeup.path == "LIVE"
    assert not [g for g in bpy.data.node_groups if g.name.startswith("KM Baked")]


def test_after_removing_no_baked_texture_is_left_to_come_back(made_up, tmp_path):
    from km_makeup.blender import makeup

    baked(made_up, tmp_path / "baked")
    makeup.remove(made_up)
    assert (made_up.km_makeup.path, made_up.km_makeup.baked_R) == ("LIVE", None)


def test_refresh_reads_a_map_whose_pixels_changed_without_a_mark(made_up, monkeypatch):
    """As after an undo: other pixels, and the image does not count as unsaved."""
    import bpy

    from km_makeup.blender import images
    from km_makeup.makeup.statistics import statistics

    layer = made_up.km_makeup.layers[0]
    assert layer.coverage > 0
    image = layer.map
    image.pixels.foreach_set([0.0] * len(image.pixels))
    image.pack()
    assert not image.is_dirty
    whole = statistics(np.full((image.size[1], image.size[0]), 255, np.uint8))
    monkeypatch.setattr(images, "_statistics", dict.fromkeys(images._statistics, whole))
    bpy.context.view_layer.objects.active = made_up
    bpy.ops.km_makeup.refresh()
    assert layer.coverage == 0


def test_a_layer_without_a_map_is_not_saved_as_one_over_the_whole_face(made_up, tmp_path):
    import bpy

    from km_makeup.blender import looks

    bpy.data.images.remove(made_up.km_makeup.layers[0].map)
    with pytest.raises(MakeupError, match="has no map"):
        looks.save_look(made_up, tmp_path / "look.json")
    assert not list(tmp_path.glob("look*"))


def test_strokes_on_a_map_are_in_the_saved_blend(made_up, tmp_path):
    import bpy

    from km_makeup.blender import images

    image = images.new_map("Strokes", 8, 8)
    made_up.km_makeup.layers[0].map = image
    image.pixels.foreach_set([1.0] * len(image.pixels))
    assert image.is_dirty
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "painted.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "painted.blend"))
    assert images.map_values(bpy.data.images["Strokes"], "R").min() == 255


def test_a_linked_head_is_refused_and_a_linked_mesh_is_made_up_on_the_object(made_up, painted_look, tmp_path):
    import bpy

    from km_makeup.blender import looks, makeup
    from tests.blender.scenes import file_text

    makeup.remove(made_up)
    made_up.data.name = "Head mesh"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects, wanted.meshes = ["Head"], ["Head mesh"]
    with pytest.raises(MakeupError, match="linked from another file"):
        makeup.set_up(bpy.data.objects["Head"])
    own = bpy.data.objects.new("Own", bpy.data.meshes["Head mesh"])
    before = file_text().partition("images")[0]
    looks.apply_look(own, painted_look)
    assert (own.material_slots[0].link, own.material_slots[0].material.name) == ("OBJECT", "Skin with Makeup")
    makeup.remove(own)
    assert file_text().partition("images")[0] == before


def test_a_bake_beside_a_blend_that_is_not_saved_is_refused(made_up):
    import bpy

    from km_makeup.blender import baking

    made_up.km_makeup.folder = "//makeup_textures"
    with pytest.raises(MakeupError, match="not saved yet"):
        baking.bake_all(made_up, bpy.context.scene)


def test_a_layer_is_removed_and_can_be_undone_though_another_has_no_product(made_up, monkeypatch):
    import bpy

    from km_makeup.blender.ui.base import MakeupOperator

    made_up.km_makeup.layers[2].product = "gone"
    bpy.context.view_layer.objects.active = made_up
    said = {}
    execute = MakeupOperator.execute
    monkeypatch.setattr(MakeupOperator, "execute", lambda self, context: said.setdefault("x", execute(self, context)))
    with pytest.raises(RuntimeError, match="no product 'gone'"):
        bpy.ops.km_makeup.layer_remove()
    assert said["x"] == {"FINISHED"}
    assert len(made_up.km_makeup.layers) == 2


def test_strokes_packed_before_an_undo_are_saved_after_it(tmp_path):
    """Undo brings the older packed bytes back and keeps the pixels: without a mark the file would be saved without the strokes."""
    import bpy

    from km_makeup.blender import images, update

    image = images.new_map("Map", 16, 16)
    image.use_fake_user = True
    painted = np.tile(np.array([0.5, 0.5, 0.5, 1], np.float32), 256)
    bpy.ops.ed.undo_push(message="before")
    image.pixels.foreach_set(painted)
    images.keep([image])
    assert not image.is_dirty
    bpy.ops.ed.undo_push(message="a layer was removed")
    bpy.ops.ed.undo()
    image = bpy.data.images["Map"]
    found = np.empty(1024, np.float32)
    image.pixels.foreach_get(found)
    assert abs(found[0] - 0.5) < 0.01, "Blender keeps the pixels"
    update.after_undo()
    update.keep_painted_maps()
    assert not image.is_dirty
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.data.images["Map"].pixels.foreach_get(found)
    np.testing.assert_allclose(found, painted, atol=0.005)
