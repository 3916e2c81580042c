"""What makeup keeps on an object: layers, chosen slots, and the way back to the original materials."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .update import layer_changed, setting_changed

PATHS = [
    ("LIVE", "Live", "Each film is a node group on its painted map; changes show at once"),
    ("BAKED", "Baked", "Textures of the whole stack, made by the bake; their cost does not grow with the layers"),
]
LIGHTS = [
    ("D65", "Daylight D65", "CIE illuminant D65, noon daylight"),
    ("D55", "Daylight D55", "CIE illuminant D55, mid-morning daylight; the paper's light"),
    ("A", "Tungsten A", "CIE illuminant A, incandescent light"),
    ("OWN", "Own Spectrum", "A CSV file with wavelength in nm and power per row"),
]
SCATTERING = [
    ("CLOSURES", "Subsurface", "The renderer's own subsurface scattering"),
    ("SCREEN", "Screen Space", "EEVEE: the compositor diffuses it, as wide as in skin (press Diffuse in Compositor)"),
]
CHANNELS = [(c, c, f"The {c} channel of the map") for c in "RGBA"]
SWITCHES = [
    ("AUTO", "Auto", "The plan decides whether this film exists"),
    ("ON", "On", "The film exists whatever the plan finds"),
    ("OFF", "Off", "The film does not exist"),
]


class KM_PG_layer(bpy.types.PropertyGroup):
    """One layer of makeup; layers stand bottom to top."""

    product: StringProperty(name="Product", description="Id of the product in the library", update=layer_changed)
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


class KM_PG_slot(bpy.types.PropertyGroup):
    """A material slot under makeup, with what it held before."""

    index: IntProperty(name="Slot", description="Index of the material slot")
    original: PointerProperty(type=bpy.types.Material, name="Original", description="The skin material, untouched")
    made: PointerProperty(type=bpy.types.Material, name="With Makeup", description="The copy that carries the makeup")
    link: StringProperty(name="Link", description="Whether the slot belonged to the object or to its data")


class KM_PG_object(bpy.types.PropertyGroup):
    """Makeup of one object."""

    layers: CollectionProperty(type=KM_PG_layer)
    active: IntProperty(name="Active Layer", description="The layer that is shown and painted", update=setting_changed)
    slots: CollectionProperty(type=KM_PG_slot)
    uv_map: StringProperty(
        name="UV Map", description="UV map that the cosmetic maps are painted on", update=setting_changed
    )
    path: EnumProperty(
        name="Colour", description="How the films' colour is computed", items=PATHS, update=setting_changed
    )
    light: EnumProperty(
        name="Light",
        description="Spectrum of the light that the colours are computed for",
        items=LIGHTS,
        update=setting_changed,
    )
    light_file: StringProperty(
        name="Spectrum", description="CSV file: wavelength in nm, power", subtype="FILE_PATH", update=setting_changed,
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )  # fmt: skip
    both_engines: BoolProperty(
        name="EEVEE and Cycles", default=True, update=setting_changed,
        description="Build an output for both engines; off: for the scene's engine alone",
    )  # fmt: skip
    scattering: EnumProperty(
        name="Skin Light", description="How light that enters the skin spreads, in EEVEE",
        items=SCATTERING, update=setting_changed,
    )  # fmt: skip
    finish: EnumProperty(
        name="Highlight",
        description="Whether the plan decides that films change the highlight",
        items=SWITCHES,
        update=setting_changed,
    )
    baked_R: PointerProperty(type=bpy.types.Image, name="Baked R")
    baked_T2: PointerProperty(type=bpy.types.Image, name="Baked T2")
    baked_R_up: PointerProperty(type=bpy.types.Image, name="Baked R up")
    baked_albedo: PointerProperty(type=bpy.types.Image, name="Baked Albedo")
    baked_finish: PointerProperty(type=bpy.types.Image, name="Baked Finish")
    folder: StringProperty(
        name="Folder", description="Where the bake writes its textures", subtype="DIR_PATH", default="//makeup_textures",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )  # fmt: skip
    resolution: IntProperty(
        name="Resolution",
        description="Width and height of the baked textures, in texels; 0: the maps' own",
        min=0,
        max=16384,
    )
    full_float: BoolProperty(name="32-bit", description="Write 32-bit float textures instead of 16-bit half floats")
    finished: BoolProperty(
        name="Finished Albedo",
        description="Also bake the colour of skin with makeup, exact for every texel of the skin's texture",
    )


CLASSES = (KM_PG_layer, KM_PG_slot, KM_PG_object)


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
