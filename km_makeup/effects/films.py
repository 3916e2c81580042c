"""Which films exist, and what between them: each film, where films lie on one another, light between films and skin, air, bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from .calibration import Calibration
from .effect import Account, Cost, Effect, because
from .facts import LayerFacts, SceneFacts, Switch
from .states import KEPT_AS, States, at_fewer_bands, rounding, states_of, without_interface

FEWER = (8, 12, 16)
"""Numbers of bands with weights of their own."""

BAKE_SHARE, BAKE_MOST = 0.5, 0.25
"""A bake may use this share of what is left of the tolerance, and no more than that, in CIEDE2000."""

BAKE_LEAST = 0.02
"""What a bake may spend beside twice what the bands' number costs on the stacks that were looked at, in CIEDE2000."""


def film_effects(facts: SceneFacts, account: Account, calibration: Calibration) -> tuple[Effect, ...]:
    """An effect for each layer's film."""
    effects: dict[int, Effect] = {}
    uncertain = []
    for index, layer in enumerate(facts.layers):
        said = layer.switch if layer.switch is not Switch.AUTO else account.said(f"film:{index}")
        known = _plainly(replace(layer, switch=said), index, facts, calibration)
        if known is None:
            uncertain.append(index)
        else:
            effects[index] = replace(known, said=said if layer.mapped else None)
    present = sorted([*uncertain, *(i for i, effect in effects.items() if effect.on)])
    states = states_of(facts, present) if uncertain else None
    errors = {index: _error_without(facts, states, present, index, account) for index in uncertain} if states else {}
    step = rounding(facts, states) if states else 0.0
    for index in sorted(uncertain, key=lambda i: (errors.get(i, np.inf), i)):
        error = account.rounded(errors[index], step) if index in errors else None
        effects[index] = _weighed(index, facts, error, account, calibration)
    return tuple(effects[i] for i in range(len(facts.layers)))


def _cost(facts: SceneFacts, calibration: Calibration) -> Cost:
    height, width = facts.textures.size
    if facts.baked:
        return Cost()
    return Cost(calibration.shading(facts, "film"), 45, 1, height * width * 4 / 1e6)


def _plainly(layer: LayerFacts, index: int, facts: SceneFacts, calibration: Calibration) -> Effect | None:
    """The effect of a layer that needs no weighing."""
    key, name, cost = f"film:{index}", f"Film {layer.name}", _cost(facts, calibration)
    if not layer.mapped:
        return Effect(key, name, False, "it has no map", 0.0, cost)
    if layer.switch is Switch.ON:
        return Effect(key, name, True, "forced on", None, cost)
    if layer.switch is Switch.OFF:
        return Effect(key, name, False, "forced off", None, cost)
    if not layer.enabled:
        return Effect(key, name, False, "the layer is hidden", 0.0, cost)
    if layer.map_max <= 0 and layer.edited:
        return Effect(key, name, True, "its map is empty, but it is the layer to be painted", None, cost)
    if layer.map_max <= 0:
        return Effect(key, name, False, "its map is empty", 0.0, cost)
    if layer.thickness_mm <= 0:
        return Effect(key, name, False, "its thickness is zero", 0.0, cost)
    if layer.edited:
        return Effect(key, name, True, _painted(layer), None, cost)
    if not facts.view.visible:
        return Effect(key, name, False, "no camera sees the head", 0.0, cost)
    if not layer.seen:
        return Effect(key, name, False, "it is painted only where no camera sees skin", 0.0, cost)
    return None


def _painted(layer: LayerFacts) -> str:
    return (
        f"painted on {100 * layer.coverage:.1f} % of the map, up to {1000 * layer.thickness_mm * layer.map_max:.3g} µm"
    )


def _error_without(facts: SceneFacts, states: States, present: Sequence[int], index: int, account: Account) -> float:
    """The most that any stack changes by without this film: by its colour in any light, or by colour and highlight."""
    from .shine import error_without_film

    pairs = [(i, states.index(one - {index})) for i, one in enumerate(states.sets) if index in one]
    with_it, without = zip(*pairs)
    error = float(states.distance(states.colours[list(with_it)], states.colours[list(without)]).max())
    if facts.finish is not Switch.OFF and facts.layers[index].finish is not None:
        mark = ("film", index, states.sets)
        error = max(error, account.once(mark, lambda: error_without_film(facts, states, present, index)))
    return error + KEPT_AS


def _weighed(index: int, facts: SceneFacts, error: float | None, account: Account, calibration: Calibration) -> Effect:
    layer, key = facts.layers[index], f"film:{index}"
    out = account.leaves_out(key, error, rounds=True)
    reason = _painted(layer) if not out else f"too thin to be seen: {1000 * layer.thickness_mm * layer.map_max:.3g} µm"
    cost = _cost(facts, calibration)
    return Effect(key, f"Film {layer.name}", not out, reason, error, cost, said=account.said(key))


