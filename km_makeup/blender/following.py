"""Baked textures that follow strokes: what a stroke changed is computed and drawn into the textures on the card at once.

The files and the images follow when the brush has rested: by the usual bake, which computes only what changed. Where the card
cannot be reached, or a layer is one that patches are not made for, the bake alone follows.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ..bake.islands import Dilation
from ..bake.touch import Kept, Rectangle, changed
from ..errors import MakeupError
from ..makeup.maps import CHANNELS
from . import baking, gpu_images
from .makeup import plan_of
from .reducing import smaller
from .update import stroking

REST = 1.5
"""Seconds after the last stroke before images and files follow."""

COARSE = 2
"""Mip level that a change is looked for at; what it finds is read again texel by texel, with a margin."""

MARGIN = 12


@dataclass
class Follower:
    """What is kept of one head: its maps and method, each painted image as last seen, and the work that is still to be done."""

    session_uid: int
    kept: Kept
    past: Dilation
    layers: dict[int, tuple[int, str]]
    coarse: dict[int, np.ndarray] = field(default_factory=dict)
    last_stroke: float = 0.0
    work: Generator | None = None
    seconds: float = 0.0
    """That the last stroke took."""


_followers: dict[int, Follower] = {}


def start(obj: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Follow strokes on the maps of a head whose baked textures are shown; they are baked first.

    Raises MakeupError where the bake does, or the textures cannot follow.
    """
    baking.bake_all(obj, scene)
    plan = plan_of(obj, scene)
    request = baking.request_of(obj, plan)
    layers: dict[int, tuple[int, str]] = {}
    for place, index in enumerate(plan.film_indices):
        layer = obj.km_makeup.layers[index]
        if layer.map.session_uid in layers or request.maps[place].dtype != np.uint8:
            raise MakeupError(
                "Baked textures follow strokes on 8-bit maps of one size, a layer each, without an exclusion mask; "
                "press Bake after painting instead."
            )
        if tuple(layer.map.size) != request.maps[place].shape[::-1]:
            raise MakeupError(
                f"The map {layer.map.name!r} is of another size than the textures; set Resolution to 0, or press Bake "
                "after painting."
            )
        layers[layer.map.session_uid] = (place, layer.channel)
    past = baking.past_islands(obj, request.maps[0].shape)
    kept = Kept(replace(request, half=False))  # the card rounds what is drawn into it
    follower = Follower(obj.session_uid, kept, past, layers)
    for index in plan.film_indices:
        image = obj.km_makeup.layers[index].map
        if gpu_images.usable(image):
            follower.coarse[image.session_uid] = _coarse(image)
    gpu_images.load(_shown(follower, obj).values())
    _followers[obj.session_uid] = follower
    for handlers, function in _handlers():
        if function not in handlers:
            handlers.append(function)


def stop(obj: bpy.types.Object) -> None:
    """Follow no more; what is still to be done is left to the next bake."""
    _followers.pop(obj.session_uid, None)
    for handlers, function in _handlers():
        if not _followers and function in handlers:
            handlers.remove(function)


def _handlers() -> list[tuple[list, Callable]]:
    """What Blender calls while anything is followed; opening another file takes them away."""
    on = bpy.app.handlers
    return [(on.depsgraph_update_post, after_update), (on.save_pre, catch_up), (on.render_init, catch_up)]


def follows(obj: bpy.types.Object) -> bool:
    """Whether the head's baked textures follow strokes."""
    return obj.session_uid in _followers


def seconds(obj: bpy.types.Object) -> float:
    """How long the last stroke took in Python."""
    return _followers[obj.session_uid].seconds


def after_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """After a stroke, of which Blender says only in which image it was."""
    painted = [u.id.original for u in depsgraph.updates if isinstance(u.id, bpy.types.Image)]
    for image in painted:
        for follower in list(_followers.values()):
            if image.session_uid in follower.layers:
                _stroke(follower, image)


