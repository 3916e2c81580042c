"""The product picker: a grid of swatches that sets a layer's product.

One line draws it, in a panel or a dialog:

    picker.draw(layout, layer)

It reads and sets ``layer.product``; the property behind it (`pick` of the layer) holds nothing itself, is never
written to the file, and each choice is a step that can be undone. Swatches are made when they are first drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import bpy
from bpy.props import EnumProperty

from . import previews

if TYPE_CHECKING:
    from ....products import Product

Item = tuple[str, str, str, int, int]

ALL, SAME = "ALL", "SAME"
_ABOUT_KINDS = "Products of this kind are offered; the layer keeps its own"

_numbers: dict[str, int] = {}
"""Number of each id in the enumeration: once given it stays, whatever is offered at the moment."""

_texts: dict[str, str] = {}
"""Blender keeps no copy of the texts of an enumeration, and a menu that is open still shows those of the call before:
each text is kept as long as Blender runs.
"""


def draw(layout: bpy.types.UILayout, layer: bpy.types.PropertyGroup, scale: float = 4.0) -> None:
    """Draw the picker of a layer: kind, the grid of swatches, and the name."""
    from ...library import library

    column = layout.column(align=True)
    column.use_property_split = False
    column.prop(bpy.context.window_manager, "km_makeup_kind", text="")
    column.template_icon_view(layer, "pick", show_labels=True, scale=scale, scale_popup=4.0)
    found = [product for product in library().products if product.id == layer.product]
    if found:
        column.label(text=found[0].name)
    else:
        column.label(text=f"{layer.product!r} is not in the library", icon="ERROR")


def draw_icon(layout: bpy.types.UILayout, product_id: str, scale: float = 1.0) -> None:
    """Draw only the swatch of a product, for a row of a list; a question mark where there is no such product."""
    number = icon_of(product_id)
    if scale == 1.0 or not number:
        layout.label(text="", **({"icon_value": number} if number else {"icon": "QUESTION"}))
    else:
        layout.template_icon(number, scale=scale)


def icon_of(product_id: str) -> int:
    """The icon number of a product's swatch; 0 where the library has no such product."""
    from ...library import library

    return next((previews.icon(product) for product in library().products if product.id == product_id), 0)


def layer_pick() -> object:
    """The property `pick` of a layer, to be declared in its class."""
    return EnumProperty(
        name="Product",
        description="Choose the layer's product by its swatch: above the opaque film, below worn on three skins",
        items=_items,
        get=_get,
        set=_set,
        options={"SKIP_SAVE"},
    )


def _items(layer: bpy.types.PropertyGroup, context: bpy.types.Context | None) -> list[Item]:
    from ...library import library

    window_manager = context.window_manager if context else bpy.context.window_manager
    kind = getattr(window_manager, "km_makeup_kind", ALL)
    if kind == SAME:
        kind = next((one.kind for one in library().products if one.id == layer.product), ALL)
    products = [one for one in library().products if kind in (ALL, one.kind) or one.id == layer.product]
    items = _items_of(products)
    if layer.product not in {one.id for one in products}:
        name = _kept(layer.product or "-")
        items.append((name, name, "Not in the library", 0, _number(layer.product)))
    return items


def all_items(_: object, context: bpy.types.Context | None) -> list[Item]:
    """Every product by its whole name, for an operator's enumeration; swatches where there is a window to show them."""
    from ...library import library

    products = library().products
    icons = [0] * len(products) if bpy.app.background else previews.icons(products)
    return [
        (_kept(one.id), _kept(one.name), _kept(_about(one)), icon, _number(one.id))
        for one, icon in zip(products, icons, strict=True)
    ]


def _items_of(products: Sequence[Product]) -> list[Item]:
    icons = previews.icons(products)
    return [
        (_kept(one.id), _kept(_short(one)), _kept(_about(one)), icon, _number(one.id))
        for one, icon in zip(products, icons, strict=True)
    ]


def _kept(text: str) -> str:
    return _texts.setdefault(text, text)


def _about(product: Product) -> str:
    return f"{product.name}: {product.form}, {product.thickness_um:g} µm, {product.provenance.status}"


def _short(product: Product) -> str:
    """The name without its kind in front, since a grid has room for ten letters: "Lipstick, berry" is "Berry"."""
    before, _, after = product.name.partition(", ")
    return after.capitalize() if after and before.lower().startswith(product.kind.lower()) else product.name


def _number(product_id: str) -> int:
    return _numbers.setdefault(product_id, len(_numbers))


def _get(layer: bpy.types.PropertyGroup) -> int:
    return _number(layer.product)


def _set(layer: bpy.types.PropertyGroup, number: int) -> None:
    chosen = next((one for one, its in _numbers.items() if its == number), layer.product)
    if chosen != layer.product:
        choose(layer, chosen)


def choose(layer: bpy.types.PropertyGroup, product_id: str) -> None:
    """Give a layer another product; its name and thickness follow where they were those of the product before."""
    from ...library import library
    from ...update import paused

    known = {product.id: product for product in library().products}
    old, new = known.get(layer.product), known.get(product_id)
    with paused():
        if old and new and layer.name == old.name:
            layer.name = new.name
        if old and new and abs(layer.thickness_um - old.thickness_um) < 1e-4 * old.thickness_um:
            layer.thickness_um = new.thickness_um
    layer.product = product_id


def _kind_items(_: object, context: bpy.types.Context | None) -> list[tuple[str, str, str]]:
    from ...library import library

    kinds = sorted({product.kind for product in library().products})
    named = [(_kept(kind), _kept(kind.capitalize()), _ABOUT_KINDS) for kind in kinds]
    same = (SAME, "Same Kind", "Products of the same kind as the layer's own are offered: other shades of it")
    return [same, (ALL, "All Products", "Every product is offered"), *named]


def register() -> None:
    """Register what the picker keeps for the window: the kind that is offered."""
    bpy.types.WindowManager.km_makeup_kind = EnumProperty(
        name="Kind", description="Which kind of product is offered", items=_kind_items
    )


def unregister() -> None:
    """Take it away again, with all pictures."""
    del bpy.types.WindowManager.km_makeup_kind
    previews.clear()
