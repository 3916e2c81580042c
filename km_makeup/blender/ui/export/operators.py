"""The export."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ....errors import MakeupError
from ..stepping import SteppedOperator

FORMATS = [
    ("PNG", "PNG, 8 bits", "Base colour in sRGB, the others as data; what other programs and glTF take"),
    ("EXR", "OpenEXR, 16 bits", "Base colour in linear Rec.709, without clipping of saturated colours"),
]
PLACES = [
    ("COPY", "Copy Beside It", "A copy of the object beside it wears the plain materials; the makeup stays as it is"),
    (
        "OBJECT",
        "This Object",
        "The object wears the plain materials in place of its makeup; undo brings the makeup back",
    ),
    ("FILES", "Files Only", "Write the files and leave the scene as it is"),
]


class KM_OT_export_look(SteppedOperator, bpy.types.Operator):
    """Flatten the makeup to textures of a plain Principled shader, and to a .glb, so that the look leaves Blender. Esc stops"""

    bl_idname = "km_makeup.export_look"
    bl_label = "Export Look"
    needs_setup = True
    needs_layer = True
    doing, status = "Export", "Exporting makeup"

    directory: StringProperty(
        name="Folder", description="Where the files go", subtype="DIR_PATH", options={"SKIP_SAVE"}
    )
    filter_folder: BoolProperty(
        name="Folders", description="Show folders in the file browser", default=True, options={"HIDDEN"}
    )
    file_format: EnumProperty(name="Textures", description="Format of the textures", items=FORMATS)
    gltf: BoolProperty(
        name="glTF (.glb)", description="Also write the object with these textures as a .glb", default=True
    )
    before: BoolProperty(name="Before, Too", description="Also write the bare skin in the same way, to compare")
    resolution: IntProperty(
        name="Resolution", description="Width and height of the textures, in texels; 0: of the largest map or skin texture",
        min=0, max=16384,
    )  # fmt: skip
    place: EnumProperty(name="In the Scene", description="Who wears the plain materials", items=PLACES)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.directory:
            self.directory = bpy.path.abspath("//makeup_export/") if bpy.data.filepath else ""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        if bpy.app.background or context.window is None:
            return super().execute(context)
        return self.start(context)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        for name in ("file_format", "gltf", "before", "resolution", "place"):
            row = layout.row()
            row.enabled = name != "gltf" or self.file_format == "PNG"
            row.prop(self, name)

    def steps(self, context: bpy.types.Context, obj: bpy.types.Object) -> Generator[tuple[int, int], None, Any]:
        from ...exporting import Export, export_steps

        if not self.directory:
            raise MakeupError("No folder is given for the export; choose one in the file browser.")
        exr = self.file_format == "EXR"
        folder = Path(bpy.path.abspath(self.directory))
        export = Export(folder, exr, self.gltf and not exr, self.before, self.resolution, self.place)
        return (yield from export_steps(obj, context.scene, export))


CLASSES = (KM_OT_export_look,)
