"""Makeup on an object: set up, rebuilt after changes, taken off again.

The skin's own materials are never changed: each chosen slot gets a copy that carries the makeup, and only
while the plan lists a film. The slot and its original are remembered, so taking off is putting back.
"""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ..effects import Engine, Plan, Switch, everything, make_plan
from ..errors import MakeupError
from ..makeup import Coat, coat, interface_of
from ..makeup.udim import TileLayout
from ..products import Product
from ..spectra import Bands, bands
from . import compositor, fitting, images, keyed, udim
from .calibration import calibration_here
from .copies import MADE, ORIGINAL, delete, delete_unused, groups_in, put_back_joined
from .facts import engines_of, facts_of, product_of, thickness_of, to_be_painted
from .highlights import by_maps, film_highlights, finishes_of, highlights_of
from .lobes import Highlights
from .nodes.groups import (
    KIND,
    BakedNodes,
    FilmNodes,
    GroupSettings,
    Parts,
    is_ours,
    makeup_group,
    retune,
    signature_of,
)
from .nodes.weights import FilmHighlight
from .shaders import apply_makeup
from .skin import Skin, skin_of
from .slots import check_slot, default_uv_map, original_of, skin_slots
from .update import paused

DRESSING = "km_makeup_dressing"
"""How a copy's shaders were rewired; while that is the same, only the group in it is changed."""


def set_up(obj: bpy.types.Object, slots: list[int] | None = None, uv_map: str | None = None) -> None:
    """Make an object ready for makeup; nothing is visible before a layer is painted.

    Parameters: ``slots`` indices of the skin's material slots (default: those that `skin_slots` takes for skin);
    ``uv_map`` the UV map the cosmetic maps lie on (default: the active one).

    Raises MakeupError where the object has no mesh, UV map or material to work with; it is then as before.
    """
    if obj.type != "MESH":
        raise MakeupError(f"{obj.name!r} is not a mesh; select the head's mesh object.")
    if obj.library or obj.override_library:
        raise MakeupError(
            f"{obj.name!r} is linked from another file, where makeup cannot be kept; append it instead of linking, or "
            "make it local (Object > Relations > Make Local)."
        )
    layers = obj.data.uv_layers
    if not layers:
        raise MakeupError(
            f"{obj.name!r} has no UV map, so there is nothing to paint on; unwrap it first (UV > Unwrap)."
        )
    uv_map = udim.source_of(obj.data, uv_map or default_uv_map(obj, slots))
    if uv_map not in layers:
        raise MakeupError(
            f"{obj.name!r} has no UV map named {uv_map!r}; it has {', '.join(layer.name for layer in layers)}."
        )
    chosen = skin_slots(obj) if slots is None else slots
    if not chosen:
        raise MakeupError(
            f"{obj.name!r} has no material that makeup can lie on; give it a skin material with a Principled shader."
        )
    for index in chosen:
        check_slot(obj, index)
    materials = [original_of(obj.material_slots[index].material) for index in chosen]
    placing = udim.placing(obj, uv_map, chosen, materials, obj.km_makeup.tiles)
    moved = _moved_maps(obj, uv_map, placing.layout if placing else None)
    if placing:
        uv_map = udim.place(obj, placing)
    if obj.km_makeup.slots:
        remove(obj, keep_layers=True)
    with paused():
        if moved:
            obj.km_makeup.path = "LIVE"  # what was baked lies where the skin was before
        obj.km_makeup.uv_map = uv_map
        obj.km_makeup["tiles_taken"] = obj.km_makeup.tiles
        for index in chosen:
            entry = obj.km_makeup.slots.add()
            entry.index, entry.original, entry.link = (
                index,
                original_of(obj.material_slots[index].material),
                obj.material_slots[index].link,
            )
        for holder, name, image in moved:
            setattr(holder, name, images.replaced(getattr(holder, name), image))
    if not placing:
        udim.forget(obj)


