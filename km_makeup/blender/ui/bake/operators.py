"""The bake."""

from __future__ import annotations

from collections.abc import Generator

import bpy

from ..stepping import SteppedOperator


class KM_OT_bake(SteppedOperator, bpy.types.Operator):
    """Compute the textures of the whole stack at 81 bands and use them; Esc stops and leaves the last ones"""

    bl_idname = "km_makeup.bake"
    bl_label = "Bake"
    needs_layer = True
    doing, status = "Bake", "Baking makeup"
    kept = "the last textures are still there"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return self.execute(context) if bpy.app.background else self.start(context)

    def steps(self, context: bpy.types.Context, obj: bpy.types.Object) -> Generator[tuple[int, int], None, str]:
        from ... import baking

        report = yield from baking.bake_steps(obj, context.scene)
        return str(report) if report else "Nothing is painted, so nothing was baked"


CLASSES = (KM_OT_bake,)
