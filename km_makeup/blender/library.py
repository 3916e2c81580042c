"""The product library as this Blender sees it: shipped products, the user's folder, folders of the environment."""

from __future__ import annotations

import functools
import os
from pathlib import Path

import bpy

from ..products import Library


def user_folder() -> Path | None:
    """The user's folder of products; None where KM Makeup does not run as an extension."""
    package = (__package__ or "").split(".")
    if package[0] != "bl_ext":
        return None
    return Path(bpy.utils.extension_path_user(".".join(package[:3]), path="products", create=True))


def library() -> Library:
    """All products; read once, and again when a folder has changed."""
    folder = user_folder()
    stamp = folder.stat().st_mtime_ns if folder and folder.is_dir() else 0
    return _library(folder, os.environ.get("KM_MAKEUP_PRODUCTS", ""), stamp)


@functools.lru_cache(maxsize=2)
def _library(folder: Path | None, variable: str, stamp: int) -> Library:
    return Library.user(folder)