Moved = list[tuple[bpy.types.PropertyGroup, str, images.MovedMap]]


def _moved_maps(obj: bpy.types.Object, source: str, now: TileLayout | None) -> Moved:
    """The maps where their tiles will lie, by who holds them; none where they stay, or lie on another UV map altogether.

    Raises MakeupError where a map cannot be moved; nothing is changed here.
    """
    makeup = obj.km_makeup
    before = udim.layout_of(obj.data, makeup.uv_map)
    if not makeup.slots or before == now or udim.source_of(obj.data, makeup.uv_map) != source:
        return []
    holders = [*((layer, "map") for layer in makeup.layers), (makeup, "exclusion")]
    return [
        (holder, name, images.moved(getattr(holder, name), before, now))
        for holder, name in holders
        if getattr(holder, name) is not None
    ]


def remove(obj: bpy.types.Object, keep_layers: bool = False) -> None:
    """Take the makeup off: every slot holds its original material again, as it was; those of joined objects too."""
    _bare(obj)
    put_back_joined(obj)
    obj.km_makeup.slots.clear()
    if not keep_layers:
        obj.km_makeup.layers.clear()
        udim.forget(obj)
        with paused():
            obj.km_makeup.path, obj.km_makeup.show, obj.km_makeup.tiles = "LIVE", True, ""
            obj.km_makeup.exclusion, obj.km_makeup.paints_exclusion = None, False
        for texture in ("R", "T2", "R_up", "albedo", "finish"):
            setattr(obj.km_makeup, f"baked_{texture}", None)


def _bare(obj: bpy.types.Object) -> None:
    """Put the originals back into the slots and delete the copies that nothing uses any more."""
    _follow_slots(obj)
    gone = not obj.material_slots  # all slots were deleted by hand: the skin would be lost with them
    for entry in obj.km_makeup.slots:
        if gone and entry.original is not None and not obj.data.library:
            obj.data.materials.append(entry.original)
        elif entry.index < len(obj.material_slots):
            _put_back(obj, entry)
        made, entry.made = entry.made, None
        delete(made)


def _put_back(obj: bpy.types.Object, entry: bpy.types.PropertyGroup) -> None:
    """Put the original into its slot, unless the user put in another material, or deleted the original."""
    slot = obj.material_slots[entry.index]
    if entry.original is None or (slot.material is not None and slot.material != entry.made):
        return
    if entry.link == "DATA" and slot.link == "OBJECT":
        slot.material = None
        slot.link = "DATA"
    if slot.material == entry.original:
        return
    if slot.link == "DATA" and _made_up_by_another(obj, slot.material):
        slot.link = "OBJECT"
    stale, slot.material = slot.material, entry.original
    delete(stale)


def _made_up_by_another(obj: bpy.types.Object, material: bpy.types.Material | None) -> bool:
    """Whether another object wears this material of ours on the same mesh."""
    return material is not None and any(
        other != obj and other.data == obj.data and any(entry.made == material for entry in other.km_makeup.slots)
        for other in bpy.data.objects
    )


def _follow_slots(obj: bpy.types.Object) -> None:
    """Slots that were moved since are found again by what they hold."""
    held = [slot.material for slot in obj.material_slots]
    for entry in obj.km_makeup.slots:
        mine = entry.made or entry.original
        if mine in held and (entry.index >= len(held) or held[entry.index] != mine):
            entry.index = held.index(mine)


