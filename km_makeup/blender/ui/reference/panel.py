"""How far the picture is from a path traced one."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places
from .operators import KM_OT_reference


class KM_PT_reference(MakeupPanel):
    """How far the picture is from a path traced one"""

    bl_label = "Reference"
    needs_setup = True

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.operator(KM_OT_reference.bl_idname, icon="RENDER_RESULT")


CLASSES = in_two_places(KM_PT_reference)
