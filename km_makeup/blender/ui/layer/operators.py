"""What is done with the active layer's map."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ImportHelper

from ..base import MakeupOperator


class KM_OT_load_map(MakeupOperator, bpy.types.Operator, ImportHelper):
    """Use an image file as the active layer's cosmetic map"""

    bl_idname = "km_makeup.load_map"
    bl_label = "Load Map"
    needs_layer = True
    filter_glob: StringProperty(default="*.png;*.exr;*.jpg;*.jpeg;*.tif;*.tiff", options={"HIDDEN"})

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ....bake.files import read_map
        from ... import images

        layer = obj.km_makeup.layers[obj.km_makeup.active]
        path = Path(bpy.path.abspath(self.filepath)).resolve()
        layer.map = images.load_map(str(path), layer.channel, read_map(path, layer.channel))


CLASSES = (KM_OT_load_map,)