def _check_set_up(obj: bpy.types.Object) -> None:
    """MakeupError where the object no longer has what it was set up with."""
    if not obj.km_makeup.slots:
        raise MakeupError(f"{obj.name!r} has no makeup; press Set Up first.")
    names = [layer.name for layer in obj.data.uv_layers]
    if obj.km_makeup.uv_map not in names:
        raise MakeupError(
            f"{obj.name!r} has no UV map named {obj.km_makeup.uv_map!r} any more (it has {', '.join(names) or 'none'}); "
            "press Set Up Makeup again."
        )
    _follow_slots(obj)
    for entry in obj.km_makeup.slots:
        if entry.index >= len(obj.material_slots):
            raise MakeupError(f"{obj.name!r} has no slot {entry.index + 1} any more; press Set Up Makeup again.")
        held = obj.material_slots[entry.index].material
        if held is not None and not held.get(MADE) and held != entry.original:
            raise MakeupError(
                f"Slot {entry.index + 1} of {obj.name!r} holds {held.name!r} now, not the material that makeup was set "
                "up on; press Set Up Makeup again."
            )
        if entry.original is None:
            raise MakeupError(
                f"The original material of slot {entry.index + 1} of {obj.name!r} was deleted; put the skin's material "
                "into the slot and press Set Up Makeup."
            )


def plan_of(
    obj: bpy.types.Object, scene: bpy.types.Scene | None = None, baked: bool | None = None, any_view: bool = False
) -> Plan:
    """What this object's makeup needs.

    ``baked``: for textures, or live films, whatever is shown now; ``any_view``: for every view, not those of the scene's cameras.
    """
    scene = scene or bpy.context.scene
    makeup = obj.km_makeup
    facts = facts_of(obj, scene)
    if baked is not None:
        facts = replace(facts, baked=baked)
    if any_view:
        facts = replace(
            facts,
            view=replace(facts.view, any_view=True, visible=True),
            layers=tuple(replace(x, seen=True) for x in facts.layers),
        )
    if makeup.everything:
        return _said_of_strokes(obj, everything(facts))
    said = {one.name: Switch(one.switch.lower()) for one in makeup.overrides}
    budget = makeup.budget_ms if makeup.use_budget else None
    made = make_plan(facts, makeup.tolerance, said, budget, _plan_so_far(obj), calibration_here())
    return _said_of_strokes(obj, made)


def _said_of_strokes(obj: bpy.types.Object, plan: Plan) -> Plan:
    """The plan, which says of the layer to be painted that it is planned for its strokes, not for what its map holds."""
    films = tuple(
        replace(one, reason="to be painted: planned as if it were there in full")
        if one.on and to_be_painted(obj, index) and obj.km_makeup.layers[index].switch == "AUTO"
        else one
        for index, one in enumerate(plan.films)
    )
    return replace(plan, films=films)


_plans: dict[int, Plan] = {}
"""The plan that each object was last built by, by session_uid."""


def _plan_so_far(obj: bpy.types.Object) -> Plan | None:
    """The plan to stay near to, so that nothing flickers in a window; rendered files do not depend on what was there before."""
    return None if bpy.app.background else planned(obj)


def planned(obj: bpy.types.Object) -> Plan | None:
    """The plan that the object was last built by in this session."""
    return _plans.get(obj.session_uid)


def light_of(obj: bpy.types.Object) -> str:
    """The light that colours are computed for, as `spectra.light_spectrum` takes it."""
    makeup = obj.km_makeup
    return bpy.path.abspath(makeup.light_file) if makeup.light == "OWN" else makeup.light


def skin_under(obj: bpy.types.Object) -> Skin:
    """The skin of the object's original materials."""
    _check_set_up(obj)
    return skin_of([entry.original for entry in obj.km_makeup.slots], obj)


def stack_of(obj: bpy.types.Object, plan: Plan) -> tuple[list[Product], list[Coat]]:
    """Products and coats of the films that the plan lists, bottom to top."""
    layers = [obj.km_makeup.layers[i] for i in plan.film_indices]
    products = [product_of(layer) for layer in layers]
    return products, [coat(p, thickness_of(obj, i)) for p, i in zip(products, plan.film_indices)]


