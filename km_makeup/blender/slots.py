"""Which material slots of an object are its skin, what they hold without makeup, and the UV map that the skin is drawn on."""

from __future__ import annotations

import bpy

from ..errors import MakeupError
from .copies import MADE, ORIGINAL
from .shaders import skin_colour_sockets
from .skin import colour_uv_maps, looks_like_skin


def skin_slots(obj: bpy.types.Object) -> list[int]:
    """Usable slots that look like skin: no eyes, hair, teeth and the like by name, no glass; all usable ones if none does."""
    usable = usable_slots(obj)
    held = [obj.material_slots[i].material for i in usable]
    return [i for i, one in zip(usable, held) if looks_like_skin(one, (original_of(one) or one).name)] or usable


def usable_slots(obj: bpy.types.Object) -> list[int]:
    """Indices of the slots whose material has a shader that can carry makeup."""
    result = []
    for index, slot in enumerate(obj.material_slots):
        try:
            if slot.material is not None and skin_colour_sockets(slot.material):
                result.append(index)
        except MakeupError:
            continue
    return result


def check_slot(obj: bpy.types.Object, index: int) -> None:
    """MakeupError where a slot has no material that makeup can lie on, or a copy of ours whose original is lost."""
    if not 0 <= index < len(obj.material_slots) or obj.material_slots[index].material is None:
        raise MakeupError(f"{obj.name!r} has no material in slot {index + 1}; choose a slot that has one.")
    material = obj.material_slots[index].material
    if original_of(material) is None:
        raise MakeupError(
            f"{material.name!r} in slot {index + 1} of {obj.name!r} is a copy that carries makeup, and its original is "
            "not known here; put the skin's own material into the slot and press Set Up Makeup."
        )
    skin_colour_sockets(material)


def default_uv_map(obj: bpy.types.Object, slots: list[int] | None = None) -> str:
    """The UV map that the skin's colour is drawn on, else the one that the object is rendered with."""
    layers = obj.data.uv_layers
    rendered = next((layer.name for layer in layers if layer.active_render), layers[0].name)
    chosen = skin_slots(obj) if slots is None else slots
    held = [obj.material_slots[i].material for i in chosen if i < len(obj.material_slots)]
    drawn = {name for one in held if one and original_of(one) for name in colour_uv_maps(original_of(one))}
    named = [name for name in drawn if name in layers]
    return named[0] if len(drawn) == len(named) == 1 else rendered


def original_of(material: bpy.types.Material) -> bpy.types.Material | None:
    """The skin material itself, or of a copy of ours the one that it was made from; None where that is lost."""
    if not material.get(MADE):
        return material
    entries = (entry for obj in bpy.data.objects for entry in obj.km_makeup.slots)
    known = next((entry.original for entry in entries if entry.made == material), None)
    return known or material.get(ORIGINAL)
