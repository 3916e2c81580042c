"""Export: the look as plain textures and as a .glb."""

from __future__ import annotations

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
