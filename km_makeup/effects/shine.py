"""Highlights: whose lobes exist, which lamps have one, whether relief fades under films."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..makeup.finish import DETAIL_DEPTH_MM, Finish, covered, distinct, top_lobe
from ..spectra import lab
from .calibration import Calibration
from .effect import Account, Cost, Effect, because
from .facts import Engine, LayerFacts, SceneFacts, Switch
from .lobes import SHARES, Lobe, Shown, light_of
from .metric import Metric
from .states import KEPT_AS, SHADES, States, rounding

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


def _coverage(layer: LayerFacts) -> float:
    """Share of the surface that a layer's film hides where it is thickest."""
    return 1.0 if layer.coat is None else _covers(layer.map_max, layer.thickness_mm, layer.coat.powder)


@functools.lru_cache(maxsize=256)
def _covers(value: float, thickness_mm: float, powder: bool) -> float:
    return float(covered(np.array([value]), thickness_mm, powder)[0])


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


def _on_top(facts: SceneFacts, live: Sequence[int], plain: frozenset[int]) -> frozenset[int]:
    """The layers whose finish EEVEE draws with a second lobe: of films with other roughness than skin's, where skin has no coat."""
    own = [i for i in live if i not in plain and facts.layers[i].finish is not None]
    if not own or facts.skin.coat[0] > 0:
        return frozenset()
    finishes, kinds = distinct([facts.layers[i].finish or facts.skin.finish for i in own])
    seen = np.zeros(len(finishes))
    for index, kind in zip(own, kinds):
        seen[kind] += facts.layers[index].coverage * _coverage(facts.layers[index])
    top = top_lobe(facts.skin.finish.roughness, finishes, seen, facts.baked)
    return frozenset(index for index, kind in zip(own, kinds) if kind in top)


def _built(
    facts: SceneFacts, members: Sequence[int], plain: frozenset[int], top: frozenset[int]
) -> tuple[tuple[Lobe, ...], ...]:
    """The lobes of a state as they are built, side by side, and those that lie over them.

    Cycles has one for each finish. EEVEE has the shader's own, whose weight is 1 whatever is seen of it, so that only its F0
    falls where films cover skin; and its coat, for the layers on ``top``.
    """
    weights = _weights(facts, sorted(members), plain)
    surfaces = {k: (facts.skin.finish if k < 0 else facts.layers[k].finish) or facts.skin.finish for k in weights}
    weight, roughness, f0 = facts.skin.coat
    coat = (Lobe(weight * weights[-1], roughness, f0),) if weight > 0 else ()
    if facts.engine is Engine.CYCLES:
        return (tuple(Lobe(weights[k], *surfaces[k]) for k in weights), coat)
    own, over = [k for k in weights if k not in top], [k for k in weights if k in top]
    first = _joined([(weights[k], surfaces[k]) for k in own])
    second = _joined([(weights[k], surfaces[k]) for k in over])
    return ((Lobe(1.0, first.roughness, first.weight * first.f0),), (second,) if over else coat)


def _joined(parts: Sequence[tuple[float, Finish]]) -> Lobe:
    """The lobe that stands for several: slope variance and F0 by their weights."""
    whole = max(sum(weight for weight, _ in parts), 1e-6)
    variance = sum(weight * finish.roughness**4 for weight, finish in parts) / whole
    return Lobe(whole, variance**0.25, sum(weight * finish.f0 for weight, finish in parts) / whole)


def _shine(facts: SceneFacts, members: frozenset[int], plain: frozenset[int], top: frozenset[int]) -> Shown:
    """The highlights of a state."""
    return light_of(facts.lamps, facts.world, _built(facts, sorted(members), plain, top))


def _difference(
    facts: SceneFacts, colours: NDArray, shine: Sequence[Shown], other: Sequence[Shown], others: NDArray | None = None
) -> float:
    """The most that states of these colours (states, 3) change when their highlights are others, and their colours ``others``.

    Looked at lamp by lamp and where they turn away, beside the diffuse light of SHADES.
    """
    shades = np.array(SHADES)[:, None, None, None]
    one, two = (
        np.stack([each.added for each in some])
        + shades * bare[:, None] * np.stack([each.kept for each in some])[..., None]
        for some, bare in ((shine, colours), (other, colours if others is None else others))
    )
    first, second = lab(one, facts.space), lab(two, facts.space)
    squared = ((first - second) ** 2).sum(axis=-1)
    at = np.unravel_index(np.argmax(squared), squared.shape)
    return float(Metric.among(np.stack([first[at], second[at]])).norm(first[at] - second[at]))


