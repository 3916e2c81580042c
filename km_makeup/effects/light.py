"""How far the skin's light spreads, and whether any of it can be seen: every Gaussian, the passes, the compositor.

What spreading changes is read off at the hardest edge of light there could be, a step from all of it to none, seen through
pixels: lids, lips and nostrils make such edges in any light. Each Gaussian that is left out leaves its share of the light
where it entered. The tolerance holds for 99 of 100 pixels; the narrowest part of an edge, FEW of them, is left aside. What of
it shows on heads was measured (`tests.effects.spread`): SEEN, STEPS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..spectra import lab
from .calibration import Calibration
from .effect import Account, Cost, Effect, because
from .facts import Engine, SceneFacts, Switch
from .metric import Metric
from .states import States

FILTER_PX2 = 0.25
"""Variance in pixels^2 of a pixel with the renderers' usual filter (1.5 pixels) around it."""

SEEN, STEPS = 1.3, 0.6
"""What shows on heads of the change at the hardest edge, of light that does not spread and of light that spreads across steps in depth,
which are fewer. Over 1 since renderers blur pixels by whole ones and the compositor blurs half of the skin's colour too. Measured at
most 1.11 (smooth head, 90 pixels high, sun) and 0.45 (smooth head, close-up, soft light), 0.2 to 0.6 on larger and rougher ones."""

WALKED = 2.5
"""CIEDE2000 by which skin that Cycles scatters light in differs from a diffuse surface however narrow that is: a random walk sends back
other parts of grazing light. Measured: 1.84 (a dark head 60 pixels high under a sun)."""

FEW = 0.005
"""Share of a head's pixels that edges of light may change by more than the tolerance allows: half of the one per cent."""

EDGES = 1.0
"""Edges as hard as that are half as long as a head is high, and it covers half of the square of its height: an edge of width w then
takes the share w / height."""

SHARP_PX2 = 0.03
"""Variance in pixels^2 below which the compositor blurs nothing: a Gaussian that narrow is not built, and its absence changes nothing."""

COARSEST, FINEST = 0.0625, 128.0
"""Pixels per mm that the compositor's blurs are made for: the next power of two between these."""

FRAME_PX = 1000.0
"""Height of a picture that may come as near as it likes."""

ANY_VIEW_PX_PER_MM = 25.0
"""The closest that a viewport is planned for: a pore is a pixel."""

_ERF = np.frompyfunc(math.erf, 1, 1)


@dataclass(frozen=True)
class Spreading:
    """What is decided on light in the skin: the effects, and how many of the narrowest Gaussians are left out, of ``count``."""

    closure: Effect
    subsurface: Effect
    gaussians: tuple[Effect, ...]
    depth: Effect
    diffusion: Effect
    passes: Effect
    compositor: Effect
    left_out: int
    count: int


def scale_of(facts: SceneFacts) -> float:
    """Pixels per mm that the plan is for."""
    return max(facts.view.px_per_mm, ANY_VIEW_PX_PER_MM) if facts.view.any_view else facts.view.px_per_mm


def blurred_for(pixels_per_mm: float) -> float:
    """The scale (pixels per mm) that the compositor's blurs are made for."""
    return float(2.0 ** math.ceil(math.log2(min(max(pixels_per_mm, COARSEST), FINEST))))


def _across_mm(facts: SceneFacts) -> float:
    """Height of what is seen of the head, mm."""
    pixels = FRAME_PX if facts.view.any_view else facts.view.head_px
    return pixels / max(scale_of(facts), 1e-6)


def _edge(x: NDArray, variance: float) -> NDArray:
    """Light (x,) across an edge from 0 to 1 that is blurred by a Gaussian (mm^2)."""
    return 0.5 + 0.5 * np.asarray(_ERF(x / math.sqrt(2 * variance)), float)


