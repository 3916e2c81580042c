"""Products: the picker with its swatches, the library, and products from measurements."""

from __future__ import annotations

from . import operators, panel, picker

CLASSES = (*operators.CLASSES, *panel.CLASSES)
register, unregister = picker.register, picker.unregister
