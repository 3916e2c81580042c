"""Textures of a stack: what painted maps and spectra give, texel by texel, and the files they live in."""

from .engine import Baked, Request, bake, baking
from .files import read_image, read_map, write_exr, write_exrs

__all__ = ["Baked", "Request", "bake", "baking", "read_image", "read_map", "write_exr", "write_exrs"]
