"""Rebuilding after a property changed: at once, or once at the end of many changes."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import bpy

_paused = 0


@contextlib.contextmanager
def one_update(obj: bpy.types.Object) -> Iterator[None]:
    """Changes of the layers inside the block rebuild the makeup of ``obj`` once, at its end.

    Textures baked before do not show them, so the live path takes over.
    """
    from .makeup import refresh

    with paused():
        yield
        obj.km_makeup.path = "LIVE"
    refresh(obj)


@contextlib.contextmanager
def paused() -> Iterator[None]:
    """Property changes inside the block rebuild nothing."""
    global _paused
    _paused += 1
    try:
        yield
    finally:
        _paused -= 1


def layer_changed(self: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A property of a layer changed: baked textures no longer show it, so the live path takes over."""
    _changed(self.id_data, stale=True)


def setting_changed(self: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A property of the makeup changed."""
    _changed(self.id_data)


def _changed(obj: bpy.types.Object, stale: bool = False) -> None:
    from ..errors import MakeupError
    from .makeup import refresh

    if _paused or not obj.km_makeup.slots:
        return
    if stale and obj.km_makeup.path == "BAKED":
        with paused():
            obj.km_makeup.path = "LIVE"
    try:
        refresh(obj)
    except MakeupError as error:
        obj.km_makeup["problem"] = str(error)
        print(f"KM Makeup: {error}")
    else:
        if "problem" in obj.km_makeup:
            del obj.km_makeup["problem"]


@bpy.app.handlers.persistent
def keep_painted_maps(*_: object) -> None:
    """Before the .blend is saved: strokes on packed and new maps go into it, which Blender leaves to a question on closing."""
    maps = {layer.map for obj in bpy.data.objects for layer in obj.km_makeup.layers if layer.map is not None}
    for image in maps:
        if image.is_dirty and (image.packed_file or image.source == "GENERATED"):
            image.pack()
