"""Highlights: what makes skin and films shine."""

from __future__ import annotations

import bpy

from . import panel

CLASSES = panel.CLASSES


def register() -> None:
    """Follow the lamps of the scene, for the paper's highlight."""
    from ...highlights_follow import follow_lamps

    bpy.app.handlers.depsgraph_update_post.append(follow_lamps)


def unregister() -> None:
    """Follow them no more."""
    from ...highlights_follow import follow_lamps

    bpy.app.handlers.depsgraph_update_post.remove(follow_lamps)
