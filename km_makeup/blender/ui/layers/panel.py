"""The list of layers and its buttons, and the exclusion mask."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places
from .operators import (
    KM_OT_layer_add,
    KM_OT_layer_duplicate,
    KM_OT_layer_move,
    KM_OT_layer_remove,
)

ROOMY = 330
"""Width of a sidebar or editor, in pixels at a resolution scale of 1, from which on a row shows the thickness too."""


class KM_UL_layers(bpy.types.UIList):
    """Layers; the bottom of the list is nearest the skin."""

    def draw_item(
        self,
        context: bpy.types.Context,
        layout: bpy.types.UILayout,
        data: object,
        item: bpy.types.PropertyGroup,
        icon: int,
        active_data: object,
        active_property: str,
        index: int = 0,
        flt_flag: int = 0,
    ) -> None:
        """One row: colour on this skin, name, thickness where there is room for it, solo, eye."""
        row = layout.row(align=True)
        colour = row.row()
        colour.scale_x = 0.35
        colour.prop(item, "swatch", text="")
        row.prop(item, "name", text="", emboss=False)
        if context.region.width > ROOMY * context.preferences.system.ui_scale:
            number = row.row()
            number.alignment, number.active = "RIGHT", item.enabled
            number.label(text=f"{item.thickness_um:.3g} µm")
        row.prop(item, "solo", text="", icon="SOLO_ON" if item.solo else "SOLO_OFF", emboss=False)
        row.prop(item, "enabled", text="", icon="HIDE_OFF" if item.enabled else "HIDE_ON", emboss=False)


class KM_PT_layers(MakeupPanel):
    """The layers of makeup"""

    bl_label = "Layers"
    bl_options: set[str] = set()
    needs_setup = True

    def draw(self, context: bpy.types.Context) -> None:
        makeup = context.object.km_makeup
        row = self.layout.row()
        row.template_list(
            "KM_UL_layers", "", makeup, "layers", makeup, "active", rows=4, sort_reverse=True, sort_lock=True
        )
        column = row.column(align=True)
        column.operator(KM_OT_layer_add.bl_idname, text="", icon="ADD")
        column.operator(KM_OT_layer_remove.bl_idname, text="", icon="REMOVE")
        column.separator()
        column.operator(KM_OT_layer_duplicate.bl_idname, text="", icon="DUPLICATE")
        column.separator()
        column.operator(KM_OT_layer_move.bl_idname, text="", icon="TRIA_UP").direction = 1
        column.operator(KM_OT_layer_move.bl_idname, text="", icon="TRIA_DOWN").direction = -1


CLASSES = (KM_UL_layers, *in_two_places(KM_PT_layers))
