"""Textures: how large they need to be at this scale, live films or baked ones, what changes over time, dither near black."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from .calibration import Calibration
from .effect import Account, Cost, Effect, because
from .facts import Engine, SceneFacts
from .light import scale_of
from .states import CLOSURE_STEP, DITHERED_BELOW, KEPT_AS, States, rounding

TEXELS_A_PIXEL = 2.0
"""Texels that a pixel's width needs: with fewer, edges of paint are softer than the picture."""

STEPS, LEAST = (2, 4, 8), 64
"""By what textures may be smaller than the maps, and texels that they have at least."""

AVERAGED = 0.02
"""Part of the detail of a box of texels that is seen in a pixel that holds two by two of such boxes or more: textures are averaged
as mip-maps are, so little but their filter differs."""


def resolution(
    facts: SceneFacts, states: States | None, live: Sequence[int], account: Account, calibration: Calibration
) -> tuple[Effect, int]:
    """Texture resolution, and by what the maps' own is divided when baking (1, 2, 4 or 8)."""
    key, name = "texture", "Texture resolution"
    height, width = facts.textures.size
    planes = (2 if facts.finished else 3) + 1
    cost = Cost(0.0, 0, planes, planes * height * width * 8 / 1e6)
    if not live:
        return Effect(key, name, False, "no film", 0.0), 1
    if not facts.baked:
        return Effect(key, name, True, f"{width}x{height}, the painted maps themselves", None), 1
    if facts.textures.asked:
        return Effect(key, name, True, f"{facts.textures.asked} texels, as asked for", None, cost), 1
    density, scale = facts.textures.texels_per_mm, scale_of(facts)
    if density <= 0 or states is None:
        return Effect(key, name, True, f"{width}x{height}: their size on the skin is not known", None, cost), 1
    fits = [step for step in STEPS if density / step >= TEXELS_A_PIXEL * scale and min(height, width) // step >= LEAST]
    losses = [account.once(("texture", step, states.sets), partial(_loss, facts, states, live, step)) for step in fits]
    losses = [account.rounded(loss, rounding(facts, states)) for loss in losses]
    reason = f"{width}x{height}: {density / scale:.2g} texels a pixel of the picture"
    if not fits:
        return Effect(key, name, True, reason, None, cost), 1
    said = account.said(key)
    for divisor, loss in zip(fits[::-1], losses[::-1]):
        if account.leaves_out(key, loss, rounds=True):
            small = f"{width // divisor}x{height // divisor} of {width}x{height}"
            reason = f"{small}: {density / divisor / scale:.2g} texels a pixel"
            less = Cost(0.0, 0, planes, cost.mb / divisor**2)
            return Effect(key, name, True, because(said, reason), loss, less, reduced=True, said=said), divisor
    return Effect(key, name, True, because(said, reason), losses[-1], cost, said=said), 1


def _loss(facts: SceneFacts, states: States, live: Sequence[int], step: int) -> float:
    """What is lost of fine paint in textures of 1/step of the size."""
    worst = 0.0
    for index in live:
        layer = facts.layers[index]
        pairs = [(i, states.index(one - {index})) for i, one in enumerate(states.sets) if index in one]
        a, b = zip(*pairs)
        detail = AVERAGED * layer.detail.get(step, 1.0) / max(layer.map_max, 1e-6)
        whole, without = states.colours[list(a)], states.colours[list(b)]
        worst = max(worst, float(states.distance(whole, whole + detail * (without - whole)).max()))
    return worst + KEPT_AS


def colour_path(facts: SceneFacts, live: Sequence[int]) -> tuple[Effect, bool]:
    """Whether textures of the whole stack may stand for the films, and whether they do."""
    key, name = "path", "Baked textures"
    if not live:
        return Effect(key, name, False, "no film", 0.0), False
    keyed = [facts.layers[i].name for i in live if facts.layers[i].keyed]
    if not facts.baked:
        return Effect(key, name, False, "live films, as asked for: changes show at once", 0.0), False
    if keyed:
        return Effect(key, name, False, f"{', '.join(keyed)} changes over time, so films stay live", 0.0), False
    return Effect(key, name, True, "as asked for: their cost does not grow with the films", None), True


def animation(facts: SceneFacts, live: Sequence[int]) -> Effect:
    """What changes over time and therefore stays live."""
    keyed = [f"{', '.join(facts.layers[i].keyed)} of {facts.layers[i].name}" for i in live if facts.layers[i].keyed]
    if not keyed:
        return Effect("animation", "Films over time", False, "no film has keys", 0.0)
    return Effect("animation", "Films over time", True, f"{'; '.join(keyed)} has keys, which the nodes follow", None)


def dither(
    facts: SceneFacts, states: States | None, live: Sequence[int], account: Account, calibration: Calibration
) -> Effect:
    """Dither of colours near black, for EEVEE."""
    key, name, cost = "dither", "Dither near black", Cost(calibration.shading(facts, "dither"), 7)
    if not live:
        return Effect(key, name, False, "no film", 0.0, cost)
    if Engine.EEVEE not in facts.engines:
        return Effect(key, name, False, "Cycles keeps colours as floats", 0.0, cost)
    error = None
    if states is not None:
        dark = states.colours < DITHERED_BELOW
        off = states.colours + 0.5 * CLOSURE_STEP * dark
        error = float(states.distance(np.maximum(states.colours, 0), np.maximum(off, 0)).max()) if dark.any() else 0.0
    out = account.leaves_out(key, error)
    reason = (
        ("no colour of these films is near black" if not error else "too little to be seen")
        if out
        else "EEVEE stores the colours of closures with 10 bits, too coarse for black films"
    )
    said = account.said(key)
    return Effect(key, name, not out, because(said, reason), error, cost, said=said)
