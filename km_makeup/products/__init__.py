"""The spectral material database: products, the pigments and recipes they are made of, and their files.

A product is a cosmetic as a Kubelka-Munk material: K and S in 1/mm on 380-780 nm @ 5 nm, its finish, and where
its numbers come from.
"""

from .files import read_product, write_product
from .library import PRODUCTS_VARIABLE, Library
from .product import Finish, Form, InterfaceKind, Product, Provenance, Status

__all__ = [
    "PRODUCTS_VARIABLE",
    "Finish",
    "Form",
    "InterfaceKind",
    "Library",
    "Product",
    "Provenance",
    "Status",
    "read_product",
    "write_product",
]
