"""Ladders of pictures: a head rendered in many ways, each against a path traced reference whose own grain is known."""

from .scene import current_settings, measured_scene, open_scene

__all__ = ["current_settings", "measured_scene", "open_scene"]
