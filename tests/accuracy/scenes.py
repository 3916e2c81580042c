"""How far the planned EEVEE picture of a drawn scene is from Cycles, and under which conditions the head is seen."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import NamedTuple

from km_makeup.accuracy.conditions import Conditions
from tests.effects.cases import Case, Stage

SAMPLES, FAR_SAMPLES = 128, 512
"""Of the path-traced reference, and of one in which the head is small, whose grain is coarser against its error and which is soon
traced; it is taken twice with half of them, so that its grain is known."""

FAR = 0.2
"""Pixels per mm below which a head is small."""

FRAME_SAMPLES = 16


class Seen(NamedTuple):
    """A scene's expected and measured mean CIEDE2000 on the head; the measured one freed of the reference's grain (in squares)."""

    expected: float
    measured: float
    with_grain: float
    grain: float
    conditions: Conditions

    def as_row(self) -> dict:
        """For a line of JSON."""
        return self._asdict() | {"conditions": asdict(self.conditions)}


def seen(stage: Stage, case: Case) -> Seen:
    """Build a case with its makeup as planned at .5, and measure it."""
    import bpy

    from km_makeup.blender.light_threshold import give_all_light
    from km_makeup.blender.measured import conditions_of, expected
    from km_makeup.blender.measuring.stage import Stage as Measuring
    from km_makeup.blender.measuring.stage import State

    scene, obj = bpy.context.scene, stage.obj
    stage.set(case)
    give_all_light(scene)  # as Set Up does
    stage.dress(case)
    stage.build(case, 0.5)
    said = {one.rung.ladder: one.mean for one in expected(obj, scene)}
    where = conditions_of(obj, scene)
    samples = FAR_SAMPLES if where.px_per_mm < FAR else SAMPLES
    measuring = Measuring(scene, obj, samples, FRAME_SAMPLES)
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
    return Seen(said.get("picture", math.nan), free, found.mean, grain.mean, where)
