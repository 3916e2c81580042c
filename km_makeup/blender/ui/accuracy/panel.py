"""What the present settings are off by, and what they cost in time."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places, paragraph
from .operators import KM_OT_measure, KM_OT_open_page, KM_OT_pick


class KM_PT_accuracy(MakeupPanel):
    """What the present settings are off by, and what they cost in time"""

    bl_label = "Accuracy & Time"
    needs_layer = True

    def draw(self, context: bpy.types.Context) -> None:
        from ... import frame_times, measured

        layout, obj = self.layout, context.object
        kept, own = measured.measurement_of(obj)
        found = measured.expected(obj, context.scene)
        for one in found:
            paragraph(layout, measured.sentence(one), "DRIVER_DISTANCE")
        if not found:
            paragraph(layout, "These settings were not measured; press Measure on This Scene.", "QUESTION")
        elif own:
            paragraph(layout, f"Measured here, {kept.date}", "INFO")
        else:
            paragraph(layout, "From the sample head; measure to know it of this scene", "INFO")
        frame = frame_times.last_frame()
        if frame is None:
            paragraph(layout, "No frame was rendered yet in this session.", "TIME")
        else:
            column = layout.column(align=True)
            column.label(text=f"Last frame, {frame.size[0]}x{frame.size[1]}: {frame.total_ms:.0f} ms", icon="TIME")
            for name, value in (
                ("Prepare", frame.prepare_ms),
                ("Render", frame.render_ms),
                ("Compositor", frame.compositor_ms),
            ):
                row = column.row()
                row.label(text=name, icon="BLANK1")
                row.label(text=f"{value:.0f} ms")
        layout.operator(KM_OT_measure.bl_idname, icon="PREVIEW_RANGE")
        row = layout.row(align=True)
        row.operator(KM_OT_pick.bl_idname, icon="SHADERFX")
        row.operator(KM_OT_open_page.bl_idname, icon="URL")


CLASSES = in_two_places(KM_PT_accuracy)
