"""Tiled (UDIM) images are refused in one sentence, and the scene stays as it was."""

from __future__ import annotations

import pytest

from km_makeup.errors import MakeupError
from tests.blender import scenes

pytestmark = pytest.mark.blender


def tiled(name: str):
    import bpy

    return bpy.data.images.new(name, 8, 8, float_buffer=True, is_data=True, tiled=True)


def make_tiled(material) -> None:
    """Swap the texture of a skin for a tiled one."""
    node = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeTexImage")
    node.image = tiled("Tiles")


def refused(act, message: str) -> None:
    before = scenes.file_text()
    with pytest.raises(MakeupError, match=message) as caught:
        act()
    assert "\n" not in str(caught.value)
    assert scenes.file_text() == before


@pytest.fixture
def head(clean_scene):
    obj = scenes.head()
    obj.data.materials.append(scenes.skin(textured=True))
    return obj


@pytest.mark.parametrize("behind", ["colour", "group"])
def test_a_tiled_skin_is_refused_in_set_up(head, behind):
    import bpy

    from km_makeup.blender import makeup

    tree = head.data.materials[0].node_tree
    if behind == "colour":
        make_tiled(head.data.materials[0])
    else:
        group = bpy.data.node_groups.new("Details", "ShaderNodeTree")
        group.nodes.new("ShaderNodeTexImage").image = tiled("Tiles")
        tree.nodes.new("ShaderNodeGroup").node_tree = group
    refused(lambda: makeup.set_up(head), "'Tiles' of material 'Skin' is tiled .UDIM.*bake the skin's textures")
    assert not head.km_makeup.slots


def test_a_skin_that_became_tiled_is_refused_in_a_new_map_and_in_the_bake(head, painted_look, tmp_path):
    import bpy

    from km_makeup.blender import adding, baking, looks
    from km_makeup.blender.update import paused

    looks.apply_look(head, painted_look)
    with paused():
        head.km_makeup.folder = str(tmp_path / "baked")
    make_tiled(head.data.materials[0] if not head.km_makeup.slots else head.km_makeup.slots[0].original)
    refused(lambda: adding.add_layer(bpy.context, head, "test-red"), "is tiled")
    refused(lambda: baking.bake_all(head, bpy.context.scene), "is tiled")
    assert not (tmp_path / "baked").exists()


def test_a_tiled_map_is_refused_in_the_bake(head, painted_look, tmp_path):
    import bpy

    from km_makeup.blender import baking, looks
    from km_makeup.blender.update import paused

    looks.apply_look(head, painted_look)
    with paused():
        head.km_makeup.folder = str(tmp_path / "baked")
        head.km_makeup.layers[1].map = tiled("Painted Tiles")
    refused(lambda: baking.bake_all(head, bpy.context.scene), "The image 'Painted Tiles' is tiled .UDIM., which makeup")
    assert not (tmp_path / "baked").exists()
