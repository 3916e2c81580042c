"""Installs the zip named last into this Blender's user folder, enables it once, and says what is there then."""

import json
import sys

import bpy

NAME = "bl_ext.user_default.km_makeup"

result = bpy.ops.extensions.package_install_files(filepath=sys.argv[-1], repo="user_default", enable_on_install=True)
enabled = NAME in bpy.context.preferences.addons

import colour  # noqa: E402 -- the bundled wheel, or in the bpy module the one of the environment

print()
print(
    json.dumps(
        {
            "result": sorted(result),
            "enabled": enabled,
            "property": hasattr(bpy.types.Object, "km_makeup"),
            "package": sys.modules[f"{NAME}.km_makeup"].__file__,
            "colour": colour.__file__,
            "colour_version": colour.__version__,
        }
    )
)
