"""The compositor's part: light that diffuses in the skin, in screen space."""

from .diffusion import diffusion_group
from .placing import find, insert, remove

__all__ = ["diffusion_group", "find", "insert", "remove"]
