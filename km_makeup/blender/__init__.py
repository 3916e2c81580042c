"""Everything that imports bpy: properties, operators, panels, node builders, bakes into the scene."""

from __future__ import annotations

import sys

import bpy

from . import ui
from .update import after_undo, finish_textures, keep_painted_maps

_commands: list[object] = []
_HANDLERS = (
    ("save_pre", keep_painted_maps),
    ("undo_post", after_undo),
    ("redo_post", after_undo),
    ("load_post", after_undo),
    ("load_post", finish_textures),
)


def register() -> None:
    """Register classes and the command line; imports no colour science, opens no file, builds nothing."""
    ui.register()
    for event, function in _HANDLERS:
        getattr(bpy.app.handlers, event).append(function)
    _commands.append(bpy.utils.register_cli_command("km_makeup", _command))


def unregister() -> None:
    """Take it all away again; makeup in the open file stays as it is."""
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    for event, function in _HANDLERS:
        getattr(bpy.app.handlers, event).remove(function)
    ui.unregister()
    for name in ("gpu_bake", "gpu_images"):
        if (module := sys.modules.get(f"{__package__}.{name}")) is not None:
            module.forget()


def _command(arguments: list[str]) -> int:
    from ..cli import main

    return main(arguments)