def error_without_film(facts: SceneFacts, states: States, present: Sequence[int], index: int) -> float:
    """What colours with highlights change by without one of the films present: others' highlights may be built in another way then."""
    none, rest = frozenset[int](), [i for i in present if i != index]
    tops = _on_top(facts, present, none), _on_top(facts, rest, none)
    left = [one - {index} for one in states.sets]
    with_it = [_shine(facts, one, none, tops[0]) for one in states.sets]
    without = [_shine(facts, one, none, tops[1]) for one in left]
    colours = states.colours[:, 0]
    return _difference(facts, colours, with_it, without, colours[[states.index(one) for one in left]])


def shining(
    facts: SceneFacts, states: States | None, live: Sequence[int], account: Account, calibration: Calibration
) -> Shining:
    """Decide on highlights."""
    lit = bool(facts.lamps) or max(facts.world) > 0
    lobes: tuple[Effect, ...] = ()
    if facts.baked:
        plain, error = _all_plain(facts, states, live, account)
    else:
        lobes, plain = _lobes(facts, states, live, lit, account, calibration)
        error = None
    finish = _finish(facts, live, plain, error, lit, account, calibration)
    second = _second(facts, states, live, plain, finish.on, account, calibration)
    lamps, each = _lamps(facts, states, bool(live), finish.on, account, calibration)
    return Shining(
        finish, lobes, second, lamps, each, _normals(facts, states, live, finish.on, account, calibration), plain
    )


def _lamp_by_lamp(facts: SceneFacts) -> bool:
    """Whether lamps get highlights of their own, of skin and films together: there is no leaving out the films' alone then."""
    return facts.lamp_highlights and Engine.EEVEE in facts.engines and any(lamp.real for lamp in facts.lamps)


def _all_plain(
    facts: SceneFacts, states: States | None, live: Sequence[int], account: Account
) -> tuple[frozenset[int], float | None]:
    """Baked textures hold the films' joint finish: all of it is there, or nothing; and what nothing changes."""
    none = frozenset[int]()
    if states is None or not live or facts.finish is not Switch.AUTO:
        return none, None
    top = _on_top(facts, live, none)
    full = [_shine(facts, one, none, top) for one in states.sets]
    without = [_shine(facts, one, frozenset(live), none) for one in states.sets]
    error = _difference(facts, states.colours[:, 0], full, without)
    keeps = _lamp_by_lamp(facts) and account.said("finish") is not Switch.OFF
    error = _apart(facts, states, account, error)
    return (frozenset(live) if not keeps and account.leaves_out("finish", error, rounds=True) else none), error


def _apart(facts: SceneFacts, states: States, account: Account, error: float) -> float:
    """With the step by which colours may be rounded apart: what a highlight reflects is taken from the closures' colours."""
    return account.rounded(error, rounding(facts, states))


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
    top = _on_top(facts, live, frozenset())
    full = [_shine(facts, one, frozenset(), top) for one in states.sets] if states else []
    for index in live:
        if states is None or facts.layers[index].finish is None:
            errors[index] = None
            continue
        mark = ("lobe", index, states.sets)
        errors[index] = (
            account.once(mark, functools.partial(_without, facts, states, live, full, index)) if lit else 0.0
        )
    plain: set[int] = set()
    effects = {}
    asked = account.said("finish")
    for index in sorted(live, key=lambda i: (errors[i] if errors[i] is not None else np.inf, i)):
        key, error = f"lobe:{index}", errors[index]
        if error and states is not None:
            error = _apart(facts, states, account, error)
        last = _lamp_by_lamp(facts) and len(plain) == len(live) - 1
        free = facts.finish is Switch.AUTO and asked is Switch.AUTO and not last
        out = free and account.leaves_out(key, error, rounds=True)
        if out:
            plain.add(index)
        engine = "lobe" if facts.engine is Engine.CYCLES else "finish"
        reason = "its own roughness and reflectance"
        if out:
            reason = "no light to be reflected" if not lit else "as what lies below shines"
        cost = Cost(calibration.shading(facts, engine), 9)
        name = f"Highlight of {facts.layers[index].name}"
        said = account.said(key) if facts.finish is Switch.AUTO and asked is Switch.AUTO and not last else None
        effects[index] = Effect(key, name, not out, because(said or Switch.AUTO, reason), error, cost, said=said)
    return tuple(effects[i] for i in live), frozenset(plain)


