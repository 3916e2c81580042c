"""Properties of layers that change over time: which, how large they get, and keys of the nodes that follow them.

Blender does not tell a property of ours that it changed with the frame, and a farm machine may lack the extension. So
nodes get keys of their own: the factor on the painted value that thickness, strength and Show make together.
"""

from __future__ import annotations

import re

import bpy

from .lamps import curves_of

FOLLOWED = ("thickness_um", "strength", "enabled")
PATH = re.compile(r'km_makeup\.layers\[(?:(\d+)|"((?:[^"\\]|\\.)*)")\]\.(\w+)')
"""Blender writes the index of a layer without a name, and the name of others."""


def _curves(obj: bpy.types.Object, index: int) -> dict[str, bpy.types.FCurve]:
    action = obj.animation_data.action if obj.animation_data else None
    found = {}
    for curve in curves_of(action) if action else ():
        match = PATH.fullmatch(curve.data_path)
        if match and match[3] in FOLLOWED and _place(obj, match) == index:
            found[match[3]] = curve
    return found


def _place(obj: bpy.types.Object, match: re.Match[str]) -> int:
    """Index of the layer that a path names; of several of one name Blender takes the first."""
    if match[1] is not None:
        return int(match[1])
    return int(obj.km_makeup.layers.find(bpy.utils.unescape_identifier(match[2])))


def names(obj: bpy.types.Object, index: int) -> tuple[str, ...]:
    """Which properties of a layer have keys that change anything."""
    return tuple(name for name in FOLLOWED if name in _curves(obj, index))


def greatest(obj: bpy.types.Object, index: int, name: str, now: float) -> float:
    """The greatest value a property has over time; its value now where it has no keys."""
    curve = _curves(obj, index).get(name)
    if curve is None or not curve.keyframe_points:
        return now
    first, last = curve.range()
    return max(curve.evaluate(frame) for frame in _frames(first, last))


def _frames(first: float, last: float) -> list[float]:
    return [first + i for i in range(int(last - first) + 1)] + [last]


def follow(obj: bpy.types.Object, index: int, socket: bpy.types.NodeSocket) -> bool:
    """Give a node's factor keys that follow a layer's; False, and no keys, where the layer has none."""
    tree = socket.id_data
    path = socket.path_from_id("default_value")
    _without_keys(tree, path)
    curves = _curves(obj, index)
    if not curves:
        return False
    layer = obj.km_makeup.layers[index]
    thickest = greatest(obj, index, "thickness_um", layer.thickness_um)
    now = {"thickness_um": layer.thickness_um, "strength": layer.strength, "enabled": float(layer.enabled)}
    first = min(curve.range()[0] for curve in curves.values())
    last = max(curve.range()[1] for curve in curves.values())
    for frame in _frames(first, last):
        value = {name: curves[name].evaluate(frame) if name in curves else now[name] for name in FOLLOWED}
        shown = 1.0 if value["enabled"] >= 0.5 else 0.0
        socket.default_value = shown * value["strength"] * value["thickness_um"] / max(thickest, 1e-9)
        socket.keyframe_insert("default_value", frame=frame)
    return True


def _without_keys(tree: bpy.types.NodeTree, path: str) -> None:
    action = tree.animation_data.action if tree.animation_data else None
    if action is None:
        return
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                for curve in [one for one in bag.fcurves if one.data_path == path]:
                    bag.fcurves.remove(curve)
    if not list(curves_of(action)):
        tree.animation_data_clear()
        if not action.users:
            bpy.data.actions.remove(action)
