"""What makes skin and films shine."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places
from ..set_up.panel import KM_PT_makeup


class KM_PT_highlights(MakeupPanel):
    """What makes skin and films shine"""

    bl_label = "Highlights"
    bl_options = {"DEFAULT_CLOSED"}
    parent = KM_PT_makeup

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and bool(context.object.km_makeup.slots)

    def draw(self, context: bpy.types.Context) -> None:
        makeup = context.object.km_makeup
        layout = self.layout
        layout.use_property_split = True
        layout.prop(makeup, "highlight")
        lamps = layout.column()
        lamps.enabled = makeup.highlight == "LAMPS"
        lamps.prop(makeup, "highlight_rule")
        lamps.prop(makeup, "highlight_shadows")
        layout.prop(makeup, "highlight_shown")


CLASSES = in_two_places(KM_PT_highlights)
