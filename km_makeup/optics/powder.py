"""Powder: films that cover only an area fraction of what is below.

Where the grains are finer than the distance that light travels in the skin, light meets film and gaps on its way in
and out alike: the layer's own R, T and A are averaged, then stacked (FINE, the default). Where they are coarser,
light that enters through a gap leaves through it: the reflectances of all 2^n stacks are averaged (COARSE).
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from ..errors import MakeupError
from .arrays import SLACK, Array, common_shape, floats, refuse_outside
from .films import Film, Stack, as_stack, over, stack
from .interfaces import Interface

# 2^n stacks: more layers than this are no powder any more.
_LAYERS_MOST = 12


class PowderRule(Enum):
    """Whether the grains of powder are finer or coarser than the skin's scattering distance."""

    FINE = "fine"
    COARSE = "coarse"


def powder(one: Film | Stack, fraction: ArrayLike) -> Stack:
    """A film that covers an area fraction (0..1), its R, T and A averaged with those of nothing (rule FINE).

    Adds 2 eps to what the film's own values are off. Raises a `MakeupError` for what is no fraction.
    """
    layer = as_stack(one)
    *fields, share = floats(*layer, fraction)
    _check_fraction(share)
    common_shape(*fields, share)
    whole = Stack(*fields)
    gap = 1 - share
    return Stack(
        R_top=share * whole.R_top,
        R_bottom=share * whole.R_bottom,
        T=share * whole.T + gap,
        A_top=share * whole.A_top,
        A_bottom=share * whole.A_bottom,
        T_up=share * whole.T_up + gap,
    )


def _check_fraction(share: Array) -> None:
    """Refuse what is no area fraction."""
    refuse_outside("The area fraction of a powder", share, 0, 1, SLACK)


def powder_over(
    films: Sequence[Film | Stack],
    fractions: Sequence[ArrayLike],
    Rg: ArrayLike,
    rule: PowderRule = PowderRule.FINE,
    interface: Interface | None = None,
) -> Array:
    """Reflectance of films that cover area fractions, over an opaque backing.

    Parameters
    ----------
    films
        Bottom to top, any broadcastable shapes.
    fractions
        Area fraction of each, 0..1; 1 is a liquid or cream.
    Rg
        Reflectance of the backing, 0..1 (internal, where an interface is given).
    rule
        FINE: average the layers, then stack. COARSE: average the stacks, layers placed independently.
    interface
        The air interface on top of everything, or None.

    Raises
    ------
    MakeupError
        Lists of unequal length, a fraction or backing outside 0..1, or more than 12 partly covering films with COARSE.
    """
    if len(films) != len(fractions):
        raise MakeupError(f"{len(films)} films need as many area fractions, not {len(fractions)}.")
    top: list[Film | Stack] = [] if interface is None else [interface.as_stack]
    if rule is PowderRule.FINE:
        whole = stack([powder(one, share) for one, share in zip(films, fractions, strict=True)] + top)
        return over(whole.R_top, whole.T * whole.T_up, whole.R_bottom, Rg)
    return _coarse(films, fractions, Rg, top)


def _coarse(
    films: Sequence[Film | Stack], fractions: Sequence[ArrayLike], Rg: ArrayLike, top: list[Film | Stack]
) -> Array:
    """The mean of the reflectances of all stacks that the films form, each there or not."""
    shares = floats(*fractions, Rg)[:-1]
    for share in shares:
        _check_fraction(share)
    choices = [(True,) if np.all(share == 1) else (True, False) for share in shares]
    if sum(len(choice) > 1 for choice in choices) > _LAYERS_MOST:
        raise MakeupError(
            f"More than {_LAYERS_MOST} powders on one another are too many for the coarse rule; take the fine one."
        )
    total: Array | float = 0.0
    for present in product(*choices):
        there = [one for one, is_there in zip(films, present, strict=True) if is_there]
        whole = stack(there + top)
        *fields, backing = floats(*whole, Rg)
        common_shape(*fields, backing, *shares)
        whole = Stack(*fields)
        weight: Array | float = 1.0
        for share, is_there in zip(floats(*fractions, backing)[:-1], present, strict=True):
            weight = weight * (share if is_there else 1 - share)
        total = total + weight * over(whole.R_top, whole.T * whole.T_up, whole.R_bottom, backing)
    return np.asarray(total)[()]


def powder_difference(
    films: Sequence[Film | Stack],
    fractions: Sequence[ArrayLike],
    Rg: ArrayLike,
    interface: Interface | None = None,
) -> Array:
    """Reflectance by the coarse rule less that by the fine one, over a backing: what the choice is worth."""
    coarse = powder_over(films, fractions, Rg, PowderRule.COARSE, interface)
    return coarse - powder_over(films, fractions, Rg, PowderRule.FINE, interface)
