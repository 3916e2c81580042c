"""The chosen material slots, with the way back to the original materials."""

from __future__ import annotations

import bpy
from bpy.props import CollectionProperty, IntProperty, PointerProperty, StringProperty

from ...update import setting_changed, tiles_changed


class KM_PG_slot(bpy.types.PropertyGroup):
    """A material slot under makeup, with what it held before."""

    index: IntProperty(name="Slot", description="Index of the material slot, from 0")
    original: PointerProperty(type=bpy.types.Material, name="Original", description="The skin material, untouched")
    made: PointerProperty(type=bpy.types.Material, name="With Makeup", description="The copy that carries the makeup")
    link: StringProperty(name="Link", description="Whether the slot belonged to the object or to its data")


class SetUpProperties:
    """Properties of Object.km_makeup."""

    slots: CollectionProperty(type=KM_PG_slot, name="Slots", description="The material slots that makeup lies on")
    uv_map: StringProperty(
        name="UV Map", description="UV map that the cosmetic maps are painted on", update=setting_changed
    )
    tiles: StringProperty(
        name="Tiles",
        description="UDIM tiles that makeup lies on, such as 1001 1002; empty: all that the skin has. They share one map, so fewer "
        "tiles get more texels each. What is painted moves along; a tile that is left out keeps its paint in the old map",
        update=tiles_changed,
    )
