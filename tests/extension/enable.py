"""Registers the installed extension in a fresh Blender: how long that takes, what it imports, what disabling leaves."""

import importlib
import json
import sys
import time

import bpy  # isort: skip -- the bpy module makes the next one importable
import addon_utils

NAME = "bl_ext.user_default.km_makeup"

addon_utils.extensions_refresh(ensure_wheels=True)
before = set(sys.modules)
start = time.perf_counter()
module = importlib.import_module(NAME)
read = time.perf_counter()
module.register()
done = time.perf_counter()
imported = {name.split(".")[0] for name in set(sys.modules) - before}
registered = hasattr(bpy.types.Object, "km_makeup")
colour, image_io = "colour" in sys.modules, "OpenImageIO" in sys.modules
module.unregister()

enabled = addon_utils.enable(NAME, handle_error=lambda error: sys.exit(f"{type(error).__name__}: {error}"))
addon_utils.disable(NAME)
left = hasattr(bpy.types.Object, "km_makeup")
addon_utils.enable(NAME, handle_error=lambda error: sys.exit(f"again: {type(error).__name__}: {error}"))

print()
print(
    json.dumps(
        {
            "import_milliseconds": (read - start) * 1e3,
            "register_milliseconds": (done - read) * 1e3,
            "enabled": enabled is not None,
            "imported": sorted(imported),
            "colour": colour,
            "OpenImageIO": image_io,
            "registered": registered,
            "left_after_disabling": left,
            "registered_again": hasattr(bpy.types.Object, "km_makeup"),
        }
    )
)
