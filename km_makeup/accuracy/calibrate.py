"""What effects cost on this machine, from the ladder of costs: what the plan weighs.

A cost is the difference of rungs that differ by one effect, by megapixel, and where it is shading by sample as well. Runs take
turns, and of each rung the faster half counts, so that what slows the machine for a while falls out of a difference. What a frame takes by
itself comes in the same way from frames of two sizes, so that Blender's own work around each falls out.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ..effects import Calibration
from .ladder import Measured, Result, of_the_fastest

LADDER = "costs"
SPEED = "speed"
"""The ladder of the bare head's frames alone."""
ENGINES = {"EEVEE": "EEVEE", "CYCLES": "Cycles"}
"""What a rung's name begins with, by engine."""

ALL, NO_FILMS, BAKED = "everything", "no makeup", "baked, no film highlights"
NODES = "nodes of {}"
"""What a ladder holds of an effect's nodes, by its kind."""
NO_FINISH, ONE_LOBE_LESS, NO_SECOND_LOBE, LAMPS = (
    "no film highlights",
    "one highlight less",
    "no second lobe",
    "lamp by lamp",
)
SMALLER = "no makeup, half as wide and high"
NO_NORMALS, NO_DITHER = "relief as it is", "no dither"
NO_SCATTERING, BARE_NO_SCATTERING = "no scattering", "no makeup, no scattering"
NO_GAUSSIAN, ONE_GAUSSIAN, ALL_GAUSSIANS, ACROSS = (
    "compositor, no Gaussian",
    "compositor, 1 Gaussian",
    "compositor, 6 Gaussians",
    "compositor, 6 Gaussians across steps",
)
COMPOSITED = ((NO_GAUSSIAN, 0, True), (ONE_GAUSSIAN, 1, True), (ALL_GAUSSIANS, 6, True), (ACROSS, 6, False))
"""Rungs of the compositor: name, Gaussians, whether they stop at steps in depth."""

CERTAIN = 0.5
"""Standard error of a cost, as a part of it, that it must not be above."""
SMALL = 0.01
"""Or as a part of the frame: then the cost is known to be small."""


@dataclass(frozen=True)
class Difference:
    """Seconds between two sums of frames, its standard error, and the seconds of one frame of them."""

    seconds: float
    error: float
    frame: float

    @property
    def certain(self) -> bool:
        """Whether it stands out of the noise, or is known to be small."""
        return self.error <= max(CERTAIN * abs(self.seconds), SMALL * self.frame)


def calibration(results: Sequence[Result], machine: str, date: str) -> Calibration | None:
    """Costs in ms a megapixel (and sample), by kind; None where no ladder of them was measured to its end, or frames
    alone were and are lost in noise.

    Kinds that are lost in noise are left out: they stay what they were.
    """
    whole = [next((r for r in results if r.ladder.name == name and r.whole), None) for name in (LADDER, SPEED)]
    result = whole[0] or whole[1]
    if result is None:
        return None
    holds = result.ladder.holds
    frame = 1e3 / holds["megapixels"]
    frames: dict[str, float] = {}
    for engine, said in ENGINES.items():
        larger = difference(result, [f"{said}, {NO_FILMS}"], [f"{said}, {SMALLER}"])
        if larger is not None and larger.certain and larger.seconds > 0:
            frames[engine] = _ms(larger, frame / holds["samples"], 3 / 4)
    if result is not whole[0]:
        return Calibration({}, {}, machine, date[:10], frames) if frames else None
    sought = {engine: _shading(result, said, holds) for engine, said in ENGINES.items()}
    units = dict.fromkeys(sought, frame / holds["samples"]) | {"compositor": frame}
    sought["compositor"] = _compositing(result)
    known = {e: _kept(one, units[e]) for e, one in sought.items()}
    lost = {e: _lost(one, units[e], known[e], holds) for e, one in sought.items()}
    compositor = known.pop("compositor")
    return Calibration(known, compositor, machine, date[:10], frames, {e: one for e, one in lost.items() if one})