def refresh(obj: bpy.types.Object, scene: bpy.types.Scene | None = None, anew: bool = False) -> Plan:
    """Bring the object's materials to what its layers say; build what the plan lists, and nothing else.

    Where only numbers changed they are set in the nodes that are there; ``anew`` copies the materials again.
    """
    scene = scene or bpy.context.scene
    _check_set_up(obj)
    plan = plan_of(obj, scene)
    _plans[obj.session_uid] = plan
    compositor.follow(scene, [plan, *(_plan_known(one, scene) for one in compositor.heads_of(scene) if one != obj)])
    if not plan.touches_material:
        _bare(obj)
        return plan
    parts = _baked_parts(obj, plan) if plan.path.on else _live_parts(obj, plan)
    engines = engines_of(obj, scene)
    products, coats = stack_of(obj, plan)
    highlights = highlights_of(obj, scene, plan, products, coats)
    settings = GroupSettings(
        obj.km_makeup.uv_map,
        plan.finish.on,
        finishes_of(plan, products) if plan.finish.on else (),
        obj.km_makeup.exclusion,
        udim.least_u(obj),
    )
    if anew or not _retuned(obj, parts, settings, engines, highlights, plan):
        group = makeup_group(parts, settings, f"KM Makeup {obj.name}")
        for entry in obj.km_makeup.slots:
            _dress(obj, entry, group, engines, highlights, plan)
    for entry in obj.km_makeup.slots:
        _follow_keys(obj, entry, plan)
        _wear(obj, entry)
    return plan


def _plan_known(obj: bpy.types.Object, scene: bpy.types.Scene) -> Plan:
    return _plans.get(obj.session_uid) or plan_of(obj, scene)


def _follow_keys(obj: bpy.types.Object, entry: bpy.types.PropertyGroup, plan: Plan) -> None:
    """Films whose layers have keys: the nodes' factors get keys that follow them."""
    if plan.path.on or entry.made is None:
        return
    for node in _makeup_nodes(entry.made.node_tree):
        for number, index in enumerate(plan.film_indices, 1):
            keyed.follow(obj, index, node.node_tree.nodes[f"Strength {number}"].inputs[1])


def _retuned(
    obj: bpy.types.Object,
    parts: Parts,
    settings: GroupSettings,
    engines: frozenset[Engine],
    highlights: Highlights,
    plan: Plan,
) -> bool:
    """Bring the group in the object's copies to ``parts``; False where the copies have to be made anew."""
    for entry in obj.km_makeup.slots:
        if entry.made is None or entry.made.get(DRESSING) != _dressing(entry, engines, highlights, plan):
            return False
        if _made_up_by_another(obj, entry.made):
            return False
    nodes = [node for entry in obj.km_makeup.slots for node in _makeup_nodes(entry.made.node_tree)]
    groups = list(dict.fromkeys(node.node_tree for node in nodes))
    if len(groups) != 1:
        return False
    (group,) = groups
    if retune(group, parts, settings):
        return True
    new = makeup_group(parts, settings, f"KM Makeup {obj.name}")
    for node in nodes:
        node.node_tree = new
    delete_unused([group, *groups_in(group)])
    return True


def _dressing(entry: bpy.types.PropertyGroup, engines: frozenset[Engine], highlights: Highlights, plan: Plan) -> str:
    """All that the rewiring of a material depends on, as a short hash."""
    effects = [plan.scatters, plan.shine.normals.on, plan.screen_diffusion.on, plan.dither.on, plan.finish.on]
    return signature_of(entry.original.name, sorted(engine.name for engine in engines), effects, highlights.marks())


def _makeup_nodes(tree: bpy.types.NodeTree) -> list[bpy.types.Node]:
    """The instances of a makeup group in a copy's tree, inside its own groups too."""
    found = []
    for node in tree.nodes:
        inner = getattr(node, "node_tree", None)
        if inner is None:
            continue
        if is_ours(inner):
            found += [node] if inner[KIND] == "makeup" else []
        else:
            found += _makeup_nodes(inner)
    return found


