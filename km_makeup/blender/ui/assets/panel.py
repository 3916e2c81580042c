"""Node groups and brushes for the asset browser."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places, paragraph
from .operators import KM_OT_assets_add, KM_OT_assets_remove


class KM_PT_assets(MakeupPanel):
    """Node groups and brushes for the asset browser"""

    bl_label = "Assets"

    def draw(self, context: bpy.types.Context) -> None:
        from ... import assets

        layout = self.layout
        found = assets.entries(context.preferences)
        if found:
            paragraph(layout, f"In the asset browser as {found[0].name!r}.", "CHECKMARK")
            layout.operator(KM_OT_assets_remove.bl_idname, icon="X")
        else:
            layout.operator(KM_OT_assets_add.bl_idname, icon="ASSET_MANAGER")


CLASSES = in_two_places(KM_PT_assets)
