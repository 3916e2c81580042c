"""Effects: what is simulated beside the films' colour."""

from __future__ import annotations

import bpy

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)


def register() -> None:
    """Plan again when the scene's engine or lamps change."""
    from ...scene_follow import follow_scene

    bpy.app.handlers.depsgraph_update_post.append(follow_scene)


def unregister() -> None:
    """Follow them no more."""
    from ...scene_follow import follow_scene

    bpy.app.handlers.depsgraph_update_post.remove(follow_scene)
