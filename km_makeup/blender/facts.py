"""What a plan is made from: the object's layers, its skin, the lamps, cameras and textures of its scene, as plain data."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..accuracy import conditions
from ..effects import Engine, LampFacts, LayerFacts, SceneFacts, SkinFacts, Switch, TextureFacts, ViewFacts
from ..errors import MakeupError
from ..makeup import coat
from ..makeup.finish import Finish as Gloss
from ..makeup.statistics import MapStatistics, joint
from ..optics.diffusion import fit_gaussians
from ..products import Finish, Product
from . import compositor, images, keyed, seen, views
from .compositor.profiles import BURLEY, distances_of
from .lamps import irradiance_at, lamps_of, solid_angle
from .library import library
from .shaders import BUMP, NORMAL_MAP, PRINCIPLED, outputs_of, shader_nodes
from .skin import skin_of

GAUSSIANS = 4
"""By so many the plan sees a profile that only the renderer draws."""

LEAST_HALF = 0.3
"""Of a lamp behind the head, or seen from anywhere: skin that mirrors it at more than some 70 degrees is a thin rim."""

MIRRORED = 6
"""Rounds in which the place is found that mirrors a lamp."""

PAINTED_SHARE = 0.2
"""Of the map, that the layer to be painted is taken to cover at least, and of whatever lies beside it."""

UNKNOWN_WORLD = 0.5
"""Radiance of a world that is not one colour, and strength of a sun in it: it is not read."""


def engines_of(obj: bpy.types.Object, scene: bpy.types.Scene) -> frozenset[Engine]:
    """The engines that the object's materials are built for."""
    if obj.km_makeup.both_engines:
        return frozenset(Engine)
    return frozenset({engine_of(scene)})


def engine_of(scene: bpy.types.Scene) -> Engine:
    """The engine that the scene renders with; EEVEE for any that is not Cycles."""
    engine: str = scene.render.engine
    return Engine.CYCLES if engine == "CYCLES" else Engine.EEVEE


def product_of(layer: bpy.types.PropertyGroup) -> Product:
    """The product of a layer, with the finish and the form that the layer puts in place of the product's own."""
    product = library().find(layer.product)
    if layer.own_finish:
        product = replace(product, finish=Finish(layer.roughness, layer.f0))
    if layer.form != "PRODUCT":
        product = replace(product, form=layer.form.lower())
    return product


def thickness_of(obj: bpy.types.Object, index: int) -> float:
    """Full thickness of a layer's film in micrometres, the greatest over time."""
    layer = obj.km_makeup.layers[index]
    return keyed.greatest(obj, index, "thickness_um", layer.thickness_um)


_known: dict[int, SceneFacts] = {}
"""What each object's last plan was made from, by session_uid."""


def facts_known(obj: bpy.types.Object, scene: bpy.types.Scene) -> SceneFacts:
    """Facts as they were last gathered, for the object's last plan; a panel asks whenever it is drawn."""
    return _known.get(obj.session_uid) or facts_of(obj, scene)


def facts_of(obj: bpy.types.Object, scene: bpy.types.Scene) -> SceneFacts:
    """Facts about the object in its scene.

    In a window the active layer is the one to be painted: it counts as if it were there in its full thickness, in view, and on the
    others, whatever its map holds now. So strokes call for nothing that is not built, and nothing is built while one paints.
    """
    facts = _known[obj.session_uid] = _gathered(obj, scene)
    return facts


