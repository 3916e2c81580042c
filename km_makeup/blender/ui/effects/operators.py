"""Diffusion in the compositor."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatVectorProperty, IntProperty, StringProperty

from ....errors import MakeupError
from ..base import MakeupOperator
from .properties import OVERRIDES


class KM_OT_diffuse(MakeupOperator, bpy.types.Operator):
    """Diffuse the skin's light in the compositor: sets this head to Screen Space and puts the group after the render"""

    bl_idname = "km_makeup.diffuse"
    bl_label = "Diffuse in Compositor"
    profile: EnumProperty(
        name="Profile",
        description="How far light spreads in the skin",
        items=[
            ("OWN", "Material's Own", "From the subsurface radius, scale and method of the skin's material"),
            ("SKIN", "Measured Skin", "d'Eon and Luebke's fit to measured Caucasian skin"),
            ("LIGHTER", "Lighter Skin", "The lighter of two skins that Jensen et al. measured (2001)"),
            (
                "DARKER",
                "Darker Skin",
                "The darker of two skins that Jensen et al. measured (2001): more absorbs, less spreads",
            ),
            ("DISTANCES", "Scattering Distances", "Burley's profile of the distances below"),
        ],
    )
    distances: FloatVectorProperty(
        name="Distances (mm)",
        description="How far light spreads in red, green and blue, Burley's d in millimetres; for Scattering Distances",
        default=(0.66, 0.32, 0.23),
        size=3,
        min=0.001,
        soft_max=3.0,
        precision=3,
    )
    gaussians: IntProperty(
        name="Gaussians",
        description="Blurs that make up the profile; fewer are quicker and cruder",
        default=6,
        min=1,
        max=6,
    )
    steps: BoolProperty(
        name="Stop at Steps", default=True,
        description="No light crosses steps in depth: from nose to cheek, chin to neck, head to head",
    )  # fmt: skip
    split: BoolProperty(
        name="Blur Half the Colour", default=True,
        description="Half of the skin's colour is blurred with the light, as in skin; else none of it, as Cycles and EEVEE do",
    )  # fmt: skip

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import compositor
        from ...makeup import refresh

        if not obj.km_makeup.slots:
            raise MakeupError(f"{obj.name!r} has no makeup; press Set Up first.")
        problem = compositor.refusal(context.scene)
        if problem:
            raise MakeupError(problem)
        heads = sorted({*compositor.heads_of(context.scene), obj}, key=lambda head: head.name)
        kind = compositor.Profile[self.profile]
        compositor.chosen_profile(kind, heads, context.scene, self.distances, self.gaussians)
        compositor.ask(context.scene, kind, self.distances, self.gaussians, self.steps, self.split)
        obj.km_makeup.scattering = "SCREEN"
        plan = refresh(obj, context.scene)
        if not plan.screen_diffusion.on:
            return f"Nothing was put in: {plan.screen_diffusion.reason}"
        return "The compositor diffuses the light of the skin"


class KM_OT_undiffuse(MakeupOperator, bpy.types.Operator):
    """Take the diffusion out of the compositor again and use the renderer's own subsurface scattering"""

    bl_idname = "km_makeup.undiffuse"
    bl_label = "Remove from Compositor"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import compositor

        compositor.forget(context.scene)
        compositor.remove(context.scene)
        obj.km_makeup.scattering = "CLOSURES"


class KM_OT_effect(MakeupOperator, bpy.types.Operator):
    """Let the plan decide on this effect, or turn it on or off"""

    bl_idname = "km_makeup.effect"
    bl_label = "Effect"
    needs_setup = True
    key: StringProperty(name="Effect", description="Key of the effect, as `plan --json` lists it")
    switch: EnumProperty(name="Switch", description="Whether the plan decides on this effect", items=OVERRIDES)

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ....effects import line, title
        from ...makeup import plan_of, refresh

        makeup = obj.km_makeup
        effects = {effect.key: effect for effect in plan_of(obj, context.scene).effects}
        if self.key not in effects:
            raise MakeupError(
                f"There is no effect {self.key!r} here; `plan --json` lists the keys of those that there are."
            )
        if effects[self.key].said is None and not makeup.everything and self.switch != "AUTO":
            raise MakeupError(f"{title(effects[self.key])} has no switch here: {effects[self.key].reason}.")
        kind, _, number = self.key.partition(":")
        if kind == "film":
            makeup.layers[int(number)].switch = self.switch
        elif self.switch == "AUTO":
            if self.key in makeup.overrides:
                makeup.overrides.remove(makeup.overrides.find(self.key))
        else:
            one = makeup.overrides.get(self.key) or makeup.overrides.add()
            one.name, one.switch = self.key, self.switch
        return line(refresh(obj, context.scene).effect(self.key))


class KM_OT_plan(MakeupOperator, bpy.types.Operator):
    """Plan again, rebuild what changed, and say what did"""

    bl_idname = "km_makeup.plan"
    bl_label = "Plan Again"
    needs_setup = True

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ....effects import changed, summary
        from ... import images
        from ...makeup import planned, refresh

        images.forget_statistics()
        before = planned(obj)
        plan = refresh(obj, context.scene)
        return "; ".join(changed(before, plan)) or f"Nothing changed: {summary(plan)}"


CLASSES = (KM_OT_diffuse, KM_OT_undiffuse, KM_OT_effect, KM_OT_plan)
