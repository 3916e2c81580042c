"""Effects, and the account of what leaving them out costs together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from .facts import Switch

DEFAULT_TOLERANCE = 0.5
"""CIEDE2000 that a picture may differ by from that with every effect: not visible."""

STAYS = 0.8
"""An effect that was there is left out only where the errors keep below this part of the tolerance: no flicker."""


Result = TypeVar("Result")


@dataclass(frozen=True)
class Cost:
    """What an effect's being there adds: milliseconds a frame, linked nodes, textures, and megabytes of them."""

    ms: float = 0.0
    nodes: int = 0
    textures: int = 0
    mb: float = 0.0

    def __add__(self, other: Cost) -> Cost:
        return Cost(self.ms + other.ms, self.nodes + other.nodes, self.textures + other.textures, self.mb + other.mb)

    @property
    def weight(self) -> float:
        """Everything in milliseconds: what an effect is worth leaving out."""
        return self.ms + 0.05 * self.nodes + 2.0 * self.textures + 0.1 * self.mb + 0.01

    def __str__(self) -> str:
        parts = [f"{self.ms:.3g} ms" if self.ms < 1000 else f"{self.ms / 1000:.3g} s"] if self.ms else []
        for count, word in ((self.nodes, "node"), (self.textures, "texture")):
            if count:
                parts.append(f"{count} {word}{'' if count == 1 else 's'}")
        if self.mb:
            parts.append(f"{self.mb:.3g} MB")
        return ", ".join(parts) or "nothing"


@dataclass(frozen=True)
class Effect:
    """One effect: on or off (``reduced``: in part), the reason in words, a bound on the error if it is left out.

    ``error`` is what the part that is left out costs where it is off or reduced, and what leaving it out would cost where it is
    on: in the units of CIEDE2000, which it is never below (`metric`); None where it is not known. ``key`` names it for
    overrides; ``said`` is what the user says of it, None where there is nothing to say: it follows from others, or costs nothing.
    """

    key: str
    name: str
    on: bool
    reason: str
    error: float | None = None
    cost: Cost = Cost()
    reduced: bool = False
    said: Switch | None = None

    @property
    def left_out(self) -> float:
        """What of the error is really there."""
        return self.error or 0.0 if not self.on or self.reduced else 0.0


@dataclass
class Account:
    """The tolerance, what of it is used, what the user says of each effect, and which were on before.

    ``chosen``: the effects that are worth leaving out, with their errors; others may use what is left of the tolerance
    beside these. ``has_rounded``: whether what is left out so far may round colours apart. ``known`` keeps what was computed.
    """

    tolerance: float
    overrides: Mapping[str, Switch] = field(default_factory=dict)
    before: Mapping[str, bool] | None = None
    chosen: Mapping[str, float] | None = None
    used: float = 0.0
    has_rounded: bool = False
    known: dict[tuple, Any] = field(default_factory=dict)

    def said(self, key: str) -> Switch:
        """What the user says of an effect; of one of a family (``lamp:Key``) what is said of the family counts too."""
        return self.overrides.get(key, self.overrides.get(key.split(":")[0], Switch.AUTO))

    def rounded(self, error: float, step: float) -> float:
        """An error of colours with the step by which they may be rounded apart, where it is not counted yet."""
        return error if self.has_rounded else error + step

    def leaves_out(self, key: str, error: float | None, rounds: bool = False) -> bool:
        """Whether an effect is left out; its error is then counted. Errors that are not known are too large.

        ``rounds``: whether its error holds that of colours that are rounded apart (`rounded`).
        """
        said = self.said(key)
        if said is not Switch.AUTO:
            return said is Switch.OFF
        out = self._keeps_the_limit(key, error)
        self.has_rounded |= out and rounds
        return out

    def _keeps_the_limit(self, key: str, error: float | None) -> bool:
        if error is None:
            return False
        if error <= 0:
            return True
        promised = sum(value for name, value in self.chosen.items() if name != key) if self.chosen else 0.0
        if self.chosen is not None and key in self.chosen:
            promised = 0.0
        if self.used + promised + error > self.limit(key):
            return False
        self.used += error
        if self.chosen is not None:
            self.chosen = {name: value for name, value in self.chosen.items() if name != key}
        return True

    def limit(self, key: str) -> float:
        """What all errors may add up to for this effect to be left out."""
        stays = self.before is not None and self.before.get(key, False)
        return self.tolerance * (STAYS if stays else 1.0)

    def once(self, key: tuple, compute: Callable[[], Result]) -> Result:
        """A result that is computed once."""
        if key not in self.known:
            self.known[key] = compute()
        found: Result = self.known[key]
        return found

    @property
    def left(self) -> float:
        """What of the tolerance is left."""
        return max(0.0, self.tolerance - self.used)


def because(said: Switch, otherwise: str) -> str:
    """The reason where the user says nothing, else that they did."""
    return otherwise if said is Switch.AUTO else f"forced {said.value}"
