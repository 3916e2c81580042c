"""The panel that all others lie in."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places, paragraph
from .operators import KM_OT_refresh, KM_OT_remove, KM_OT_set_up


class KM_PT_makeup(MakeupPanel):
    """Set up, and what is wrong"""

    bl_label = "Makeup"

    def draw(self, context: bpy.types.Context) -> None:
        layout, makeup = self.layout, context.object.km_makeup
        if problem := makeup.get("problem"):
            paragraph(layout, problem, "ERROR")
        if not makeup.slots:
            layout.operator(KM_OT_set_up.bl_idname, icon="BRUSH_DATA")
            return
        row = layout.row(align=True)
        row.operator(KM_OT_refresh.bl_idname, icon="FILE_REFRESH")
        row.operator(KM_OT_remove.bl_idname, icon="TRASH")


CLASSES = in_two_places(KM_PT_makeup)