def over(found: Calibration, before: Calibration) -> Calibration:
    """Costs that were measured, and those measured before of kinds that are lost in noise now or that this scene does not have.

    Those from another machine are taken in proportion to the bare head's frame. Costs that are but the shipped ones in
    proportion are left out: reading puts them in, in proportion to the frame that is known by then.
    """
    supposed = Calibration.shipped().scaled(before.frame_ms)
    own = {engine: _but(costs, supposed.shading_ms.get(engine, {})) for engine, costs in before.shading_ms.items()}
    before = replace(before, shading_ms=own, compositor_ms=_but(before.compositor_ms, supposed.compositor_ms))
    if before.machine != found.machine:
        before = before.scaled(found.frame_ms)
    engines = {
        engine: {**before.shading_ms.get(engine, {}), **found.shading_ms.get(engine, {})}
        for engine in dict.fromkeys((*before.shading_ms, *found.shading_ms))
    }
    return Calibration(
        engines,
        {**before.compositor_ms, **found.compositor_ms},
        found.machine,
        found.measured,
        {**(before.frame_ms if before.machine else {}), **found.frame_ms},  # no machine: a frame that is assumed
    )


def _but(costs: Mapping[str, float], supposed: Mapping[str, float]) -> dict[str, float]:
    """Costs other than those supposed."""
    return {kind: ms for kind, ms in costs.items() if not math.isclose(ms, supposed.get(kind, -1.0), rel_tol=1e-9)}


Sought = dict[str, tuple[Difference | None, float]]
"""By kind: the difference, and how many effects of the kind it holds."""


def _shading(result: Result, said: str, holds: Mapping[str, float]) -> Sought:
    def of(plus: Sequence[str], minus: Sequence[str]) -> Difference | None:
        return difference(result, [f"{said}, {name}" for name in plus], [f"{said}, {name}" for name in minus])

    films, lobes, lamps = holds["films"], holds["lobes"], holds["lamps"]
    relief = _has(result, f"{said}, {NO_NORMALS}")
    found: Sought = {
        "film": (of([NO_FINISH], [NO_FILMS]), films),
        "baked": (of([BAKED], [NO_FILMS]), 1),
        "normals": (of([ALL], [NO_NORMALS]), 1),
    }
    # without highlights of films nothing fades the relief either
    highlights = ([NO_NORMALS] if relief else [ALL]), [NO_FINISH]
    if said == "EEVEE":
        second = _has(result, f"{said}, {NO_SECOND_LOBE}")
        found |= {
            "second_lobe": (of([ALL], [NO_SECOND_LOBE]), 1),
            "dither": (of([ALL], [NO_DITHER]), 1),
            "subsurface": (of([ALL], [NO_SCATTERING]), 1),
            "lamp": (of([LAMPS], [NO_SECOND_LOBE if second else ALL]), lamps),
            "finish": (of([*highlights[0], *([NO_SECOND_LOBE] if second else [])], [*highlights[1], *([ALL] if second else [])]), 1 + lobes),
        }  # fmt: skip
        return found
    one = _has(result, f"{said}, {ONE_LOBE_LESS}")
    found |= {
        "lobe": (of([ALL], [ONE_LOBE_LESS]), 1),
        "finish": (of(*highlights) if not one else _rest(result, said, highlights, lobes), 1),
        "subsurface": (of([NO_FILMS], [BARE_NO_SCATTERING]), 1),
        "film_closure": (of([ALL, BARE_NO_SCATTERING], [NO_SCATTERING, NO_FILMS]), 1),
    }
    return found


def _rest(
    result: Result, said: str, highlights: tuple[Sequence[str], Sequence[str]], lobes: float
) -> Difference | None:
    """What highlights cost beside a lobe for each film."""
    plus, minus = ([f"{said}, {name}" for name in side] for side in highlights)
    return difference(
        result, [*plus, *[f"{said}, {ONE_LOBE_LESS}"] * int(lobes)], [*minus, *[f"{said}, {ALL}"] * int(lobes)]
    )


