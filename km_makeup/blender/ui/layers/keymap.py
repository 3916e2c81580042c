"""The shortcut of Before / After."""

from __future__ import annotations

import bpy

from .operators import KM_OT_before_after

_items: list[tuple[bpy.types.KeyMap, bpy.types.KeyMapItem]] = []


def register() -> None:
    """Shift Ctrl B over a 3D view; in background there are no shortcuts."""
    configuration = bpy.context.window_manager.keyconfigs.addon
    if configuration is None:
        return
    keymap = configuration.keymaps.new(name="3D View", space_type="VIEW_3D")
    _items.append((keymap, keymap.keymap_items.new(KM_OT_before_after.bl_idname, "B", "PRESS", ctrl=True, shift=True)))


def unregister() -> None:
    """Take the shortcut away again."""
    while _items:
        keymap, item = _items.pop()
        keymap.keymap_items.remove(item)
