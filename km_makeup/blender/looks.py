"""Looks on an object: layers from a look file, and the look file from the layers."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

from ..bake.files import read_map, write_png
from ..errors import MakeupError
from ..files import ensure_folder
from ..makeup import Layer, Look, interface_of
from ..makeup.maps import check_same_size
from . import images
from .library import library
from .makeup import remove, set_up
from .update import one_update, paused

WHOLE = 64
"""Size in texels of the map of a layer that covers the whole face and has no image of its own, if no other map sets one."""


LAYER_FIELDS = ("name", "product", "thickness_um", "strength", "enabled", "channel", "switch", "map")


def apply_look(obj: bpy.types.Object, look: Look) -> None:
    """Put a look on an object in place of the layers it has; it is set up if it was not.

    Everything is read and checked first: where a product or a map is unusable a MakeupError says which,
    and the object is as before.
    """
    products = [library().find(layer.product) for layer in look.layers]
    interface_of(products)
    paths = [look.map_path(layer) for layer in look.layers]
    values = {i: read_map(path, layer.channel) for i, (path, layer) in enumerate(zip(paths, look.layers)) if path}
    shape = check_same_size([(str(paths[i]), v) for i, v in values.items()]) if values else (WHOLE, WHOLE)
    with _all_or_nothing(obj), one_update(obj):
        if not obj.km_makeup.slots:
            set_up(obj)
        obj.km_makeup.layers.clear()
        for i, (layer, product) in enumerate(zip(look.layers, products)):
            entry = obj.km_makeup.layers.add()
            entry.name, entry.product = product.name, product.id
            entry.thickness_um = product.thickness_um if np.isnan(layer.thickness_um) else layer.thickness_um
            entry.strength, entry.enabled, entry.channel = layer.strength, layer.enabled, layer.channel
            path = paths[i]
            entry.map = (
                images.load_map(str(path.resolve()), layer.channel, values[i])
                if path
                else _whole(f"Whole {product.name}", shape)
            )
        obj.km_makeup.path = "LIVE"
        obj.km_makeup["look"] = look.name


@contextlib.contextmanager
def _all_or_nothing(obj: bpy.types.Object) -> Iterator[None]:
    """Layers, slots and images are as before where the block ends in a MakeupError."""
    makeup = obj.km_makeup
    layers = [{field: getattr(entry, field) for field in LAYER_FIELDS} for entry in makeup.layers]
    path, had_slots, images_before = makeup.path, bool(makeup.slots), set(bpy.data.images)
    try:
        yield
    except MakeupError:
        with paused():
            makeup.layers.clear()
            for fields in layers:
                entry = makeup.layers.add()
                for field, value in fields.items():
                    setattr(entry, field, value)
            makeup.path = path
            if not had_slots:
                remove(obj, keep_layers=True)
        for image in set(bpy.data.images) - images_before:
            bpy.data.images.remove(image)
        raise


def _whole(name: str, shape: tuple[int, int]) -> bpy.types.Image:
    return images.image_from_map(name, np.full(shape, 255, np.uint8))


def look_of(obj: bpy.types.Object) -> Look:
    """The object's layers as a look without files."""
    layers = tuple(
        Layer(entry.product, round(entry.thickness_um, 6), "", entry.channel, round(entry.strength, 6), entry.enabled)
        for entry in obj.km_makeup.layers
    )
    return Look(str(obj.km_makeup.get("look", obj.name)), layers)


def save_look(obj: bpy.types.Object, path: Path) -> Look:
    """Write the object's layers as a look file, its maps as PNG (8-bit) beside it in ``<name>_maps``.

    Raises MakeupError where there are no layers or the folder cannot be written to.
    """
    if not obj.km_makeup.layers:
        raise MakeupError(f"{obj.name!r} has no layers to save; add one first.")
    for entry in obj.km_makeup.layers:
        if entry.map is None:
            raise MakeupError(
                f"The layer {entry.name or entry.product!r} has no map, and a look without one covers the whole face; "
                "load a map or remove the layer."
            )
    folder = ensure_folder(path.parent / f"{path.stem}_maps")
    layers = []
    for i, (entry, layer) in enumerate(zip(obj.km_makeup.layers, look_of(obj).layers)):
        name = f"{folder.name}/{i + 1}-{layer.product}.png"
        if entry.map is not None:
            values = images.map_values(entry.map, entry.channel)
            eight_bit = values if values.dtype == np.uint8 else np.rint(values * 255).astype(np.uint8)
            write_png(path.parent / name, eight_bit)
        layers.append(
            Layer(layer.product, layer.thickness_um, name if entry.map else "", "R", layer.strength, layer.enabled)
        )
    look = Look(path.stem, tuple(layers), path.parent)
    look.save(path)
    return look