def _gathered(obj: bpy.types.Object, scene: bpy.types.Scene) -> SceneFacts:
    makeup = obj.km_makeup
    maps = _maps(obj)
    view = views.view_of(obj, scene)
    layers = tuple(_layer(obj, index, maps) for index in range(len(makeup.layers)))
    facts = SceneFacts(
        layers,
        engines_of(obj, scene),
        _finish(makeup),
        makeup.scattering == "SCREEN",
        compositor.stops_at_steps(scene),
        makeup.highlight == "LAMPS",
        renders=engine_of(scene),
        baked=makeup.path == "BAKED",
        finished=makeup.finished,
        view=view,
        light=bpy.path.abspath(makeup.light_file) if makeup.light == "OWN" else makeup.light,
        space=str(bpy.data.colorspace.working_space),
    )
    present = [i for i, one in enumerate(layers) if one.mapped and one.enabled and one.map_max > 0]
    if not makeup.slots or not (present or facts.screen_diffusion or any(one.edited for one in layers)):
        return facts
    lamps, left_out = _lamps(obj, scene, view)
    sizes = [maps[i].shape for i in present]
    size = max(sizes, key=lambda shape: shape[0] * shape[1], default=(0, 0))
    where = seen.seen_by(obj, scene, view)
    return replace(
        facts,
        layers=tuple(
            replace(one, seen=one.edited or i not in maps or where.shows(maps[i])) if one.map_max > 0 else one
            for i, one in enumerate(layers)
        ),
        lamps=lamps,
        lamps_left_out=left_out,
        world=_world(scene),
        skin=_skin(obj, scene),
        textures=TextureFacts(size, where.texels_per_mm(size), makeup.resolution),
        meets=_meets(maps, present, layers),
    )


def _finish(makeup: bpy.types.PropertyGroup) -> Switch:
    """Whether films have a highlight of their own: they must where only the skin's or only the films' are shown."""
    if makeup.finish == "AUTO" and makeup.highlight_shown != "ALL":
        return Switch.ON
    return Switch(makeup.finish.lower())


def _maps(obj: bpy.types.Object) -> dict[int, MapStatistics]:
    layers = enumerate(obj.km_makeup.layers)
    return {i: images.statistics(layer.map, layer.channel) for i, layer in layers if layer.map is not None}


def _layer(obj: bpy.types.Object, index: int, maps: Mapping[int, MapStatistics]) -> LayerFacts:
    layer = obj.km_makeup.layers[index]
    product = product_of(layer)
    if not math.isfinite(layer.thickness_um):
        raise MakeupError(f"The thickness of layer {layer.name!r} is not a number; give it one in µm.")
    known = maps.get(index)
    strength = keyed.greatest(obj, index, "strength", layer.strength)
    layer.map_max = known.maximum * strength if known else 0.0
    layer.coverage = known.coverage if known else 0.0
    alone = any(other.solo for other in obj.km_makeup.layers)
    shown = keyed.greatest(obj, index, "enabled", float(layer.enabled)) > 0
    thickness = thickness_of(obj, index)
    painted = layer.map is not None and to_be_painted(obj, index)
    return LayerFacts(
        name=layer.name or product.name,
        product=product.id,
        thickness_mm=thickness / 1000,
        map_max=max(layer.map_max, strength) if painted else layer.map_max,
        coverage=max(layer.coverage, PAINTED_SHARE) if painted else layer.coverage,
        enabled=shown and (layer.solo or not alone),
        internal=product.interface == "internal",
        switch=Switch(layer.switch.lower()),
        mapped=layer.map is not None,
        edited=to_be_painted(obj, index),
        keyed=keyed.names(obj, index),
        coat=coat(product, thickness),
        finish=Gloss(product.finish.roughness, product.finish.f0),
        detail=known.detail if known else {},
    )


def to_be_painted(obj: bpy.types.Object, index: int) -> bool:
    """Whether a layer is the one that strokes go to, in a window."""
    return index == obj.km_makeup.active and not bpy.app.background


def _meets(
    maps: Mapping[int, MapStatistics], present: list[int], layers: Sequence[LayerFacts]
) -> dict[tuple[int, ...], float]:
    """By sets of two and three layers the share of the map that all of them cover, or may come to cover."""
    found: dict[tuple[int, ...], float] = {}
    for size in (2, 3):
        for one in combinations(present, size):
            if size == 2 or all(found[pair] > 0 for pair in combinations(one, 2)):
                others = tuple(i for i in one if not layers[i].edited)
                painted = len(others) < len(one)
                beside = layers[others[0]].coverage if len(others) == 1 else found.get(others, 0.0)
                found[one] = max(_joint(tuple(maps[i] for i in one)), PAINTED_SHARE * beside if painted else 0.0)
    return found


@functools.lru_cache(maxsize=64)
def _joint_of(marks: tuple[int, ...]) -> list[float]:
    """A place to keep what maps share, by their identities."""
    return []


