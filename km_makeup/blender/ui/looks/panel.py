"""Looks as files."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places
from .operators import KM_OT_load_look, KM_OT_save_look


class KM_PT_looks(MakeupPanel):
    """Looks as files"""

    bl_label = "Looks"

    def draw(self, context: bpy.types.Context) -> None:
        row = self.layout.row(align=True)
        row.operator(KM_OT_load_look.bl_idname, icon="FILE_FOLDER")
        row.operator(KM_OT_save_look.bl_idname, icon="FILE_TICK")


CLASSES = in_two_places(KM_PT_looks)
