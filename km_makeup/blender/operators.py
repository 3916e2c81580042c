"""Operators: what an artist does with makeup, each one undoable and each refusal in a sentence.

The floors below are imported when an operator runs, so that registering stays quick.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ..errors import MakeupError
from .update import one_update

MAP_SIZE = 2048


class _Makeup:
    """What all operators share: they need a mesh, and turn a MakeupError into a report."""

    bl_options = {"REGISTER", "UNDO"}
    needs_layer = False
    changes_layers = False
    """Whether the layers are changed before the makeup is rebuilt: then a refusal is a step that can be undone."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        obj = context.object
        if obj is None or obj.type != "MESH":
            cls.poll_message_set("Select the mesh of the head first")
            return False
        if cls.needs_layer and not obj.km_makeup.layers:
            cls.poll_message_set("Add a layer of makeup first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            message = self.act(context, context.object)
        except MakeupError as error:
            self.report({"ERROR"}, str(error))
            return {"FINISHED" if self.changes_layers else "CANCELLED"}
        if message:
            self.report({"INFO"}, message)
        return {"FINISHED"}

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str | None:
        """What the operator does; the text it returns is shown."""
        raise TypeError(f"{type(self).__name__} does not say what it does")


class KM_OT_set_up(_Makeup, bpy.types.Operator):
    """Make this head ready for makeup: chooses its skin materials and UV map"""

    bl_idname = "km_makeup.set_up"
    bl_label = "Set Up Makeup"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from . import makeup

        makeup.set_up(obj)
        if obj.km_makeup.layers:
            makeup.refresh(obj, context.scene)
        names = ", ".join(entry.original.name for entry in obj.km_makeup.slots)
        return f"Makeup lies on {names}, painted on {obj.km_makeup.uv_map!r}"


class KM_OT_remove(_Makeup, bpy.types.Operator):
    """Take the makeup off; the original materials are back as they were. Layers are forgotten, map images stay"""

    bl_idname = "km_makeup.remove"
    bl_label = "Remove Makeup"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from . import makeup

        makeup.remove(obj)


class KM_OT_refresh(_Makeup, bpy.types.Operator):
    """Read the maps again and rebuild what changed"""

    bl_idname = "km_makeup.refresh"
    bl_label = "Refresh"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from . import images, makeup

        images.forget_statistics()
        plan = makeup.refresh(obj, context.scene)
        return "; ".join(f"{e.name}: {'on' if e.on else 'off'}, {e.reason}" for e in plan.films) or "No layers"


class KM_OT_layer_add(_Makeup, bpy.types.Operator):
    """Add a layer of a product on top, with an empty map"""

    bl_idname = "km_makeup.layer_add"
    bl_label = "Add Layer"
    bl_property = "product"

    def _products(self, context: bpy.types.Context | None) -> list[tuple[str, str, str]]:
        from .library import library

        KM_OT_layer_add.items = [
            (p.id, p.name, f"{p.kind}, {p.form}, {p.provenance.status}") for p in library().products
        ]
        return KM_OT_layer_add.items

    items: list[tuple[str, str, str]] = []
    product: EnumProperty(name="Product", description="The product of the new layer", items=_products)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window_manager.invoke_search_popup(self)
        return {"RUNNING_MODAL"}

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from . import images, makeup
        from .library import library

        product = library().find(self.product)
        if not obj.km_makeup.slots:
            makeup.set_up(obj)
        sizes = [layer.map.size[:] for layer in obj.km_makeup.layers if layer.map]
        width, height = sizes[0] if sizes else (MAP_SIZE, MAP_SIZE)
        with one_update(obj):
            layer = obj.km_makeup.layers.add()
            layer.name, layer.product, layer.thickness_um = product.name, product.id, product.thickness_um
            layer.map = images.new_map(f"{obj.name} {product.name}", width, height)
            obj.km_makeup.active = len(obj.km_makeup.layers) - 1
        _canvas(context, layer.map)


def _canvas(context: bpy.types.Context, image: bpy.types.Image) -> None:
    """Make the map what Texture Paint paints on, in white."""
    paint = context.scene.tool_settings.image_paint
    paint.mode, paint.canvas = "IMAGE", image
    paint.unified_paint_settings.color = (1, 1, 1)


class KM_OT_layer_remove(_Makeup, bpy.types.Operator):
    """Remove the active layer; its map stays in the file until it is saved without users"""

    bl_idname = "km_makeup.layer_remove"
    bl_label = "Remove Layer"
    needs_layer = True
    changes_layers = True

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        with one_update(obj):
            obj.km_makeup.layers.remove(obj.km_makeup.active)
            obj.km_makeup.active = max(0, min(obj.km_makeup.active, len(obj.km_makeup.layers) - 1))


class KM_OT_layer_move(_Makeup, bpy.types.Operator):
    """Move the active layer in the order of application"""

    bl_idname = "km_makeup.layer_move"
    bl_label = "Move Layer"
    needs_layer = True
    changes_layers = True
    direction: IntProperty(
        name="Direction", description="+1 towards the air, -1 towards the skin", default=1, min=-1, max=1
    )

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        target = obj.km_makeup.active + self.direction
        if 0 <= target < len(obj.km_makeup.layers):
            with one_update(obj):
                obj.km_makeup.layers.move(obj.km_makeup.active, target)
                obj.km_makeup.active = target


class KM_OT_load_map(_Makeup, bpy.types.Operator, ImportHelper):
    """Use an image file as the active layer's cosmetic map"""

    bl_idname = "km_makeup.load_map"
    bl_label = "Load Map"
    needs_layer = True
    filter_glob: StringProperty(default="*.png;*.exr;*.jpg;*.jpeg;*.tif;*.tiff", options={"HIDDEN"})

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ..bake.files import read_map
        from . import images

        layer = obj.km_makeup.layers[obj.km_makeup.active]
        path = Path(bpy.path.abspath(self.filepath)).resolve()
        layer.map = images.load_map(str(path), layer.channel, read_map(path, layer.channel))


class KM_OT_load_look(_Makeup, bpy.types.Operator, ImportHelper):
    """Put a saved look on this head in place of its layers"""

    bl_idname = "km_makeup.load_look"
    bl_label = "Load Look"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ..makeup import Look
        from . import looks

        look = Look.load(self.filepath)
        looks.apply_look(obj, look)
        return f"{look.name}: {len(look.layers)} layers"


class KM_OT_save_look(_Makeup, bpy.types.Operator, ExportHelper):
    """Save the layers as a look file, with their maps beside it"""

    bl_idname = "km_makeup.save_look"
    bl_label = "Save Look"
    bl_options = {"REGISTER"}
    needs_layer = True
    filename_ext = ".json"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from . import looks

        look = looks.save_look(obj, Path(self.filepath))
        return f"Saved {len(look.layers)} layers to {self.filepath}"


class KM_OT_bake(_Makeup, bpy.types.Operator):
    """Compute the textures of the whole stack at 81 bands and use them; Esc stops and leaves the last ones"""

    bl_idname = "km_makeup.bake"
    bl_label = "Bake"
    needs_layer = True
    _timer: Any = None
    _steps: Any = None

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from . import baking

        report = baking.bake_all(obj, context.scene)
        return str(report) if report else "Nothing is painted, so nothing was baked"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if bpy.app.background:
            return self.execute(context)
        from . import baking

        self._steps = baking.bake_steps(context.object, context.scene)
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.progress_begin(0, 1)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC":
            self._end(context)
            self.report({"INFO"}, "Bake stopped; the last textures are still there")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            done, total = next(self._steps)
        except StopIteration as end:
            self._end(context)
            self.report({"INFO"}, str(end.value) if end.value else "Nothing is painted, so nothing was baked")
            return {"FINISHED"}
        except MakeupError as error:
            self._end(context)
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.window_manager.progress_update(done / max(total, 1))
        context.workspace.status_text_set(f"Baking makeup: {100 * done // max(total, 1)} %, Esc stops")
        return {"RUNNING_MODAL"}

    def _end(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


class KM_OT_diffuse(_Makeup, bpy.types.Operator):
    """Diffuse the skin's light in the compositor: sets this head to Screen Space and puts the group after the render"""

    bl_idname = "km_makeup.diffuse"
    bl_label = "Diffuse in Compositor"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from . import compositor

        if not obj.km_makeup.slots:
            raise MakeupError(f"{obj.name!r} has no makeup; press Set Up first.")
        compositor.insert(context.scene)
        obj.km_makeup.scattering = "SCREEN"
        return "The compositor diffuses the light of the skin"


class KM_OT_undiffuse(_Makeup, bpy.types.Operator):
    """Take the diffusion out of the compositor again and use the renderer's own subsurface scattering"""

    bl_idname = "km_makeup.undiffuse"
    bl_label = "Remove from Compositor"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from . import compositor

        compositor.remove(context.scene)
        obj.km_makeup.scattering = "CLOSURES"


CLASSES = (
    KM_OT_diffuse,
    KM_OT_undiffuse,
    KM_OT_set_up,
    KM_OT_remove,
    KM_OT_refresh,
    KM_OT_layer_add,
    KM_OT_layer_remove,
    KM_OT_layer_move,
    KM_OT_load_map,
    KM_OT_load_look,
    KM_OT_save_look,
    KM_OT_bake,
)