def _joint(maps: tuple[MapStatistics, ...]) -> float:
    kept = _joint_of(tuple(one.mark for one in maps))
    if not kept:
        kept.append(joint(list(maps)))
    return kept[0]


def _lamps(obj: bpy.types.Object, scene: bpy.types.Scene, view: ViewFacts) -> tuple[tuple[LampFacts, ...], str]:
    corners = [obj.matrix_world @ Vector(corner) for corner in obj.bound_box]
    place = sum(corners, Vector()) / len(corners)
    lamps = lamps_of(scene, place)
    radius = min(max(c[i] for c in corners) - min(c[i] for c in corners) for i in range(3)) / 2
    eyes = [] if view.any_view else [eye.matrix_world for eye in views.cameras_in(scene)]
    found = [
        LampFacts(
            one.name,
            irradiance_at(one, place),
            solid_angle(one, place),
            view_dot_half=_view_dot_half(one, place, radius, eyes),
        )
        for one in lamps.chosen
    ]
    if _world_is_unknown(scene) or (not found and not any(_world(scene)) and _something_glows(scene)):
        found.append(LampFacts("World", (math.pi * UNKNOWN_WORLD,) * 3, 1e-3, real=False))
    return tuple(found), lamps.sentence


def light_shares(obj: bpy.types.Object, scene: bpy.types.Scene) -> dict[str, float]:
    """Shares of the light on the object by kind, as `accuracy.conditions` has them."""
    lamps, _ = _lamps(obj, scene, ViewFacts(any_view=True))
    return conditions.light_shares(lamps, (0.0, 0.0, 0.0) if _world_is_unknown(scene) else _world(scene))


def _view_dot_half(lamp: bpy.types.Object, place: Vector, radius: float, eyes: Sequence[Matrix]) -> float:
    """The least cosine between the direction of a camera and the half vector of camera and lamp, where a ball of this radius mirrors
    the lamp, its far edge too: a lamp that is near or wide is mirrored much more grazing than its middle is from the ball's."""
    cosines = [_mirrored(lamp, place, radius, eye.translation) for eye in eyes]
    return max(LEAST_HALF, min(cosines)) if cosines else LEAST_HALF


def _mirrored(lamp: bpy.types.Object, place: Vector, radius: float, eye: Vector) -> float:
    """The same for one camera."""
    matrix = lamp.matrix_world
    sun = lamp.data.type == "SUN"
    half, cosine, angle = Vector(), 1.0, 0.0
    for _ in range(MIRRORED):
        point = place + radius * half
        away = matrix.translation - point
        towards = (matrix.col[2].xyz if sun else away).normalized()
        view = (eye - point).normalized()
        half = (towards + view).normalized()
        cosine = max(-1.0, min(1.0, half.dot(view)))
        angle = math.asin(min(1.0, math.sqrt(solid_angle(lamp, point) / math.pi)))
    return math.cos(min(math.acos(cosine) + angle / 2, math.pi / 2))


def _background(scene: bpy.types.Scene) -> list[bpy.types.Node]:
    tree = scene.world.node_tree if scene.world else None
    return [node for node in tree.nodes if node.bl_idname not in ("ShaderNodeOutputWorld",)] if tree else []


def _world_is_unknown(scene: bpy.types.Scene) -> bool:
    return any(node.bl_idname != "ShaderNodeBackground" for node in _background(scene))


def _world(scene: bpy.types.Scene) -> tuple[float, float, float]:
    """Radiance of the world, RGB."""
    if scene.world is None:
        return (0.0, 0.0, 0.0)
    nodes = _background(scene)
    if not nodes:
        r, g, b = scene.world.color if scene.world.node_tree is None else (0.0, 0.0, 0.0)
        return r, g, b
    if _world_is_unknown(scene):
        return (UNKNOWN_WORLD,) * 3
    total = np.zeros(3)
    for node in nodes:
        total += np.array(node.inputs["Color"].default_value[:3]) * node.inputs["Strength"].default_value
    return float(total[0]), float(total[1]), float(total[2])