def overlap_effects(facts: SceneFacts, live: Sequence[int]) -> tuple[Effect, ...]:
    """An effect for each pair of films, and for each three that meet: films are fitted to what they really lie on."""
    found = []
    for size in (2, 3):
        for one in combinations(live, size):
            names = " and ".join(facts.layers[i].name for i in one)
            share = 0.0 if facts.meets is None else facts.meets.get(one, 0.0)
            on = facts.meet(one)
            if size == 3 and not on:
                continue
            reason = "they meet nowhere in the maps"
            if on:
                reason = (
                    "where they meet is not known"
                    if facts.meets is None
                    else f"they meet on {100 * share:.2g} % of the map"
                )
            key = "overlap:" + "+".join(str(i) for i in one)
            found.append(Effect(key, f"{names} on one another", on, reason, None if on else 0.0))
    return tuple(found)


def interreflection(
    facts: SceneFacts,
    states: States | None,
    live: Sequence[int],
    diffused: bool,
    account: Account,
    calibration: Calibration,
) -> Effect:
    """Light that goes between films and skin: a texture and a division of its own where textures are baked."""
    key, name = "interreflection", "Interreflection of films and skin"
    if not live:
        return Effect(key, name, False, "no film", 0.0)
    if states is None:
        return Effect(key, name, True, "the films' optics are not known", None)
    if not facts.baked or facts.finished:
        where = "the finished albedo" if facts.finished and facts.baked else "each film's own table"
        return Effect(key, name, True, f"it is part of {where} and costs nothing", None)
    c, mean = states.skins, states.skins[0]
    R, T2, R_up = states.R[:, None], states.T2[:, None], states.R_up[:, None]
    error = float(states.distance(R + T2 * c / (1 - R_up * c), R + T2 * c / (1 - R_up * mean)).max()) + KEPT_AS
    height, width = facts.textures.size
    cost = Cost(calibration.shading(facts, "baked") / 3, 8, 1, height * width * 8 / 1e6)
    said = account.said(key)
    if diffused and said is Switch.AUTO:
        reason = "the diffusion needs to know what the films send back into the skin"
        return Effect(key, name, True, reason, error, cost, said=said)
    error = account.rounded(error, rounding(facts, states))
    out = account.leaves_out(key, error, rounds=True)
    reason = because(
        said,
        f"changes nothing by more than {error:.2g}: one texture less"
        if out
        else f"would change colours by {error:.2g}",
    )
    return Effect(key, name, not out, reason, error, cost, said=said)


def air(facts: SceneFacts, states: States | None, live: Sequence[int], account: Account) -> Effect:
    """The air interface: free of cost, so there whenever products need it."""
    internal = any(facts.layers[i].internal for i in live)
    if not internal:
        reason = "products were measured through the surface" if live else "no film"
        return Effect("air", "Air interface", False, reason, 0.0)
    known = states is not None and all(facts.layers[i].internal for i in live)
    error = None
    if known and states is not None:
        error = account.once(("air", states.sets), lambda: without_interface(facts, states, live))
    return Effect(
        "air", "Air interface", True, "products hold internal K and S: light leaves through the surface", error
    )


def band_effect(
    facts: SceneFacts, states: States | None, live: Sequence[int], account: Account
) -> tuple[Effect, float]:
    """Spectral bands, and the CIEDE2000 that a bake may spend on fewer of them."""
    key, name = "bands", "Spectral bands"
    if states is None or not live:
        return Effect(key, name, bool(live), "all 81" if live else "no film", None if live else 0.0), 0.0
    if not facts.baked:
        return Effect(key, name, True, "all 81: films are fitted once, in milliseconds", None), 0.0
    said = account.said(key)
    if said is Switch.ON:
        return Effect(key, name, True, "forced on: all 81", None, said=said), 0.0
    step = account.rounded(0.0, rounding(facts, states))
    allowed = min(BAKE_SHARE * account.left, BAKE_MOST, account.left - step)
    for count in FEWER:
        error = at_fewer_bands(facts, states, live, count)
        if error <= allowed or said is Switch.OFF:
            most = 2 * error + BAKE_LEAST
            spent = most if said is Switch.OFF else min(allowed, most)
            reason = f"{count} of 81 do for these products under {facts.light} (error {error:.2g})"
            reason = because(said, f"{reason}; the bake may spend {spent:.2g}")
            account.used += spent + step if said is Switch.AUTO else 0.0
            return Effect(key, name, True, reason, spent + step, reduced=True, said=said), spent
    return Effect(key, name, True, "all 81: fewer would be seen", None, said=said), 0.0


def skin_effect(facts: SceneFacts, live: Sequence[int]) -> Effect:
    """The skin's spectrum from its colour."""
    if not live:
        return Effect("skin", "Skin spectrum", False, "no film", 0.0)
    count = len(facts.skin.colours)
    if facts.baked and facts.finished:
        return Effect("skin", "Skin spectrum", True, "for each texel of the skin's texture, as asked for", None)
    reason = "one colour, one spectrum" if count == 1 else f"{count} colours stand for the skin's texture"
    return Effect("skin", "Skin spectrum", True, reason, None, reduced=False)
