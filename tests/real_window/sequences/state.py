"""The state of a made-up head as plain data: list, maps, nodes. Runs inside Blender."""

from __future__ import annotations

import hashlib
import re
from typing import Any

import bpy
import numpy as np

from tests.blender import scenes

FIELDS = (
    "name", "product", "thickness_um", "strength", "enabled", "solo", "form", "own_finish", "roughness", "f0",
    "channel", "switch",
)  # fmt: skip


def head() -> bpy.types.Object:
    return bpy.data.objects["Head"]


def map_bytes(image: bpy.types.Image) -> np.ndarray:
    """The red channel of an 8-bit map, (height, width) uint8."""
    values = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(values)
    return np.rint(values.reshape(image.size[1], image.size[0], -1)[..., 0] * 255).astype(np.uint8)


def digest(image: bpy.types.Image | None) -> str:
    if image is None:
        return "none"
    return hashlib.sha256(map_bytes(image).tobytes()).hexdigest()[:16] if min(image.size) else "no pixels"


def layer_fields(layer: bpy.types.PropertyGroup) -> dict[str, Any]:
    return {name: _plain(getattr(layer, name)) for name in FIELDS}


def _plain(value: Any) -> Any:
    return round(value, 5) if isinstance(value, float) else value


def state() -> dict[str, Any]:
    """The list with the maps' contents, what is shown, and the nodes, as one dictionary that can be compared."""
    makeup = head().km_makeup
    slots = [
        "with makeup" if entry.made is not None and slot.material == entry.made else
        "original" if slot.material == entry.original else "other"
        for entry, slot in zip(makeup.slots, head().material_slots)
    ]  # fmt: skip
    return {
        "layers": [layer_fields(layer) | {"map": digest(layer.map)} for layer in makeup.layers],
        "show": makeup.show,
        "light": makeup.light,
        "exclusion": digest(makeup.exclusion),
        "slots": slots,
        "problem": makeup.get("problem", ""),
        "nodes": hashlib.sha256(nodes_text().encode()).hexdigest()[:16],
        "groups": sorted({g.get("km_makeup_group") for g in bpy.data.node_groups if g.get("km_makeup_group")}),
    }


def nodes_text() -> str:
    """The nodes of the copies that carry makeup, groups inside them, and the stops of ramps; without numbered names."""
    trees = [entry.made.node_tree for entry in head().km_makeup.slots if entry.made is not None]
    lines: list[str] = []
    while trees:
        tree = trees.pop(0)
        lines += scenes.tree_lines(tree)
        for node in sorted(tree.nodes, key=lambda n: n.name):
            if node.bl_idname == "ShaderNodeValToRGB":
                lines += [
                    f"{node.name} {e.position:.6f} {[round(c, 6) for c in e.color]}" for e in node.color_ramp.elements
                ]
            if node.bl_idname == "ShaderNodeTexImage":
                lines.append(f"{node.name} shows {digest(node.image)}")
            if getattr(node, "node_tree", None):
                trees.append(node.node_tree)
    text = re.sub(r"<[^>]*>", "<>", "\n".join(lines))
    return text


def difference(expected: dict[str, Any], found: dict[str, Any]) -> str:
    """What differs, in words; empty where nothing does."""
    parts = []
    for key, value in expected.items():
        if found[key] == value:
            continue
        if key == "layers" and len(value) == len(found[key]):
            for i, (a, b) in enumerate(zip(value, found[key])):
                parts += [f"layer {i} {k}: {a[k]!r} became {b[k]!r}" for k in a if a[k] != b[k]]
        else:
            parts.append(f"{key}: {value!r} became {found[key]!r}")
    return "; ".join(parts)
