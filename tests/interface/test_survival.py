"""Nothing is lost: files without the extension, datablocks renamed, deleted and copied by hand, and Refresh after them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.blender import scenes
from tests.interface.test_actions import head, nodes_text, ops, painted_head  # noqa: F401

pytestmark = pytest.mark.blender

RENDER_WITHOUT = """
import sys
sys.path.append({checkout!r})
import bpy, numpy as np
bpy.ops.wm.open_mainfile(filepath={blend!r})
assert not hasattr(bpy.types.Object, "km_makeup")
from pathlib import Path
from tests.blender import scenes
np.save({out!r}, scenes.picture("cycles", Path({folder!r}), size=24, samples=2))
"""


def without_extension(script: str, tmp_path: Path) -> None:
    """Run a script in another process of this Blender, in which KM Makeup is not there."""
    import bpy

    file = tmp_path / "without.py"
    file.write_text(script)
    program = bpy.app.binary_path
    command = [program, "--background", "--factory-startup", "--python-exit-code", "1", "--python", str(file)]
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "nobody")}
    done = subprocess.run(
        command if program else [sys.executable, str(file)],
        env=environment, capture_output=True, text=True, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 0, (done.stdout + done.stderr)[-2000:]


def test_a_file_renders_the_same_where_the_extension_is_not_there(head, tmp_path):  # noqa: F811
    import bpy

    painted_head(head)
    scenes.studio()
    with_it = scenes.picture("cycles", tmp_path, size=24, samples=2)
    blend = tmp_path / "farm.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    checkout = str(Path(__file__).resolve().parents[2])
    out = tmp_path / "without.npy"
    without_extension(
        RENDER_WITHOUT.format(checkout=checkout, blend=str(blend), out=str(out), folder=str(tmp_path)), tmp_path
    )
    assert np.abs(np.load(out) - with_it).max() < 2e-6  # Cycles differs by parts in ten million between processes
    head.km_makeup.show = False  # seen by its own name: makeup is what both pictures show
    assert np.abs(scenes.picture("cycles", tmp_path, size=24, samples=2) - with_it).max() > 0.02


@pytest.mark.parametrize("what", ["object", "skin", "copy", "map", "group", "uv map"])
def test_what_is_renamed_by_hand_goes_on(head, what):  # noqa: F811
    import bpy

    painted_head(head)
    entry = head.km_makeup.slots[0]
    before = [layer.map for layer in head.km_makeup.layers]
    if what == "uv map":
        head.data.uv_layers[0].name = "Other"
        with pytest.raises(RuntimeError, match="no UV map named 'UVMap' any more"):
            ops().refresh()
        head.km_makeup.uv_map = "Other"
    else:
        {
            "object": head, "skin": entry.original, "copy": entry.made, "map": head.km_makeup.layers[0].map,
            "group": next(g for g in bpy.data.node_groups if g.get("km_makeup_group") == "makeup"),
        }[what].name = "Renamed"  # fmt: skip
    head.km_makeup.layers[0].thickness_um = 51
    assert not head.km_makeup.get("problem")
    assert [layer.map for layer in head.km_makeup.layers] == before
    changed = nodes_text(head)
    ops().refresh()
    assert nodes_text(head) == changed


@pytest.mark.parametrize("what", ["copy", "makeup group", "film groups", "nodes in the copy", "map", "exclusion"])
def test_refresh_repairs_what_was_deleted_by_hand(head, what):  # noqa: F811
    import bpy

    painted_head(head)
    whole = nodes_text(head)
    makeup = head.km_makeup
    groups = {
        kind: [g for g in bpy.data.node_groups if g.get("km_makeup_group") == kind] for kind in ("makeup", "film")
    }
    if what == "copy":
        bpy.data.materials.remove(makeup.slots[0].made)
    elif what == "makeup group":
        bpy.data.node_groups.remove(groups["makeup"][0])
    elif what == "film groups":
        for group in groups["film"]:
            bpy.data.node_groups.remove(group)
    elif what == "nodes in the copy":
        makeup.slots[0].made.node_tree.nodes.clear()
    elif what == "map":
        kept = makeup.layers[1].map.copy()
        bpy.data.images.remove(makeup.layers[1].map)
        makeup.layers[1].map = kept
    else:
        ops().exclusion_add()
        bpy.data.images.remove(makeup.exclusion)
        makeup.paints_exclusion = False
    makeup.layers[0].thickness_um = 37
    makeup.layers[0].thickness_um = painted_thickness(makeup)
    ops().refresh()
    assert not makeup.get("problem")
    if what != "map":
        assert nodes_text(head) == whole
    assert head.material_slots[0].material == makeup.slots[0].made


def painted_thickness(makeup) -> float:
    from km_makeup.products import Library

    return Library.shipped().find(makeup.layers[0].product).thickness_um


def test_a_film_whose_map_was_deleted_is_left_out_and_the_others_stay(head):  # noqa: F811
    import bpy

    painted_head(head)
    bpy.data.images.remove(head.km_makeup.layers[1].map)
    ops().refresh()
    from km_makeup.blender import makeup

    assert makeup.plan_of(head).film_indices == (0, 2)
    assert not head.km_makeup.get("problem")


def test_a_refused_layer_leaves_nothing_behind(head):  # noqa: F811
    import bpy

    painted_head(head)
    images, layers = len(bpy.data.images), len(head.km_makeup.layers)
    head.material_slots[0].material = scenes.skin("Own")
    with pytest.raises(RuntimeError, match="holds 'Own' now"):
        ops().layer_add(product="blush-rose")
    assert (len(bpy.data.images), len(head.km_makeup.layers)) == (images, layers)


def test_removing_is_refused_where_the_skin_was_deleted_and_the_layers_stay(head):  # noqa: F811
    import bpy

    painted_head(head)
    bpy.data.materials.remove(head.km_makeup.slots[0].original)
    with pytest.raises(RuntimeError, match="nothing to put back"):
        ops().remove()
    assert len(head.km_makeup.layers) == 3
    head.material_slots[0].material = scenes.skin("New")
    assert ops().remove() == {"FINISHED"}
    assert [slot.material.name for slot in head.material_slots] == ["New"]


def test_removing_after_all_slots_were_deleted_brings_the_skin_back(head):  # noqa: F811
    painted_head(head)
    head.data.materials.clear()
    ops().remove()
    assert [slot.material.name for slot in head.material_slots] == ["Skin"]


def test_eyes_and_glass_are_not_taken_for_skin(head):  # noqa: F811
    for name in ("helper-l-eye", "Teeth", "EyeWet"):
        head.data.materials.append(scenes.skin(name))
    glass = scenes.skin("Visor")
    scenes.principled_of(glass).inputs["Transmission Weight"].default_value = 1
    head.data.materials.append(glass)
    head.data.materials.append(scenes.skin("Lips"))
    ops().set_up()
    assert [entry.original.name for entry in head.km_makeup.slots] == ["Skin", "Lips"]


def test_a_head_without_material_is_given_a_skin(clean_scene):
    import bpy

    obj = scenes.head()
    bpy.context.view_layer.objects.active = obj
    assert ops().set_up() == {"FINISHED"}
    assert [entry.original.name for entry in obj.km_makeup.slots] == ["Skin"]
    assert obj.km_makeup.layers[0].product == "blush-rose"