def _wear(obj: bpy.types.Object, entry: bpy.types.PropertyGroup) -> None:
    """Put the copy into its slot, or the original while the face is shown without makeup."""
    slot = obj.material_slots[entry.index]
    wanted = entry.made if obj.km_makeup.show else entry.original
    if slot.material == wanted:
        return
    if slot.link == "DATA" and (obj.data.users > 1 or obj.data.library):
        slot.link = "OBJECT"
    slot.material = wanted


def _dress(
    obj: bpy.types.Object,
    entry: bpy.types.PropertyGroup,
    group: bpy.types.NodeTree,
    engines: frozenset[Engine],
    highlights: Highlights,
    plan: Plan,
) -> None:
    """Make a copy of one slot's skin material with the makeup group in it."""
    material = entry.original.copy()
    material.name = f"{entry.original.name} with Makeup"
    material[MADE], material[ORIGINAL] = True, entry.original
    material[DRESSING] = _dressing(entry, engines, highlights, plan)

    def instance(tree: bpy.types.NodeTree) -> bpy.types.Node:
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        return node

    apply_makeup(
        material, instance, engines, highlights,
        plan.screen_diffusion.on, plan.dither.on, plan.scatters, plan.shine.normals.on,
    )  # fmt: skip
    old, entry.made = entry.made, material
    _wear(obj, entry)
    delete(old)


def _live_parts(obj: bpy.types.Object, plan: Plan) -> list[FilmNodes]:
    if not plan.any_film:
        return []
    products, coats = stack_of(obj, plan)
    skin = fitting.SkinColours.of(skin_under(obj))
    live = plan.film_indices
    below = [[k for k in range(n) if (live[k], live[n]) in plan.meeting] for n in range(len(live))]
    space = bpy.data.colorspace.working_space
    transfers = fitting.transfers(coats, skin, interface_of(products), light_of(obj), space, below)
    layers = [obj.km_makeup.layers[i] for i in plan.film_indices]
    for layer, transfer in zip(layers, transfers):
        layer.swatch = transfer.apply(np.array(1.0), skin.colours.mean(axis=0)).clip(0, 1)
    highlights = film_highlights(obj, plan, products, coats, _bands_of(obj))
    return [
        FilmNodes(highlight, transfer, product.name)
        for highlight, transfer, product in zip(highlights, transfers, products)
    ]


def _bands_of(obj: bpy.types.Object) -> Bands:
    return bands(light_of(obj), bpy.data.colorspace.working_space)


def _baked_parts(obj: bpy.types.Object, plan: Plan) -> BakedNodes:
    makeup = obj.km_makeup
    passed = makeup.baked_T2 is not None and (makeup.baked_R_up is not None or makeup.baked_simply)
    if makeup.baked_R is None or not (passed or (makeup.finished and makeup.baked_albedo is not None)):
        raise MakeupError(f"{obj.name!r} has no baked textures yet; press Bake, or set Colour to Live.")
    albedo = makeup.baked_albedo if makeup.finished else None
    return BakedNodes(
        R=makeup.baked_R,
        T2=None if albedo else makeup.baked_T2,
        R_up=None if albedo else makeup.baked_R_up,
        albedo=albedo,
        finish=makeup.baked_finish if plan.finish.on else None,
        highlights=_highlights_by_maps(obj, plan),
    )


def _highlights_by_maps(obj: bpy.types.Object, plan: Plan) -> tuple[FilmHighlight, ...]:
    if not by_maps(obj, plan):
        return ()
    return tuple(film_highlights(obj, plan, *stack_of(obj, plan), _bands_of(obj)))


def clean_up() -> int:
    """Delete our groups that nothing uses; how many there were."""
    unused = [tree for tree in bpy.data.node_groups if is_ours(tree) and not tree.users]
    for tree in unused:
        bpy.data.node_groups.remove(tree)
    return len(unused)
