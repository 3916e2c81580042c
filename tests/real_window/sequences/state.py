"""The state of a made-up head as plain data: list, maps, nodes. Runs inside Blender."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
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
    texts: dict[int, list[str]] = {}
    lines: list[str] = []
    while trees:
        tree = trees.pop(0)
        key = tree.as_pointer()
        if key not in texts:
            texts[key] = list(_tree_text(tree))
        lines += texts[key]
        trees += [node.node_tree for node in tree.nodes if getattr(node, "node_tree", None)]
    return re.sub(r"<[^>]*>", "<>", "\n".join(lines))


def _tree_text(tree: bpy.types.NodeTree) -> Iterator[str]:
    yield from scenes.tree_lines(tree)
    for node in sorted(tree.nodes, key=lambda n: n.name):
        if node.bl_idname == "ShaderNodeValToRGB":
            for stop in node.color_ramp.elements:
                yield f"{node.name} {stop.position:.6f} {[round(c, 6) for c in stop.color]}"
        if node.bl_idname == "ShaderNodeTexImage":
            yield f"{node.name} shows {digest(node.image)}"


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
