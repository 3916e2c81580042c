"""The ladder of the skin below the films: from multiplying RGB to its measured spectrum.

The films are computed at all 81 bands in every rung; what differs is what is known of the skin.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from numpy.typing import NDArray

from ..makeup.coat import on_skin
from ..spectra import bands, upsample_skin
from .colour import Array, Compute, Method, Stack, _judge, _preparer, reference_cases, timed_stack
from .ladder import Ladder, Rung


def skin_ladder(stacks: Sequence[Stack] | None = None, timed: Stack | None = None) -> Ladder:
    """The ladder; other cases and another timed stack may be given."""
    cases, work = tuple(stacks or reference_cases()), timed or timed_stack()
    return Ladder(
        "skin",
        "What is known of the skin",
        "CIEDE2000",
        f"{len(work.values)} texels of {len(work.products)} films",
        "the skin's measured spectrum, 1 nm, 40 digits (mpmath)",
        [Rung(name, about, _preparer(m, work), _judge(m, cases), setting) for name, about, m, setting in METHODS],
        falling=(tuple(name for name, *_ in METHODS[:-1]),),
        notes=(
            "The skins here are mixtures of the three that the basis was fitted with, so the basis is as near as the spectrum "
            "itself: what is left of both are the steps of 5 nm.",
        ),
    )


def multiplied(stack: Stack) -> Compute:
    """The films' R and T^2 in RGB, T^2 times the skin's RGB; light between films and skin is left out."""
    W, coats = bands(stack.light).weights, stack.coats()

    def compute(values: Array, skins: Array) -> Array:
        optics = on_skin([c.at(v) for c, v in zip(coats, values.T)], stack.interface)
        return optics.R @ W + (optics.T2 @ W) * (skins @ W)

    return compute


def known_by(spectrum: Callable[[NDArray, str], NDArray]) -> Method:
    """The stack over spectra made from the skin's RGB under a light."""

    def prepare(stack: Stack) -> Compute:
        W, coats = bands(stack.light).weights, stack.coats()

        def compute(values: Array, skins: Array) -> Array:
            optics = on_skin([c.at(v) for c, v in zip(coats, values.T)], stack.interface)
            return optics.over(spectrum(skins @ W, stack.light)) @ W

        return compute

    return prepare


def measured(stack: Stack) -> Compute:
    """The stack over the skin's own spectrum."""
    W, coats = bands(stack.light).weights, stack.coats()
    return lambda values, skins: on_skin([c.at(v) for c, v in zip(coats, values.T)], stack.interface).over(skins) @ W


METHODS: Sequence[tuple[str, str, Method, str]] = (
    ("RGB multiply", "R + T² c in RGB, no light between films and skin", multiplied, ""),
    ("Mallett-Yuksel", "a smooth spectrum for any colour", known_by(lambda c, light: upsample_skin(c, light, shrinkage=1.0)), ""),
    ("skin basis", "a spectrum such as skins have; what bakes use", known_by(lambda c, light: upsample_skin(c, light)), "finished"),
    ("spectral texture", "the measured spectrum of every texel", measured, ""),
)  # fmt: skip
