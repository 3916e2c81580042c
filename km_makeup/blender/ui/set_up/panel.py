"""The panel that all others lie in: set up, before and after, what is wrong; below it the skin that was chosen."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places, paragraph, settings
from .operators import (
    KM_OT_keep_maps,
    KM_OT_refresh,
    KM_OT_remove,
    KM_OT_set_up,
    KM_OT_shading,
    KM_OT_slot_toggle,
)

BEFORE_AFTER = "km_makeup.before_after"  # of the page Layers, which itself lies in this panel


class KM_PT_makeup(MakeupPanel):
    """Set up, before and after, and what is wrong"""

    bl_label = "Makeup"
    bl_options: set[str] = set()
    parent = ""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        in_view = context.space_data is not None and context.space_data.type == "VIEW_3D"
        return in_view or super().poll(context)  # the tab is always there, so that it is found

    def draw(self, context: bpy.types.Context) -> None:
        layout, obj = self.layout, context.object
        if obj is None or obj.type != "MESH":
            paragraph(layout, "Click on the head to select it; then set it up here.", "INFO")
            return
        makeup = obj.km_makeup
        if not makeup.slots:
            column = layout.column()
            column.scale_y = 1.5
            column.operator(KM_OT_set_up.bl_idname, icon="BRUSH_DATA")
            return
        row = layout.row(align=True)
        row.operator(BEFORE_AFTER, text="Before", depress=not makeup.show).side = "BEFORE"
        row.operator(BEFORE_AFTER, text="After", depress=makeup.show).side = "AFTER"
        _notices(layout, context, makeup)


def _notices(layout: bpy.types.UILayout, context: bpy.types.Context, makeup: bpy.types.PropertyGroup) -> None:
    """What the artist should know now, each with the button that mends it."""
    from ...copies import joined_slots
    from ...images import unsaved_maps

    if joined := joined_slots(context.object):
        box = layout.box()
        names = ", ".join(slot.material.name for slot in joined)
        paragraph(
            box,
            f"{names} came with a head that was joined to this one; its layers went with it. Undo to have them back.",
            "ERROR",
        )
        again = box.operator(KM_OT_set_up.bl_idname, text="Makeup on All Skin", icon="FILE_REFRESH")
        again.paint = again.shading = False
    if problem := makeup.get("problem"):
        box = layout.box()
        box.alert = True
        paragraph(box, problem, "ERROR")
        box.operator(KM_OT_refresh.bl_idname, icon="FILE_REFRESH")
    if makeup.path == "BAKED" and not makeup.follows:
        box = layout.box()
        paragraph(box, "Baked textures are shown: strokes are seen after the next bake, or in Live.", "INFO")
        box.prop_enum(makeup, "path", "LIVE", text="Show Live")
    if _hides_materials(context):
        box = layout.box()
        paragraph(box, "This viewport shows no materials.", "INFO")
        row = box.row(align=True)
        row.operator(KM_OT_shading.bl_idname, text="Material", icon="SHADING_TEXTURE").kind = "MATERIAL"
        row.operator(KM_OT_shading.bl_idname, text="Rendered", icon="SHADING_RENDERED").kind = "RENDERED"
    if not bpy.data.is_saved and unsaved_maps():
        box = layout.box()
        paragraph(box, "Strokes are in no file yet.", "ERROR")
        row = box.row(align=True)
        row.operator("wm.save_mainfile", text="Save", icon="FILE_TICK")
        row.operator(KM_OT_keep_maps.bl_idname, text="Pack", icon="PACKAGE")


def _hides_materials(context: bpy.types.Context) -> bool:
    space = context.space_data
    return space is not None and space.type == "VIEW_3D" and space.shading.type in {"SOLID", "WIREFRAME"}


class KM_PT_skin(MakeupPanel):
    """Which material slots and which UV map makeup lies on"""

    bl_label = "Skin"
    needs_setup = True

    def draw(self, context: bpy.types.Context) -> None:
        from ... import udim  # not before it is drawn: registering is to be quick

        layout, obj = self.layout, context.object
        originals = {entry.index: entry.original for entry in obj.km_makeup.slots}
        column = layout.column(align=True)
        column.label(text="Makeup on")
        for index, slot in enumerate(obj.material_slots):
            material = originals.get(index, slot.material)
            chosen = index in originals
            column.operator(
                KM_OT_slot_toggle.bl_idname,
                text=material.name if material else f"Slot {index + 1}, no material",
                icon="CHECKBOX_HLT" if chosen else "CHECKBOX_DEHLT",
                emboss=False,
            ).index = index
        column = settings(layout)
        column.prop_search(obj.km_makeup, "uv_map", obj.data, "uv_layers", icon="GROUP_UVS")
        tiles = udim.layout_of(obj.data, obj.km_makeup.uv_map)
        if tiles:
            column.prop(obj.km_makeup, "tiles", placeholder=" ".join(map(str, tiles.tiles)))
        layout.operator(KM_OT_set_up.bl_idname, text="Set Up Again", icon="FILE_PARENT").paint = False
        row = layout.row(align=True)
        row.operator(KM_OT_refresh.bl_idname, icon="FILE_REFRESH")
        row.operator(KM_OT_remove.bl_idname, text="Remove", icon="TRASH")


CLASSES = in_two_places(KM_PT_makeup, KM_PT_skin)
