"""Materials of a head as they are under some settings, kept as copies, so that a render can go from one to the other at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import bpy

from ..update import paused


@dataclass(frozen=True)
class Dressed:
    """Copies of the materials in the slots (index, material) of a head."""

    obj: bpy.types.Object
    materials: tuple[tuple[int, bpy.types.Material], ...]

    def wear(self) -> None:
        """Put them on."""
        for index, material in self.materials:
            if self.obj.material_slots[index].material != material:
                self.obj.material_slots[index].material = material

    def throw_away(self) -> None:
        """Delete the copies; what is worn instead must be put on first. `makeup.clean_up` deletes the groups they leave."""
        for _, material in self.materials:
            bpy.data.materials.remove(material)


def wear_own(obj: bpy.types.Object) -> None:
    """Put on what the head's makeup says, instead of a copy."""
    for entry in obj.km_makeup.slots:
        own = entry.made or entry.original
        if obj.material_slots[entry.index].material != own:
            obj.material_slots[entry.index].material = own


def worn(obj: bpy.types.Object) -> tuple[tuple[int, bpy.types.Material], ...]:
    """The materials in the slots that carry makeup, as they are."""
    return tuple((entry.index, obj.material_slots[entry.index].material) for entry in obj.km_makeup.slots)


def kept(obj: bpy.types.Object, name: str) -> Dressed:
    """Copies of what the head wears now."""
    copies = []
    for index, material in worn(obj):
        copy = material.copy()
        copy.name = f"{material.name} ({name})"
        copies.append((index, copy))
    return Dressed(obj, tuple(copies))


@contextmanager
def settings(obj: bpy.types.Object, scene: bpy.types.Scene, **values: object) -> Iterator[None]:
    """The makeup built with other settings inside the block; afterwards the settings are as they were, and nothing is rebuilt.

    It is planned for EEVEE whatever was rendered last (``both_engines`` for Cycles as well): for Cycles no light would be left to
    the compositor.
    """
    from ..makeup import refresh

    wear_own(obj)
    makeup, engine = obj.km_makeup, scene.render.engine
    before = {name: getattr(makeup, name) for name in values}
    with paused():
        try:
            scene.render.engine = "BLENDER_EEVEE"
            for name, value in values.items():
                setattr(makeup, name, value)
            refresh(obj, scene)
            yield
        finally:
            for name, value in before.items():
                setattr(makeup, name, value)
            scene.render.engine = engine
