"""The optics of makeup, with numpy alone: films and stacks of films, the air interface, K and S from measurements,
highlights, diffusion in the skin, powder.

K and S in 1/mm, thickness in mm, reflectances 0..1; everything broadcasts and keeps float32 or float64.
"""

from .diffusion import SKIN, GaussianProfile, burley, burley_distance, burley_within, fit_gaussians, reduced, widened
from .films import Film, Stack, as_stack, film, film_over, lay, opaque_reflectance, over, stack
from .fitting import FilmsInversion, invert_films
from .interfaces import (
    DiffuseFresnel,
    Interface,
    air_interface,
    apparent,
    fresnel_diffuse,
    internal,
    saunderson,
    unsaunderson,
)
from .inversion import Inversion, Status, free_film, invert, invert_backings
from .microfacets import HighlightRule, kelemen, kelemen_albedo, lay_highlights, schlick, unscattered
from .powder import PowderRule, powder, powder_difference, powder_over

__all__ = [
    "SKIN",
    "DiffuseFresnel",
    "Film",
    "FilmsInversion",
    "GaussianProfile",
    "HighlightRule",
    "Interface",
    "Inversion",
    "PowderRule",
    "Stack",
    "Status",
    "air_interface",
    "apparent",
    "as_stack",
    "burley",
    "burley_distance",
    "burley_within",
    "film",
    "film_over",
    "fit_gaussians",
    "free_film",
    "fresnel_diffuse",
    "internal",
    "invert",
    "invert_backings",
    "invert_films",
    "kelemen",
    "kelemen_albedo",
    "lay",
    "lay_highlights",
    "opaque_reflectance",
    "over",
    "powder",
    "powder_difference",
    "powder_over",
    "reduced",
    "saunderson",
    "schlick",
    "stack",
    "unsaunderson",
    "unscattered",
    "widened",
]
