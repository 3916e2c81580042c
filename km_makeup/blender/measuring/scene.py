"""A head opened for measuring, and the ladders of its pictures."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import bpy

from ...accuracy.commands import SceneLadders, SceneRequest
from ...accuracy.ladder import Ladder
from ...errors import MakeupError
from ...makeup import Look
from .. import looks, studio
from ..reference import Restoring
from .costs import costs_ladder, speed_ladder
from .diffusion import CYCLES, diffusion_ladder
from .frame import frame_ladder
from .gloss import gloss_ladder
from .picture import picture_ladder
from .stage import Stage

log = logging.getLogger("km_makeup")

LADDERS: dict[str, Callable[[Stage], Ladder]] = {
    "diffusion": diffusion_ladder,
    "gloss": gloss_ladder,
    "picture": picture_ladder,
    "frame": frame_ladder,
    "costs": costs_ladder,
    "speed": speed_ladder,
}


def open_scene(request: SceneRequest) -> SceneLadders:
    """Open the head's file, put the look on, choose camera and size; the ladders of its pictures.

    Raises MakeupError where the file, the look or the camera cannot be had, or the head has no makeup.
    """
    from ..commands import ensure_registered

    ensure_registered()
    look = Look.load(request.look) if request.look else None
    head = studio.open_head(request.head, None, None)
    for line in head.said:
        log.info(line)
    obj, scene = head.object, bpy.context.scene
    if look is not None:
        looks.apply_look(obj, look)
    if request.view or scene.camera is None:
        scene.camera = studio.camera_for(obj, request.view or "front")
    settings = Restoring()
    settings.set(
        scene.render,
        engine="BLENDER_EEVEE",
        resolution_x=request.size[0],
        resolution_y=request.size[1],
        resolution_percentage=100,
    )
    stage = _stage(scene, obj, request.reference_samples, request.samples, request.timed)
    about = {
        "Blender": bpy.app.version_string,
        "size": f"{request.size[0]}x{request.size[1]}",
        "scene": f"{request.head.name}{f', {request.look.stem}' if request.look else ''}, camera {scene.camera.name}",
    }
    return SceneLadders(_ladders(stage), current_settings(obj, scene), about)


@contextmanager
def measured_scene(
    scene: bpy.types.Scene, obj: bpy.types.Object, longest: int, reference_samples: int, samples: int
) -> Iterator[dict[str, Callable[[], Ladder]]]:
    """The ladders of the open scene, with pictures whose longer side has so many pixels; afterwards it is as it was."""
    settings, render = Restoring(), scene.render
    share = 100 * longest / max(render.resolution_x, render.resolution_y)
    settings.set(render, engine="BLENDER_EEVEE", resolution_percentage=max(1, min(100, round(share))))
    try:
        stage = _stage(scene, obj, reference_samples, samples)
        try:
            yield _ladders(stage)
        finally:
            stage.close()
    finally:
        settings.restore()


def _stage(
    scene: bpy.types.Scene, obj: bpy.types.Object, reference_samples: int, samples: int, timed: int = 0
) -> Stage:
    """MakeupError where there is nothing to measure."""
    if not obj.km_makeup.slots or not obj.km_makeup.layers:
        raise MakeupError(f"{obj.name!r} has no makeup to measure; give --look, or a .blend that has some.")
    if scene.camera is None:
        raise MakeupError(f"The scene {scene.name!r} has no camera; add one.")
    return Stage(scene, obj, reference_samples, samples, timed)


def _ladders(stage: Stage) -> dict[str, Callable[[], Ladder]]:
    return {name: partial(build, stage) for name, build in LADDERS.items()}


def current_settings(obj: bpy.types.Object, scene: bpy.types.Scene) -> tuple[str, ...]:
    """Settings in force, as rungs name them."""
    makeup = obj.km_makeup
    if scene.render.engine == CYCLES:
        return ("cycles denoised" if scene.cycles.use_denoising else "cycles",)
    found = [f"path {makeup.path}", "lamp by lamp" if makeup.highlight == "LAMPS" else "lobes 2"]
    found.append("diffusion 6" if makeup.scattering == "SCREEN" else "diffusion own")
    found.append("everything" if makeup.everything else f"plan {makeup.tolerance:g}")
    return tuple(found)


__all__ = ["LADDERS", "current_settings", "measured_scene", "open_scene"]
