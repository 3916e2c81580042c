"""The active layer: what it is, the brush, its map."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, active_layer, in_two_places, paragraph, settings
from ..layers.operators import KM_OT_exclusion_add
from ..products import picker
from .operators import STROKES, KM_OT_fill, KM_OT_load_map, KM_OT_paint


class KM_PT_layer(MakeupPanel):
    """Product and thickness of the active layer"""

    bl_label = "Layer"
    bl_options: set[str] = set()
    needs_layer = True

    def draw(self, context: bpy.types.Context) -> None:
        layer, layout = active_layer(context.object), self.layout
        layout.label(text="Product: click the swatch to choose")
        picker.draw(layout, layer, scale=3.0)
        column = settings(layout, align=True)
        column.prop(layer, "thickness_um", text="Thickness µm")
        column.prop(layer, "strength")
        settings(layout).prop(layer, "form")


class KM_PT_paint(MakeupPanel):
    """The brush and the map of the active layer"""

    bl_label = "Paint"
    bl_options: set[str] = set()
    parent = "KM_PT_layer"
    needs_layer = True

    def draw(self, context: bpy.types.Context) -> None:
        from ... import painting

        obj, layout = context.object, self.layout
        makeup, layer = obj.km_makeup, active_layer(obj)
        in_hand = painting.stroke_of(context.scene) if painting.is_painted(obj, context.scene) else None
        row = layout.row(align=True)
        for name, label, _, icon, _ in STROKES:
            pressed = in_hand is not None and in_hand.name == name
            row.operator(KM_OT_paint.bl_idname, text=label, icon=icon, depress=pressed).stroke = name
        if obj.mode == "TEXTURE_PAINT":
            _brush(layout, context, makeup, in_hand is not None)
        row = layout.row(align=True)
        row.operator(KM_OT_fill.bl_idname, text="Fill", icon="SNAP_FACE").value = 1
        row.operator(KM_OT_fill.bl_idname, text="Clear", icon="TRASH").value = 0
        row = layout.row(align=True)
        row.template_ID(layer, "map", new=KM_OT_fill.bl_idname, open=KM_OT_load_map.bl_idname)
        settings(layout).prop(layer, "channel")


def _brush(layout: bpy.types.UILayout, context: bpy.types.Context, makeup: bpy.types.PropertyGroup, ours: bool) -> None:
    """Settings of the brush in hand, or where it paints if that is not this layer's map."""
    from ... import painting

    paint = context.scene.tool_settings.image_paint
    if not ours:
        canvas = f"{paint.canvas.name!r}" if paint.mode == "IMAGE" and paint.canvas else "the material's own images"
        paragraph(layout, f"The brush paints on {canvas}; press Paint to paint this layer.", "INFO")
        return
    if makeup.paints_exclusion:
        paragraph(layout, "The brush paints on the exclusion mask.", "INFO")
    column = settings(layout, align=True)
    column.prop(makeup, "brush_value", text="Value")
    column.prop(paint.unified_paint_settings, "size", text="Size")
    brush = paint.brush
    if brush is not None:
        column.prop(painting.flow_of(context.scene), "strength", text="Flow")
        column.prop(brush, "use_pressure_strength", text="Pen Pressure")
    settings(layout, heading="Mirror").prop(context.object.data, "use_mirror_x", text="X")


class KM_PT_finish(MakeupPanel):
    """The highlight of the active layer, and whether its film exists"""

    bl_label = "Finish"
    parent = "KM_PT_layer"
    needs_layer = True

    def draw(self, context: bpy.types.Context) -> None:
        layer, layout = active_layer(context.object), self.layout
        settings(layout).prop(layer, "own_finish")
        column = settings(layout, align=True)
        column.active = layer.own_finish
        column.prop(layer, "roughness")
        column.prop(layer, "f0")
        settings(layout).prop(layer, "switch", text="Film")


class KM_PT_exclusion(MakeupPanel):
    """A mask that keeps all makeup away from brows, lashes and nostrils"""

    bl_label = "Exclusion Mask"
    needs_layer = True

    def draw(self, context: bpy.types.Context) -> None:
        makeup, layout = context.object.km_makeup, self.layout
        layout.template_ID(makeup, "exclusion", new=KM_OT_exclusion_add.bl_idname, open="image.open")
        if makeup.exclusion is None:
            paragraph(layout, "White keeps makeup away: brows, lashes, nostrils.", "INFO")
        else:
            layout.prop(makeup, "paints_exclusion", text="Brush Paints on Mask", icon="BRUSH_DATA", toggle=True)


CLASSES = in_two_places(KM_PT_layer, KM_PT_paint, KM_PT_finish, KM_PT_exclusion)
