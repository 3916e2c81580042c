"""Pictures of products for lists and pickers: made when they are first drawn, kept until the product changes.

Nothing is made at registration. A draw may make only as many pictures as fit into BUDGET seconds; a timer makes
the others and redraws, so that a library of hundreds of products does not hold the window up.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import bpy
import bpy.utils.previews

if TYPE_CHECKING:
    from ....products import Product

SIZE = 96
BUDGET = 0.04
"""Seconds of one draw, or one tick of the timer, that may go into making pictures."""

_pictures: bpy.utils.previews.ImagePreviewCollection | None = None
_icons: dict[str, int] = {}
_waiting: dict[str, Product] = {}


def icons(products: Sequence[Product]) -> list[int]:
    """Icon numbers of some products, in their order; 0 for those that are still to be made."""
    deadline = time.perf_counter() + BUDGET
    return [_icon(product, time.perf_counter() < deadline) for product in products]


def icon(product: Product) -> int:
    """The icon number of one product, made at once where it is missing."""
    return _icon(product, True)


def _icon(product: Product, now: bool) -> int:
    key = _key(product)
    if key not in _icons:
        if not now:
            _wait_for(key, product)
            return 0
        _make(key, product)
    return _icons[key]


def _key(product: Product) -> str:
    """The same for the same picture: two files with one id that look different have different keys."""
    digest = hashlib.sha1(product.K.tobytes() + product.S.tobytes(), usedforsecurity=False)
    return f"{product.id} {product.thickness_um:g} {digest.hexdigest()[:12]}"


def _make(key: str, product: Product) -> None:
    import numpy as np

    from ....products.swatches import thumbnail

    global _pictures
    if _pictures is None:
        _pictures = bpy.utils.previews.new()
    image = thumbnail(product, SIZE)[::-1].astype(np.float32) / 255
    image[..., :3] *= image[..., 3:]  # icons are premultiplied
    picture = _pictures.new(key)
    picture.icon_size = picture.image_size = (SIZE, SIZE)
    picture.icon_pixels_float = picture.image_pixels_float = image.ravel().tolist()
    _icons[key] = picture.icon_id
    _waiting.pop(key, None)


def _wait_for(key: str, product: Product) -> None:
    _waiting[key] = product
    if not bpy.app.timers.is_registered(_make_some):
        bpy.app.timers.register(_make_some, first_interval=0.02)


def _make_some() -> float | None:
    """Timer: some of the missing pictures, then a redraw; again until there are none."""
    deadline = time.perf_counter() + BUDGET
    while _waiting and time.perf_counter() < deadline:
        _make(*next(iter(_waiting.items())))
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            area.tag_redraw()
    return 0.02 if _waiting else None


def clear() -> None:
    """Forget all pictures; the extension is being disabled."""
    global _pictures
    if bpy.app.timers.is_registered(_make_some):
        bpy.app.timers.unregister(_make_some)
    _icons.clear()
    _waiting.clear()
    if _pictures is not None:
        bpy.utils.previews.remove(_pictures)
        _pictures = None
