"""Loading and saving looks."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ....errors import MakeupError
from ..base import MakeupOperator, paragraph

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


class KM_OT_load_look(MakeupOperator, bpy.types.Operator, ImportHelper):
    """Put a saved look on this head in place of its layers; their maps are kept in the file. Esc stops a transfer"""

    bl_idname = "km_makeup.load_look"
    bl_label = "Load Look"
    filename_ext = ".json"
    filepath: StringProperty(name="File", description="The look file", subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})
    maps: EnumProperty(name="Maps", description="What becomes of the look's maps on this head", items=MAPS)
    _timer: Any = None
    _steps: Generator[tuple[str, float], None, Any] | None = None
    _object = 0
    _undone = 0

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Any:
        if self.filepath:  # dropped onto the 3D view
            return context.window_manager.invoke_props_dialog(
                self, width=360, title=f"Load Look on {context.object.name}"
            )
        return super().invoke(context, event)

    def draw(self, context: bpy.types.Context) -> None:
        from ...looks import METHODS, choose

        layout, obj = self.layout, context.object
        look = _look(self.filepath)
        if isinstance(look, str):
            paragraph(layout, look, "INFO")
            return
        column = layout.column(align=True)
        column.label(text=look.name, icon="FILE_TEXT")
        for layer in look.layers[::-1]:
            column.label(text=f"{layer.name or layer.product}, {layer.thickness_um:.3g} µm", icon="BLANK1")
        layout.prop(self, "maps")
        if self.maps == "AUTO" and obj is not None and obj.type == "MESH":
            try:
                choice = choose(obj, look)
            except MakeupError as error:
                paragraph(layout, str(error), "ERROR")
            else:
                paragraph(layout, f"{METHODS[choice.method][0]}: {choice.reason}.", "INFO")

    def _start(self, obj: bpy.types.Object) -> Generator[tuple[str, float], None, Any]:
        from ....makeup import Look
        from ... import looks

        method = None if self.maps == "AUTO" else looks.Method[self.maps]
        return looks.applying(obj, Look.load(bpy.path.abspath(self.filepath)), method)

    def execute(self, context: bpy.types.Context) -> set[str]:
        if bpy.app.background or not self._is_slow(context, _look(self.filepath)):
            return super().execute(context)
        from ...update import times_undone

        self._steps = self._start(context.object)
        self._object, self._undone = context.object.session_uid, times_undone()
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.progress_begin(0, 1)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

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

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        steps = self._start(obj)
        while True:
            try:
                next(steps)
            except StopIteration as end:
                return self._said(obj, end.value)

    def _said(self, obj: bpy.types.Object, choice: Any) -> str:
        from ...looks import METHODS

        name, count = obj.km_makeup.get("look", ""), len(obj.km_makeup.layers)
        return f"{name}: {count} layers. {METHODS[choice.method][0]}, {choice.reason}"

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC":
            return self._stop(context, "INFO", "Look not loaded; the head is as before")
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        obj = next((one for one in bpy.data.objects if one.session_uid == self._object), None)
        from ...update import times_undone

        if obj is None or times_undone() != self._undone:
            return self._stop(context, "WARNING", "Look not loaded, since the scene was undone or its head deleted")
        try:
            what, share = next(self._steps)  # type: ignore[arg-type]
        except StopIteration as end:
            self._end(context)
            self.report({"INFO"}, self._said(obj, end.value))
            return {"FINISHED"}
        except MakeupError as error:
            return self._stop(context, "ERROR", str(error))
        context.window_manager.progress_update(share)
        context.workspace.status_text_set(f"Loading look: {what}, Esc stops")
        return {"RUNNING_MODAL"}

    def _stop(self, context: bpy.types.Context, kind: str, message: str) -> set[str]:
        self._end(context)
        self.report({kind}, message)
        return {"CANCELLED"}

    def _end(self, context: bpy.types.Context) -> None:
        self._steps = None
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


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

        look = looks.save_look(obj, Path(bpy.path.abspath(self.filepath)), self.with_head)
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
