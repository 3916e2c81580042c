"""Measuring this scene, and settings picked by what was measured."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ....errors import MakeupError
from ..base import MakeupOperator
from ..stepping import SteppedOperator


class KM_OT_measure(SteppedOperator, bpy.types.Operator):
    """Render this view in many ways and in Cycles, small, and keep what each is off by and how long it takes; Esc stops and keeps what was measured"""

    bl_idname = "km_makeup.measure"
    bl_label = "Measure on This Scene"
    needs_layer = True
    doing, status = "Measuring", "Measuring accuracy and time"
    kept = "what was measured until then is kept"
    longest: IntProperty(
        name="Size", description="Longer side of the pictures measured, in pixels", default=200, min=32, max=8192
    )
    samples: IntProperty(name="Samples", description="Samples of a frame, a count", default=16, min=1, max=4096)
    reference: IntProperty(
        name="Reference", description="Samples of the path traced reference, a count", default=256, min=2, max=1 << 20
    )
    thorough: BoolProperty(
        name="Thorough",
        description="Also diffusion, highlights and what each effect costs (which the plan then weighs), and seven timed runs instead of three",
    )
    folder: StringProperty(
        name="Folder", description="Where the page with plots and pictures is written; empty: only the panel shows it",
        subtype="DIR_PATH", default="//accuracy",
    )  # fmt: skip

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        problem = super().hindrance(context)
        if not problem and context.scene.camera is None:
            return "Add a camera first"
        return problem

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return self.execute(context) if bpy.app.background else self.start(context)

    def steps(self, context: bpy.types.Context, obj: bpy.types.Object) -> Generator[tuple[int, int], None, str]:
        from ....accuracy.ladder import Result, measure
        from ...measuring import measured_scene

        scene, results = context.scene, []
        names = ("picture", "diffusion", "gloss", "costs") if self.thorough else ("picture", "speed")
        with measured_scene(scene, obj, self.longest, self.reference, self.samples) as ladders:
            size = {x: getattr(scene.render, x) for x in ("resolution_x", "resolution_y", "resolution_percentage")}
            try:
                for number, name in enumerate(names):
                    ladder = ladders[name]()
                    results.append(Result(ladder))
                    for done, total, _ in measure(ladder, 7 if self.thorough else 3, results[-1]):
                        yield number * total + done, len(names) * total
            finally:
                for name, value in size.items():  # frames of the costs have sizes of their own
                    setattr(scene.render, name, value)
                message = self._keep(obj, scene, [one for one in results if one.rungs])
        return message

    def _keep(self, obj: bpy.types.Object, scene: bpy.types.Scene, results: list) -> str:
        """Keep what was measured on the object, and write the page."""
        from ....accuracy.calibrate import calibration, over
        from ....accuracy.page import page
        from ....accuracy.report import machine, write_report
        from ... import measured
        from ...calibration import calibration_file, calibration_here
        from ...measuring.scene import current_settings

        if not results:
            return "Nothing was measured"
        made = machine()
        measured.remember(obj, scene, results, made)
        file = calibration_file()
        if file is not None:  # the plan weighs costs by this machine's times from now on
            costs = calibration(results, f"{made['processor']}, {made['cores']} cores", made["date"])
            if costs is not None:
                over(costs, calibration_here()).write(file)
        if not self.folder or (self.folder.startswith("//") and not bpy.data.filepath):
            return "Measured; save the file first to get the page as well" if self.folder else "Measured"
        folder = Path(bpy.path.abspath(self.folder))
        files = write_report(results, folder, page(results, made, current_settings(obj, scene)), made)
        return f"Measured; the page is {next(f for f in files if f.suffix == '.html')}"


class KM_OT_pick(MakeupOperator, bpy.types.Operator):
    """Set the plan by how far off the picture may be, or by how long a frame may take, from what was measured"""

    bl_idname = "km_makeup.pick"
    bl_label = "Pick for Me"
    needs_layer = True
    by: EnumProperty(
        name="By", description="What is given",
        items=[("TOLERANCE", "Tolerance", "How far off the picture may be from everything on"), ("TIME", "Time", "How long a frame may take")],
    )  # fmt: skip
    tolerance: FloatProperty(
        name="Tolerance", description="CIEDE2000 from the picture with every effect on; 0.5 is not visible", default=0.5, min=0.0, max=100.0
    )  # fmt: skip
    frame_ms: FloatProperty(
        name="Frame", description="How long a frame may take, in milliseconds (ms)", default=1000.0, min=0.0, max=1e7, precision=0
    )  # fmt: skip

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        shown: set[str] = context.window_manager.invoke_props_dialog(self)
        return shown

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import picking

        if self.by == "TIME":
            return picking.by_time(obj, context.scene, self.frame_ms)
        return picking.by_tolerance(obj, context.scene, self.tolerance)


class KM_OT_open_page(MakeupOperator, bpy.types.Operator):
    """Open the page of the last measurement in the browser"""

    bl_idname = "km_makeup.open_page"
    bl_label = "Open Page"
    bl_options = {"REGISTER"}
    needs_setup = True
    folder: StringProperty(
        name="Folder", description="Where the page was written", subtype="DIR_PATH", default="//accuracy"
    )

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        file = Path(bpy.path.abspath(self.folder)) / "accuracy.html"
        if not file.is_file():
            raise MakeupError(f"There is no page {file} yet; press Measure on This Scene first.")
        bpy.ops.wm.path_open(filepath=str(file))


CLASSES = (KM_OT_measure, KM_OT_pick, KM_OT_open_page)
