"""Highlights: whose lobes exist, which lamps have one, whether relief fades under films.

A lobe is taken as F0 E / (4 pi a^2) / (1 + theta^2/a^2)^2 at an angle theta between normal and half vector, a^2 = alpha^2 +
Omega/(4 pi), with E the irradiance of a lamp of solid angle Omega and alpha = roughness^2: GGX, as wide as the
lamp's reflection makes it. The normals of a head within theta are the share theta^2/2 of those that are seen; the
brightest half of a per cent of them are left aside. The world adds F0 times its radiance. All in units of what a white card sends back.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..makeup.finish import DETAIL_DEPTH_MM, Finish, covered, two_lobes
from ..spectra import lab
from .calibration import Calibration
from .effect import Account, Cost, Effect, because
from .facts import Engine, LampFacts, LayerFacts, SceneFacts, Switch
from .metric import Metric
from .states import States, states_of

SHARES = (0.005, 0.02, 0.08, 0.25)
"""Shares of a head's pixels that a highlight is brighter on than where it is looked at."""

SLOPE = 0.2
"""Root mean square slope of the relief that a normal or bump map of strength 1 gives skin: how much its shading varies."""


@dataclass(frozen=True)
class Shining:
    """What is decided on highlights: ``plain`` are the layers whose film keeps the highlight below it."""

    finish: Effect
    lobes: tuple[Effect, ...]
    second: Effect
    lamps: Effect
    each_lamp: tuple[Effect, ...]
    normals: Effect
    plain: frozenset[int] = field(default_factory=frozenset)


def _peaks(facts: SceneFacts, finish: Finish) -> NDArray:
    """Highlight of a surface from each lamp at SHARES and, last, from the world: (lamps x SHARES + 1, 3), a white card being 1."""
    return _peaks_of(facts.lamps, facts.world, finish)


@functools.lru_cache(maxsize=256)
def _peaks_of(lamps: tuple[LampFacts, ...], world: tuple[float, float, float], finish: Finish) -> NDArray:
    alpha = max(finish.roughness, 0.02) ** 2
    peaks = []
    for lamp in lamps:
        width = alpha * alpha + lamp.solid_angle / (4 * math.pi)
        for share in SHARES:
            fall = (1 + 2 * share / width) ** 2
            peaks.append(np.array(lamp.irradiance) / (4 * math.pi * width * fall))
    E = np.sum([lamp.irradiance for lamp in lamps], axis=0) if lamps else np.zeros(3)
    white = np.maximum(E / math.pi + np.array(world), 1e-6)
    return finish.f0 * np.array([*peaks, world]) / white


def _coverage(layer: LayerFacts) -> float:
    """Share of the surface that a layer's film hides where it is thickest."""
    if layer.coat is None:
        return 1.0
    return float(covered(np.array([layer.map_max]), layer.thickness_mm, layer.coat.powder)[0])


def _weights(facts: SceneFacts, members: Sequence[int], plain: frozenset[int]) -> dict[int, float]:
    """How much is seen of each layer's surface, of skin's under -1."""
    weights = {-1: 1.0}
    for index in sorted(members):
        layer = facts.layers[index]
        if index in plain or layer.finish is None:
            continue
        share = _coverage(layer)
        weights = {k: w * (1 - share) for k, w in weights.items()} | {index: share}
    return weights


def _shine(facts: SceneFacts, members: frozenset[int], plain: frozenset[int], one_lobe: bool = False) -> NDArray:
    """The highlight of a state from each lamp at SHARES and the world, (lamps x SHARES + 1, 3)."""
    weights = _weights(facts, sorted(members), plain)
    surfaces = {k: facts.skin.finish if k < 0 else facts.layers[k].finish for k in weights}
    weight, roughness, f0 = facts.skin.coat
    coat = weight * weights[-1] * _peaks(facts, Finish(roughness, f0))
    if one_lobe:
        variance = sum(w * s.roughness**4 for w, s in zip(weights.values(), surfaces.values()) if s)
        mean = sum(w * s.f0 for w, s in zip(weights.values(), surfaces.values()) if s)
        return coat + _peaks(facts, Finish(max(variance, 1e-9) ** 0.25, mean))
    return coat + np.sum([weights[k] * _peaks(facts, s) for k, s in surfaces.items() if s], axis=0)


def _difference(facts: SceneFacts, states: States, shine: Sequence[NDArray], other: Sequence[NDArray]) -> float:
    """The most that states change when their highlights (3,) are others: lamp by lamp, in its full light."""
    one, two = np.stack(shine), np.stack(other)
    a, b = (
        states.colours[:, :1] + np.concatenate([each[:, :-1] + each[:, -1:], each[:, -1:]], axis=1)
        for each in (one, two)
    )
    first, second = lab(a, facts.space), lab(b, facts.space)
    squared = ((first - second) ** 2).sum(axis=-1)
    at = np.unravel_index(np.argmax(squared), squared.shape)
    return float(Metric.among(np.stack([first[at], second[at]])).norm(first[at] - second[at]))


