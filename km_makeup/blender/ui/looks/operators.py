"""Loading and saving looks."""

from __future__ import annotations

import os
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ....errors import MakeupError
from ..base import CHARACTERS, MakeupOperator, paragraph
from ..stepping import SteppedOperator

if TYPE_CHECKING:
    from ....makeup import Look

MAPS = [
    (
        "AUTO",
        "Best for This Head",
        "Same UV layout: maps as they are; another one: transfer; no shape known: products only",
    ),
    ("AS_THEY_ARE", "As They Are", "Use the look's maps on this head's UV map without a change"),
    ("TRANSFER", "Transfer", "Bring the maps over the skin of both heads, by their landmarks"),
    ("PRODUCTS", "Products Only", "Take products, thicknesses and finishes; the maps start empty"),
]
WIDE = 56
"""Characters of a line in the dialog, which is 360 pixels wide."""

_read: dict[tuple[str, float], Any] = {}


def _look(filepath: str) -> Look | str:
    """The look of a file, or the sentence that says why there is none; read once while the file stays the same."""
    from ....makeup import Look

    path = Path(bpy.path.abspath(filepath))
    if not path.is_file():
        return "Choose a look file (.json)."
    key = (str(path), path.stat().st_mtime)
    if key not in _read:
        _read.clear()
        try:
            _read[key] = Look.load(path)
        except MakeupError as error:
            _read[key] = str(error)
    return _read[key]


class KM_OT_load_look(SteppedOperator, bpy.types.Operator, ImportHelper):
    """Put a saved look on this head in place of its layers; their maps are kept in the file. Esc stops a transfer"""

    bl_idname = "km_makeup.load_look"
    bl_label = "Load Look"
    doing, status, kept, alone = "Loading the look", "Loading look", "the head is as before", True
    filename_ext = ".json"
    filepath: StringProperty(name="File", description="The look file", subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})
    maps: EnumProperty(name="Maps", description="What becomes of the look's maps on this head", items=MAPS)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        if self.filepath:  # dropped onto the 3D view
            return context.window_manager.invoke_props_dialog(
                self, width=360, title=f"Load Look on {context.object.name}", confirm_text="Load Look"
            )
        return super().invoke(context, event)

    def draw(self, context: bpy.types.Context) -> None:
        from ...library import library
        from ...looks import METHODS, choose

        layout, obj = self.layout, context.object
        width = CHARACTERS if context.area is not None and context.area.type == "FILE_BROWSER" else WIDE
        look = _look(self.filepath)
        if isinstance(look, str):
            paragraph(layout, look, "INFO", width)
            return
        names = {product.id: product.name for product in look.with_carried(library()).products}
        column = layout.column(align=True)
        column.label(text=look.name, icon="FILE_TEXT")
        for layer in look.layers[::-1]:
            name = layer.name or names.get(layer.product, layer.product)
            column.label(text=f"{name}, {layer.thickness_um:.3g} µm", icon="BLANK1")
        layout.prop(self, "maps")
        if self.maps == "AUTO" and obj is not None and obj.type == "MESH":
            try:
                choice = choose(obj, look)
            except MakeupError as error:
                paragraph(layout, str(error), "ERROR", width)
            else:
                paragraph(layout, f"{METHODS[choice.method][0]}: {choice.reason}.", "INFO", width)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if bpy.app.background or not self._is_slow(context, _look(self.filepath)):
            return super().execute(context)
        return self.start(context)

    def _is_slow(self, context: bpy.types.Context, look: Look | str) -> bool:
        """Whether maps have to be transferred, which takes seconds."""
        from ...looks import Method, choose

        if isinstance(look, str):
            return False
        try:
            return self.maps == "TRANSFER" or (
                self.maps == "AUTO" and choose(context.object, look).method is Method.TRANSFER
            )
        except MakeupError:
            return False

    def steps(self, context: bpy.types.Context, obj: bpy.types.Object) -> Generator[tuple[int, int], None, str]:
        from ....makeup import Look
        from ... import looks, painting

        method = None if self.maps == "AUTO" else looks.Method[self.maps]
        applying = looks.applying(obj, Look.load(bpy.path.abspath(self.filepath)), method)
        while True:
            try:
                self.now, share = next(applying)
            except StopIteration as end:
                painting.follow_layer(obj, context.scene)  # or strokes would go to a map that no layer has any more
                name, count = obj.km_makeup.get("look", ""), len(obj.km_makeup.layers)
                return f"{name}: {count} layers. {looks.METHODS[end.value.method][0]}, {end.value.reason}"
            yield round(100 * share), 100


class KM_OT_save_look(MakeupOperator, bpy.types.Operator, ExportHelper):
    """Save the layers as a look file, with their maps and the head's shape beside it"""

    bl_idname = "km_makeup.save_look"
    bl_label = "Save Look"
    bl_options = {"REGISTER"}
    needs_layer = True
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})
    with_head: BoolProperty(
        name="For Other Heads",
        description="Keep this head's shape beside the look, so that its maps can be brought to heads with other UV layouts",
        default=True,
    )

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import looks

        path = bpy.path.abspath(self.filepath)
        if os.path.basename(path) in ("", self.filename_ext) or os.path.isdir(path):
            raise MakeupError("Save Look: the file has no name; type one, such as evening.json.")
        look = looks.save_look(obj, Path(path), self.with_head)
        carried = f"; {len(look.products)} products travel in it" if look.products else ""
        return f"Saved {len(look.layers)} layers to {self.filepath}{carried}"


class KM_FH_look(bpy.types.FileHandler):
    """A look file dropped onto the 3D view"""

    bl_idname = "KM_FH_look"
    bl_label = "Makeup Look"
    bl_import_operator = "km_makeup.load_look"
    bl_file_extensions = ".json"

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return context.area is not None and context.area.type == "VIEW_3D"


CLASSES = (KM_OT_load_look, KM_OT_save_look, KM_FH_look)
