"""Regions of a head as the start of a layer's map."""

from __future__ import annotations

import bpy
import numpy as np

from ..errors import MakeupError
from ..makeup.regions import Region, RegionOptions, region_mask
from . import images
from .adding import add_layer
from .heads import head_of
from .library import library


def new_layer(context: bpy.types.Context, obj: bpy.types.Object, kind: str) -> bpy.types.PropertyGroup:
    """A new layer of the first product of a kind (any product where there is none of it)."""
    products = library().products
    if not products:
        raise MakeupError("There are no products; check the folders in KM_MAKEUP_PRODUCTS.")
    product = next((one for one in products if kind in one.kind), products[0])
    return add_layer(context, obj, product.id)


def lay(obj: bpy.types.Object, layer: bpy.types.PropertyGroup, region: str, edge_mm: float, brows: bool) -> float:
    """Add a region (name in `Region`) to a layer's map; the share of its texels that carry product then.

    A new image takes the place of the map, which stays in the file, so that undo brings it back.
    """
    width, height = layer.map.size if layer.map is not None and min(layer.map.size) else (2048, 2048)
    mask = region_mask(Region[region], head_of(obj), (height, width), RegionOptions(edge_mm, brows))
    values = np.rint(mask * 255).astype(np.uint8)
    old = layer.map
    if old is not None:
        painted = images.map_values(old, layer.channel)
        values = np.maximum(painted, values if painted.dtype == np.uint8 else mask)
    images.keep([old] if old is not None and images.statistics(old, layer.channel).maximum > 0 else [])
    layer.map = images.image_from_map(f"{obj.name} {layer.name}", values)
    layer.channel = "R"
    return float(np.count_nonzero(values)) / values.size
