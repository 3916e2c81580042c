"""Layers: the list of films from the skin to the air, and what is done with whole layers."""

from __future__ import annotations

from . import keymap, operators, panel

CLASSES = (*operators.CLASSES, *panel.CLASSES)
register, unregister = keymap.register, keymap.unregister