def _compositing(result: Result) -> Sought:
    return {
        "passes": (difference(result, [NO_GAUSSIAN], [f"EEVEE, {NO_SCATTERING}"]), 1),
        "gaussian": (difference(result, [ALL_GAUSSIANS], [ONE_GAUSSIAN]), 5),
        "group": (difference(result, [ONE_GAUSSIAN] * 6, [NO_GAUSSIAN] * 5 + [ALL_GAUSSIANS]), 5),
        "depth_aware": (difference(result, [ALL_GAUSSIANS], [ACROSS]), 1),
    }


def _has(result: Result, name: str) -> bool:
    return any(rung.name == name for rung in result.rungs)


def difference(result: Result, plus: Sequence[str], minus: Sequence[str]) -> Difference | None:
    """Frames of some rungs less those of others; None where one of them was not measured, or fewer than three times.

    Of every rung the faster half of its runs; the error by leaving out one round of runs after the other (jackknife).
    """
    rungs: dict[str, Measured] = {rung.name: rung for rung in result.rungs}
    if not all(name in rungs and len(rungs[name].times.runs) >= 3 for name in (*plus, *minus)):
        return None
    count = min(len(rungs[name].times.runs) for name in (*plus, *minus))

    def found(rounds: Sequence[int]) -> float:
        def of(name: str) -> float:
            return of_the_fastest([rungs[name].times.runs[i] for i in rounds])

        return sum(map(of, plus)) - sum(map(of, minus))

    without = [found([i for i in range(count) if i != out]) for out in range(count)]
    middle = statistics.mean(without)
    error = math.sqrt((count - 1) / count * sum((one - middle) ** 2 for one in without))
    return Difference(found(range(count)), error, max(rungs[name].undisturbed for name in (*plus, *minus)))


def _kept(found: Sought, unit: float) -> dict[str, float]:
    """Costs that are known: at least nothing."""
    return {
        kind: _ms(one, unit, count) for kind, (one, count) in found.items() if one is not None and count and one.certain
    }


def _ms(one: Difference, unit: float, count: float) -> float:
    return float(f"{max(0.0, unit * one.seconds / count):.3g}")


def _lost(found: Sought, unit: float, known: Mapping[str, float], holds: Mapping[str, float]) -> dict[str, float]:
    """Costs that the noise hides: as they were found where that is above its error, else by their nodes, each as costly as a film's."""
    lost = {}
    for kind, (one, count) in found.items():
        if one is None or not count or kind in known:
            continue
        nodes, of_film = holds.get(NODES.format(kind)), holds.get(NODES.format("film"))
        if one.seconds > one.error:
            lost[kind] = _ms(one, unit, count)
        elif nodes and of_film and "film" in known:
            lost[kind] = float(f"{known['film'] * nodes / of_film:.3g}")
    return lost


def answer(result: Result) -> str:
    """What the plan takes from it, in a sentence."""
    made = calibration([result], "", "")
    if made is None:
        return ""
    parts = [
        f"{engine}'s frame of the bare head {ms:g} ms a megapixel and sample" for engine, ms in made.frame_ms.items()
    ]
    parts += [
        f"{engine} (ms a megapixel and sample): {', '.join(f'{kind} {ms:g}' for kind, ms in costs.items())}"
        for engine, costs in made.shading_ms.items()
        if costs
    ]
    if made.compositor_ms:
        parts.append(
            f"compositor (ms a megapixel): {', '.join(f'{kind} {ms:g}' for kind, ms in made.compositor_ms.items())}"
        )
    return (
        f"The plan weighs {'; '.join(parts)}."
        if parts
        else "Every cost is lost in the noise of these runs; measure again on a quieter machine."
    )


__all__ = ["Difference", "answer", "calibration", "difference", "over"]
