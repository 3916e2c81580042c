"""What is simulated."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places, settings
from .operators import KM_OT_diffuse, KM_OT_undiffuse


class KM_PT_effects(MakeupPanel):
    """What is simulated beside the films' colour"""

    bl_label = "Effects"
    needs_setup = True

    def draw(self, context: bpy.types.Context) -> None:
        makeup = context.object.km_makeup
        layout, column = self.layout, settings(self.layout)
        column.prop(makeup, "finish")
        column.prop(makeup, "scattering")
        row = layout.row(align=True)
        row.operator(KM_OT_diffuse.bl_idname, icon="NODE_COMPOSITING")
        row.operator(KM_OT_undiffuse.bl_idname, text="", icon="X")


CLASSES = in_two_places(KM_PT_effects)
