"""The layers of an object."""

from __future__ import annotations

from bpy.props import CollectionProperty, IntProperty

from ...update import setting_changed
from ..layer.properties import KM_PG_layer


class LayersProperties:
    """Properties of Object.km_makeup."""

    layers: CollectionProperty(type=KM_PG_layer, name="Layers", description="The films, from the skin to the air")
    active: IntProperty(
        name="Active Layer", description="The layer that is shown and painted, from 0", update=setting_changed
    )
