"""Settings picked by how far off a picture may be, or by how long a frame may take, from what was measured."""

from __future__ import annotations

import bpy

from ..errors import MakeupError
from . import measured
from .update import paused


def by_tolerance(obj: bpy.types.Object, scene: bpy.types.Scene, tolerance: float) -> str:
    """Let the plan keep a tolerance (CIEDE2000 from everything on); what that means, in a sentence."""
    _plan(obj, scene, everything=False, tolerance=tolerance, use_budget=False)
    return f"The plan keeps within {tolerance:g} of everything on. {_expected(obj, scene)}".strip()


def by_time(obj: bpy.types.Object, scene: bpy.types.Scene, frame_ms: float) -> str:
    """Let the plan keep a frame within a time: what the bare head takes is measured, the rest is the makeup's budget.

    Raises MakeupError where the bare head alone takes longer, or was not measured.
    """
    kept, own = measured.measurement_of(obj)
    bare = kept.named(measured.PICTURE, measured.BARE)
    if not own or bare is None or not kept.megapixels:
        raise MakeupError("What a frame of this scene takes is not known; press Measure on This Scene first.")
    share = scene.render.resolution_percentage / 100
    pixels = scene.render.resolution_x * scene.render.resolution_y * share * share / 1e6
    alone = 1e3 * bare.seconds * pixels / kept.megapixels
    if frame_ms <= alone:
        raise MakeupError(
            f"The bare head alone takes about {alone:.0f} ms at this size; give more, render smaller, or with fewer samples."
        )
    _plan(obj, scene, everything=False, use_budget=True, budget_ms=frame_ms - alone)
    return f"About {alone:.0f} ms are the bare head's, {frame_ms - alone:.0f} ms the makeup's. {_expected(obj, scene)}".strip()


def _plan(obj: bpy.types.Object, scene: bpy.types.Scene, **values: object) -> None:
    from .makeup import refresh

    with paused():
        for name, value in values.items():
            setattr(obj.km_makeup, name, value)
    refresh(obj, scene)


def _expected(obj: bpy.types.Object, scene: bpy.types.Scene) -> str:
    return "; ".join(measured.sentence(one) for one in measured.expected(obj, scene))
