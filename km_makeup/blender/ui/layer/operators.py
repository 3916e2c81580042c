"""What is done with the active layer's map: brushes, fill and clear, maps from files and dropped images."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import EnumProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ..base import MakeupOperator, active_layer

STROKES = [
    ("PAINT", "Paint", "Lay product on; the value of the brush's colour is the thickness", "BRUSH_DATA", 0),
    ("ERASE", "Erase", "Take product off", "X", 1),
    ("SOFTEN", "Soften", "Blend edges of what is painted", "MOD_SMOOTH", 2),
]
PICTURES = (".png", ".exr", ".jpg", ".jpeg", ".tif", ".tiff")


class KM_OT_paint(MakeupOperator, bpy.types.Operator):
    """Take the brush in hand and paint on the active layer's map"""

    bl_idname = "km_makeup.paint"
    bl_label = "Paint"
    needs_layer = True
    stroke: EnumProperty(name="Stroke", description="What a stroke does to the map", items=STROKES)

    @classmethod
    def description(cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return next(text for name, _, text, *_ in STROKES if name == properties.stroke)

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import painting

        painting.enter(context, obj)
        painting.take_brush(context, painting.Stroke[self.stroke])


class KM_OT_fill(MakeupOperator, bpy.types.Operator):
    """Give the whole map one value; the map as it was is kept beside it until the file is closed, so undo brings it back"""

    bl_idname = "km_makeup.fill"
    bl_label = "Fill Map"
    needs_layer = True
    changes_layers = True
    value: FloatProperty(
        name="Value", description="Painted value everywhere (0..1 of the full thickness)", default=1, min=0, max=1,
        subtype="FACTOR",
    )  # fmt: skip

    @classmethod
    def description(cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        done = "Take all product of this layer off" if properties.value == 0 else "Lay the product over the whole face"
        return f"{done}; undo brings the painted map back"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import images, painting

        layer = active_layer(obj)
        layer.map = images.filled_like(layer.map, f"{obj.name} {layer.name}", self.value)
        painting.follow_layer(obj, context.scene)


class KM_OT_load_map(MakeupOperator, bpy.types.Operator, ImportHelper):
    """Use an image file as the active layer's map: white is the full thickness, black bare skin"""

    bl_idname = "km_makeup.load_map"
    bl_label = "Load Map"
    needs_layer = True
    filter_glob: StringProperty(default=";".join(f"*{end}" for end in PICTURES), options={"HIDDEN"})

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import painting

        message = _give_map(active_layer(obj), self.filepath)
        painting.follow_layer(obj, context.scene)
        return message


def _give_map(layer: bpy.types.PropertyGroup, filepath: str) -> str:
    """Make an image file the map of a layer; where its shape lies in alpha alone, that channel is read."""
    from ... import images
    from ...update import paused

    image = _image(filepath, layer.channel)
    message = f"{Path(filepath).name} is the map of {layer.name}"
    if layer.channel == "R" and images.shape_is_in_alpha(image):
        with paused():
            layer.channel = "A"
        message += "; its shape lies in alpha, so Channel is A"
    layer.map = image
    return message


def _image(filepath: str, channel: str) -> bpy.types.Image:
    from ....bake.files import read_map
    from ... import images

    path = Path(bpy.path.abspath(filepath)).resolve()
    return images.load_map(str(path), channel, read_map(path, channel))


class KM_OT_drop_map(MakeupOperator, bpy.types.Operator):
    """Use an image that was dropped onto the viewport for makeup"""

    bl_idname = "km_makeup.drop_map"
    bl_label = "Use Image for Makeup"
    needs_setup = True
    changes_layers = True

    filepath: StringProperty(name="File", description="The image file", subtype="FILE_PATH", options={"SKIP_SAVE"})
    use: EnumProperty(
        name="Use As",
        description="What the image is for",
        items=[
            ("MAP", "Map of the Active Layer", "Takes the place of the map that the active layer has"),
            ("EXCLUSION", "Exclusion Mask", "White keeps all makeup away: brows, lashes, nostrils"),
        ],
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not context.object.km_makeup.layers:
            self.use = "EXCLUSION"
        title = f"Use {Path(self.filepath).name} for Makeup"
        return set(context.window_manager.invoke_props_dialog(self, title=title, confirm_text="Load"))

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.prop(self, "use", expand=True)

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ....errors import MakeupError
        from ... import painting

        layer = active_layer(obj)
        if self.use == "EXCLUSION":
            obj.km_makeup.exclusion = _image(self.filepath, "R")
            return f"{Path(self.filepath).name} keeps makeup away where it is white"
        if layer is None:
            raise MakeupError("There is no layer for this map; add one, then drop the image again.")
        message = _give_map(layer, self.filepath)
        painting.follow_layer(obj, context.scene)
        return message


class KM_FH_map(bpy.types.FileHandler):
    """Images dropped onto the 3D view"""

    bl_idname = "KM_FH_map"
    bl_label = "Makeup Map"
    bl_import_operator = KM_OT_drop_map.bl_idname
    bl_file_extensions = ";".join(PICTURES)

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        area, obj = context.area, context.object
        return (
            area is not None
            and area.type == "VIEW_3D"
            and obj is not None
            and obj.type == "MESH"
            and bool(obj.km_makeup.slots)
        )


CLASSES = (KM_OT_paint, KM_OT_fill, KM_OT_load_map, KM_OT_drop_map, KM_FH_map)