def _stroke(follower: Follower, image: bpy.types.Image) -> None:
    obj = _head(follower)
    if obj is None or obj.km_makeup.path != "BAKED":
        return
    start = time.perf_counter()
    place = _patched(follower, obj, image)
    follower.last_stroke = time.perf_counter()
    follower.seconds = follower.last_stroke - start
    follower.work = None
    if place is not None:
        obj.update_tag()
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas:
                area.tag_redraw()
    if not bpy.app.timers.is_registered(_when_at_rest):
        bpy.app.timers.register(_when_at_rest, first_interval=REST)


def _patched(follower: Follower, obj: bpy.types.Object, image: bpy.types.Image) -> Rectangle | None:
    """Compute what changed and draw it into the textures; None where that cannot be, or nothing changed."""
    index, channel = follower.layers[image.session_uid]
    found = _changed_place(follower, image)
    if found is None:
        return None
    height, width = follower.kept.maps[index].shape
    texels = gpu_images.read(image, found)[..., CHANNELS.index(channel)]
    follower.kept.maps[index][found.slices] = texels
    shown = _shown(follower, obj)
    divisor = width // shown["R"].size[0]
    place = follower.past.follow(follower.kept.maps[index], found).aligned(gpu_images.ALIGNED * divisor, height, width)
    whole = dict(zip(follower.kept.request.textures, follower.kept.patch(place).textures))
    between = follower.kept.request.reference if obj.km_makeup.baked_simply else None
    for name, part in smaller(whole, between, divisor).items():
        gpu_images.write(shown[name], place.divided(divisor), part)
    return place


def _shown(follower: Follower, obj: bpy.types.Object) -> dict[str, bpy.types.Image]:
    """The textures that the head shows, by name; R_up only where the plan calls for it."""
    every = {name: getattr(obj.km_makeup, f"baked_{name}") for name in follower.kept.request.textures}
    return {name: image for name, image in every.items() if image is not None}


def _changed_place(follower: Follower, image: bpy.types.Image) -> Rectangle | None:
    """Where an image changed since it was last seen, with a margin; by its mip-map, so that little is read."""
    if image.session_uid not in follower.coarse:
        return None
    before, now = follower.coarse[image.session_uid], _coarse(image)
    follower.coarse[image.session_uid] = now
    found = changed(before, now)
    if found is None:
        return None
    width, height = image.size
    sides = (found.top << COARSE, found.bottom << COARSE, found.left << COARSE, found.right << COARSE)
    return Rectangle(*sides).grown(MARGIN, height, width)


def _coarse(image: bpy.types.Image) -> np.ndarray:
    """A mip level of an image, (rows, columns) of four bytes as one number."""
    width, height = image.size
    whole = Rectangle(0, height >> COARSE, 0, width >> COARSE)
    return np.ascontiguousarray(gpu_images.read(image, whole, COARSE)).view(np.uint32)[..., 0]


def _head(follower: Follower) -> bpy.types.Object | None:
    return next((obj for obj in bpy.data.objects if obj.session_uid == follower.session_uid), None)


def _when_at_rest() -> float | None:
    """A timer: when the brush has rested, the bake follows in small steps; ends when all is done."""
    if stroking():
        return REST
    left = False
    for follower in list(_followers.values()):
        if not follower.last_stroke:
            continue
        if time.perf_counter() - follower.last_stroke < REST or _bake_step(follower):
            left = True
        elif (obj := _head(follower)) is not None:
            gpu_images.load(_shown(follower, obj).values())
    return 0.02 if left else None


def _bake_step(follower: Follower) -> bool:
    """A step of the bake that follows; whether there are more."""
    obj = _head(follower)
    if obj is None:
        return False
    if follower.work is None:
        follower.work = baking.bake_steps(obj, bpy.context.scene)
    try:
        if next(follower.work, None) is not None:
            return True
    except MakeupError as error:
        obj.km_makeup["problem"] = str(error)
    follower.work, follower.last_stroke = None, 0.0
    return False


def catch_up(*_: object) -> None:
    """Before a render or a save: the bake that was to follow is done now."""
    for follower in list(_followers.values()):
        while follower.last_stroke and _bake_step(follower):
            pass
