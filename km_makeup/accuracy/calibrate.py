"""What effects cost on this machine, from ladders of pictures: what the plan weighs.

A cost is the difference of two rungs that differ by one thing, by megapixel, and where it is shading by sample as well.
Where a difference is lost in the noise of the two times (half of their middle 50 %), the cost is left to the default.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..effects import Calibration
from .ladder import Measured, Result


@dataclass(frozen=True)
class Frames:
    """What the frames were: megapixels, samples, films of the look, finishes of films, lamps that give highlights."""

    megapixels: float
    samples: int
    films: int
    lamps: int


def calibration(results: Sequence[Result], frames: Frames, machine: str, date: str) -> Calibration:
    """Costs in ms a megapixel (and sample); only kinds that stand out of the noise, others are the shipped ones when it is read."""
    rungs = {(r.ladder.name, rung.name): rung for r in results for rung in r.rungs}
    shading = 1e3 / (frames.megapixels * frames.samples)
    frame = 1e3 / frames.megapixels
    eevee = _costs(rungs, shading, {
        "film": ("picture", "EEVEE, live", "EEVEE, no makeup", frames.films),
        "baked": ("picture", "EEVEE, baked", "EEVEE, no makeup", 1),
        "second_lobe": ("gloss", "two lobes", "the skin's lobe only", 1),
        "lamp": ("gloss", "lamp by lamp", "the skin's lobe only", frames.lamps),
        "subsurface": ("diffusion", "EEVEE's own", "0 Gaussians", 1),
    })  # fmt: skip
    compositor = _costs(rungs, frame, {
        "gaussian": ("diffusion", "6 Gaussians", "1 Gaussian", 5),
        "depth_aware": ("diffusion", "6 Gaussians", "6 Gaussians, across steps", 1),
        "group": ("diffusion", "1 Gaussian", "0 Gaussians", 1),
    })  # fmt: skip
    return Calibration({"EEVEE": eevee}, compositor, machine, date[:10])


def _costs(
    rungs: dict[tuple[str, str], Measured], unit: float, wanted: dict[str, tuple[str, str, str, int]]
) -> dict[str, float]:
    found = {}
    for kind, (ladder, with_it, without, count) in wanted.items():
        one, other = rungs.get((ladder, with_it)), rungs.get((ladder, without))
        if one is None or other is None or not count:
            continue
        difference = one.times.later - other.times.later
        if difference > one.times.spread + other.times.spread:
            found[kind] = float(f"{unit * difference / count:.3g}")
    return found


__all__ = ["Frames", "calibration"]
