"""The measurement that goes with a head: its own, kept on the object, or that of the sample head."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy

from ..accuracy.conditions import Conditions, brightness
from ..accuracy.kept import Kept, KeptRung, error_scale, keep, read_kept, shipped
from ..accuracy.ladder import Result
from ..errors import MakeupError
from .facts import facts_known, light_shares
from .measuring.scene import current_settings
from .occlusion import occlusion_of
from .views import view_of

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
    new = keep(results, made, pixels / 1e6, conditions_of(obj, scene))
    before, own = measurement_of(obj)
    ladders = {rung.ladder for rung in new.rungs}
    old = tuple(rung for rung in before.rungs if own and rung.ladder not in ladders)
    kept = replace(new, rungs=old + new.rungs)
    obj.km_makeup.measured = kept.as_json()
    return kept


def conditions_of(obj: bpy.types.Object, scene: bpy.types.Scene) -> Conditions:
    """What the error of a picture hangs on: the scene as it is, and the head as it was last planned."""
    facts = facts_known(obj, scene)
    return Conditions(
        light_shares(obj, scene), view_of(obj, scene).px_per_mm, *brightness(facts), occlusion_of(obj, scene)
    )


@dataclass(frozen=True)
class Expected:
    """What the settings in force are expected to be off by, from rungs that were measured.

    ``scale``: how many times the rungs' error it is under this scene's conditions; 1 where they were measured in them.
    """

    rung: KeptRung
    best: KeptRung
    own: bool
    scale: float = 1.0

    @property
    def mean(self) -> float:
        """Expected mean CIEDE2000 of the settings in force."""
        return self.rung.mean * self.scale


def expected(obj: bpy.types.Object, scene: bpy.types.Scene) -> list[Expected]:
    """For the picture and for the diffusion: the rung of the present settings, and the best of the same engine."""
    kept, own = measurement_of(obj)
    settings = current_settings(obj, scene)
    rungs = [rung for ladder in (PICTURE, DIFFUSION) if (rung := kept.with_setting(ladder, settings))]
    if not rungs:
        return []  # without a look at the scene's lamps: a panel asks whenever it is drawn
    scale = error_scale(kept, conditions_of(obj, scene))
    found = []
    for rung in rungs:
        traced = rung.name.startswith("Cycles")
        same = [r for r in kept.rungs if r.ladder == rung.ladder and r.name.startswith("Cycles") == traced]
        found.append(Expected(rung, min(same, key=lambda r: r.mean), own, 1.0 if traced else scale))
    return found


def sentence(one: Expected) -> str:
    """An expected error as a sentence."""
    what = {PICTURE: "Picture", DIFFUSION: "Diffusion"}[one.rung.ladder]
    text = f"{what}: ΔE {one.mean:.2f} from Cycles ({one.rung.name})"
    best = one.best.mean * one.scale
    if one.best.name != one.rung.name and best < one.mean - 0.005:
        text += f"; best {best:.2f} with {one.best.name}, {one.best.seconds / one.rung.seconds:.2f} times the frame"
    return text
