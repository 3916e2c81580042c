"""Accuracy & Time: what the present settings are off by, what a frame costs, and settings picked by either."""

from __future__ import annotations

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)


def register() -> None:
    """Listen to renders, to know how long a frame takes."""
    from ... import frame_times

    frame_times.register()


def unregister() -> None:
    """Stop listening."""
    from ... import frame_times

    frame_times.unregister()
