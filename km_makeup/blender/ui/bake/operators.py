"""The bake."""

from __future__ import annotations

from typing import Any

import bpy

from ....errors import MakeupError
from ..base import MakeupOperator


class KM_OT_bake(MakeupOperator, bpy.types.Operator):
    """Compute the textures of the whole stack at 81 bands and use them; Esc stops and leaves the last ones"""

    bl_idname = "km_makeup.bake"
    bl_label = "Bake"
    needs_layer = True
    _timer: Any = None
    _steps: Any = None
    _object = 0
    _undone = 0

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import baking

        report = baking.bake_all(obj, context.scene)
        return str(report) if report else "Nothing is painted, so nothing was baked"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if bpy.app.background:
            return self.execute(context)
        from ... import baking
        from ...update import times_undone

        self._steps = baking.bake_steps(context.object, context.scene)
        self._object, self._undone = context.object.session_uid, times_undone()
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.progress_begin(0, 1)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC":
            return self._stop(context, "INFO", "Bake stopped; the last textures are still there")
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if problem := self._lost():
            return self._stop(context, "WARNING", problem)
        try:
            done, total = next(self._steps)
        except StopIteration as end:
            self._end(context)
            self.report({"INFO"}, str(end.value) if end.value else "Nothing is painted, so nothing was baked")
            return {"FINISHED"}
        except MakeupError as error:
            return self._stop(context, "ERROR", str(error))
        context.window_manager.progress_update(done / max(total, 1))
        context.workspace.status_text_set(f"Baking makeup: {100 * done // max(total, 1)} %, Esc stops")
        return {"RUNNING_MODAL"}

    def _lost(self) -> str:
        """Why the bake cannot go on: its head was deleted, or an undo put other data in its place."""
        from ...update import times_undone

        if times_undone() != self._undone:
            return "Bake stopped, since the scene was undone or another file opened; the last textures are still there"
        if not any(obj.session_uid == self._object for obj in bpy.data.objects):
            return "Bake stopped, since its head was deleted; nothing was written"
        return ""

    def _stop(self, context: bpy.types.Context, kind: str, message: str) -> set[str]:
        self._end(context)
        self.report({kind}, message)
        return {"CANCELLED"}

    def _end(self, context: bpy.types.Context) -> None:
        self._steps = None
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


CLASSES = (KM_OT_bake,)
