"""Diffusion in the compositor."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatVectorProperty, IntProperty

from ....errors import MakeupError
from ..base import MakeupOperator


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

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import compositor

        if not obj.km_makeup.slots:
            raise MakeupError(f"{obj.name!r} has no makeup; press Set Up first.")
        heads = sorted({*compositor.heads_of(context.scene), obj}, key=lambda head: head.name)
        kind = compositor.Profile[self.profile]
        profile = compositor.chosen_profile(kind, heads, context.scene, self.distances, self.gaussians)
        compositor.insert(context.scene, profile, self.steps)
        obj.km_makeup.scattering = "SCREEN"
        return "The compositor diffuses the light of the skin"


class KM_OT_undiffuse(MakeupOperator, bpy.types.Operator):
    """Take the diffusion out of the compositor again and use the renderer's own subsurface scattering"""

    bl_idname = "km_makeup.undiffuse"
    bl_label = "Remove from Compositor"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> None:
        from ... import compositor

        compositor.remove(context.scene)
        obj.km_makeup.scattering = "CLOSURES"


CLASSES = (KM_OT_diffuse, KM_OT_undiffuse)
