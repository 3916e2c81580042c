"""What the error of a picture of a head hangs on, as far as it can be told without a reference: light, scale, how bright, bare and hollow.

EEVEE misses Cycles by light that skin gives to skin, in proportion to how much the surface sends back and to how much skin faces
skin; by how light spreads inside skin, where films let it in; by light of the world where it does not reach. The share of each kind of
light, how large the head is in the picture, how bright it is and how much of what it sends back comes from the skin are
known before anything is rendered.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..effects import LampFacts, SceneFacts
from ..effects.states import states_of

HARD, SOFT, WORLD = KINDS = ("hard", "soft", "world")
HARD_SR = 0.01
"""Lamps of a smaller solid angle count as hard: an edge of their shadow is narrower than a tenth of what stands off."""

GREY = (0.2126, 0.7152, 0.0722)


@dataclass(frozen=True)
class Conditions:
    """What an expectation is made from.

    ``shares`` of the light by kind; ``px_per_mm`` on the nearest skin; ``reflectance`` (0..1), luminous, of the head as made up;
    ``from_skin`` (0..1), the share of it that went through the films into the skin and back; ``occlusion`` (0..1), the
    share of the directions above the skin that the head itself blocks, in the mean over the picture.
    """

    shares: Mapping[str, float] = field(default_factory=dict)
    px_per_mm: float = 0.0
    reflectance: float = 0.0
    from_skin: float = 0.0
    occlusion: float = 0.0


@dataclass(frozen=True)
class ErrorModel:
    """Mean CIEDE2000 of EEVEE's picture from Cycles by conditions, fitted (`python -m tests.accuracy.conditions`).

    ``lights`` by kind of light, four numbers at 1 pixel per mm: a convex head's; what is added where all light comes from the
    skin; what occlusion 1 adds on a black surface; what it adds to that on a white one. In mixed light it is the mean by
    share. It goes with the ``power`` of pixels per mm inside ``scales``, the least and the most it was fitted at, and stays
    beyond them.
    """

    lights: Mapping[str, Sequence[float]]
    power: float
    scales: Sequence[float]

    def error(self, where: Conditions) -> float:
        """Expected mean CIEDE2000; NaN in the dark, without a scale, or where a kind of light is not known."""
        shares = {kind: share for kind, share in where.shares.items() if share > 0}
        if not shares or where.px_per_mm <= 0 or not set(shares) <= set(self.lights):
            return math.nan
        parts = parts_of(where)
        mixed = sum(share * float(np.dot(self.lights[kind], parts)) for kind, share in shares.items())
        scale = min(max(where.px_per_mm, self.scales[0]), self.scales[1])
        return float(mixed * scale**self.power)


def parts_of(where: Conditions) -> tuple[float, float, float, float]:
    """What a model's four numbers of a kind of light are multiplied by."""
    return 1.0, where.from_skin, where.occlusion, where.occlusion * where.reflectance


def light_shares(lamps: Sequence[LampFacts], world: Sequence[float]) -> dict[str, float]:
    """Shares of the irradiance on skin that faces each light, by kind; all 0 where it is dark.

    Parameters: the lamps; ``world`` its radiance, RGB, which irradiates skin that faces it by pi times as much.
    """
    found = dict.fromkeys(KINDS, 0.0)
    found[WORLD] = math.pi * _grey(world)
    for lamp in lamps:
        found[WORLD if not lamp.real else HARD if lamp.solid_angle < HARD_SR else SOFT] += _grey(lamp.irradiance)
    total = sum(found.values())
    return {kind: value / total for kind, value in found.items()} if total > 0 else found


def brightness(facts: SceneFacts) -> tuple[float, float]:
    """Luminous reflectance of the head as made up, and the share of it that comes from the skin; by area.

    Layers count as painted as thick as they get where they are, and where they meet is taken by chance from what each
    covers: it is a mean over the head that is asked for.
    """
    worn = [i for i, one in enumerate(facts.layers) if one.enabled and one.map_max > 0 and one.coat is not None]
    states = states_of(facts, worn) if worn else None
    if states is None:
        return _grey(facts.skin.colours[0]), 1.0
    covers = {i: facts.layers[i].coverage for i in worn}
    weights = np.array(
        [math.prod(covers[i] if i in members else 1 - covers[i] for i in worn) for members in states.sets]
    )
    if not weights.any():  # all meet everywhere, and that was one set too many to be looked at
        weights[-1] = 1
    weights /= weights.sum()
    whole = float(weights @ states.colours[:, 0] @ np.array(GREY))
    of_films = float(weights @ states.R @ np.array(GREY))
    return whole, 1 - of_films / max(whole, 1e-6)


def _grey(colour: Sequence[float]) -> float:
    return float(sum(a * max(b, 0.0) for a, b in zip(GREY, colour, strict=True)))


__all__ = ["KINDS", "Conditions", "ErrorModel", "brightness", "light_shares", "parts_of"]
