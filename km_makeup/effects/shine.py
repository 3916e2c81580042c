"""Highlights: whose lobes exist, which lamps have one, whether relief fades under films.

A lobe is taken as F E / (4 pi a^2 h) / (1 + theta^2/a^2)^2 at an angle theta between normal and half vector, a^2 = alpha^2 +
Omega/(4 pi), with E the irradiance of a lamp of solid angle Omega, alpha = roughness^2, h the cosine between view and half vector and F
the Fresnel reflectance there: GGX, as wide as the lamp's reflection makes it. The normals of a head within theta are the share theta^2/2 of those that are seen; the
brightest half of a per cent of them are left aside. The world adds F0 times its radiance, and more where skin turns away
(RIMS). All in units of what a white card sends back.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..makeup.finish import DETAIL_DEPTH_MM, Finish, covered, distinct, top_lobe
from ..spectra import lab
from .calibration import Calibration
from .effect import Account, Cost, Effect, because
from .facts import Engine, LampFacts, LayerFacts, SceneFacts, Switch
from .metric import Metric
from .states import KEPT_AS, SHADES, States

SHARES = (0.005, 0.02, 0.08, 0.25)
"""Shares of a head's pixels that a highlight is brighter on than where it is looked at."""

RIMS = np.array([0.01, 0.05, 0.25])
"""Shares of a head's pixels whose normals are turned farther from the eye: nu^2 of a ball's are beyond the cosine nu. Lobes reflect the
world there by their Fresnel reflectance, not by F0. Of the one per cent that turns away the most nothing is promised."""

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


class Lobe(NamedTuple):
    """A glossy lobe as it is built: how much of it there is, roughness, and F0 at that weight."""

    weight: float
    roughness: float
    f0: float


class Shown(NamedTuple):
    """Highlights (n, 3) at SHARES of each lamp, from the world, and from the world at RIMS; the part (n,) of diffuse light beside them."""

    added: NDArray
    kept: NDArray


@functools.lru_cache(maxsize=64)
def _white(lamps: tuple[LampFacts, ...], world: tuple[float, float, float]) -> NDArray:
    """What a white card sends back that faces all the light there is."""
    E = np.sum([lamp.irradiance for lamp in lamps], axis=0) if lamps else np.zeros(3)
    return np.maximum(E / math.pi + np.array(world), 1e-6)


@functools.lru_cache(maxsize=256)
def _peaks(lamps: tuple[LampFacts, ...], world: tuple[float, float, float], roughness: float) -> NDArray:
    """Highlight of a surface of reflectance 1 from each lamp at SHARES, (lamps x SHARES, 3), a white card being 1."""
    alpha, shares = max(roughness, 0.02) ** 2, np.array(SHARES)
    found = [np.zeros((0, 3))]
    for lamp in lamps:
        width = alpha * alpha + lamp.solid_angle / (4 * math.pi)
        falls = 4 * math.pi * lamp.view_dot_half * width * (1 + 2 * shares / width) ** 2
        found.append(np.array(lamp.irradiance) / falls[:, None])
    return np.concatenate(found) / _white(lamps, world)


@functools.lru_cache(maxsize=256)
def _reflectance(lamps: tuple[LampFacts, ...], f0: float, roughness: float) -> NDArray:
    """A lobe's reflectance where it mirrors each lamp (SHARES times), where skin faces the eye, and at RIMS.

    It is that of a dielectric of this F0, which rises to 1 at grazing angles whatever its F0. A rough surface is seen less grazing than
    it lies, by half of its alpha: within a tenth of what EEVEE draws of a black ball (roughness 0.45, IOR 1.4, 1.27 and 1.11) in a
    white world.
    """
    halves = np.repeat([lamp.view_dot_half for lamp in lamps], len(SHARES))
    cos = np.minimum(np.concatenate([halves, [1.0], np.sqrt(RIMS) + roughness * roughness / 2]), 1.0)
    root = math.sqrt(min(max(f0, 0.0), 0.9))
    eta = (1 + root) / (1 - root)
    within = np.sqrt(1 - (1 - cos * cos) / (eta * eta))
    across, along = (cos - eta * within) / (cos + eta * within), (eta * cos - within) / (eta * cos + within)
    found: NDArray = (across * across + along * along) / 2
    return found


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
    return _light_of(facts.lamps, facts.world, _built(facts, sorted(members), plain, top))


@functools.lru_cache(maxsize=1024)
def _light_of(
    lamps: tuple[LampFacts, ...], world_light: tuple[float, float, float], built: tuple[tuple[Lobe, ...], ...]
) -> Shown:
    """The highlights of lobes; what one reflects is not there for those below."""
    world = np.array(world_light) / _white(lamps, world_light)
    count = len(lamps) * len(SHARES)
    added, kept = np.zeros((count + 1 + len(RIMS), 3)), np.ones(count + 1 + len(RIMS))
    for layer in built:
        bright, reflected = np.zeros_like(added), np.zeros_like(kept)
        for weight, roughness, f0 in layer:
            part = _reflectance(lamps, f0, roughness)
            bright[:count] += weight * part[:count, None] * _peaks(lamps, world_light, roughness)
            bright += weight * part[:, None] * world
            reflected += weight * part
        added = added * (1 - reflected)[:, None] + bright
        kept = kept * (1 - reflected)
    return Shown(added, kept)


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
    none, top = frozenset[int](), _on_top(facts, live, frozenset())
    full = [_shine(facts, one, none, top) for one in states.sets]
    without = [_shine(facts, one, frozenset(live), none) for one in states.sets]
    return (
        frozenset(live)
        if account.leaves_out("finish", _difference(facts, states.colours[:, 0], full, without))
        else frozenset()
    )


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
        out = facts.finish is Switch.AUTO and asked is Switch.AUTO and account.leaves_out(key, error)
        if out:
            plain.add(index)
        engine = "lobe" if facts.engine is Engine.CYCLES else "finish"
        reason = "its own roughness and reflectance"
        if out:
            reason = "no light to be reflected" if not lit else "as what lies below shines"
        cost = Cost(calibration.shading(facts, engine), 9)
        name = f"Highlight of {facts.layers[index].name}"
        said = account.said(key) if facts.finish is Switch.AUTO and asked is Switch.AUTO else None
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
    lobes: Sequence[Effect],
    plain: frozenset[int],
    lit: bool,
    account: Account,
    calibration: Calibration,
) -> Effect:
    key, name, cost = "finish", "Film highlight", Cost(calibration.shading(facts, "finish"), 25)
    if not live:
        return Effect(key, name, False, "no film", 0.0, cost)
    if facts.finish is Switch.OFF:
        return Effect(key, name, False, "forced off", None, cost)
    said = account.said(key)
    if said is Switch.OFF:
        return Effect(key, name, False, "forced off", None, cost, said=said)
    if set(live) <= plain:
        reason = "films shine as the skin does" if lit else "no light to be reflected"
        return Effect(key, name, False, reason, 0.0, cost, said=said)
    reason = because(said, "films have their own roughness and reflectance")
    return Effect(key, name, True, reason, None, cost, said=said)


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
    out = account.leaves_out(key, error)
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
