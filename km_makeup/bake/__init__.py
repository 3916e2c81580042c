"""Textures of a stack: what painted maps and spectra give, texel by texel, and the files they live in."""

from .colours import Shine
from .engine import Baked, Request, bake, baking
from .files import read_image, read_map, write_exr, write_exrs, write_picture
from .levels import ArrayRows, Rows

__all__ = [
    "ArrayRows",
    "Baked",
    "Request",
    "Rows",
    "Shine",
    "bake",
    "baking",
    "read_image",
    "read_map",
    "write_exr",
    "write_exrs",
    "write_picture",
]
