"""What an object's highlights are made from: its films' finishes, the lamps of the scene, and what the artist chose."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..effects import Plan
from ..makeup import Coat
from ..makeup.finish import Finish, covered, dimming, distinct, top_lobe
from ..optics import HighlightRule
from ..products import Product
from ..spectra import Bands
from .lamps import LampLight, Lamps, lamps_of
from .lobes import Highlights, Shown
from .nodes.weights import FilmHighlight
from .shaders import PRINCIPLED, outputs_of, shader_nodes

USUAL_ROUGHNESS = 0.45
"""Roughness of skin where a texture gives it: it only decides which finishes share a lobe in EEVEE."""


def film_highlights(
    obj: bpy.types.Object, plan: Plan, products: Sequence[Product], coats: Sequence[Coat], bands: Bands
) -> list[FilmHighlight]:
    """What each planned film does to highlights, bottom to top."""
    kinds = _kinds(plan, products)[1]
    paper = by_maps(obj, plan)
    return [
        FilmHighlight(
            image=layer.map,
            channel="RGBA".index(layer.channel),
            strength=layer.strength,
            thickness_mm=one.thickness_mm,
            powder=one.powder,
            kind=kind,
            passed=dimming(one, bands) if paper else None,
        )
        for layer, one, kind in zip(_layers(obj, plan), coats, kinds)
    ]


def finishes_of(plan: Plan, products: Sequence[Product]) -> tuple[Finish, ...]:
    """The distinct finishes of films, as their `FilmHighlight.kind` counts them."""
    return _kinds(plan, products)[0]


def by_maps(obj: bpy.types.Object, plan: Plan) -> bool:
    """Whether highlights need the painted maps even over baked textures: the paper dims by every film's transmittance."""
    return plan.lamp_highlights.on and HighlightRule[obj.km_makeup.highlight_rule] is HighlightRule.PAPER


def highlights_of(
    obj: bpy.types.Object, scene: bpy.types.Scene, plan: Plan, products: Sequence[Product], coats: Sequence[Coat]
) -> Highlights:
    """How the object's materials make their highlights."""
    makeup = obj.km_makeup
    joint = plan.path.on and not by_maps(obj, plan)
    finishes, kinds = _kinds(plan, products)
    seen = _seen(_layers(obj, plan), coats, kinds, len(finishes))
    count = min(1, len(finishes)) if joint else len(finishes)
    top = top_lobe(_skin_roughness(obj), finishes, seen, joint)
    planned = {effect.key.removeprefix("lamp:") for effect in plan.shine.each_lamp if effect.on}
    chosen = tuple(lamp for lamp in lamps_for(obj, scene).chosen if lamp.name in planned)
    lamps = LampLight(chosen, makeup.highlight_shadows, world_shines(scene))
    on_top = tuple(number + 1 for number in top if number < count) if plan.shine.second.on else ()
    return Highlights(count, on_top, Shown[makeup.highlight_shown], lamps if plan.lamp_highlights.on else None)


def lamps_for(obj: bpy.types.Object, scene: bpy.types.Scene) -> Lamps:
    """The lamps that give the object a highlight, by the light they send to its middle."""
    corners = [obj.matrix_world @ Vector(corner) for corner in obj.bound_box]
    return lamps_of(scene, sum(corners, Vector()) / len(corners))


def world_shines(scene: bpy.types.Scene) -> bool:
    """Whether the world may give any light."""
    if scene.world is None:
        return False
    tree = scene.world.node_tree
    backgrounds = [n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground"] if tree else []
    others = (
        [n for n in tree.nodes if n.bl_idname not in ("ShaderNodeBackground", "ShaderNodeOutputWorld")] if tree else []
    )
    if others or not backgrounds:
        return bool(others) or (tree is None and max(tuple(scene.world.color)) > 0)
    return any(max(n.inputs["Color"].default_value[:3]) * n.inputs["Strength"].default_value > 0 for n in backgrounds)


def _layers(obj: bpy.types.Object, plan: Plan) -> list[bpy.types.PropertyGroup]:
    return [obj.km_makeup.layers[i] for i in plan.film_indices]


def _kinds(plan: Plan, products: Sequence[Product]) -> tuple[tuple[Finish, ...], tuple[int, ...]]:
    """The distinct finishes, and each film's among them; -1 for films that keep the highlight below them."""
    own = [index not in plan.shine.plain for index in plan.film_indices]
    finishes, kinds = distinct([Finish(p.finish.roughness, p.finish.f0) for p, one in zip(products, own) if one])
    numbers = iter(kinds)
    return finishes, tuple(next(numbers) if one else -1 for one in own)


def _seen(
    layers: Sequence[bpy.types.PropertyGroup], coats: Sequence[Coat], kinds: Sequence[int], count: int
) -> NDArray:
    """Roughly how much of each finish is seen: painted share of the map times coverage at full thickness."""
    seen = np.zeros(count)
    for layer, one, kind in zip(layers, coats, kinds):
        if kind < 0:
            continue
        full = np.array([layer.map_max if layer.map_max > 0 else 1.0])
        seen[kind] += layer.coverage * float(covered(full, one.thickness_mm, one.powder)[0])
    return seen


def _skin_roughness(obj: bpy.types.Object) -> float:
    """Roughness of the skin's shader, where it is a number."""
    for entry in obj.km_makeup.slots:
        for output in outputs_of(entry.original)[:1]:
            for node in shader_nodes(output.inputs["Surface"]):
                if node.bl_idname == PRINCIPLED and not node.inputs["Roughness"].is_linked:
                    return float(node.inputs["Roughness"].default_value)
    return USUAL_ROUGHNESS
