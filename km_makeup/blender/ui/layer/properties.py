"""One layer of makeup."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    PointerProperty,
    StringProperty,
)

from ...update import layer_changed
from ..products.picker import layer_pick

CHANNELS = [(c, c, f"The {c} channel of the map") for c in "RGBA"]
FORMS = [
    ("PRODUCT", "As the Product", "Liquid, cream or powder, as the product says"),
    ("LIQUID", "Liquid", "The painted value is the film's thickness"),
    ("CREAM", "Cream", "The painted value is the film's thickness"),
    ("POWDER", "Powder", "The painted value is the share of the area that a film of full thickness covers"),
]
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
    solo: BoolProperty(
        name="Solo",
        description="Show only this layer, and others that are set to solo; the picture renders that way too",
        default=False,
        update=layer_changed,
    )
    form: EnumProperty(
        name="Form",
        description="What the painted value means: a thickness, or the share of the area that grains cover",
        items=FORMS,
        update=layer_changed,
    )
    own_finish: BoolProperty(
        name="Own Finish",
        description="Use the roughness and reflectance below instead of the product's own",
        update=layer_changed,
    )
    roughness: FloatProperty(
        name="Roughness", description="Roughness of the film's highlight (0..1): 0.1 wet gloss, 0.8 matte powder",
        min=0.02, max=1, default=0.4, subtype="FACTOR", update=layer_changed,
    )  # fmt: skip
    f0: FloatProperty(
        name="Reflectance", description="Reflectance of the film's surface seen straight on, F0 (0..1): 0.04 oils and waxes",
        min=0, max=1, default=0.04, precision=3, subtype="FACTOR", update=layer_changed,
    )  # fmt: skip
    swatch: FloatVectorProperty(
        name="On This Skin", description="The film at full thickness on this skin, linear RGB (0..1)",
        subtype="COLOR", size=3, min=0, max=1, default=(0.5, 0.5, 0.5),
    )  # fmt: skip
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
