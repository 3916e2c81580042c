"""The ladder of mip-mapping: what is seen of makeup from afar, when a texel stands for many.

Reference: every texel computed, then colours averaged over squares. The thickness averaged first is what a mip-mapped map does;
R, T2 and R_up averaged is what mip-mapped baked textures do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from numpy.typing import NDArray

from ..bake import bake
from ..spectra import delta_e
from .colour import Array, spread
from .ladder import Ladder, Result, Rung
from .maps import Painted, over, painted, request
from .pictures import Spread

STEPS = (2, 4, 8)


def averaged(pixels: NDArray, step: int) -> NDArray:
    """Means (height/step, width/step, channels) over squares."""
    height, width, channels = pixels.shape
    return pixels.reshape(height // step, step, width // step, step, channels).mean(axis=(1, 3))


def from_mean_thickness(work: Painted, step: int) -> Array:
    """Thickness averaged, then films computed."""
    layers, height, width = work.maps.shape
    small = work.maps.reshape(layers, height // step, step, width // step, step).mean(axis=(2, 4))
    return over(bake(request(small, tolerance=0)), averaged(work.skin, step))


def from_mean_textures(work: Painted, step: int) -> Array:
    """Films computed, their textures averaged, then laid over the averaged skin."""
    made = bake(request(work.maps, tolerance=0))
    R, T2, R_up = (averaged(texture[..., :3].astype(float), step) for texture in (made.R, made.T2, made.R_up))
    skin = averaged(work.skin, step)
    return R + T2 * skin / (1 - R_up * skin)


def mip_ladder(work: Painted | None = None) -> Ladder:
    """The ladder; another painting may be given."""
    given = work or painted()
    truth = over(bake(request(given.maps, tolerance=0)), given.skin)
    delta_e(truth[0, 0], truth[0, 0])
    return Ladder(
        "mip",
        "Mip-mapping",
        "CIEDE2000",
        f"a bake of {given.maps.shape[1]}x{given.maps.shape[1]} texels and its reduction",
        "every texel computed, its colour averaged",
        [
            Rung(f"{name}, {step}x{step}", about, _preparer(way, given, step), _judge(way, given, step, truth), setting)
            for step in STEPS[::-1]
            for name, about, way, setting in WAYS
        ],
        falling=tuple((f"mean thickness, {step}x{step}", f"mean textures, {step}x{step}") for step in STEPS)
        + (tuple(f"mean thickness, {step}x{step}" for step in STEPS[::-1]),),
        answer=_answer,
        notes=("Averaging thickness makes a film look more even than it is: half a square thickly covered is not the whole of it thinly covered.",),
    )  # fmt: skip


def _answer(result: Result) -> str:
    """Textures against thickness at the coarsest step measured."""
    at = {r.name: r.error for r in result.rungs}
    step = next((s for s in STEPS[::-1] if f"mean thickness, {s}x{s}" in at and f"mean textures, {s}x{s}" in at), None)
    if step is None:
        return "Too little was measured to say."
    thick, textures = at[f"mean thickness, {step}x{step}"], at[f"mean textures, {step}x{step}"]
    return (
        f"From afar, baked textures may be mip-mapped and painted maps should not: {step} times minified the mean error is "
        f"{textures.mean:.3f} with textures and {thick.mean:.2f} with thickness, 99 % {textures.p99:.2f} and {thick.p99:.0f}, most of it at hard edges."
    )


Way = Callable[[Painted, int], Array]

WAYS: Sequence[tuple[str, str, Way, str]] = (
    ("mean thickness", "thickness averaged, then films computed: mip-maps of the painted map", from_mean_thickness, ""),
    (
        "mean textures",
        "films computed, then R, T² and R_up averaged: mip-maps of baked textures",
        from_mean_textures,
        "path BAKED",
    ),
)


def _preparer(way: Way, work: Painted, step: int) -> Callable[[], Callable[[], Array]]:
    return lambda: lambda: way(work, step)


def _judge(way: Way, work: Painted, step: int, truth: Array) -> Callable[[], Spread]:
    covered = averaged((work.maps.max(axis=0) > 0).astype(float)[..., None], step)[..., 0] > 0
    return lambda: spread(delta_e(way(work, step)[covered], averaged(truth, step)[covered]))


__all__ = ["STEPS", "averaged", "mip_ladder"]
