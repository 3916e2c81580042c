"""The layers of an object, what is left out of them, and whether they are shown."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, CollectionProperty, FloatProperty, IntProperty, PointerProperty

from ...update import active_changed, exclusion_changed, setting_changed
from ..layer.properties import KM_PG_layer


def _paint_settings() -> bpy.types.UnifiedPaintSettings:
    return bpy.context.scene.tool_settings.image_paint.unified_paint_settings


def _value_of_brush(_: object) -> float:
    return max(*_paint_settings().color)


def _set_value_of_brush(_: object, value: float) -> None:
    _paint_settings().use_unified_color = True
    _paint_settings().color = (value,) * 3


class LayersProperties:
    """Properties of Object.km_makeup."""

    layers: CollectionProperty(type=KM_PG_layer, name="Layers", description="The films, from the skin to the air")
    active: IntProperty(
        name="Active Layer",
        description="The layer that is shown and painted, counted from 0 at the skin",
        update=active_changed,
    )
    show: BoolProperty(
        name="Makeup",
        description="Show the face with makeup; off: the bare skin, as before (renders show it too)",
        default=True,
        update=setting_changed,
    )
    exclusion: PointerProperty(
        type=bpy.types.Image,
        name="Exclusion Mask",
        description="Image whose white keeps all makeup away: brows, lashes, nostrils; Non-Color",
        update=exclusion_changed,
    )
    paints_exclusion: BoolProperty(
        name="Paint Mask", description="The brush paints on the exclusion mask, not on the layer", update=active_changed
    )
    brush_value: FloatProperty(
        name="Brush Value",
        description="What a stroke brings the map to (0..1 of the layer's full thickness); it is the brush's colour",
        min=0, max=1, subtype="FACTOR", precision=2, get=_value_of_brush, set=_set_value_of_brush,
        options={"SKIP_SAVE"},
    )  # fmt: skip
