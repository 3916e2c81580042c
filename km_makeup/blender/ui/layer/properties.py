"""One layer of makeup."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, PointerProperty, StringProperty

from ...update import layer_changed
from ..products.picker import layer_pick

CHANNELS = [(c, c, f"The {c} channel of the map") for c in "RGBA"]
SWITCHES = [
    ("AUTO", "Auto", "The plan decides whether this film exists"),
    ("ON", "On", "The film exists whatever the plan finds"),
    ("OFF", "Off", "The film does not exist"),
]


class KM_PG_layer(bpy.types.PropertyGroup):
    """One layer of makeup; layers stand bottom to top."""

    product: StringProperty(name="Product", description="Id of the product in the library", update=layer_changed)
    pick: layer_pick()
    thickness_um: FloatProperty(
        name="Thickness", description="Thickness of the film where the map is white, in micrometres (µm)",
        min=0, soft_max=200, max=1e5, default=20, precision=1, update=layer_changed,
    )  # fmt: skip
    strength: FloatProperty(
        name="Strength", description="Factor on the painted map (0..1)", min=0, max=1, default=1, subtype="FACTOR",
        update=layer_changed,
    )  # fmt: skip
    enabled: BoolProperty(
        name="Show", description="Whether this layer is on the face", default=True, update=layer_changed
    )
    map: PointerProperty(
        type=bpy.types.Image, name="Map",
        description="Cosmetic map: 1 is the full thickness, 0 is bare skin; Non-Color", update=layer_changed,
    )  # fmt: skip
    channel: EnumProperty(
        name="Channel", description="Channel of the map that holds this layer", items=CHANNELS, update=layer_changed
    )
    switch: EnumProperty(
        name="Plan", description="Whether the plan decides that this film exists", items=SWITCHES, update=layer_changed
    )
    map_max: FloatProperty(name="Map Maximum", description="Highest painted value found at the last update (0..1)")
    coverage: FloatProperty(
        name="Coverage", description="Share of the map's texels that carry product at the last update (0..1)"
    )
