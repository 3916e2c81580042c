"""Diffusion in the compositor."""

from __future__ import annotations

import bpy

from ....errors import MakeupError
from ..base import MakeupOperator


class KM_OT_diffuse(MakeupOperator, bpy.types.Operator):
    """Diffuse the skin's light in the compositor: sets this head to Screen Space and puts the group after the render"""

    bl_idname = "km_makeup.diffuse"
    bl_label = "Diffuse in Compositor"

    def act(self, context: bpy.types.Context, obj: bpy.types.Object) -> str:
        from ... import compositor

        if not obj.km_makeup.slots:
            raise MakeupError(f"{obj.name!r} has no makeup; press Set Up first.")
        compositor.insert(context.scene)
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