def error_without_finish(facts: SceneFacts, index: int) -> float:
    """What a film that is alone on the skin changes of the highlight."""
    states = states_of(facts, [index])
    if states is None:
        return 0.0
    with_it = [_shine(facts, one, frozenset()) for one in states.sets]
    return _difference(facts, states, with_it, [_shine(facts, one, frozenset({index})) for one in states.sets])


def shining(
    facts: SceneFacts, states: States | None, live: Sequence[int], account: Account, calibration: Calibration
) -> Shining:
    """Decide on highlights."""
    lit = bool(facts.lamps) or max(facts.world) > 0
    lobes: tuple[Effect, ...] = ()
    if facts.baked:
        plain = _all_plain(facts, states, live, account)
    else:
        lobes, plain = _lobes(facts, states, live, lit, account, calibration)
    finish = _finish(facts, live, lobes, plain, lit, account, calibration)
    second = _second(facts, states, live, plain, finish.on, account, calibration)
    lamps, each = _lamps(facts, states, bool(live), finish.on, account, calibration)
    return Shining(
        finish, lobes, second, lamps, each, _normals(facts, states, live, finish.on, account, calibration), plain
    )


def _all_plain(facts: SceneFacts, states: States | None, live: Sequence[int], account: Account) -> frozenset[int]:
    """Baked textures hold the films' joint finish: all of it is there, or nothing."""
    if states is None or not live or facts.finish is not Switch.AUTO:
        return frozenset()
    full = [_shine(facts, one, frozenset()) for one in states.sets]
    without = [_shine(facts, one, frozenset(live)) for one in states.sets]
    return frozenset(live) if account.leaves_out("finish", _difference(facts, states, full, without)) else frozenset()


def _lobes(
    facts: SceneFacts,
    states: States | None,
    live: Sequence[int],
    lit: bool,
    account: Account,
    calibration: Calibration,
) -> tuple[tuple[Effect, ...], frozenset[int]]:
    """An effect for each film's own surface: left out, the highlight of what lies below stays there."""
    errors: dict[int, float | None] = {}
    full = [_shine(facts, one, frozenset()) for one in states.sets] if states else []
    for index in live:
        if states is None or facts.layers[index].finish is None:
            errors[index] = None
            continue
        mark = ("lobe", index, states.sets)
        errors[index] = account.once(mark, functools.partial(_without, facts, states, full, index)) if lit else 0.0
    plain: set[int] = set()
    effects = {}
    asked = account.said("finish")
    for index in sorted(live, key=lambda i: (errors[i] if errors[i] is not None else np.inf, i)):
        key, error = f"lobe:{index}", errors[index]
        out = facts.finish is Switch.AUTO and asked is Switch.AUTO and account.leaves_out(key, error)
        if out:
            plain.add(index)
        engine = "lobe" if facts.engine is Engine.CYCLES else "finish"
        reason = "its own roughness and reflectance"
        if out:
            reason = "no light to be reflected" if not lit else "as what lies below shines"
        cost = Cost(calibration.shading(facts, engine), 9)
        name = f"Highlight of {facts.layers[index].name}"
        effects[index] = Effect(key, name, not out, because(account.said(key), reason), error, cost)
    return tuple(effects[i] for i in live), frozenset(plain)


def _without(facts: SceneFacts, states: States, full: Sequence[NDArray], index: int) -> float:
    """What the highlight of one film makes."""
    return _difference(facts, states, full, [_shine(facts, one, frozenset({index})) for one in states.sets])


def _merged(facts: SceneFacts, states: States, plain: frozenset[int]) -> float:
    """What one lobe for all finishes makes."""
    two = [_shine(facts, one, plain) for one in states.sets]
    return _difference(facts, states, two, [_shine(facts, one, plain, True) for one in states.sets])


def _finish(
    facts: SceneFacts,
    live: Sequence[int],
    lobes: Sequence[Effect],
    plain: frozenset[int],
    lit: bool,
    account: Account,
    calibration: Calibration,
) -> Effect:
    key, name, cost = "finish", "Film highlight", Cost(calibration.shading(facts, "finish"), 25)
    if not live:
        return Effect(key, name, False, "no film", 0.0, cost)
    if Switch.OFF in (facts.finish, account.said(key)):
        return Effect(key, name, False, "forced off", None, cost)
    if set(live) <= plain:
        reason = "films shine as the skin does" if lit else "no light to be reflected"
        return Effect(key, name, False, reason, 0.0, cost)
    return Effect(key, name, True, "films have their own roughness and reflectance", None, cost)


