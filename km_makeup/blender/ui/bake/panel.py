"""Light, engine, bake."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places
from ..set_up.panel import KM_PT_makeup
from .operators import KM_OT_bake


class KM_PT_bake(MakeupPanel):
    """Light, engine, bake"""

    bl_label = "Colour & Bake"
    bl_options = {"DEFAULT_CLOSED"}
    parent = KM_PT_makeup

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and bool(context.object.km_makeup.slots)

    def draw(self, context: bpy.types.Context) -> None:
        makeup = context.object.km_makeup
        layout = self.layout
        layout.use_property_split = True
        layout.prop(makeup, "path")
        layout.prop(makeup, "light")
        if makeup.light == "OWN":
            layout.prop(makeup, "light_file")
        layout.prop(makeup, "both_engines")
        layout.prop(makeup, "folder")
        layout.prop(makeup, "resolution")
        layout.prop(makeup, "full_float")
        layout.prop(makeup, "finished")
        layout.operator(KM_OT_bake.bl_idname, icon="RENDER_STILL")


CLASSES = in_two_places(KM_PT_bake)