def spread_errors(facts: SceneFacts, states: States | None) -> NDArray:
    """What changes at an edge of light when 0, 1, 2, ... of the narrowest Gaussians do not spread it."""
    count = len(facts.skin.variances)
    if states is None or not count:
        return np.zeros(count + 1)
    order = np.argsort(facts.skin.variances, kind="stable")
    variances, weights = np.array(facts.skin.variances)[order], np.array(facts.skin.weights)[order]
    soft = FILTER_PX2 / scale_of(facts) ** 2
    reach = 2.5 * math.sqrt(variances.max() + soft)
    beside = np.geomspace(0.3 * math.sqrt(variances.min() + soft), reach, 12)
    x = np.concatenate([-beside[::-1], [0.0], beside])
    widths, few = np.gradient(x), FEW * _across_mm(facts) / EDGES
    none = _edge(x, soft)
    spread = np.stack([_edge(x, soft + v) for v in variances])
    change = np.cumsum((none - spread)[:, :, None] * weights[:, None], axis=0)
    full = np.einsum("gx,gc->xc", spread, weights)
    light = np.stack([full, *(full + one for one in change)])
    films, through = states.R, np.maximum(states.colours[:, 0] - states.R, 0)
    seen = lab(films[:, None, None] * none[:, None] + through[:, None, None] * light, facts.space)
    difference = seen[:, 1:] - seen[:, :1]
    found = [0.0]
    for k in range(count):
        one = difference[:, k]
        squared = (one * one).sum(axis=-1)
        state = int(np.argmax(squared.max(axis=1)))
        falling = np.argsort(-squared[state], kind="stable")
        beyond = int(np.searchsorted(np.cumsum(widths[falling]), few))
        at = state, falling[min(beyond, len(x) - 1)]
        near = Metric.among(np.stack([seen[at[0], 0, at[1]], seen[at[0], k + 1, at[1]]]))
        found.append(float(near.norm(one[at])))
    return np.array(found)


def _spread_once(facts: SceneFacts, states: States, account: Account) -> NDArray:
    return account.once(("spread", states.sets), lambda: spread_errors(facts, states))


def spreading(
    facts: SceneFacts, states: States | None, any_film: bool, account: Account, calibration: Calibration
) -> Spreading:
    """Decide on light in the skin."""
    count = len(facts.skin.variances)
    screen = facts.screen_diffusion and facts.engine is Engine.EEVEE
    effects, left_out = _gaussians(facts, states, any_film, screen, account, calibration)
    spreads = left_out < count
    subsurface = _subsurface(facts, any_film, screen, spreads, effects, calibration)
    diffusion = _diffusion(facts, screen, spreads, effects, account.said("diffusion"))
    depth = _depth(facts, states, diffusion.on, account, calibration)
    cost = Cost(calibration.compositing(facts, "passes"), 0, 5, facts.view.megapixels * 5 * 16)
    reason = "the diffusion reads light, colour, depth, share and mask" if diffusion.on else "no diffusion to read them"
    passes = Effect("passes", "Passes and AOVs", diffusion.on, reason, None if diffusion.on else 0.0, cost)
    reason = "the diffusion" if diffusion.on else "nothing for it to do"
    cost = Cost(calibration.compositing(facts, "group"), 60)
    compositor = Effect("compositor", "Compositor", diffusion.on, reason, None if diffusion.on else 0.0, cost)
    closure = _closure(facts, any_film, spreads, calibration)
    return Spreading(closure, subsurface, effects, depth, diffusion, passes, compositor, left_out, count)


def _gaussians(
    facts: SceneFacts,
    states: States | None,
    any_film: bool,
    screen: bool,
    account: Account,
    calibration: Calibration,
) -> tuple[tuple[Effect, ...], int]:
    """Gaussians narrowest first: they are left out one after the other while that is not seen, or with a wider one that the user left out.

    Without the compositor they are all the renderer's own, which spreads light by all or by none.
    """
    count = len(facts.skin.variances)
    if states is None or not count or (not any_film and not screen):
        return (), 0
    errors = SEEN * _spread_once(facts, states, account)
    if not screen:
        error = float(errors[-1]) + (WALKED if Engine.CYCLES in facts.engines else 0.0)
        out = account.leaves_out("subsurface", error)
        sigma = math.sqrt(max(facts.skin.variances))
        reason = f"up to {sigma:.2g} mm, {sigma * scale_of(facts):.2g} pixels"
        said = account.said("subsurface")
        effect = Effect("subsurface", "Light spreads in the skin", not out, reason, error, said=said)
        return (effect,), count if out else 0
    whole = account.said("diffusion")
    each = [whole if whole is not Switch.AUTO else account.said(f"gaussian:{k + 1}") for k in range(count)]
    effects, left_out, sharp = [], 0, SHARP_PX2 / blurred_for(scale_of(facts)) ** 2
    for k, variance in enumerate(sorted(facts.skin.variances)):
        key, sigma = f"gaussian:{k + 1}", math.sqrt(variance)
        step = 0.0 if variance < sharp else max(0.0, float(errors[k + 1] - errors[: k + 1].max()))
        width = sigma * scale_of(facts)
        in_order = left_out == k
        off = each[k] is not Switch.ON and Switch.OFF in each[k:]
        out = in_order and (off or (each[k] is not Switch.ON and account.leaves_out(key, step)))
        left_out += int(out)
        cost = Cost(calibration.compositing(facts, "gaussian"), 14)
        if out:
            reason = (
                f"{width:.2g} pixels wide: too narrow for the compositor to blur"
                if variance < sharp
                else f"{width:.2g} pixels wide: narrower than a pixel shows"
                if width < 1
                else f"{width:.2g} pixels, hardly seen"
            )
        else:
            reason = f"{sigma:.2g} mm, {width:.2g} pixels"
        if off:
            reason = "forced off" if out else "a narrower one is forced on"
        reason = reason if off else because(each[k], reason)
        effects.append(Effect(key, f"Gaussian {k + 1}", not out, reason, step, cost, said=each[k]))
    return tuple(effects), left_out


