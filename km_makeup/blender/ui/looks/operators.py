"""Loading and saving looks."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ..base import MakeupOperator


class KM_OT_load_look(MakeupOperator, bpy.types.Operator, ImportHelper):
    """Put a saved look on this head in place of its layers"""

    bl_idname = "km_makeup.load_look"
    bl_label = "Load Look"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ....makeup import Look
        from ... import looks

        look = Look.load(self.filepath)
        looks.apply_look(obj, look)
        return f"{look.name}: {len(look.layers)} layers"


class KM_OT_save_look(MakeupOperator, bpy.types.Operator, ExportHelper):
    """Save the layers as a look file, with their maps beside it"""

    bl_idname = "km_makeup.save_look"
    bl_label = "Save Look"
    bl_options = {"REGISTER"}
    needs_layer = True
    filename_ext = ".json"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import looks

        look = looks.save_look(obj, Path(self.filepath))
        return f"Saved {len(look.layers)} layers to {self.filepath}"


CLASSES = (KM_OT_load_look, KM_OT_save_look)
