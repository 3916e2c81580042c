"""The compositor's part: light that diffuses in the skin, in screen space."""

from .diffusion import diffusion_group
from .placing import find, insert, remove
from .profiles import Profile, chosen_profile, profile_of
from .scale import heads_of, refusal

__all__ = [
    "Profile",
    "chosen_profile",
    "diffusion_group",
    "find",
    "heads_of",
    "insert",
    "profile_of",
    "refusal",
    "remove",
]
