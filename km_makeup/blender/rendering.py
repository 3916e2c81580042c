"""Renders as a command makes them: engine, size, samples, seed and file, the same bytes every time."""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..effects import Engine
from ..errors import MakeupError
from ..files import replacing

log = logging.getLogger("km_makeup")
PATIENCE = 2.0
"""Seconds between lines of progress."""

ENGINE_NAMES = {Engine.EEVEE: "BLENDER_EEVEE", Engine.CYCLES: "CYCLES"}
FORMATS = {".png": ("PNG", "8"), ".exr": ("OPEN_EXR", "32")}


@dataclass(frozen=True)
class Shot:
    """One picture: camera, engine, size in pixels, samples, seed, target file (.png or .exr)."""

    camera: bpy.types.Object
    engine: Engine
    size: tuple[int, int]
    samples: int
    seed: int
    path: Path


def check_format(path: Path) -> None:
    """MakeupError where the file's suffix is none that can be written."""
    if path.suffix.lower() not in FORMATS:
        raise MakeupError(f"{path.name}: pictures are written as .png or .exr; choose one of these suffixes.")


def render(scene: bpy.types.Scene, shot: Shot) -> float:
    """Render and write the picture, whole or not at all; seconds it took."""
    check_format(shot.path)
    settings = scene.render
    scene.camera = shot.camera
    set_frame(scene, shot.engine, shot.size, shot.samples)
    scene.cycles.seed, scene.cycles.use_animated_seed = shot.seed, False
    kind, depth = FORMATS[shot.path.suffix.lower()]
    settings.image_settings.media_type = "IMAGE"
    settings.image_settings.file_format, settings.image_settings.color_depth = kind, depth
    _no_stamps(settings)
    start = time.perf_counter()
    with replacing(shot.path) as temporary, _told(start):
        settings.filepath = str(temporary)
        settings.use_file_extension = False
        bpy.ops.render.render(write_still=True)
        if temporary.stat().st_size == 0:
            raise MakeupError(f"Blender could not write {shot.path}; is the disk full?")
        if kind == "PNG":
            temporary.write_bytes(without_text(temporary.read_bytes()))
    return time.perf_counter() - start


def set_frame(scene: bpy.types.Scene, engine: Engine, size: tuple[int, int], samples: int) -> None:
    """Engine, size in pixels and samples of the pictures to come."""
    settings = scene.render
    settings.engine = ENGINE_NAMES[engine]
    settings.resolution_x, settings.resolution_y = size
    settings.resolution_percentage = 100
    scene.cycles.samples = scene.eevee.taa_render_samples = samples


def without_text(png: bytes) -> bytes:
    """A PNG without its text: Cycles writes there how long it took, whatever the stamp settings say."""
    kept, place = [png[:8]], 8
    while place + 12 <= len(png):
        end = place + 12 + int.from_bytes(png[place : place + 4], "big")
        if png[place + 4 : place + 8] not in (b"tEXt", b"zTXt", b"iTXt"):
            kept.append(png[place:end])
        place = end
    return b"".join(kept)


@contextlib.contextmanager
def _told(start: float) -> Iterator[None]:
    """While rendering, what Blender says about its progress, at most every PATIENCE seconds."""
    last = start

    def tell(text: object, *_: object) -> None:
        nonlocal last
        now = time.perf_counter()
        if now - last > PATIENCE:
            last = now
            log.info("  %.0f s: %s", now - start, text)

    bpy.app.handlers.render_stats.append(tell)
    try:
        yield
    finally:
        bpy.app.handlers.render_stats.remove(tell)


def _no_stamps(settings: bpy.types.RenderSettings) -> None:
    """No time of day, no file path in the picture: the same scene gives the same bytes."""
    for prop in settings.bl_rna.properties:
        if prop.identifier.startswith("use_stamp_") and prop.type == "BOOLEAN" and not prop.is_readonly:
            setattr(settings, prop.identifier, False)
