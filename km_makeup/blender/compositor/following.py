"""The diffusion group as the plan wants it: put in, made narrower or taken out as scene and makeup change.

What the artist asked for (profile, number of Gaussians, steps) is kept on the scene. A group that was put in by a script
without asking stays as it is.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Sequence

import bpy

from ...effects import Plan
from ...optics.diffusion import GaussianProfile
from .placing import find, insert, remove
from .profiles import COUNT, Profile, bare_profile, chosen_profile, distances_of, sharpened
from .scale import finest_scale, heads_of, refusal

ASKED = "km_makeup_diffusion_asked"
"""Custom property of a scene: what was asked for, as JSON."""

PLANNED = "km_makeup_diffusion_planned"
"""Custom property of the node: what it was made for."""


def ask(
    scene: bpy.types.Scene,
    profile: Profile,
    distances: Sequence[float],
    gaussians: int,
    steps: bool,
    split: bool = True,
) -> None:
    """Keep what the artist asks of the diffusion: profile (with its own distances, mm), at most so many Gaussians, stop at steps,
    blur half of the skin's colour."""
    asked = {
        "profile": profile.name,
        "distances": list(distances),
        "gaussians": gaussians,
        "steps": steps,
        "split": split,
    }
    scene[ASKED] = json.dumps(asked)


def stops_at_steps(scene: bpy.types.Scene) -> bool:
    """Whether light is asked to stop at steps in depth; it is unless the artist said otherwise."""
    return bool(json.loads(scene.get(ASKED) or "{}").get("steps", True))


def planned_profile(scene: bpy.types.Scene, head: bpy.types.Object) -> GaussianProfile:
    """The profile asked for, quick enough for every plan: what films send back does not widen it."""
    asked = json.loads(scene.get(ASKED) or "{}")
    kind, count = Profile[asked.get("profile", "OWN")], asked.get("gaussians", COUNT)
    if kind is Profile.OWN:
        return bare_profile(distances_of(head, scene), count)
    return _chosen(kind, tuple(asked["distances"]), count)


@functools.lru_cache(maxsize=16)
def _chosen(kind: Profile, distances: tuple[float, ...], count: int) -> GaussianProfile:
    return chosen_profile(kind, [], bpy.context.scene, distances, count)


def forget(scene: bpy.types.Scene) -> None:
    """Nothing is asked for any more."""
    if scene.get(ASKED) is not None:
        del scene[ASKED]


def follow(scene: bpy.types.Scene, plans: list[Plan]) -> None:
    """Bring the scene's compositor to what the plans of its heads list. Nothing happens where nothing was asked for."""
    if scene.get(ASKED) is None:
        return
    diffused = [plan for plan in plans if plan.screen_diffusion.on]
    if not diffused or refusal(scene):
        remove(scene)
        return
    asked = json.loads(scene[ASKED])
    left_out = min(plan.light.left_out for plan in diffused)
    aware = stops_at_steps(scene) and any(plan.light.depth.on for plan in diffused)
    made_for = json.dumps([asked, left_out, aware, finest_scale(scene)])
    node = find(scene)
    if node is not None and node.get(PLANNED) == made_for:
        return
    kind = Profile[asked["profile"]]
    heads = sorted(heads_of(scene), key=lambda head: head.name)
    profile = chosen_profile(kind, heads, scene, asked["distances"], asked["gaussians"])
    insert(scene, sharpened(profile, left_out), aware, split=asked.get("split", True))[PLANNED] = made_for
