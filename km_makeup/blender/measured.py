"""The measurement that goes with a head: its own, kept on the object, or that of the sample head."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ..accuracy.kept import Kept, KeptRung, keep, read_kept, shipped
from ..accuracy.ladder import Result
from ..errors import MakeupError
from .measuring.scene import current_settings

PICTURE, DIFFUSION = "picture", "diffusion"
BARE = "EEVEE, no makeup"


def measurement_of(obj: bpy.types.Object) -> tuple[Kept, bool]:
    """The measurement, and whether it is of this head in this scene."""
    text: str = obj.km_makeup.measured
    if text:
        try:
            return read_kept(text, f"What {obj.name!r} keeps"), True
        except MakeupError:
            return shipped(), False
    return shipped(), False


def remember(obj: bpy.types.Object, scene: bpy.types.Scene, results: Sequence[Result], made: dict[str, str]) -> Kept:
    """Keep a measurement on the object; rungs of ladders not measured now stay."""
    size = scene.render.resolution_percentage / 100
    pixels = scene.render.resolution_x * scene.render.resolution_y * size * size
    new = keep(results, made, pixels / 1e6)
    before, own = measurement_of(obj)
    ladders = {rung.ladder for rung in new.rungs}
    old = tuple(rung for rung in before.rungs if own and rung.ladder not in ladders)
    kept = Kept(old + new.rungs, new.machine, new.date, new.megapixels)
    obj.km_makeup.measured = kept.as_json()
    return kept


@dataclass(frozen=True)
class Expected:
    """What the settings in force are expected to be off by, from rungs that were measured."""

    rung: KeptRung
    best: KeptRung
    own: bool


def expected(obj: bpy.types.Object, scene: bpy.types.Scene) -> list[Expected]:
    """For the picture and for the diffusion: the rung of the present settings, and the best of the same engine."""
    kept, own = measurement_of(obj)
    settings = current_settings(obj, scene)
    found = []
    for ladder in (PICTURE, DIFFUSION):
        rung = kept.with_setting(ladder, settings)
        if rung is None:
            continue
        same = [
            r
            for r in kept.rungs
            if r.ladder == ladder and r.name.startswith("Cycles") == rung.name.startswith("Cycles")
        ]
        found.append(Expected(rung, min(same, key=lambda r: r.mean), own))
    return found


def sentence(one: Expected) -> str:
    """An expected error as a sentence."""
    what = {PICTURE: "Picture", DIFFUSION: "Diffusion"}[one.rung.ladder]
    text = f"{what}: ΔE {one.rung.mean:.2f} from Cycles ({one.rung.name})"
    if one.best.name != one.rung.name and one.best.mean < one.rung.mean - 0.005:
        text += f"; best {one.best.mean:.2f} with {one.best.name}, {one.best.seconds / one.rung.seconds:.2f} times the frame"
    return text
