"""Adding, removing and ordering layers."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty

from ...update import one_update
from ..base import MakeupOperator

MAP_SIZE = 2048


class KM_OT_layer_add(MakeupOperator, bpy.types.Operator):
    """Add a layer of a product on top, with an empty map"""

    bl_idname = "km_makeup.layer_add"
    bl_label = "Add Layer"
    bl_property = "product"

    def _products(self, context: bpy.types.Context | None) -> list[tuple[str, str, str]]:
        from ...library import library

        KM_OT_layer_add.items = [
            (p.id, p.name, f"{p.kind}, {p.form}, {p.provenance.status}") for p in library().products
        ]
        return KM_OT_layer_add.items

    items: list[tuple[str, str, str]] = []
    product: EnumProperty(name="Product", description="The product of the new layer", items=_products)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window_manager.invoke_search_popup(self)
        return {"RUNNING_MODAL"}

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import images, makeup
        from ...library import library

        product = library().find(self.product)
        if not obj.km_makeup.slots:
            makeup.set_up(obj)
        sizes = [layer.map.size[:] for layer in obj.km_makeup.layers if layer.map]
        width, height = sizes[0] if sizes else (MAP_SIZE, MAP_SIZE)
        with one_update(obj):
            layer = obj.km_makeup.layers.add()
            layer.name, layer.product, layer.thickness_um = product.name, product.id, product.thickness_um
            layer.map = images.new_map(f"{obj.name} {product.name}", width, height)
            obj.km_makeup.active = len(obj.km_makeup.layers) - 1
        _canvas(context, layer.map)


def _canvas(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Make the map what Texture Paint paints on, in white."""
    paint = context.scene.tool_settings.image_paint
    paint.mode, paint.canvas = "IMAGE", image
    paint.unified_paint_settings.color = (1, 1, 1)


class KM_OT_layer_remove(MakeupOperator, bpy.types.Operator):
    """Remove the active layer; its map stays in the file until it is saved without users"""

    bl_idname = "km_makeup.layer_remove"
    bl_label = "Remove Layer"
    needs_layer = True
    changes_layers = True

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        with one_update(obj):
            obj.km_makeup.layers.remove(obj.km_makeup.active)
            obj.km_makeup.active = max(0, min(obj.km_makeup.active, len(obj.km_makeup.layers) - 1))


class KM_OT_layer_move(MakeupOperator, bpy.types.Operator):
    """Move the active layer in the order of application"""

    bl_idname = "km_makeup.layer_move"
    bl_label = "Move Layer"
    needs_layer = True
    changes_layers = True
    direction: IntProperty(
        name="Direction", description="+1 towards the air, -1 towards the skin", default=1, min=-1, max=1
    )

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        target = obj.km_makeup.active + self.direction
        if 0 <= target < len(obj.km_makeup.layers):
            with one_update(obj):
                obj.km_makeup.layers.move(obj.km_makeup.active, target)
                obj.km_makeup.active = target


CLASSES = (KM_OT_layer_add, KM_OT_layer_remove, KM_OT_layer_move)