def _something_glows(scene: bpy.types.Scene) -> bool:
    """Whether any material of the scene may give light."""
    for obj in scene.objects:
        for slot in obj.material_slots:
            tree = slot.material.node_tree if slot.material else None
            for node in tree.nodes if tree else ():
                if node.bl_idname == "ShaderNodeEmission" or node.bl_idname == "ShaderNodeGroup":
                    return True
                strength = node.inputs.get("Emission Strength")
                if strength is not None and (strength.is_linked or strength.default_value > 0):
                    return True
    return False


def _skin(obj: bpy.types.Object, scene: bpy.types.Scene) -> SkinFacts:
    originals = [entry.original for entry in obj.km_makeup.slots if entry.original is not None]
    skin = skin_of(originals, obj)
    order = np.argsort(skin.colours.mean(axis=1))
    chosen = skin.colours[list(dict.fromkeys((order[len(order) // 2], order[0], order[-1])))]
    colours = [skin.mean, *chosen] if len(skin.colours) > 1 else [skin.mean]
    variances, weights = _profile(obj, scene)
    return SkinFacts(
        tuple(tuple(float(c) for c in one) for one in colours),
        *_surface(originals),
        _relief(originals),
        variances,
        weights,
    )


def _profile(
    obj: bpy.types.Object, scene: bpy.types.Scene
) -> tuple[tuple[float, ...], tuple[tuple[float, float, float], ...]]:
    """Gaussians of the skin's own subsurface scattering, narrowest first."""
    if obj.km_makeup.scattering == "SCREEN":
        profile = compositor.planned_profile(scene, obj)
        order = np.argsort(profile.variances)
        return tuple(profile.variances[order].tolist()), tuple(tuple(w) for w in profile.weights[order].tolist())
    found = np.maximum(distances_of(obj, scene), distances_of(obj, scene, BURLEY))  # as Cycles and as EEVEE reads them
    if not len(found):
        return (), ()
    d = np.exp(np.mean(np.log(np.maximum(found, 1e-4)), axis=0))
    unit = _unit_profile()
    variances, weights = [], []
    for v, (w,) in zip(unit.variances, unit.weights):
        for channel in range(3):
            variances.append(float(v * d[channel] ** 2))
            weights.append(tuple(float(w) if i == channel else 0.0 for i in range(3)))
    order = np.argsort(variances, kind="stable")
    return tuple(variances[i] for i in order), tuple(weights[i] for i in order)


@functools.cache
def _unit_profile():  # type: ignore[no-untyped-def]
    return fit_gaussians(1.0, GAUSSIANS)


def _surface(materials: list[bpy.types.Material]) -> tuple[Gloss, tuple[float, float, float]]:
    """The skin's own roughness and F0, and weight, roughness and F0 of its coat, where they are numbers."""
    for material in materials:
        for output in outputs_of(material)[:1]:
            for node in shader_nodes(output.inputs["Surface"]):
                if node.bl_idname == PRINCIPLED:
                    return _principled(node)
    return Gloss(0.45, 0.0), (0.0, 0.1, 0.04)


def _principled(node: bpy.types.Node) -> tuple[Gloss, tuple[float, float, float]]:
    def number(name: str, otherwise: float) -> float:
        socket = node.inputs[name]
        return otherwise if socket.is_linked else float(socket.default_value)

    def f0(ior: float) -> float:
        return ((ior - 1) / (ior + 1)) ** 2

    finish = Gloss(number("Roughness", 0.45), 2 * number("Specular IOR Level", 0.5) * f0(number("IOR", 1.45)))
    return finish, (number("Coat Weight", 1.0), number("Coat Roughness", 0.1), f0(number("Coat IOR", 1.5)))


def _relief(materials: list[bpy.types.Material]) -> float:
    """Strength of the normal or bump maps that feed the skin's shaders; 1 where it is no number."""
    found = 0.0
    for material in materials:
        for output in outputs_of(material)[:1]:
            for node in shader_nodes(output.inputs["Surface"]):
                if node.bl_idname == "ShaderNodeGroup":
                    found = max(found, 1.0)
                socket = node.inputs.get("Normal")
                source = socket.links[0].from_node if socket is not None and socket.is_linked else None
                if source is not None and source.bl_idname in (NORMAL_MAP, BUMP):
                    strength = source.inputs["Strength"]
                    found = max(found, 1.0 if strength.is_linked else float(strength.default_value))
    return found
