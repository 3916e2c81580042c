"""KM Makeup as a Blender extension: Blender asks this file, at the root, for register and unregister."""

if __package__ and __package__.startswith("bl_ext."):  # and not when a test runner comes by
    from .km_makeup.blender import register, unregister

    __all__ = ["register", "unregister"]
