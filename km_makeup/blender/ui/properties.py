"""What makeup keeps on an object, put together from the pages: each has a class of properties for it.

Groups that other groups point to are registered first.
"""

from __future__ import annotations

import bpy
from bpy.props import PointerProperty

from .accuracy.properties import AccuracyProperties
from .bake.properties import BakeProperties
from .effects.properties import EffectsProperties, KM_PG_override
from .highlights.properties import HighlightsProperties
from .landmarks.properties import KM_PG_landmark, LandmarkProperties
from .layer.properties import KM_PG_layer
from .layers.properties import LayersProperties
from .set_up.properties import KM_PG_slot, SetUpProperties


class KM_PG_object(
    SetUpProperties,
    LayersProperties,
    EffectsProperties,
    HighlightsProperties,
    BakeProperties,
    LandmarkProperties,
    AccuracyProperties,
    bpy.types.PropertyGroup,
):
    """Makeup of one object."""


CLASSES = (KM_PG_layer, KM_PG_slot, KM_PG_override, KM_PG_landmark, KM_PG_object)


def register() -> None:
    """Register the property groups and hang them on Object."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.km_makeup = PointerProperty(type=KM_PG_object)


def unregister() -> None:
    """Take the property groups away again; their data stays in the file."""
    del bpy.types.Object.km_makeup
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
