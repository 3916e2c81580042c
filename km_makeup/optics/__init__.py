"""The optics of makeup, with numpy alone: films and stacks of films, the air interface, K and S from measurements,
highlights, diffusion in the skin, powder.

K and S in 1/mm, thickness in mm, reflectances 0..1; everything broadcasts and keeps float32 or float64.
"""

from .films import Film, Stack, as_stack, film, film_over, lay, opaque_reflectance, over, stack
from .interfaces import Interface, air_interface, apparent, fresnel_diffuse, internal, saunderson, unsaunderson
from .inversion import Inversion, Status, free_film, invert, invert_backings

__all__ = [
    "Film",
    "Interface",
    "Inversion",
    "Stack",
    "Status",
    "air_interface",
    "apparent",
    "as_stack",
    "film",
    "film_over",
    "free_film",
    "fresnel_diffuse",
    "internal",
    "invert",
    "invert_backings",
    "lay",
    "opaque_reflectance",
    "over",
    "saunderson",
    "stack",
    "unsaunderson",
]
