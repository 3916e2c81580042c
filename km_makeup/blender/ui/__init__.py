"""The Makeup tab. Each panel is a page: a folder with its panel, operators, properties and a README.md.

`PAGES` lists them as they stand in the tab. README.md here says how a page is added.
"""

from __future__ import annotations

import bpy

from . import (
    accuracy,
    assets,
    bake,
    effects,
    export,
    highlights,
    landmarks,
    layer,
    layers,
    looks,
    products,
    properties,
    reference,
    set_up,
)

PAGES = (
    set_up,
    layers,
    layer,
    products,
    looks,
    landmarks,
    effects,
    highlights,
    bake,
    export,
    reference,
    accuracy,
    assets,
)
"""Modules with CLASSES, and where they need more than classes `register()` and `unregister()`."""


def register() -> None:
    """Register every page; nothing is read, opened or built."""
    properties.register()
    for page in PAGES:
        for cls in page.CLASSES:
            bpy.utils.register_class(cls)
        if hasattr(page, "register"):
            page.register()


def unregister() -> None:
    """Take the tab away again; makeup in the open file stays as it is."""
    for page in reversed(PAGES):
        if hasattr(page, "unregister"):
            page.unregister()
        for cls in reversed(page.CLASSES):
            bpy.utils.unregister_class(cls)
    properties.unregister()
