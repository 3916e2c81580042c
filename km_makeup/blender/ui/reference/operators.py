"""The reference, render after render, with Blender's own progress and Esc."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ....errors import MakeupError
from ..base import MakeupOperator


class KM_OT_reference(MakeupOperator, bpy.types.Operator, ExportHelper):
    """Render the picture in EEVEE and path traced in Cycles, and write both with maps of their difference; Esc stops"""

    bl_idname = "km_makeup.reference"
    bl_label = "Compare with Cycles"
    bl_options = {"REGISTER"}
    filename_ext = ".png"
    filter_glob: StringProperty(default="*.png", options={"HIDDEN"})
    samples: IntProperty(
        name="Samples", description="Samples a pixel of the path traced picture", default=256, min=2, max=2**20
    )
    seed: IntProperty(name="Seed", description="Noise seed, a count from 0", default=0, min=0, max=2**30)

    _run: Any = None
    _timer: Any = None
    _state = ""

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import reference

        return str(reference.make_reference(context.scene, obj, Path(self.filepath), self.samples, self.seed))

    def execute(self, context: bpy.types.Context) -> set[str]:
        if bpy.app.background:
            return super().execute(context)
        from ... import reference

        try:
            self._run = reference.ReferenceRun(context.scene, context.object, self.samples, self.seed)
        except MakeupError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        bpy.app.handlers.render_complete.append(self._complete)
        bpy.app.handlers.render_cancel.append(self._cancel)
        self._timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._state = "next"
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC" and self._state != "rendering":
            self._state = "stopped"
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            return self._step(context)
        except (MakeupError, RuntimeError) as error:
            self._end(context)
            self.report({"ERROR"}, str(error).strip())
            return {"CANCELLED"}

    def _step(self, context: bpy.types.Context) -> set[str]:
        """What is to be done now that a render ended, or none has begun."""
        if self._state == "stopped":
            self._end(context)
            self.report({"INFO"}, "Stopped; the scene is as it was, nothing was written")
            return {"CANCELLED"}
        if self._state == "rendering" or bpy.app.is_job_running("RENDER"):
            return {"RUNNING_MODAL"}
        if self._state == "complete":
            self._run.collect()
        if self._run.prepare():
            number = self._run.count - self._run.left
            context.workspace.status_text_set(f"Compare with Cycles: {number} of {self._run.count}, Esc stops")
            self._state = "rendering"
            bpy.ops.render.render("INVOKE_DEFAULT")
            return {"RUNNING_MODAL"}
        self._end(context)
        self.report({"INFO"}, str(self._run.write(Path(self.filepath))))
        return {"FINISHED"}

    def _complete(self, *_: object) -> None:
        self._state = "complete"

    def _cancel(self, *_: object) -> None:
        self._state = "stopped"

    def _end(self, context: bpy.types.Context) -> None:
        self._run.restore()
        bpy.app.handlers.render_complete.remove(self._complete)
        bpy.app.handlers.render_cancel.remove(self._cancel)
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        problem = super().hindrance(context)
        if not problem and context.scene.render.engine == "CYCLES":
            return "The scene renders in Cycles, which is the reference; choose EEVEE"
        if not problem and context.scene.camera is None:
            return "Add a camera first"
        return problem


CLASSES = (KM_OT_reference,)