def _subsurface(
    facts: SceneFacts,
    any_film: bool,
    screen: bool,
    spreads: bool,
    effects: tuple[Effect, ...],
    calibration: Calibration,
) -> Effect:
    key, name = "subsurface", "Light spreads in the skin"
    cost = Cost(calibration.shading(facts, "subsurface"), 1)
    if not facts.skin.variances:
        return Effect(key, name, False, "the skin's material has no subsurface scattering", 0.0, cost)
    if screen:
        return Effect(
            key, name, False, "the compositor does it" if spreads else "left to no one: see the diffusion", 0.0, cost
        )
    if not effects:
        return Effect(key, name, any_film, "as the skin's own material has it" if any_film else "no film", None, cost)
    (one,) = effects
    reason = one.reason if one.on else f"{one.reason}: not seen"
    return replace(one, reason=because(one.said or Switch.AUTO, reason), cost=cost)


def _diffusion(facts: SceneFacts, screen: bool, spreads: bool, effects: tuple[Effect, ...], asked: Switch) -> Effect:
    key, name = "diffusion", "Screen-space diffusion"
    if not facts.screen_diffusion:
        return Effect(key, name, False, "not asked for", 0.0)
    if facts.engine is not Engine.EEVEE:
        return Effect(key, name, False, "Cycles scatters light in the skin by itself", 0.0)
    if not screen or (effects and not spreads):
        error = sum(effect.error or 0.0 for effect in effects)
        where = f"the head is {facts.view.head_px:.0f} pixels high"
        reason = because(asked, f"{where}: light spreads over less than is seen")
        return Effect(key, name, False, reason, error, said=asked if effects else None)
    count, on = len(effects), sum(effect.on for effect in effects)
    if not effects:
        return Effect(key, name, True, "asked for: light is diffused in the compositor, in millimetres of skin", None)
    left = "" if on == count else f"; {count - on} are narrower than shows at this distance"
    error = sum(effect.left_out for effect in effects)
    return Effect(
        key,
        name,
        True,
        because(asked, f"asked for: {on} of {count} Gaussians{left}"),
        error if on < count else None,
        reduced=on < count,
        said=asked,
    )


def _depth(
    facts: SceneFacts, states: States | None, diffusion: bool, account: Account, calibration: Calibration
) -> Effect:
    key, name = "depth", "Diffusion stops at steps in depth"
    cost = Cost(calibration.compositing(facts, "depth_aware"), 60)
    if not diffusion:
        return Effect(key, name, False, "no diffusion", 0.0, cost)
    if not facts.stops_at_steps:
        return Effect(key, name, False, "not asked for", 0.0, cost)
    error = STEPS * float(_spread_once(facts, states, account)[-1]) if states and facts.skin.variances else None
    out = account.leaves_out(key, error)
    reason = "light across steps would not be seen" if out else "no light from nose to cheek, chin to neck"
    said = account.said(key)
    return Effect(key, name, not out, because(said, reason), error, cost, said=said)


def _closure(facts: SceneFacts, any_film: bool, spreads: bool, calibration: Calibration) -> Effect:
    key, name, cost = "closure", "Film light apart from skin light", Cost(calibration.shading(facts, "film_closure"), 6)
    if not any_film:
        return Effect(key, name, False, "no film", 0.0, cost)
    if facts.skin.variances and not spreads:
        return Effect(key, name, False, "no light spreads in the skin", 0.0, cost)
    if Engine.CYCLES in facts.engines:
        return Effect(
            key, name, True, "Cycles scatters the skin's part only; the films' part leaves where it enters", None, cost
        )
    reason = "EEVEE samples two closures with noise; one closure, its radius scaled by the skin's share"
    return Effect(key, name, False, reason, 0.0, cost)
