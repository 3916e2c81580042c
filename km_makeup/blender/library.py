"""The product library as this Blender sees it: shipped products, the user's folder, folders of the environment, and
products that came into this file with a look."""

from __future__ import annotations

import functools
import json
import os
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import bpy

from ..errors import MakeupError
from ..products import Library, Product
from ..products.library import PRODUCTS_VARIABLE

CARRIED = "carried_products"
"""Custom property of an object's makeup: products that came with a look and are on no shelf of this machine, as JSON."""

State = tuple[tuple[str, int, int], ...]


def user_folder() -> Path | None:
    """The user's folder of products; None where KM Makeup does not run as an extension."""
    package = (__package__ or "").split(".")
    if package[0] != "bl_ext":
        return None
    return Path(bpy.utils.extension_path_user(".".join(package[:3]), path="products", create=True))


def library() -> Library:
    """All products; read once, and again when a file of any folder has come, gone or changed.

    The folders are looked at once a second at most, since some lie on a network drive and panels draw often.
    """
    global _looked
    folder, variable = user_folder(), os.environ.get(PRODUCTS_VARIABLE, "")
    if _looked is None or time.monotonic() - _looked[0] > LOOK_EVERY or _looked[1] != (folder, variable):
        _looked = time.monotonic(), (folder, variable), _state(folder, variable)
    carried = {obj.km_makeup.get(CARRIED, "") for obj in bpy.data.objects if hasattr(obj, "km_makeup")}
    return _with_carried(folder, variable, _looked[2], tuple(sorted(carried - {""})))


@functools.lru_cache(maxsize=2)
def _with_carried(folder: Path | None, variable: str, state: State, carried: tuple[str, ...]) -> Library:
    here = _library(folder, variable, state)
    known = {product.id for product in here.products}
    for text in carried:
        for product in _products(text):
            if product.id not in known:
                known.add(product.id)
                here = replace(here, products=(*here.products, product))
    return here


def _products(text: str) -> list[Product]:
    from ..products.files import product_of

    try:
        return [product_of(data) for data in json.loads(text)]
    except (ValueError, MakeupError, TypeError, AttributeError) as error:
        print(f"KM Makeup: products kept in this file cannot be read ({error})")
        return []


def carry(obj: bpy.types.Object, products: Iterable[Product]) -> None:
    """Keep in the file those products that this machine does not have."""
    from ..products.files import product_text

    folder, variable = user_folder(), os.environ.get(PRODUCTS_VARIABLE, "")
    known = {one.id for one in _library(folder, variable, _state(folder, variable)).products}
    missing = [json.loads(product_text(product)) for product in products if product.id not in known]
    if missing:
        new = {data["id"] for data in missing}
        before = [json.loads(product_text(one)) for one in _products(obj.km_makeup.get(CARRIED, "[]"))]
        obj.km_makeup[CARRIED] = json.dumps([*(data for data in before if data["id"] not in new), *missing])


def look_again() -> None:
    """The next call of `library` looks at the folders: a product was saved."""
    global _looked
    _looked = None


LOOK_EVERY = 1.0
_looked: tuple[float, tuple[Path | None, str], State] | None = None


def _state(folder: Path | None, variable: str) -> State:
    """Name, time and size of every product file, which change with any of them; a folder's own time does not on all drives."""
    folders = [Path(one) for one in variable.split(os.pathsep) if one.strip()] + ([folder] if folder else [])
    found = []
    for one in folders:
        try:
            with os.scandir(one) as entries:
                files = [(entry.path, entry.stat()) for entry in entries if entry.name.endswith(".json")]
        except OSError:
            continue  # Library.user says so
        found += [(path, about.st_mtime_ns, about.st_size) for path, about in files]
    return tuple(sorted(found))


@functools.lru_cache(maxsize=2)
def _library(folder: Path | None, variable: str, state: State) -> Library:
    return Library.user(folder)
