"""Assets: node groups and brushes in Blender's asset browser."""

from __future__ import annotations

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
