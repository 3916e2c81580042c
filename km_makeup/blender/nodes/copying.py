"""Copies of nodes inside their tree."""

from __future__ import annotations

import bpy


def copy_node(node: bpy.types.Node) -> bpy.types.Node:
    """A second node with the same properties, input values and incoming links."""
    tree = node.id_data
    twin = tree.nodes.new(node.bl_idname)
    base = {p.identifier for p in bpy.types.Node.bl_rna.properties} - {"label", "mute", "hide", "width"}
    for prop in node.bl_rna.properties:
        if not prop.is_readonly and prop.identifier not in base:
            setattr(twin, prop.identifier, getattr(node, prop.identifier))
    twin.location = (node.location.x, node.location.y - 420)
    for old, new in zip(node.inputs, twin.inputs):
        if old.is_linked:
            tree.links.new(old.links[0].from_socket, new)
        elif hasattr(old, "default_value"):
            new.default_value = old.default_value
    return twin
