"""Settings picked by how far off a picture may be, or by how long a frame may take, from what was measured."""

from __future__ import annotations

import bpy

from ..accuracy.kept import KeptRung
from ..errors import MakeupError
from . import measured
from .update import paused

PATHS = {"path LIVE": "LIVE", "path BAKED": "BAKED"}


def by_tolerance(obj: bpy.types.Object, scene: bpy.types.Scene, tolerance: float) -> str:
    """The quickest colour path within a tolerance (CIEDE2000) of the best, and a plan that keeps it; what that means, in a sentence."""
    rungs = _paths(obj)
    best = min(rungs, key=lambda r: r.mean)
    chosen = min((r for r in rungs if r.mean <= best.mean + tolerance), key=lambda r: r.seconds)
    _set(obj, scene, chosen, everything=False, tolerance=tolerance, use_budget=False)
    return _said(obj, scene, chosen, f"Within {tolerance:g} of what EEVEE can do here.")


def by_time(obj: bpy.types.Object, scene: bpy.types.Scene, frame_ms: float) -> str:
    """The nearest colour path whose frame keeps a time, and a plan whose makeup does: the bare head's frame is measured.

    Raises MakeupError where the bare head alone takes longer, or was not measured.
    """
    kept, own = measured.measurement_of(obj)
    bare = kept.named(measured.PICTURE, measured.BARE)
    if not own or bare is None or not kept.megapixels:
        raise MakeupError("What a frame of this scene takes is not known; press Measure on This Scene first.")
    share = scene.render.resolution_percentage / 100
    scale = 1e3 * scene.render.resolution_x * scene.render.resolution_y * share * share / 1e6 / kept.megapixels
    alone = scale * bare.seconds
    if frame_ms <= alone:
        raise MakeupError(
            f"The bare head alone takes about {alone:.0f} ms at this size; give more, render smaller, or with fewer samples."
        )
    rungs = _paths(obj)
    quick = [r for r in rungs if scale * r.seconds <= frame_ms]
    chosen = min(quick, key=lambda r: r.mean) if quick else min(rungs, key=lambda r: r.seconds)
    _set(obj, scene, chosen, everything=False, use_budget=True, budget_ms=frame_ms - alone)
    said = f"About {alone:.0f} ms are the bare head's, {frame_ms - alone:.0f} ms are left for the makeup."
    return _said(obj, scene, chosen, said)


def _paths(obj: bpy.types.Object) -> list[KeptRung]:
    """The measured rungs of the colour paths; MakeupError where there is none."""
    kept, _ = measured.measurement_of(obj)
    rungs = [r for r in kept.rungs if r.ladder == measured.PICTURE and r.setting in PATHS]
    if not rungs:
        raise MakeupError("No picture of this scene was measured yet; press Measure on This Scene first.")
    return rungs


def _set(obj: bpy.types.Object, scene: bpy.types.Scene, chosen: KeptRung, **values: object) -> None:
    """Settings of the plan, and the path, where textures are there that can be shown."""
    from .makeup import refresh

    makeup = obj.km_makeup
    path = PATHS[chosen.setting]
    with paused():
        for name, value in values.items():
            setattr(makeup, name, value)
        if path == "LIVE" or makeup.baked_R is not None:
            makeup.path = path
    refresh(obj, scene)


def _said(obj: bpy.types.Object, scene: bpy.types.Scene, chosen: KeptRung, text: str) -> str:
    bake = " Press Bake: baked textures are the quicker way." if obj.km_makeup.path != PATHS[chosen.setting] else ""
    expected = "; ".join(measured.sentence(one) for one in measured.expected(obj, scene))
    return f"{text}{bake} {expected}".strip()
