"""What makes skin and films shine."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places, settings


class KM_PT_highlights(MakeupPanel):
    """What makes skin and films shine"""

    bl_label = "Highlights"
    needs_setup = True

    def draw(self, context: bpy.types.Context) -> None:
        makeup = context.object.km_makeup
        layout = self.layout
        settings(layout).prop(makeup, "highlight")
        lamps = settings(layout)
        lamps.enabled = makeup.highlight == "LAMPS"
        lamps.prop(makeup, "highlight_rule")
        lamps.prop(makeup, "highlight_shadows")
        settings(layout).prop(makeup, "highlight_shown")


CLASSES = in_two_places(KM_PT_highlights)
