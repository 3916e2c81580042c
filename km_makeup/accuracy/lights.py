"""What light a head is seen in, as far as the error of a picture hangs on it: shares of hard lamps, soft lamps and the world."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ..effects import LampFacts

HARD, SOFT, WORLD = KINDS = ("hard", "soft", "world")
HARD_SR = 0.01
"""Lamps of a smaller solid angle count as hard: an edge of their shadow is narrower than a tenth of what stands off."""

GREY = (0.2126, 0.7152, 0.0722)


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


def mean_error(errors: Mapping[str, float], shares: Mapping[str, float]) -> float:
    """Error in mixed light: of a sum of lights, the mean of theirs by share. NaN where a kind is not known or it is dark.

    Differences of two renderings add up light by light, and CIEDE2000 is near to linear in them where they are small.
    """
    if not any(shares.values()) or any(share and kind not in errors for kind, share in shares.items()):
        return math.nan
    return sum(share * errors[kind] for kind, share in shares.items() if share)


def _grey(colour: Sequence[float]) -> float:
    return float(sum(a * max(b, 0.0) for a, b in zip(GREY, colour, strict=True)))


__all__ = ["KINDS", "light_shares", "mean_error"]
