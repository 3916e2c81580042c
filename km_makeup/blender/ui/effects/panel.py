"""What is simulated."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places
from ..set_up.panel import KM_PT_makeup
from .operators import KM_OT_diffuse, KM_OT_undiffuse


class KM_PT_effects(MakeupPanel):
    """What is simulated beside the films' colour"""

    bl_label = "Effects"
    bl_options = {"DEFAULT_CLOSED"}
    parent = KM_PT_makeup

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and bool(context.object.km_makeup.slots)

    def draw(self, context: bpy.types.Context) -> None:
        makeup = context.object.km_makeup
        layout = self.layout
        layout.use_property_split = True
        layout.prop(makeup, "finish")
        layout.prop(makeup, "scattering")
        row = layout.row(align=True)
        row.operator(KM_OT_diffuse.bl_idname, icon="NODE_COMPOSITING")
        row.operator(KM_OT_undiffuse.bl_idname, text="", icon="X")


CLASSES = in_two_places(KM_PT_effects)
