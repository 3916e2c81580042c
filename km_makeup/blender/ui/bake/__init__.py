"""Colour & Bake: the light that colours are computed for, the colour path, and textures of the whole stack."""

from __future__ import annotations

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
