"""The copies of skin materials that carry makeup: how they are known, and how they are deleted when nothing uses them."""

from __future__ import annotations

import bpy

MADE = "km_makeup_made"
ORIGINAL = "km_makeup_original"
"""The skin's own material, kept on the copy that carries makeup: found there when its object was joined to another."""


def put_back_joined(obj: bpy.types.Object) -> None:
    """Put originals into slots that came with an object that was made up and then joined to this one."""
    for slot in joined_slots(obj):
        worn = slot.material
        if worn.get(ORIGINAL) is not None:
            slot.material = worn[ORIGINAL]
            delete(worn)


def joined_slots(obj: bpy.types.Object) -> list[bpy.types.MaterialSlot]:
    """Slots with makeup that came with an object that was joined to this one; its layers went with it."""
    kept = [entry.made for other in bpy.data.objects for entry in other.km_makeup.slots]
    return [
        slot for slot in obj.material_slots if slot.material and slot.material.get(MADE) and slot.material not in kept
    ]


def delete(material: bpy.types.Material | None) -> None:
    """Delete a copy of ours and the groups that only it used."""
    if material is None or not material.get(MADE) or material.users:
        return
    trees = groups_in(material.node_tree)
    bpy.data.materials.remove(material)
    delete_unused(trees)


def delete_unused(trees: list[bpy.types.NodeTree]) -> None:
    """Delete those of the groups that nothing uses, and then those that only these used."""
    while unused := [tree for tree in trees if not tree.users]:
        trees = [tree for tree in trees if tree.users]
        for tree in unused:
            bpy.data.node_groups.remove(tree)


def groups_in(tree: bpy.types.NodeTree) -> list[bpy.types.NodeTree]:
    """Our groups and copies inside a tree, at any depth."""
    found: list[bpy.types.NodeTree] = []
    for node in tree.nodes:
        inner = getattr(node, "node_tree", None)
        if inner is not None and inner not in found:
            found.append(inner)
            found += [one for one in groups_in(inner) if one not in found]
    return found
