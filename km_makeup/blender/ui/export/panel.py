"""The button that lets a look leave Blender."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places
from .operators import KM_OT_export_look


class KM_PT_export(MakeupPanel):
    """The look as plain textures and glTF"""

    bl_label = "Export"
    needs_setup = True

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.operator(KM_OT_export_look.bl_idname, text="Export Look…", icon="EXPORT")


CLASSES = in_two_places(KM_PT_export)
