"""Highlights: what makes skin and films shine."""

from __future__ import annotations

from . import panel

CLASSES = panel.CLASSES
