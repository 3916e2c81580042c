"""The ladder of powder's two rules: are its grains finer or coarser than the distance that light travels in the skin?

Reference: grains of a size laid at random, light that goes in through grain or gap, wanders in the skin by the measured profile of
d'Eon and Luebke (red, green and blue), and comes out through grain or gap elsewhere, back and forth until nothing is left; 81 bands,
on a grid that repeats. The rules are its two ends: grains without size, and grains without end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..makeup.coat import coat
from ..optics import Interface, PowderRule, film, powder_over
from ..optics.diffusion import SKIN
from ..products import Library
from ..spectra import WAVELENGTHS, bands, delta_e, reference_skins
from .colour import Array, spread
from .ladder import Ladder, Result, Rung
from .pictures import Spread

GRAINS_MM = (0.05, 0.5, 2.5)
"""Sizes of grains, or of the clumps in which they lie, in mm."""

FRACTIONS = (0.2, 0.5, 0.8)
GRID = 64
CELLS = 32
"""Grains along a side of the grid; light that leaves on one side comes in on the other."""

BOUNCES = 6
TEXELS = 1 << 12


@dataclass(frozen=True)
class Powdered:
    """One powder on one skin: reflectance and transmittance of its film (81,), and the skin's internal reflectance (81,)."""

    R: Array
    T: Array
    skin: Array


@cache
def powders() -> tuple[Powdered, ...]:
    """Every second shipped powder on the lightest and the darkest skin that is shipped."""
    library = Library.shipped()
    skins = sorted(reference_skins().values(), key=lambda one: float(one.mean()))
    found = []
    for product in [p for p in library.products if p.form == "powder"][::2]:
        one = coat(product, product.thickness_um)
        made = film(one.K, one.S, one.thickness_mm)
        found += [Powdered(made.R, made.T, _inside(skin)) for skin in (skins[0], skins[-1])]
    return tuple(found)


def _interface() -> Interface:
    from ..makeup.coat import INDEX
    from ..optics import air_interface

    return air_interface(INDEX)


def _inside(skin: Array) -> Array:
    """The skin's reflectance below its surface."""
    k = _interface()
    return skin / ((1 - k.k1) * (1 - k.k2) + k.k2 * skin)


def _seen(internal_reflectance: Array) -> Array:
    """Colours of internal reflectances (..., 81) through the surface, without its first reflection."""
    k = _interface()
    r = internal_reflectance
    return (1 - k.k1) * (1 - k.k2) * r / (1 - k.k2 * r) @ bands().weights


def transported(one: Powdered, fraction: float, grain_mm: float) -> Array:
    """Mean internal reflectance (81,) of grains of a size that cover an area fraction: light wanders from grain to gap."""
    random = np.random.default_rng(5)
    cells = random.permutation(CELLS * CELLS).reshape(CELLS, CELLS) < round(fraction * CELLS * CELLS)
    mask = cells.repeat(GRID // CELLS, 0).repeat(GRID // CELLS, 1).astype(float)
    step = grain_mm * CELLS / GRID
    frequency = 2 * np.pi * np.fft.fftfreq(GRID, step)
    wander = SKIN.spectrum(np.hypot(frequency[:, None], frequency[None, : GRID // 2 + 1]))
    total = np.empty(len(WAVELENGTHS))
    for i, nm in enumerate(WAVELENGTHS):
        kernel = wander[..., 2 if nm < 490 else 1 if nm < 580 else 0]
        through, back = 1 - mask + mask * one.T[i], mask * one.R[i]
        inside, out = through, mask * one.R[i]
        for _ in range(BOUNCES):
            leaving = one.skin[i] * np.fft.irfft2(np.fft.rfft2(inside) * kernel, inside.shape)
            out = out + through * leaving
            inside = back * leaving
        total[i] = out.mean()
    return total


def powder_ladder() -> Ladder:
    """The ladder."""
    some = powders()
    delta_e(np.ones(3), np.ones(3))
    return Ladder(
        "powder",
        "Powder's two rules",
        "CIEDE2000",
        f"{TEXELS} texels of one powder at 81 bands",
        f"light that wanders between grains of {', '.join(f'{g:g}' for g in GRAINS_MM)} mm in the skin, 81 bands, computed on a grid",
        [
            Rung(f"{name}, {about_grain}", about, _preparer(rule, some[0]), _judge(rule, some, grains), setting)
            for grains, about_grain in GROUPS
            for name, about, rule, setting in RULES
        ],
        answer=_answer,
        notes=(
            "Neither rule is the better one everywhere: the fine rule is exact for grains without size, the coarse one for grains "
            "without end. Powder as applied has grains and clumps far below half a millimetre, hence the default.",
        ),
    )  # fmt: skip


def _answer(result: Result) -> str:
    """Which rule is nearer at which size."""
    at = {r.name: r.error.mean for r in result.rungs}
    sizes = [g for g in GRAINS_MM if f"fine rule, {g:g} mm" in at and f"coarse rule, {g:g} mm" in at]
    fine = [g for g in sizes if at[f"fine rule, {g:g} mm"] < at[f"coarse rule, {g:g} mm"]]
    words = "; ".join(
        f"{g:g} mm: fine {at[f'fine rule, {g:g} mm']:.2f}, coarse {at[f'coarse rule, {g:g} mm']:.2f}" for g in sizes
    )
    nearer = f"up to {max(fine):g} mm the fine rule is the nearer one" if fine else "the coarse rule is the nearer one"
    return f"For grains and clumps {nearer} (mean error at {words}); both cost about the same."


GROUPS: Sequence[tuple[tuple[float, ...], str]] = tuple(((g,), f"{g:g} mm") for g in GRAINS_MM)

RULES: Sequence[tuple[str, str, PowderRule, str]] = (
    ("coarse rule", "the reflectances of covered and bare skin averaged", PowderRule.COARSE, ""),
    ("fine rule", "the film's R and T averaged with those of nothing, then laid on the skin", PowderRule.FINE, "powder fine"),
)  # fmt: skip


@cache
def _truths(grain: float) -> tuple[Array, ...]:
    return tuple(_seen(transported(one, fraction, grain)) for one in powders() for fraction in FRACTIONS)


def _by_rule(one: Powdered, fractions: Array, rule: PowderRule) -> Array:
    from ..optics import Film

    made = Film(one.R, one.T, np.maximum(1 - one.R - one.T, 0))
    return powder_over([made], [fractions[:, None]], one.skin, rule)


def _judge(rule: PowderRule, some: Sequence[Powdered], grains: Sequence[float]) -> Callable[[], Spread]:
    def error() -> Spread:
        given = np.concatenate([_seen(_by_rule(one, np.array(FRACTIONS), rule)) for one in some])
        return spread(np.concatenate([delta_e(given, np.array(_truths(grain))) for grain in grains]))

    return error


def _preparer(rule: PowderRule, one: Powdered) -> Callable[[], Callable[[], Array]]:
    fractions = np.random.default_rng(1).random(TEXELS)
    return lambda: lambda: _seen(_by_rule(one, fractions, rule))


__all__ = ["GRAINS_MM", "powder_ladder", "powders", "transported"]
