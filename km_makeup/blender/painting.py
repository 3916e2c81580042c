"""Texture Paint set up for makeup: the map of the selected layer as canvas, and a brush whose value is thickness.

White is the layer's full thickness, black is none. Brush assets of Blender's own are used; what is set on them are the
settings of the paint mode (colour, strength), which stay the artist's to change.
"""

from __future__ import annotations

from enum import Enum

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

from ..errors import MakeupError
from .images import COSMETIC_MAP, IMAGE_KIND

FIRST_PRODUCT = "blush-rose"
"""Product of the layer that Set Up makes: it is seen on every skin at the first stroke."""

ESSENTIALS = "brushes/essentials_brushes-mesh_texture.blend/Brush/"


class Stroke(Enum):
    """What a stroke does: the brush asset, and the colour it lays (None: it lays none)."""

    PAINT = ("Paint Soft", 1.0)
    ERASE = ("Paint Soft", 0.0)
    SOFTEN = ("Blur", None)

    @property
    def brush(self) -> str:
        return self.value[0]

    @property
    def colour(self) -> float | None:
        return self.value[1]


def maps_of(obj: bpy.types.Object) -> list[bpy.types.Image]:
    """The maps that a brush may paint for this object, the exclusion mask among them."""
    makeup = obj.km_makeup
    return [image for image in (*(layer.map for layer in makeup.layers), makeup.exclusion) if image is not None]


def active_map(obj: bpy.types.Object) -> bpy.types.Image | None:
    """What the brush should paint on: the selected layer's map, or the exclusion mask while it is edited."""
    makeup = obj.km_makeup
    if makeup.paints_exclusion:
        return makeup.exclusion
    if not makeup.layers:
        return None
    return makeup.layers[max(0, min(makeup.active, len(makeup.layers) - 1))].map


