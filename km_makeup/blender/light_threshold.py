"""EEVEE's Light Threshold: it fades lamps out long before they stop giving light.

EEVEE gives each lamp a reach, the distance where its power over the squared distance falls to the threshold, and fades it out
towards there by ``(1 - (distance / reach)^4)^2``. At Blender's default of 0.01 a fill lamp of 3.4 W loses a quarter of its light on
a head one metre away (`python -m tests.highlights.weak_lamps`). 0 does not turn this off: it darkens lamps, or loses them.
"""

from __future__ import annotations

import bpy

HARMLESS = 2e-3
"""The highest threshold that leaves lamps about a metre from a face nearly all of their light; Blender keeps it as a 32-bit number."""

WHOLE = 1e-4
"""A threshold at which lamps give all of their light."""


def fades(scene: bpy.types.Scene) -> bool:
    """Whether EEVEE fades lamps of this scene, or turns them off."""
    return any(obj.type == "LIGHT" and obj.data.type != "SUN" for obj in scene.objects) and not (
        0 < scene.eevee.light_threshold <= HARMLESS * (1 + 1e-6)
    )


def give_all_light(scene: bpy.types.Scene) -> bool:
    """Let EEVEE's lamps give all of their light; whether anything had to be changed."""
    faded = fades(scene)
    if faded:
        scene.eevee.light_threshold = WHOLE
    return faded


__all__ = ["HARMLESS", "WHOLE", "fades", "give_all_light"]
