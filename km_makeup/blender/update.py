"""Rebuilding after a property changed: at once, or once at the end of many changes; and what has to happen around undo."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import bpy

_paused = 0
_undone = 0


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


def stroking() -> bool:
    """Whether a brush is down in any window: Blender then holds on to the image, the mesh and the materials it paints, and ends with
    a crash where they are built anew under it."""
    windows = bpy.context.window_manager.windows
    return any(
        one.bl_idname.startswith(("PAINT_OT_", "SCULPT_OT_")) for window in windows for one in window.modal_operators
    )


def layer_changed(self: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A property of a layer changed: baked textures no longer show it, so the live path takes over."""
    _changed(self.id_data, stale=True)


def setting_changed(self: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A property of the makeup changed."""
    _changed(self.id_data)


def active_changed(self: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Another layer is selected: the brush paints on its map from now on."""
    from . import images
    from .painting import follow_layer

    if not _paused:
        left = bpy.context.scene.tool_settings.image_paint.canvas
        if left is not None:
            images.forget_statistics(left)  # it may have been painted, or erased to nothing
        follow_layer(self.id_data, bpy.context.scene)
        _changed(self.id_data)


def exclusion_changed(self: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Another exclusion mask, or none."""
    if self.exclusion is None and self.paints_exclusion:
        with paused():
            self.paints_exclusion = False
    active_changed(self, context)


def tiles_changed(self: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Other UDIM tiles: they are gathered anew, and the maps follow."""
    from . import makeup, painting

    def gather(obj: bpy.types.Object) -> None:
        makeup.set_up(obj, [entry.index for entry in obj.km_makeup.slots], obj.km_makeup.uv_map)
        makeup.refresh(obj)
        painting.follow_layer(obj, bpy.context.scene)

    if _paused or not self.slots:
        return
    told(self.id_data, gather)
    if self.get("problem"):
        with paused():
            self.tiles = self.get("tiles_taken", "")


def follows_changed(self: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Baked textures are to follow strokes, or no more; where they cannot, the switch goes back and the panel says why."""
    if _paused:
        return
    from . import following

    following.stop(self.id_data)
    if self.follows:
        told(self.id_data, lambda obj: following.start(obj, context.scene))
        if not following.follows(self.id_data):
            with paused():
                self.follows = False


def _changed(obj: bpy.types.Object, stale: bool = False) -> None:
    from .makeup import refresh

    if _paused or not obj.km_makeup.slots:
        return
    if stale and obj.km_makeup.path == "BAKED":
        with paused():
            obj.km_makeup.path = "LIVE"
    told(obj, refresh)


def told(obj: bpy.types.Object, build: object) -> None:
    """Run ``build(obj)``; a MakeupError is kept on the object, where the panel shows it, until it is mended."""
    from ..errors import MakeupError

    try:
        build(obj)  # type: ignore[operator]
    except MakeupError as error:
        obj.km_makeup["problem"] = str(error)
        print(f"KM Makeup: {error}")
    else:
        if "problem" in obj.km_makeup:
            del obj.km_makeup["problem"]


def times_undone() -> int:
    """How often the file was undone, redone or opened since Blender started: pointers held from before are not valid."""
    return _undone


@bpy.app.handlers.persistent
def after_undo(*_: object) -> None:
    """After an undo, a redo or opening a file: maps are read again, and the brush follows the layer that is selected now.

    Blender keeps the canvas through an undo and the selected layer not.
    """
    global _undone
    from . import images
    from .painting import follow_layer

    _undone += 1
    images.forget_statistics()
    images.mark_undone()
    for scene in bpy.data.scenes:
        for obj in scene.objects:
            if obj.km_makeup.layers and obj.mode == "TEXTURE_PAINT":
                follow_layer(obj, scene)


@bpy.app.handlers.persistent
def keep_painted_maps(*_: object) -> None:
    """Before the .blend is saved: strokes on maps go into it, which Blender leaves to a question on closing."""
    from .images import pack, unsaved_maps

    for image in unsaved_maps():
        pack(image)


@bpy.app.handlers.persistent
def finish_textures(*_: object) -> None:
    """After opening a file: a set of textures whose bake was killed while they took their places comes in whole."""
    from pathlib import Path

    from ..files import finish_swaps

    baked = [obj.km_makeup.baked_R for obj in bpy.data.objects]
    folders = {Path(bpy.path.abspath(image.filepath)).parent for image in baked if image is not None and image.filepath}
    came = {path for folder in folders for path in finish_swaps(folder)}
    for image in bpy.data.images if came else ():
        if image.filepath and Path(bpy.path.abspath(image.filepath)) in came:
            image.reload()
