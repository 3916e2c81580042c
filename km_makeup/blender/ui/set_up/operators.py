"""Setting a head up, rebuilding its makeup, taking it off."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty

from ....errors import MakeupError
from ...adding import add_layer, skin_material
from ...light_threshold import WHOLE, give_all_light
from ..base import MakeupOperator
from ..products import picker


class KM_OT_set_up(MakeupOperator, bpy.types.Operator):
    """Make this head ready and start painting: finds the skin materials and the UV map, adds a first layer with an empty
    map, and enters Texture Paint with a brush that fits. One undo takes all of it back"""

    bl_idname = "km_makeup.set_up"
    bl_label = "Set Up Makeup"

    product: EnumProperty(name="Product", description="The product of the first layer", items=picker.all_items)
    paint: BoolProperty(
        name="Start Painting", description="Add the first layer and enter Texture Paint on its map", default=True
    )
    shading: BoolProperty(
        name="Material Preview",
        description="Show the viewport in Material Preview if it shows no materials",
        default=True,
    )

    all_light: BoolProperty(
        name="All of the Lamps' Light",
        description="Lower EEVEE's Light Threshold to 0.0001 where it is so high (0.01 unless changed) that EEVEE fades weak lamps on "
        "the skin, by a fifth and more. The scene's setting stays lowered when the makeup is removed",
        default=True,
    )

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        problem = super().hindrance(context)
        if not problem and context.object.mode not in {"OBJECT", "TEXTURE_PAINT"}:
            problem = "Leave this mode first: makeup is set up in Object Mode or Texture Paint"
        return problem

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        from ... import painting

        if not self.properties.is_property_set("product"):
            self.product = painting.FIRST_PRODUCT  # so that the panel of the last operator shows it
        return self.execute(context)

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import makeup, painting, udim
        from ...update import told

        first = self.product if self.properties.is_property_set("product") else painting.FIRST_PRODUCT
        bare = not any(slot.material for slot in obj.material_slots) and obj.data.uv_layers and not obj.library
        made = skin_material(obj).name if bare else ""
        try:
            makeup.set_up(obj)
        except MakeupError:
            if made:
                bpy.data.materials.remove(bpy.data.materials[made])
            raise
        names = ", ".join(entry.original.name for entry in obj.km_makeup.slots)
        message = f"Makeup lies on {names}, painted on {obj.km_makeup.uv_map!r}"
        layout = udim.layout_of(obj.data, obj.km_makeup.uv_map)
        if layout is not None and len(layout.tiles) > 1:
            message += f", where the UDIM tiles {', '.join(map(str, layout.tiles))} share a map (Skin > Tiles chooses)"
        if made:
            message += f"; the head had no material, so it was given {made!r}"
        if self.all_light and give_all_light(context.scene):
            message += f"; EEVEE faded weak lamps: its Light Threshold is {WHOLE:g} now"
        if self.paint and not obj.km_makeup.layers:
            add_layer(context, obj, first)
        elif obj.km_makeup.layers:
            told(obj, lambda one: makeup.refresh(one, context.scene, anew=True))
            painting.follow_layer(obj, context.scene)
        if self.paint:
            painting.bring_into_view(context, obj)
            painting.enter(context, obj)
            painting.take_brush(context, painting.Stroke.PAINT)
            painting.fit_brush(context)
            if self.shading:
                painting.show_materials(context)
        return message


class KM_OT_slot_toggle(MakeupOperator, bpy.types.Operator):
    """Put makeup on this material slot, or leave it out. Of a UDIM skin the paint on tiles that only this slot has stays in the
    old map"""

    bl_idname = "km_makeup.slot_toggle"
    bl_label = "Makeup on Slot"
    needs_setup = True

    index: IntProperty(name="Slot", description="Index of the material slot, counted from 0", min=0)

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import makeup, painting

        chosen = [entry.index for entry in obj.km_makeup.slots]
        wanted = [i for i in chosen if i != self.index] if self.index in chosen else sorted([*chosen, self.index])
        if not wanted:
            raise MakeupError("Makeup needs at least one skin material; to take it off the head press Remove Makeup.")
        makeup.set_up(obj, wanted, obj.km_makeup.uv_map)
        if obj.km_makeup.layers:
            makeup.refresh(obj, context.scene)
        painting.follow_layer(obj, context.scene)


class KM_OT_remove(MakeupOperator, bpy.types.Operator):
    """Take the makeup off; the original materials are back as they were. Layers are forgotten, map images stay in the file"""

    bl_idname = "km_makeup.remove"
    bl_label = "Remove Makeup"
    needs_setup = True

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import images, makeup

        for entry in obj.km_makeup.slots:
            held = obj.material_slots[entry.index].material if entry.index < len(obj.material_slots) else None
            if entry.original is None and held is not None and held == entry.made:
                raise MakeupError(
                    f"The skin material of slot {entry.index + 1} was deleted, so there is nothing to put back; undo that, "
                    "or put the skin's material into the slot, then press Remove Makeup again. Nothing was changed."
                )
        images.keep(layer.map for layer in obj.km_makeup.layers)
        images.keep([obj.km_makeup.exclusion])
        makeup.remove(obj)


class KM_OT_refresh(MakeupOperator, bpy.types.Operator):
    """Read maps and skin textures again and rebuild all nodes, after something was deleted, renamed or changed by hand"""

    bl_idname = "km_makeup.refresh"
    bl_label = "Refresh"
    needs_setup = True

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import images, makeup, skin
        from ...update import told

        images.forget_statistics()
        skin.forget_samples()
        plans: list = []
        told(obj, lambda one: plans.append(makeup.refresh(one, context.scene, anew=True)))
        if not plans:
            raise MakeupError(obj.km_makeup["problem"])
        return "; ".join(f"{e.name}: {'on' if e.on else 'off'}, {e.reason}" for e in plans[0].films) or "No layers"


class KM_OT_keep_maps(MakeupOperator, bpy.types.Operator):
    """Pack all painted maps into the .blend, so that no stroke can be lost; files on disk stay as they are"""

    bl_idname = "km_makeup.keep_maps"
    bl_label = "Pack Painted Maps"

    @classmethod
    def hindrance(cls, context: bpy.types.Context) -> str:
        from ...images import unsaved_maps

        return super().hindrance(context) or ("" if unsaved_maps() else "All maps are kept in the file already")

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ...images import pack, unsaved_maps

        packed = unsaved_maps()
        for image in packed:
            pack(image)
        return f"Packed {len(packed)} maps; save the .blend to keep them"


class KM_OT_shading(bpy.types.Operator):
    """Show this viewport with materials, so that makeup is seen"""

    bl_idname = "km_makeup.shading"
    bl_label = "Viewport Shading"
    bl_options = {"INTERNAL"}

    kind: EnumProperty(
        name="Shading",
        description="How the viewport is drawn",
        items=[
            ("MATERIAL", "Material Preview", "EEVEE with Blender's own studio light"),
            ("RENDERED", "Rendered", "The scene's engine with the scene's lights"),
        ],
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.space_data is None or context.space_data.type != "VIEW_3D":
            cls.poll_message_set("Move the mouse over a 3D viewport first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.space_data.shading.type = self.kind
        return {"FINISHED"}


CLASSES = (
    KM_OT_set_up,
    KM_OT_slot_toggle,
    KM_OT_remove,
    KM_OT_refresh,
    KM_OT_keep_maps,
    KM_OT_shading,
)
