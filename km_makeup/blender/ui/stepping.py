"""Operators whose work goes in steps: a timer in the window, with progress and Esc; at once in background."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import bpy

from ...errors import MakeupError
from ...steps import result_of
from .base import MakeupOperator


class SteppedOperator(MakeupOperator):
    """An operator that works through `steps`; its head is found again before each."""

    doing, status = "", ""
    """What is being done, for messages ("Bake") and for the status line ("Baking makeup")."""
    kept = "nothing was written"
    """What is true when it is stopped."""
    alone = False
    """Whether mouse and keys do nothing else until it ends."""
    now = ""
    """What the step that comes next does, in the status line; `steps` may set it."""
    _timer: Any = None
    _steps: Any = None
    _object = 0
    _undone = 0

    def steps(self, context: bpy.types.Context, obj: bpy.types.Object) -> Generator[tuple[int, int], None, Any]:
        """Yields (done, total) and returns what to report; raises MakeupError."""
        raise TypeError(f"{type(self).__name__} has no steps")

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        return str(result_of(self.steps(context, obj)))

    def start(self, context: bpy.types.Context) -> set[str]:
        """Begin in the window; to be returned from invoke or execute."""
        from ..update import times_undone

        self._steps = self.steps(context, context.object)
        self._object, self._undone = context.object.session_uid, times_undone()
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.progress_begin(0, 1)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC":
            return self._stop(context, "INFO", f"{self.doing} stopped; {self.kept}")
        if event.type != "TIMER":
            return {"RUNNING_MODAL" if self.alone else "PASS_THROUGH"}
        if problem := self._lost():
            return self._stop(context, "WARNING", problem)
        try:
            done, total = next(self._steps)
        except StopIteration as end:
            self._end(context)
            self.report({"INFO"}, str(end.value))
            return {"FINISHED"}
        except MakeupError as error:
            return self._stop(context, "ERROR", str(error))
        context.window_manager.progress_update(done / max(total, 1))
        text = f"{self.status}: {self.now + ', ' if self.now else ''}{100 * done // max(total, 1)} %, Esc stops"
        context.workspace.status_text_set(text)
        return {"RUNNING_MODAL"}

    def _lost(self) -> str:
        """Why the work cannot go on: its head was deleted, or an undo put other data in its place."""
        from ..update import times_undone

        if times_undone() != self._undone:
            return f"{self.doing} stopped, since the scene was undone or another file opened; {self.kept}"
        if not any(obj.session_uid == self._object for obj in bpy.data.objects):
            return f"{self.doing} stopped, since its head was deleted"
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
