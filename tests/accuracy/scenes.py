"""How far the planned EEVEE picture of a drawn scene is from Cycles, and in what light and size the head is seen."""

from __future__ import annotations

import math
from typing import NamedTuple

from tests.effects.cases import Case, Stage

SAMPLES = 128
"""Of the path-traced reference; it is taken twice with half of them, so that its grain is known."""

FRAME_SAMPLES = 16


class Seen(NamedTuple):
    """A scene's expected and measured mean CIEDE2000 on the head; the measured one freed of the reference's grain (in squares)."""

    expected: float
    measured: float
    with_grain: float
    grain: float
    shares: dict[str, float]
    px_per_mm: float


def seen(stage: Stage, case: Case) -> Seen:
    """Build a case with its makeup as planned at .5, and measure it."""
    import bpy

    from km_makeup.blender import facts, views
    from km_makeup.blender.light_threshold import give_all_light
    from km_makeup.blender.measured import expected
    from km_makeup.blender.measuring.stage import Stage as Measuring
    from km_makeup.blender.measuring.stage import State

    scene, obj = bpy.context.scene, stage.obj
    stage.set(case)
    give_all_light(scene)  # as Set Up does
    stage.dress(case)
    stage.build(case, 0.5)
    said = {one.rung.ladder: one.mean for one in expected(obj, scene)}
    shares = facts.light_shares(obj, scene)
    scale = views.view_of(obj, scene).px_per_mm
    measuring = Measuring(scene, obj, SAMPLES, FRAME_SAMPLES)
    try:
        wears = measuring.wear("planned")
        for _ in measuring.make_reference(bounces=True):
            pass
        measuring.bring(State("BLENDER_EEVEE", FRAME_SAMPLES, wears))
        measuring.render()
        measuring.take()
        found = measuring.compare(bounces=True).error
        grain = measuring.noise(bounces=True)
    finally:
        measuring.close()
    free = math.sqrt(max(found.mean**2 - grain.mean**2, 0.0))
    return Seen(said.get("picture", math.nan), free, found.mean, grain.mean, shares, scale)
