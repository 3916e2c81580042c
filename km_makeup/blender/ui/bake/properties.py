"""Light, colour path and textures of an object."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, PointerProperty, StringProperty

from ...update import follows_changed, setting_changed

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


class BakeProperties:
    """Properties of Object.km_makeup."""

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
    baked_R: PointerProperty(
        type=bpy.types.Image,
        name="Baked R",
        description="Texture of the bake: reflectance of the films from above (0..1)",
    )
    baked_T2: PointerProperty(
        type=bpy.types.Image,
        name="Baked T2",
        description="Texture of the bake: transmittance of the films, in and out (0..1)",
    )
    baked_R_up: PointerProperty(
        type=bpy.types.Image,
        name="Baked R up",
        description="Texture of the bake: reflectance of the films from below (0..1)",
    )
    baked_simply: BoolProperty(
        name="Baked without R up",
        description="Light between films and skin is in the other textures, since the plan found that to look the same",
    )
    baked_albedo: PointerProperty(
        type=bpy.types.Image, name="Baked Albedo", description="Texture of the bake: colour of skin with makeup (0..1)"
    )
    baked_finish: PointerProperty(
        type=bpy.types.Image, name="Baked Finish",
        description="Texture of the bake: share of the skin's highlight, slope variance and F0 of the films (0..1)",
    )  # fmt: skip
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
    follows: BoolProperty(
        name="Follow Strokes", update=follows_changed, options={"SKIP_SAVE"},
        description="Baked textures follow strokes at once: what a stroke changed is computed and drawn into them, and the "
        "files follow when the brush has rested",
    )  # fmt: skip
    finished: BoolProperty(
        name="Finished Albedo",
        description="Also bake the colour of skin with makeup, exact for every texel of the skin's texture",
    )
