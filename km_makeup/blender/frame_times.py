"""How long each step of the last frame took: from Blender's own render handlers, whoever renders."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass

import bpy

SAMPLING = re.compile(r"(?:Rendering|Sample)s?\b.*\d+ */ *\d+")
"""What Blender says once it samples; before, it prepares: objects, textures, shaders."""


@dataclass(frozen=True)
class FrameTimes:
    """Milliseconds of a frame: preparing (objects, textures, shaders), rendering, compositing; its size and engine."""

    prepare_ms: float
    render_ms: float
    compositor_ms: float
    size: tuple[int, int]
    engine: str

    @property
    def total_ms(self) -> float:
        """The whole frame."""
        return self.prepare_ms + self.render_ms + self.compositor_ms


class _Clock:
    """What has happened so far in the frame that is being rendered."""

    def __init__(self) -> None:
        self.start = self.sampling = self.composite = 0.0
        self.compositor = 0.0


_now = _Clock()
_last: FrameTimes | None = None


def last_frame() -> FrameTimes | None:
    """The last frame that was rendered in this session."""
    return _last


@bpy.app.handlers.persistent
def frame_begins(*_: object) -> None:
    """Before a frame."""
    global _now
    _now = _Clock()
    _now.start = time.perf_counter()


@bpy.app.handlers.persistent
def frame_tells(text: object, *_: object) -> None:
    """While rendering."""
    if _now.start and not _now.sampling and SAMPLING.search(str(text)):
        _now.sampling = time.perf_counter()


@bpy.app.handlers.persistent
def compositing_begins(*_: object) -> None:
    """Before the compositor."""
    _now.composite = time.perf_counter()


@bpy.app.handlers.persistent
def compositing_ends(*_: object) -> None:
    """After the compositor."""
    if _now.composite:
        _now.compositor = time.perf_counter() - _now.composite


@bpy.app.handlers.persistent
def frame_ends(scene: bpy.types.Scene, *_: object) -> None:
    """After a frame."""
    global _last
    if not _now.start:
        return
    whole = time.perf_counter() - _now.start
    prepare = _now.sampling - _now.start if _now.sampling else 0.0
    share, settings = scene.render.resolution_percentage / 100, scene.render
    size = (round(settings.resolution_x * share), round(settings.resolution_y * share))
    rest = max(0.0, whole - prepare - _now.compositor)
    _last = FrameTimes(1e3 * prepare, 1e3 * rest, 1e3 * _now.compositor, size, settings.engine)


HANDLERS = (
    ("render_pre", frame_begins),
    ("render_stats", frame_tells),
    ("composite_pre", compositing_begins),
    ("composite_post", compositing_ends),
    ("render_post", frame_ends),
)


def register() -> None:
    """Listen to renders."""
    for event, function in HANDLERS:
        getattr(bpy.app.handlers, event).append(function)


def unregister() -> None:
    """Stop listening."""
    for event, function in HANDLERS:
        getattr(bpy.app.handlers, event).remove(function)
