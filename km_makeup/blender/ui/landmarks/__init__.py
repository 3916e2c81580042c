"""Landmarks of the face, and regions that a brush can start from."""

from __future__ import annotations

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
