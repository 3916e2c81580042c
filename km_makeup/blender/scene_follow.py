"""What plans depend on beside the makeup's own settings: the engine, lamps that come, go, are hidden or change their type, and strokes.

A layer is planned before it is painted; when the brush rests, heads whose plan is another now are built again. What drivers follow (place, direction, power, size of a lamp) needs nothing here. This module is imported at registration.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import bpy

if TYPE_CHECKING:
    from ..effects import Plan

REST = 1.0
"""Seconds after the last stroke before heads are planned for what was painted."""

_painted: dict[int, float] = {}
"""When an image was painted last, by its session_uid."""

_covers: dict[int, tuple[int, ...]] = {}
"""What layers covered when a head was last built after strokes, by its session_uid."""

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
    if depsgraph is not None and depsgraph.id_type_updated("IMAGE"):
        _notice_strokes(scene, depsgraph)
    if depsgraph is not None and not any(depsgraph.id_type_updated(kind) for kind in ("SCENE", "LIGHT")):
        return
    if not _heads(scene):
        return
    marks = _marks(scene)
    known = _seen.get(scene.session_uid)
    _seen[scene.session_uid] = marks
    if known is not None and known != marks and not bpy.app.timers.is_registered(_rebuild):
        bpy.app.timers.register(_rebuild, first_interval=0.1)


def _notice_strokes(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    changed = {update.id.session_uid for update in depsgraph.updates if isinstance(update.id, bpy.types.Image)}
    maps = {image.session_uid for obj in _heads(scene) if obj.mode == "TEXTURE_PAINT" for image in _maps(obj)}
    if changed & maps:
        _painted.update(dict.fromkeys(changed & maps, time.monotonic()))
        if not bpy.app.timers.is_registered(at_rest):
            bpy.app.timers.register(at_rest, first_interval=REST)


def _maps(obj: bpy.types.Object) -> list[bpy.types.Image]:
    return [layer.map for layer in obj.km_makeup.layers if layer.map is not None]


def at_rest() -> float | None:
    """Once the brush has rested: plan for what was painted, and build the heads whose plan decides otherwise now.

    Returns the seconds until it is to be asked again, None when all is done, as timers have it.
    """
    from .images import forget_statistics
    from .makeup import plan_of, planned, refresh
    from .update import stroking, told

    wait = max(_painted.values(), default=-REST) + REST - time.monotonic()
    if wait > 0:
        return wait
    if stroking():
        return REST
    painted = set(_painted)
    _painted.clear()
    for scene in bpy.data.scenes:
        for obj in _heads(scene):
            if not painted & {image.session_uid for image in _maps(obj)}:
                continue
            for image in _maps(obj):
                if image.session_uid in painted:
                    forget_statistics(image)
            before, plan = planned(obj), plan_of(obj, scene)
            known, now = _covers.get(obj.session_uid), _coverage(obj)
            _covers[obj.session_uid] = now
            if before is not None and (known != now or _decisions(plan) != _decisions(before)):
                told(obj, lambda one, scene=scene: refresh(one, scene))
    return None


def _coverage(obj: bpy.types.Object) -> tuple[int, ...]:
    """What each layer covers, in steps of the root of two: which highlights films share goes by it."""
    from .facts import facts_known

    layers = facts_known(obj, bpy.context.scene).layers
    return tuple(round(2 * math.log2(max(one.coverage, 1e-5))) for one in layers)


def _decisions(plan: Plan) -> list[tuple]:
    return [(effect.key, effect.on, effect.reduced) for effect in plan.effects]


def _rebuild() -> float | None:
    from .makeup import refresh
    from .update import stroking, told

    if stroking():
        return REST
    for scene in bpy.data.scenes:
        for obj in _heads(scene):
            told(obj, lambda one, scene=scene: refresh(one, scene))
    return None
