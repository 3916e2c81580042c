"""Node groups written as formulas, and the groups that KM Makeup is built from."""

from .expression import Colour, Scalar, Tree
from .groups import baked_group, film_group, makeup_group

__all__ = ["Colour", "Scalar", "Tree", "baked_group", "film_group", "makeup_group"]
