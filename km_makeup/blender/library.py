"""The product library as this Blender sees it: shipped products, the user's folder, folders of the environment."""

from __future__ import annotations

import functools
import os
import time
from pathlib import Path

import bpy

from ..products import Library
from ..products.library import PRODUCTS_VARIABLE

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
    return _library(folder, variable, _looked[2])


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
