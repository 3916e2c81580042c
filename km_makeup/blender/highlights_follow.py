"""Lamps that come, go, are hidden or change their type: the paper's highlight is built again for those that are there.

What drivers follow (place, direction, power, size) needs nothing here. This module is imported at registration.
"""

from __future__ import annotations

import bpy

_seen_lamps: dict[str, tuple] = {}


def _marks(scene: bpy.types.Scene) -> tuple:
    """What the paper's highlight depends on and drivers do not follow."""
    return tuple(
        (obj.name, obj.data.type, getattr(obj.data, "shape", ""), obj.hide_render)
        for obj in scene.objects
        if obj.type == "LIGHT"
    )


def _heads(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    return [
        obj
        for obj in scene.objects
        if obj.type == "MESH" and obj.km_makeup.slots and obj.km_makeup.highlight == "LAMPS"
    ]


@bpy.app.handlers.persistent
def follow_lamps(scene: bpy.types.Scene, *_: object) -> None:
    """After the scene changed: heads with the paper's highlight are built again if its lamps are others now.

    From a timer, since data must not change while Blender evaluates them.
    """
    if not _heads(scene):
        return
    marks = _marks(scene)
    known = _seen_lamps.get(scene.name)
    _seen_lamps[scene.name] = marks
    if known is not None and known != marks and not bpy.app.timers.is_registered(_rebuild):
        bpy.app.timers.register(_rebuild, first_interval=0.1)


def _rebuild() -> None:
    from .makeup import refresh
    from .update import told

    for scene in bpy.data.scenes:
        for obj in _heads(scene):
            told(obj, refresh)
