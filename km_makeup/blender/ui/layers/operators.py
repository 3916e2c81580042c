"""Adding, removing, copying and ordering layers; the exclusion mask; before and after."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty

from ...adding import MAP_SIZE, add_layer
from ...update import one_update, paused, told
from ..base import MakeupOperator, active_index
from ..products import picker

COPIED = (
    "name", "product", "thickness_um", "strength", "enabled", "solo", "form", "own_finish", "roughness", "f0", "swatch",
    "map", "channel", "switch", "map_max", "coverage",
)  # fmt: skip
"""Properties of a layer that a copy of it has too."""


class KM_OT_layer_add(MakeupOperator, bpy.types.Operator):
    """Add a layer of a product on top, with an empty map to paint on"""

    bl_idname = "km_makeup.layer_add"
    bl_label = "Add Layer"
    bl_property = "product"

    product: EnumProperty(name="Product", description="The product of the new layer", items=picker.all_items)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window_manager.invoke_search_popup(self)
        return {"RUNNING_MODAL"}

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        add_layer(context, obj, self.product)


class KM_OT_layer_duplicate(MakeupOperator, bpy.types.Operator):
    """Copy the active layer with its map, above it"""

    bl_idname = "km_makeup.layer_duplicate"
    bl_label = "Duplicate Layer"
    needs_layer = True
    changes_layers = True

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import images, painting

        makeup, source = obj.km_makeup, active_index(obj)
        with one_update(obj), paused():
            fields = {field: getattr(makeup.layers[source], field) for field in COPIED}
            copy = makeup.layers.add()
            for field, value in fields.items():
                setattr(copy, field, value)
            copy.name = _free_name(fields["name"], [layer.name for layer in makeup.layers][:-1])
            if copy.map is not None:
                copy.map = images.copy_of(copy.map)
            makeup.layers.move(len(makeup.layers) - 1, source + 1)
            makeup.active = source + 1
        painting.follow_layer(obj, context.scene)


def _free_name(name: str, taken: list[str]) -> str:
    """The name with a number where another has it, as Blender numbers datablocks."""
    stem = name[:-4] if len(name) > 4 and name[-4] == "." and name[-3:].isdigit() else name
    number = 1
    while f"{stem}.{number:03}" in taken:
        number += 1
    return name if name not in taken else f"{stem}.{number:03}"


class KM_OT_layer_remove(MakeupOperator, bpy.types.Operator):
    """Remove the active layer; its map is kept in the file and can be chosen again under Map"""

    bl_idname = "km_makeup.layer_remove"
    bl_label = "Remove Layer"
    needs_layer = True
    changes_layers = True

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import images, painting

        index = active_index(obj)
        images.keep([obj.km_makeup.layers[index].map])
        with one_update(obj), paused():
            obj.km_makeup.layers.remove(index)
            obj.km_makeup.active = max(0, min(index, len(obj.km_makeup.layers) - 1))
        painting.follow_layer(obj, context.scene)


class KM_OT_layer_move(MakeupOperator, bpy.types.Operator):
    """Move the active layer in the order of application"""

    bl_idname = "km_makeup.layer_move"
    bl_label = "Move Layer"
    needs_layer = True
    changes_layers = True
    direction: IntProperty(
        name="Direction", description="+1 towards the air, -1 towards the skin", default=1, min=-1, max=1
    )

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        index = active_index(obj)
        target = index + self.direction
        if 0 <= target < len(obj.km_makeup.layers):
            with one_update(obj), paused():
                obj.km_makeup.layers.move(index, target)
                obj.km_makeup.active = target


class KM_OT_before_after(MakeupOperator, bpy.types.Operator):
    """Show the face without makeup (before) or with it (after)"""

    bl_idname = "km_makeup.before_after"
    bl_label = "Before / After"
    needs_setup = True
    side: EnumProperty(
        name="Side",
        description="Which of the two to show",
        items=[
            ("TOGGLE", "The Other", "The one that is not shown now"),
            ("BEFORE", "Before", "Show the bare skin; renders show it too"),
            ("AFTER", "After", "Show the face with its makeup"),
        ],
    )

    @classmethod
    def description(cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        if properties.side == "TOGGLE":
            return cls.__doc__ or ""
        return (
            "Show the bare skin; renders show it too"
            if properties.side == "BEFORE"
            else "Show the face with its makeup"
        )

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        shown = not obj.km_makeup.show if self.side == "TOGGLE" else self.side == "AFTER"
        if shown != obj.km_makeup.show:
            obj.km_makeup.show = shown


class KM_OT_exclusion_add(MakeupOperator, bpy.types.Operator):
    """Make an exclusion mask for this head and paint on it: where it is white no makeup lies (brows, lashes, nostrils)"""

    bl_idname = "km_makeup.exclusion_add"
    bl_label = "New Exclusion Mask"
    needs_setup = True
    changes_layers = True

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import images, makeup, painting

        sizes = [layer.map.size[:] for layer in obj.km_makeup.layers if layer.map]
        width, height = max(sizes) if sizes else (MAP_SIZE, MAP_SIZE)
        with paused():
            obj.km_makeup.exclusion = images.new_map(f"{obj.name} Exclusion", width, height)
            obj.km_makeup.paints_exclusion = True
        painting.follow_layer(obj, context.scene)
        told(obj, lambda one: makeup.refresh(one, context.scene))


CLASSES = (
    KM_OT_layer_add,
    KM_OT_layer_duplicate,
    KM_OT_layer_remove,
    KM_OT_layer_move,
    KM_OT_before_after,
    KM_OT_exclusion_add,
)
