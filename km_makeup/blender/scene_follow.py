"""What plans depend on beside the makeup's own settings: the engine, lamps that come, go, are hidden or change their type.

What drivers follow (place, direction, power, size of a lamp) needs nothing here, and strokes neither: the layer to be painted is
planned as if it were painted (`facts`). This module is imported at registration.
"""

from __future__ import annotations

import bpy

AGAIN = 0.5
"""Seconds after which it is tried again where a brush is down."""

_seen: dict[int, tuple] = {}
"""By session_uid of scenes."""


def _marks(scene: bpy.types.Scene) -> tuple:
    """What plans depend on and drivers do not follow."""
    lamps = tuple(
        (obj.name, obj.data.type, getattr(obj.data, "shape", ""), obj.hide_render)
        for obj in scene.objects
        if obj.type == "LIGHT"
    )
    return str(scene.render.engine), lamps


def _heads(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    return [obj for obj in scene.objects if obj.type == "MESH" and obj.km_makeup.slots]


@bpy.app.handlers.persistent
def follow_scene(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """After the scene changed: heads are planned and built again if the engine or the lamps are others now.

    From a timer, since data must not change while Blender evaluates them. Called at every change, each frame of an animation
    among them: objects are looked through only where the scene's own settings, its objects' number or a light changed.
    """
    if depsgraph is not None and not any(depsgraph.id_type_updated(kind) for kind in ("SCENE", "LIGHT")):
        return
    if not _heads(scene):
        return
    marks = _marks(scene)
    known = _seen.get(scene.session_uid)
    _seen[scene.session_uid] = marks
    if known is not None and known != marks and not bpy.app.timers.is_registered(_rebuild):
        bpy.app.timers.register(_rebuild, first_interval=0.1)


def _rebuild() -> float | None:
    from .makeup import refresh
    from .update import stroking, told

    if stroking():
        return AGAIN
    for scene in bpy.data.scenes:
        for obj in _heads(scene):
            told(obj, lambda one, scene=scene: refresh(one, scene))
    return None
