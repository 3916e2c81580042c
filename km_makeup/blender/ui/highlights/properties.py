"""How highlights are made on an object."""

from __future__ import annotations

from bpy.props import BoolProperty, EnumProperty

from ...update import setting_changed

HIGHLIGHTS = [
    ("LOBES", "Glossy Lobes", "A lobe for each distinct finish, shaded by the renderer; EEVEE draws two"),
    (
        "LAMPS",
        "Lamp by Lamp",
        "The paper's: Kelemen and Szirmay-Kalos with Beckmann, for each lamp, in EEVEE; no reflections of the world",
    ),
]
RULES = [
    ("COVERAGE", "Coverage", "What lies below is seen where the film does not cover it"),
    ("PAPER", "The Paper's", "What lies below is dimmed by the transmittance of the film above, which is too bright"),
]
SHOWN = [
    ("ALL", "All", "Highlights of skin and films"),
    ("SKIN", "Skin", "The skin's own highlight only"),
    ("FILMS", "Films", "Highlights of films only"),
]


class HighlightsProperties:
    """Properties of Object.km_makeup."""

    highlight: EnumProperty(
        name="Model", description="How highlights are made", items=HIGHLIGHTS, update=setting_changed
    )
    highlight_rule: EnumProperty(
        name="Below a Film", description="What a film leaves of the highlights below it", items=RULES,
        update=setting_changed,
    )  # fmt: skip
    highlight_shown: EnumProperty(
        name="Show", description="Whose highlights are there", items=SHOWN, update=setting_changed
    )
    highlight_shadows: BoolProperty(
        name="Shadows", default=True, update=setting_changed,
        description="Lamp by lamp: shadow each highlight as the lamp's light is shadowed; off: quicker",
    )  # fmt: skip
