"""The asset library that comes with KM Makeup, and its entry in Blender's preferences.

A manifest cannot declare an asset library: it is an entry in the user's own preferences, made and taken away only where
the user asks for it.
"""

from __future__ import annotations

from pathlib import Path

import bpy

from ..errors import MakeupError

FOLDER = Path(__file__).resolve().parents[2] / "node_groups"
"""Beside the package, in the checkout as in the installed extension."""

FILES = ("makeup_groups.blend", "makeup_brushes.blend", "blender_assets.cats.txt")
NAME = "KM Makeup"


def entries(preferences: bpy.types.Preferences) -> list[bpy.types.UserAssetLibrary]:
    """The asset libraries in the preferences that are this one, whatever they are called."""
    return [one for one in preferences.filepaths.asset_libraries if one.path and _is_ours(one.path)]


def _is_ours(path: str) -> bool:
    return Path(bpy.path.abspath(path)).resolve() == FOLDER.resolve()


def missing_files() -> list[str]:
    """Files of the library that are not there."""
    return [name for name in FILES if not (FOLDER / name).is_file()]


def add(preferences: bpy.types.Preferences) -> str:
    """Enter the library in the preferences; returns what there is to say.

    Assets are appended, not linked: a file stays whole where the extension is not installed.
    Raises MakeupError where the library is there already, or files of it are missing.
    """
    if entries(preferences):
        raise MakeupError("The Makeup assets are in the preferences already.")
    if missing := missing_files():
        raise MakeupError(f"{', '.join(missing)} is missing from {FOLDER}; install KM Makeup again.")
    library = preferences.filepaths.asset_libraries.new(name=NAME, directory=str(FOLDER))
    library.import_method = "APPEND"
    preferences.is_dirty = True
    return f"Added {library.name!r} to the asset libraries.{_saving(preferences)}"


def remove(preferences: bpy.types.Preferences) -> str:
    """Take the library out of the preferences; files stay. Raises MakeupError where it is not there."""
    found = entries(preferences)
    if not found:
        raise MakeupError("The Makeup assets are not in the preferences.")
    while found:
        preferences.filepaths.asset_libraries.remove(found[0])
        found = entries(preferences)
    preferences.is_dirty = True
    return f"Removed the Makeup assets from the asset libraries.{_saving(preferences)}"


def _saving(preferences: bpy.types.Preferences) -> str:
    """What the user has to do so that it lasts."""
    if preferences.use_preferences_save:
        return ""
    return " Save the preferences to keep this: auto-save is off."
