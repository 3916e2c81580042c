"""Setting a head up, rebuilding its makeup, taking it off."""

from __future__ import annotations

import bpy

from ..base import MakeupOperator


class KM_OT_set_up(MakeupOperator, bpy.types.Operator):
    """Make this head ready for makeup: chooses its skin materials and UV map"""

    bl_idname = "km_makeup.set_up"
    bl_label = "Set Up Makeup"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import makeup

        makeup.set_up(obj)
        if obj.km_makeup.layers:
            makeup.refresh(obj, context.scene)
        names = ", ".join(entry.original.name for entry in obj.km_makeup.slots)
        return f"Makeup lies on {names}, painted on {obj.km_makeup.uv_map!r}"


class KM_OT_remove(MakeupOperator, bpy.types.Operator):
    """Take the makeup off; the original materials are back as they were. Layers are forgotten, map images stay"""

    bl_idname = "km_makeup.remove"
    bl_label = "Remove Makeup"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import makeup

        makeup.remove(obj)


class KM_OT_refresh(MakeupOperator, bpy.types.Operator):
    """Read the maps again and rebuild what changed"""

    bl_idname = "km_makeup.refresh"
    bl_label = "Refresh"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import images, makeup

        images.forget_statistics()
        plan = makeup.refresh(obj, context.scene)
        return "; ".join(f"{e.name}: {'on' if e.on else 'off'}, {e.reason}" for e in plan.films) or "No layers"


CLASSES = (KM_OT_set_up, KM_OT_remove, KM_OT_refresh)
