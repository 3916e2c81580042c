"""Landmarks and regions."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places
from .operators import KM_OT_landmarks_clear, KM_OT_landmarks_place, KM_OT_landmarks_propose, KM_OT_region


class KM_PT_landmarks(MakeupPanel):
    """Where eyes, nose and lips are, and regions to start painting from"""

    bl_label = "Regions & Landmarks"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.operator(KM_OT_region.bl_idname, icon="MOD_MASK")
        marks = context.object.km_makeup.landmarks
        layout.label(text=f"{len(marks)} landmarks" if marks else "Landmarks are proposed when they are needed")
        row = layout.row(align=True)
        row.operator(KM_OT_landmarks_propose.bl_idname, icon="VIEWZOOM")
        row.operator(KM_OT_landmarks_place.bl_idname, icon="EMPTY_AXIS")
        row.operator(KM_OT_landmarks_clear.bl_idname, text="", icon="X")


CLASSES = in_two_places(KM_PT_landmarks)
