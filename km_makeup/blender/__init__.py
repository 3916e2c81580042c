"""Everything that imports bpy: properties, operators, panels, node builders, bakes into the scene."""

from __future__ import annotations

import bpy

from . import ui
from .update import keep_painted_maps

_commands: list[object] = []


def register() -> None:
    """Register classes and the command line; imports no colour science, opens no file, builds nothing."""
    ui.register()
    bpy.app.handlers.save_pre.append(keep_painted_maps)
    _commands.append(bpy.utils.register_cli_command("km_makeup", _command))


def unregister() -> None:
    """Take it all away again; makeup in the open file stays as it is."""
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    bpy.app.handlers.save_pre.remove(keep_painted_maps)
    ui.unregister()


def _command(arguments: list[str]) -> int:
    from ..cli import main

    return main(arguments)