def follow_layer(obj: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Make the map of the selected layer the canvas of a head that is being painted, unless an image of another kind is."""
    paint = scene.tool_settings.image_paint
    wanted = active_map(obj)
    ours = paint.canvas is None or paint.canvas.get(IMAGE_KIND) == COSMETIC_MAP or paint.canvas in maps_of(obj)
    if obj.mode == "TEXTURE_PAINT" and wanted is not None and (paint.mode == "MATERIAL" or ours):
        set_canvas(scene, wanted)


def set_canvas(scene: bpy.types.Scene, image: bpy.types.Image) -> None:
    """Make an image what Texture Paint paints on."""
    paint = scene.tool_settings.image_paint
    if paint.mode != "IMAGE":
        paint.mode = "IMAGE"
    if paint.canvas != image:
        paint.canvas = image


def is_painted(obj: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """Whether a stroke on this object now would go to the map that is meant."""
    paint = scene.tool_settings.image_paint
    return obj.mode == "TEXTURE_PAINT" and paint.mode == "IMAGE" and paint.canvas == active_map(obj) is not None


def enter(context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """Go into Texture Paint on the selected layer's map and its UV map.

    Raises MakeupError where there is no map, or the object cannot be painted.
    """
    wanted = active_map(obj)
    if wanted is None:
        raise MakeupError(f"The selected layer of {obj.name!r} has no map; press New Map, or load one.")
    if obj.hide_viewport or not obj.visible_get():
        raise MakeupError(f"{obj.name!r} is hidden in the viewport; show it before painting.")
    uv = obj.data.uv_layers.get(obj.km_makeup.uv_map)
    if uv is None:
        raise MakeupError(f"{obj.name!r} has no UV map named {obj.km_makeup.uv_map!r}; press Set Up Makeup again.")
    obj.km_makeup.show = True  # one paints what one sees
    obj.data.uv_layers.active = uv  # Texture Paint in image mode paints on the active one
    set_canvas(context.scene, wanted)
    if obj.mode != "TEXTURE_PAINT" and not bpy.app.background:
        bpy.ops.object.mode_set(mode="TEXTURE_PAINT")


def take_brush(context: bpy.types.Context, stroke: Stroke, mark: float = 1.0) -> None:
    """Take a brush for the stroke. ``mark``: thickness the brush lays, 0..1 of the layer's full thickness.

    Painting and erasing each have the flow that they had when they were left.
    """
    paint = context.scene.tool_settings.image_paint
    left, holder = stroke_of(context.scene), flow_of(context.scene)
    if left is not None and holder is not None:
        _flows[left] = holder.strength
    if not bpy.app.background:
        bpy.ops.brush.asset_activate(
            asset_library_type="ESSENTIALS", relative_asset_identifier=ESSENTIALS + stroke.brush
        )
    unified = paint.unified_paint_settings
    unified.use_unified_color = True
    if stroke.colour is not None:
        unified.color = (stroke.colour * mark,) * 3
    brush = paint.brush
    if brush is not None and stroke.colour is not None:
        brush.blend = "MIX"
        flow_of(context.scene).strength = _flows.get(stroke, 1.0)  # type: ignore[union-attr]


SHARE_OF_VIEW = 0.045
"""Radius of the first brush as a share of the viewport's height: about a cheek's on a head that fills it."""


def fit_brush(context: bpy.types.Context) -> None:
    """Make the brush as large as suits a head that is framed in this viewport."""
    if context.area is not None and context.area.type == "VIEW_3D":
        unified = context.scene.tool_settings.image_paint.unified_paint_settings
        unified.use_unified_size = True
        unified.size = max(12, round(SHARE_OF_VIEW * context.area.height))


FLOW = {
    "blush": 0.3, "bronzer": 0.3, "contour": 0.3, "highlighter": 0.3, "powder": 0.25, "eyeshadow": 0.4, "foundation": 0.5,
    "concealer": 0.5, "primer": 0.5,
}  # fmt: skip
"""How much of its value a stroke of a first brush lays, by kind of product: what is blended builds up, the others cover."""


_flows: dict[Stroke, float] = {}


def fit_flow(scene: bpy.types.Scene, kind: str) -> None:
    """Make the brush lay as much at a stroke as suits a product of this kind, now or when it is taken up."""
    _flows[Stroke.PAINT] = FLOW.get(kind, 1.0)
    holder = flow_of(scene)
    if holder is not None and stroke_of(scene) is Stroke.PAINT:
        holder.strength = _flows[Stroke.PAINT]


def flow_of(scene: bpy.types.Scene) -> bpy.types.Brush | bpy.types.UnifiedPaintSettings | None:
    """What holds the strength of the brush in hand: the brush, or the settings that all brushes share."""
    paint = scene.tool_settings.image_paint
    return paint.unified_paint_settings if paint.unified_paint_settings.use_unified_strength else paint.brush


def stroke_of(scene: bpy.types.Scene) -> Stroke | None:
    """What the brush that is in hand does, None where it is another than those of makeup."""
    paint = scene.tool_settings.image_paint
    brush = paint.brush
    if brush is None:
        return None
    if brush.image_brush_type == "SOFTEN":
        return Stroke.SOFTEN
    if brush.image_brush_type != "DRAW":
        return None
    return Stroke.ERASE if max(paint.unified_paint_settings.color) == 0 else Stroke.PAINT


def show_materials(context: bpy.types.Context) -> None:
    """Show the viewport that the mouse is in, else the largest one, in Material Preview, if it shows no materials."""
    if context.window is None:
        return
    views = [area for area in context.window.screen.areas if area.type == "VIEW_3D"]
    if context.area is not None and context.area.type == "VIEW_3D":
        views = [context.area]
    for area in sorted(views, key=lambda one: -one.width * one.height)[:1]:
        shading = area.spaces.active.shading
        if shading.type in {"SOLID", "WIREFRAME"}:
            shading.type = "MATERIAL"


LEAST, MOST = 0.3, 1.5
"""Height of the object on the screen, as a share of the viewport's, outside which it is framed by Set Up."""


def bring_into_view(context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """Frame the object in this viewport where it is not reasonably in view; a view through a camera is left alone."""
    region, space = context.region, context.space_data
    if context.window is None or space is None or space.type != "VIEW_3D" or context.area is None:
        return
    view = space.region_3d
    if view.view_perspective == "CAMERA":
        return
    window = next((one for one in context.area.regions if one.type == "WINDOW"), region)
    height = window.height
    corners = [location_3d_to_region_2d(window, view, obj.matrix_world @ Vector(c)) for c in obj.bound_box]
    seen = [c for c in corners if c is not None]
    if len(seen) == len(corners):
        low, high = min(c.y for c in seen), max(c.y for c in seen)
        inside = low < 0.8 * height and high > 0.2 * height
        if inside and LEAST * height < high - low < MOST * height:
            return
    with context.temp_override(region=window):
        for other in context.selected_objects:
            other.select_set(other == obj)
        obj.select_set(True)
        bpy.ops.view3d.view_selected()
