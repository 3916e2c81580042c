"""What a .blend holds, as text: to compare two files, or a file with what the script makes."""

from __future__ import annotations

import hashlib

import bpy
import numpy as np

KINDS = ("objects", "meshes", "materials", "lights", "cameras", "worlds", "collections")
LEFT_OUT = {
    # of the run and not of the contents: addresses, paths, counts, what is derived
    "rna_type", "session_uid", "users", "id_data", "filepath", "filepath_raw", "bindcode", "is_dirty", "tag", "preview",
    "library", "original", "is_evaluated", "warning", "execution_time", "name_full", "location_absolute", "dimensions",
    "use_nodes",
}  # fmt: skip


def contents() -> dict[str, str]:
    """A digest for every data-block of the open file but its pictures, by kind and name."""
    bpy.context.view_layer.update()  # world matrices, which a file just read has
    return {
        f"{kind}/{item.name}": hashlib.sha256(_text(item).encode()).hexdigest()[:16]
        for kind in KINDS
        for item in getattr(bpy.data, kind)
    }


def pictures() -> dict[str, np.ndarray]:
    """The pictures of the open file, as bytes by name."""
    found = {}
    for image in bpy.data.images:
        if image.source == "FILE":
            flat = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(flat)
            found[f"images/{image.name}"] = np.round(flat * 255).astype(np.uint8)
    return found


def differences(one: dict[str, str], other: dict[str, str]) -> list[str]:
    """The data-blocks that are not the same in both, or are in one only."""
    return sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))


def unlike(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> list[str]:
    """Pictures that differ by more than a level, which rounding on another machine may, or are in one only."""
    both = sorted(name for name in one.keys() & other.keys() if one[name].shape == other[name].shape)
    same = [name for name in both if np.abs(one[name].astype(int) - other[name]).max() <= 1]
    return sorted((one.keys() | other.keys()) - set(same))


def _text(item: bpy.types.ID) -> str:
    lines = _properties(item)
    if isinstance(item, bpy.types.Mesh):
        lines += [_array(item.vertices, "co", 3), _array(item.loops, "vertex_index", 1, np.int32)]
        lines += [_array(layer.data, "uv", 2) for layer in item.uv_layers]
    if isinstance(item, bpy.types.Object):
        for modifier in item.modifiers:
            lines += _properties(modifier)
    if isinstance(item, bpy.types.Collection):
        lines += sorted(o.name for o in item.objects)
    tree = getattr(item, "node_tree", None)
    if tree is not None and isinstance(item, (bpy.types.Material, bpy.types.World)):
        for node in tree.nodes:
            lines += _properties(node)
            lines += [f"{s.identifier}={_value(getattr(s, 'default_value', None))}" for s in node.inputs]
            if hasattr(node, "color_ramp"):
                lines += [f"{e.position:.6g} {_value(e.color)}" for e in node.color_ramp.elements]
        lines += sorted(
            f"{k.from_node.name}.{k.from_socket.identifier}>{k.to_node.name}.{k.to_socket.identifier}"
            for k in tree.links
        )
    return "\n".join(lines)


def _properties(item) -> list[str]:
    """Every plain property and the names of what it points to."""
    lines = []
    for prop in item.bl_rna.properties:
        name = prop.identifier
        if name in LEFT_OUT or prop.type == "COLLECTION" or prop.is_runtime:  # what extensions add is theirs
            continue
        lines.append(f"{name}={_value(getattr(item, name))}")
    return lines


def _value(value) -> str:
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, (bool, int, str)) or value is None:
        return repr(value)
    if isinstance(value, bpy.types.ID):
        return value.name
    if isinstance(value, bpy.types.bpy_struct):
        return type(value).__name__
    try:
        return " ".join(_value(v) for v in value)
    except TypeError:
        return type(value).__name__


def _array(items, name: str, width: int, kind: type = np.float32) -> str:
    """A digest of a property of all items; places to a micrometre."""
    flat = np.empty(len(items) * width, kind)
    items.foreach_get(name, flat)
    if kind is np.float32:
        flat = np.round(flat * 1e6).astype(np.int64)
    return hashlib.sha256(flat.tobytes()).hexdigest()


__all__ = ["contents", "differences", "pictures", "unlike"]
