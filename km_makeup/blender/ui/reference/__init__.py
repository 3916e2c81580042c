"""Reference: the same picture path traced in Cycles, and the difference."""

from __future__ import annotations

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
