"""The Makeup tab in the sidebar of the 3D view."""

from __future__ import annotations

import bpy

from .operators import (
    KM_OT_bake,
    KM_OT_diffuse,
    KM_OT_layer_add,
    KM_OT_layer_move,
    KM_OT_layer_remove,
    KM_OT_load_look,
    KM_OT_load_map,
    KM_OT_refresh,
    KM_OT_remove,
    KM_OT_save_look,
    KM_OT_set_up,
    KM_OT_undiffuse,
)


class KM_UL_layers(bpy.types.UIList):
    """Layers, bottom of the list is nearest the skin."""

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
        """One row: name, thickness, eye."""
        row = layout.row(align=True)
        row.prop(item, "name", text="", emboss=False)
        row.label(text=f"{item.thickness_um:.3g} µm")
        row.prop(item, "enabled", text="", icon="HIDE_OFF" if item.enabled else "HIDE_ON", emboss=False)


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Makeup"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.object is not None and context.object.type == "MESH"


class KM_PT_makeup(_Panel, bpy.types.Panel):
    """Set up, and the layers of makeup"""

    bl_idname = "KM_PT_makeup"
    bl_label = "Makeup"

    def draw(self, context: bpy.types.Context) -> None:
        layout, makeup = self.layout, context.object.km_makeup
        if problem := makeup.get("problem"):
            for line in _wrapped(problem):
                layout.label(text=line, icon="ERROR" if line == _wrapped(problem)[0] else "BLANK1")
        if not makeup.slots:
            layout.operator(KM_OT_set_up.bl_idname, icon="BRUSH_DATA")
            layout.operator(KM_OT_load_look.bl_idname, icon="FILE_FOLDER")
            return
        row = layout.row()
        row.template_list(
            "KM_UL_layers", "", makeup, "layers", makeup, "active", rows=4, sort_reverse=True, sort_lock=True
        )
        column = row.column(align=True)
        column.operator(KM_OT_layer_add.bl_idname, text="", icon="ADD")
        column.operator(KM_OT_layer_remove.bl_idname, text="", icon="REMOVE")
        column.operator(KM_OT_layer_move.bl_idname, text="", icon="TRIA_UP").direction = 1
        column.operator(KM_OT_layer_move.bl_idname, text="", icon="TRIA_DOWN").direction = -1
        row = layout.row(align=True)
        row.operator(KM_OT_refresh.bl_idname, icon="FILE_REFRESH")
        row.operator(KM_OT_remove.bl_idname, icon="TRASH")


class KM_PT_layer(_Panel, bpy.types.Panel):
    """The active layer"""

    bl_idname = "KM_PT_layer"
    bl_parent_id = "KM_PT_makeup"
    bl_label = "Layer"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.object is not None and bool(context.object.km_makeup.layers)

    def draw(self, context: bpy.types.Context) -> None:
        makeup = context.object.km_makeup
        layer = makeup.layers[min(makeup.active, len(makeup.layers) - 1)]
        layout = self.layout
        layout.use_property_split = True
        layout.prop(layer, "product")
        layout.prop(layer, "thickness_um", text="Film (µm)")
        layout.prop(layer, "strength")
        layout.template_ID(layer, "map", new="image.new", open="image.open")
        layout.operator(KM_OT_load_map.bl_idname, icon="IMAGE_DATA")
        layout.prop(layer, "channel")
        layout.prop(layer, "switch")


class KM_PT_looks(_Panel, bpy.types.Panel):
    """Looks as files"""

    bl_idname = "KM_PT_looks"
    bl_parent_id = "KM_PT_makeup"
    bl_label = "Looks"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        row = self.layout.row(align=True)
        row.operator(KM_OT_load_look.bl_idname, icon="FILE_FOLDER")
        row.operator(KM_OT_save_look.bl_idname, icon="FILE_TICK")


class KM_PT_bake(_Panel, bpy.types.Panel):
    """Light, engine, bake"""

    bl_idname = "KM_PT_bake"
    bl_parent_id = "KM_PT_makeup"
    bl_label = "Colour & Bake"

    def draw(self, context: bpy.types.Context) -> None:
        makeup = context.object.km_makeup
        layout = self.layout
        layout.use_property_split = True
        layout.prop(makeup, "path")
        layout.prop(makeup, "light")
        if makeup.light == "OWN":
            layout.prop(makeup, "light_file")
        layout.prop(makeup, "both_engines")
        layout.prop(makeup, "scattering")
        row = layout.row(align=True)
        row.operator(KM_OT_diffuse.bl_idname, icon="NODE_COMPOSITING")
        row.operator(KM_OT_undiffuse.bl_idname, text="", icon="X")
        layout.prop(makeup, "folder")
        layout.prop(makeup, "resolution")
        layout.prop(makeup, "full_float")
        layout.prop(makeup, "finished")
        layout.operator(KM_OT_bake.bl_idname, icon="RENDER_STILL")


def _wrapped(text: str, width: int = 44) -> list[str]:
    import textwrap

    return textwrap.wrap(text, width)


CLASSES = (KM_UL_layers, KM_PT_makeup, KM_PT_layer, KM_PT_looks, KM_PT_bake)
