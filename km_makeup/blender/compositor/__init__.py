"""The compositor's part: light that diffuses in the skin, in screen space."""

from .diffusion import diffusion_group
from .following import ask, follow, forget, planned_profile, stops_at_steps
from .placing import find, insert, remove
from .profiles import Profile, chosen_profile, profile_of
from .scale import heads_of, refusal, shots

__all__ = [
    "Profile",
    "ask",
    "chosen_profile",
    "diffusion_group",
    "find",
    "follow",
    "forget",
    "heads_of",
    "insert",
    "planned_profile",
    "profile_of",
    "refusal",
    "remove",
    "shots",
    "stops_at_steps",
]
