"""Light, engine, bake."""

from __future__ import annotations

import bpy

from ..base import MakeupPanel, in_two_places, settings
from .operators import KM_OT_bake


def _own_size(makeup: bpy.types.PropertyGroup) -> str:
    """What a resolution of 0 comes to."""
    sizes = [layer.map.size for layer in makeup.layers if layer.map is not None]
    width, height = max(sizes, key=lambda size: size[0] * size[1], default=(0, 0))
    return f"As the largest map: {width} x {height}" if width else "As the largest map"


class KM_PT_bake(MakeupPanel):
    """Light, engine, bake"""

    bl_label = "Colour & Bake"
    needs_setup = True

    def draw(self, context: bpy.types.Context) -> None:
        makeup = context.object.km_makeup
        layout, column = self.layout, settings(self.layout)
        column.prop(makeup, "path")
        column.prop(makeup, "light")
        if makeup.light == "OWN":
            column.prop(makeup, "light_file")
        column.prop(makeup, "both_engines")
        column.prop(makeup, "folder")
        column.prop(makeup, "resolution")
        if not makeup.resolution:
            column.label(text=_own_size(makeup))
        column.prop(makeup, "full_float")
        column.prop(makeup, "finished")
        layout.operator(KM_OT_bake.bl_idname, icon="RENDER_STILL")
        layout.prop(makeup, "follows")


CLASSES = in_two_places(KM_PT_bake)
