"""What is simulated on an object."""

from __future__ import annotations

from bpy.props import EnumProperty

from ...update import setting_changed
from ..layer.properties import SWITCHES

SCATTERING = [
    ("CLOSURES", "Subsurface", "The renderer's own subsurface scattering"),
    ("SCREEN", "Screen Space", "EEVEE: the compositor diffuses it, as wide as in skin (press Diffuse in Compositor)"),
]


class EffectsProperties:
    """Properties of Object.km_makeup."""

    scattering: EnumProperty(
        name="Skin Light", description="How light that enters the skin spreads, in EEVEE",
        items=SCATTERING, update=setting_changed,
    )  # fmt: skip
    finish: EnumProperty(
        name="Highlight",
        description="Whether the plan decides that films change the highlight",
        items=SWITCHES,
        update=setting_changed,
    )
