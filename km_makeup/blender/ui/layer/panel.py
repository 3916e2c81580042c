"""The active layer."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, active_layer, in_two_places
from ..products import picker
from ..set_up.panel import KM_PT_makeup
from .operators import KM_OT_load_map


class KM_PT_layer(MakeupPanel):
    """The active layer"""

    bl_label = "Layer"
    parent = KM_PT_makeup

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and bool(context.object.km_makeup.layers)

    def draw(self, context: bpy.types.Context) -> None:
        layer = active_layer(context.object)
        layout = self.layout
        layout.use_property_split = True
        picker.draw(layout, layer)
        layout.prop(layer, "thickness_um", text="Film (µm)")
        layout.prop(layer, "strength")
        layout.template_ID(layer, "map", new="image.new", open="image.open")
        layout.operator(KM_OT_load_map.bl_idname, icon="IMAGE_DATA")
        layout.prop(layer, "channel")
        layout.prop(layer, "switch")


CLASSES = in_two_places(KM_PT_layer)
