"""Products: the picker with its swatches."""

from __future__ import annotations

from . import picker

CLASSES: tuple[type, ...] = ()
register, unregister = picker.register, picker.unregister
