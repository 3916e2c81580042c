"""Set Up: the top of the tab. Chooses skin materials and UV map, shows problems, takes makeup off."""

from __future__ import annotations

from . import operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