def _second(
    facts: SceneFacts,
    states: States | None,
    live: Sequence[int],
    plain: frozenset[int],
    finish: bool,
    account: Account,
    calibration: Calibration,
) -> Effect:
    """EEVEE's second lobe; Cycles has one for each finish."""
    key, name, cost = "second_lobe", "Second lobe", Cost(calibration.shading(facts, "second_lobe"), 12)
    if not finish:
        return Effect(key, name, False, "no film highlight", 0.0, cost)
    if Engine.EEVEE not in facts.engines:
        return Effect(key, name, True, "Cycles has a lobe for each finish", None, cost)
    if facts.skin.coat[0] > 0:
        return Effect(key, name, False, "the skin's own coat takes its place: one lobe for all finishes", 0.0, cost)
    surfaces = [facts.skin.finish, *(facts.layers[i].finish or facts.skin.finish for i in live if i not in plain)]
    if not two_lobes([s.roughness for s in surfaces], [1.0] * len(surfaces))[1]:
        return Effect(key, name, False, "all finishes are of one roughness", 0.0, cost)
    error = None
    if states is not None:
        error = account.once(("second", states.sets, plain), lambda: _merged(facts, states, plain))
    out = account.leaves_out(key, error)
    reason = "one lobe of their mean looks the same" if out else "skin and films shine in different widths"
    return Effect(key, name, not out, because(account.said(key), reason), error, cost)


def _lamps(
    facts: SceneFacts,
    states: States | None,
    any_film: bool,
    finish: bool,
    account: Account,
    calibration: Calibration,
) -> tuple[Effect, tuple[Effect, ...]]:
    key, name = "lamps", "Highlight of each lamp"
    cost = Cost(calibration.shading(facts, "lamp") * len(facts.lamps), 20 * len(facts.lamps))
    if not facts.lamp_highlights:
        return Effect(key, name, False, "not asked for: glossy lobes, shaded by the renderer", 0.0, cost), ()
    if not any_film or not finish:
        return Effect(key, name, False, "no film highlight", 0.0, cost), ()
    if Engine.EEVEE not in facts.engines:
        return Effect(key, name, False, "Cycles has no Shader to RGB and path traces its glossy lobes", 0.0, cost), ()
    if not any(lamp.real for lamp in facts.lamps):
        reason = "the scene has no lamp; light of the world alone gives none"
        return Effect(key, name, False, reason, None, cost), ()
    each = _each_lamp(facts, states, account, calibration)
    count = sum(effect.on for effect in each)
    reason = f"asked for: {count} lamp{'' if count == 1 else 's'}, in EEVEE. {facts.lamps_left_out}".strip()
    error = sum(effect.left_out for effect in each)
    return Effect(key, name, True, reason, error or None, cost, reduced=count < len(each)), each


def _each_lamp(
    facts: SceneFacts, states: States | None, account: Account, calibration: Calibration
) -> tuple[Effect, ...]:
    errors: list[float | None] = []
    for k, lamp in enumerate(facts.lamps):
        if states is None or not lamp.real:
            errors.append(None)
            continue
        full = [_shine(facts, one, frozenset()) for one in states.sets]
        without = []
        for one in full:
            less = one.copy()
            less[k * len(SHARES) : (k + 1) * len(SHARES)] = 0
            without.append(less)
        errors.append(_difference(facts, states, full, without))
    order = sorted(range(len(errors)), key=lambda k: (errors[k] if errors[k] is not None else np.inf, k))
    effects: dict[int, Effect] = {}
    for position, k in enumerate(order):
        lamp, error = facts.lamps[k], errors[k]
        last = position == len(order) - 1 and not any(effect.on for effect in effects.values())
        out = not last and account.leaves_out(f"lamp:{lamp.name}", error)
        reason = "its highlight is too faint to be seen" if out else "its highlight is seen"
        cost = Cost(calibration.shading(facts, "lamp"), 32)
        effects[k] = Effect(
            f"lamp:{lamp.name}", f"Highlight of {lamp.name}", not out,
            because(account.said(f"lamp:{lamp.name}"), reason), error, cost,
        )  # fmt: skip
    return tuple(effects[k] for k, lamp in enumerate(facts.lamps) if lamp.real)


def _normals(
    facts: SceneFacts,
    states: States | None,
    live: Sequence[int],
    finish: bool,
    account: Account,
    calibration: Calibration,
) -> Effect:
    """Pores and creases fade under films by exp(-X/depth): how much less the shading varies."""
    key, name, cost = "normals", "Relief fades under films", Cost(calibration.shading(facts, "normals"), 3)
    if not live:
        return Effect(key, name, False, "no film", 0.0, cost)
    if facts.skin.relief <= 0:
        return Effect(key, name, False, "the skin has no normal or bump map", 0.0, cost)
    if not finish:
        return Effect(key, name, False, "no film highlight", None, cost)
    error = None
    if states is not None:
        thickness = max(sum(facts.layers[i].thickness_mm * facts.layers[i].map_max for i in one) for one in states.sets)
        varies = SLOPE * facts.skin.relief * -math.expm1(-thickness / DETAIL_DEPTH_MM)
        error = float(states.distance(states.colours, states.colours * (1 - min(varies, 0.9))).max())
    out = account.leaves_out(key, error)
    reason = "films are too thin to fill pores visibly" if out else "films fill pores and creases"
    return Effect(key, name, not out, because(account.said(key), reason), error, cost)
