"""What is simulated on an object."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty

from ...update import setting_changed
from ..layer.properties import SWITCHES

SCATTERING = [
    ("CLOSURES", "Subsurface", "The renderer's own subsurface scattering"),
    ("SCREEN", "Screen Space", "EEVEE: the compositor diffuses it, as wide as in skin (press Diffuse in Compositor)"),
]
VIEWS = [
    ("VIEWS", "Any View", "Nothing is left out that a viewport could come near enough to show"),
    (
        "CAMERAS",
        "Cameras",
        "What the scene's cameras show over its frames; a closer look in the viewport may lack effects",
    ),
]
OVERRIDES = [
    ("AUTO", "Auto", "The plan decides by the tolerance"),
    ("ON", "On", "The effect is there whatever the plan finds"),
    ("OFF", "Off", "The effect is left out; its error does not count"),
]


class KM_PG_override(bpy.types.PropertyGroup):
    """What the user says of one effect; its name is the effect's key."""

    switch: EnumProperty(name="Switch", description="Whether the plan decides on this effect", items=OVERRIDES)


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
    tolerance: FloatProperty(
        name="Tolerance ΔE",
        description="Colour difference (CIEDE2000) that all effects left out may make together; 0.5 is not visible",
        min=0, soft_max=5, max=100, default=0.5, precision=2, update=setting_changed,
    )  # fmt: skip
    everything: BoolProperty(
        name="Everything",
        description="Build every effect without asking the plan: what planned pictures are compared with",
        update=setting_changed,
    )
    plan_for: EnumProperty(
        name="Plan for", description="Which views must look right while a window is open; renders in background go by the cameras",
        items=VIEWS, update=setting_changed,
    )  # fmt: skip
    use_budget: BoolProperty(
        name="Time Budget",
        description="Raise the tolerance until a frame's makeup takes no more than this time",
        update=setting_changed,
    )
    budget_ms: FloatProperty(
        name="Budget", description="Time a frame's makeup may take, in milliseconds (ms), as calibrated",
        min=0, soft_max=10000, default=1000, precision=0, update=setting_changed,
    )  # fmt: skip
    overrides: CollectionProperty(
        type=KM_PG_override, name="Overrides", description="Effects that the user turned on or off, by their keys"
    )