def _without(facts: SceneFacts, states: States, live: Sequence[int], full: Sequence[Shown], index: int) -> float:
    """What the highlight of one film makes."""
    plain = frozenset({index})
    top = _on_top(facts, live, plain)
    without = [_shine(facts, one, plain, top) for one in states.sets]
    return _difference(facts, states.colours[:, 0], full, without) + KEPT_AS


def _merged(facts: SceneFacts, states: States, plain: frozenset[int], top: frozenset[int]) -> float:
    """What one lobe for all finishes makes."""
    two = [_shine(facts, one, plain, top) for one in states.sets]
    return _difference(
        facts, states.colours[:, 0], two, [_shine(facts, one, plain, frozenset()) for one in states.sets]
    )


def _finish(
    facts: SceneFacts,
    live: Sequence[int],
    plain: frozenset[int],
    error: float | None,
    lit: bool,
    account: Account,
    calibration: Calibration,
) -> Effect:
    """``error``: of baked textures, which have no effect for each film's lobe that would say it."""
    key, name, cost = "finish", "Film highlight", Cost(calibration.shading(facts, "finish"), 25)
    if not live:
        return Effect(key, name, False, "no film", 0.0, cost)
    if facts.finish is Switch.OFF:
        return Effect(key, name, False, "forced off", None, cost)
    said = account.said(key)
    if said is Switch.OFF:
        return Effect(key, name, False, "forced off", error, cost, said=said)
    if set(live) <= plain:
        reason = "films shine as the skin does" if lit else "no light to be reflected"
        return Effect(key, name, False, reason, error or 0.0, cost, said=said)
    reason = because(said, "films have their own roughness and reflectance")
    return Effect(key, name, True, reason, error, cost, said=said)


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
    top = _on_top(facts, live, plain)
    if not top:
        return Effect(key, name, False, "all finishes are of one roughness", 0.0, cost)
    error = None
    if states is not None:
        error = account.once(("second", states.sets, plain), lambda: _merged(facts, states, plain, top))
        error = _apart(facts, states, account, error)
    out = account.leaves_out(key, error, rounds=True)
    reason = "one lobe of their mean looks the same" if out else "skin and films shine in different widths"
    said = account.said(key)
    return Effect(key, name, not out, because(said, reason), error, cost, said=said)


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
    top = (
        _on_top(facts, [i for i in range(len(facts.layers)) if any(i in one for one in states.sets)], frozenset())
        if states
        else frozenset()
    )
    full = [_shine(facts, one, frozenset(), top) for one in states.sets] if states else []
    for k, lamp in enumerate(facts.lamps):
        if states is None or not lamp.real:
            errors.append(None)
            continue
        without = []
        for one in full:
            less = one.added.copy()
            less[k * len(SHARES) : (k + 1) * len(SHARES)] = 0
            without.append(Shown(less, one.kept))
        errors.append(_difference(facts, states.colours[:, 0], full, without))
    order = sorted(range(len(errors)), key=lambda k: (errors[k] if errors[k] is not None else np.inf, k))
    effects: dict[int, Effect] = {}
    for position, k in enumerate(order):
        lamp, error = facts.lamps[k], errors[k]
        last = position == len(order) - 1 and not any(effect.on for effect in effects.values())
        key = f"lamp:{lamp.name}"
        out = not last and account.leaves_out(key, error)
        reason = "its highlight is too faint to be seen" if out else "its highlight is seen"
        cost = Cost(calibration.shading(facts, "lamp"), 32)
        said = account.said(key)
        reason = "one lamp has to be there" if last and said is Switch.OFF else because(said, reason)
        effects[k] = Effect(key, f"Highlight of {lamp.name}", not out, reason, error, cost, said=said)
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
    said = account.said(key)
    return Effect(key, name, not out, because(said, reason), error, cost, said=said)
