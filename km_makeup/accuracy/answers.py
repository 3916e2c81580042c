"""What a measurement says, in sentences: each ladder's answer, and the questions that a reader comes with."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

from .ladder import Measured, Result
from .report import fastest

Results = Mapping[str, Result]
"""What was measured, by the ladder's name."""


def answer(result: Result) -> str:
    """The ladder's answer in a sentence: the fastest rung whose error stays invisible, and what the best one costs more."""
    if result.ladder.answer is not None:
        return result.ladder.answer(result)
    base, visible, unit = fastest(result), result.ladder.visible, result.ladder.unit
    good = [r for r in result.rungs if r.error.p99 <= visible]
    best = min(result.rungs, key=lambda r: (r.error.mean, r.times.later))
    if not good:
        near = min(result.rungs, key=lambda r: r.error.p99)
        if result.noise is not None and result.noise.p99 > visible:
            return (
                f"Nearest is {near.name}: 99 % of its errors are below {near.error.p99:.2f}. Whether that is visible ({visible:g} {unit}) "
                f"can't be told here: the reference's own grain is {result.noise.p99:.2f} at 99 %. {_told_apart(result)}"
            )
        return f"No way here keeps 99 % of the errors below {visible:g} {unit}; the nearest, {near.name}, has {near.error.p99:.2f}."
    quick = min(good, key=lambda r: r.times.later)
    text = (
        f"Use {quick.name}: 99 % of its errors are below {_short(quick.error.p99)} {unit} (visible from {visible:g}), and no way that good is "
        f"faster; it takes {about(quick.times.later / base)} times the fastest of all."
    )
    if best.name == quick.name:
        return text + " It is also the most accurate."
    times = about(best.times.later / quick.times.later)
    return (
        text
        + f" The most accurate in the mean, {best.name} ({_least(best.error.mean)}), takes {times} times as long as that."
    )


def _told_apart(result: Result) -> str:
    """Which rungs the grain of the reference cannot tell apart from the nearest, and the fastest of them."""
    assert result.noise is not None
    best = min(r.error.mean for r in result.rungs)
    alike = [r for r in result.rungs if r.error.mean <= best + result.noise.mean / 4]
    if len(alike) < 2:
        return "It is nearer than all others by more than a quarter of that grain."
    quick = min(alike, key=lambda r: r.times.later)
    names = ", ".join(r.name for r in alike[:-1]) + f" and {alike[-1].name}"
    if all(_as_long(r, quick) for r in alike):
        return f"{names} differ by less than a quarter of it, and their times by less than they scatter."
    return f"{names} differ by less than a quarter of it; {quick.name} is the fastest of them."


def about(ratio: float) -> str:
    """A ratio of times, with the two digits that it is good for."""
    return f"{float(f'{ratio:.2g}'):g}"


def _short(error: float) -> str:
    return f"{error:.2f}" if error >= 0.005 else "0.005"


def _least(error: float) -> str:
    return f"{error:.2f}" if error >= 0.005 else "less than 0.005"


def _as_long(one: Measured, other: Measured) -> bool:
    """Whether two times differ by less than they scatter."""
    return abs(one.times.later - other.times.later) <= one.times.spread + other.times.spread


def in_short(results: Sequence[Result]) -> list[tuple[str, str]]:
    """Questions with their answers; for those whose ladder was not measured, how it is."""
    by_name = {result.ladder.name: result for result in results if result.rungs}
    found = []
    for name, question, tell in QUESTIONS:
        head = " HEAD.blend" if name in OF_A_HEAD else ""
        missing = f"Not measured in this run: km_makeup accuracy{head} --ladder {name} --out FOLDER."
        text = tell(by_name) if name in by_name else missing
        if text:
            found.append((question, text))
    return found


def _rung(result: Result, name: str) -> Measured | None:
    return next((r for r in result.rungs if r.name == name), None)


def how_many_bands(results: Results) -> str:
    """The fewest fitted bands that nobody tells from the truth."""
    result = results["colour"]
    counted = [(int(m[1]), r) for r in result.rungs if (m := re.fullmatch(r"(\d+) (?:fitted )?bands", r.name))]
    if not counted:
        return ""
    counted.sort(key=lambda one: one[0])
    enough = next((one for one in counted if one[1].error.p99 <= result.ladder.visible), None)
    most, last = counted[-1]
    if enough is None:
        return f"More than {most}: 99 % of the errors are then still up to {last.error.p99:.2f}."
    count, rung = enough
    fewer = [one for one in counted if one[0] < count]
    before = (
        f" With {fewer[-1][0]}, 1 % of the colours are off by more than {fewer[-1][1].error.p99:.2f}." if fewer else ""
    )
    never = next((one for one in counted if one[1].error.max <= result.ladder.visible), None)
    safe = (
        f" For no visible error at all take {never[0]} (largest {never[1].error.max:.2f})."
        if never and never[0] != count
        else ""
    )
    single = _rung(result, f"{most} bands, float32")
    quick = f", {about(single.times.later / rung.times.later)} in single precision" if single else ""
    alike = [
        (int(m[1]), r)
        for r in result.rungs
        if (m := re.fullmatch(r"(\d+) fitted bands, float32", r.name)) and r.times.later <= 1.05 * rung.times.later
    ]
    more, better = max(alike, key=lambda one: one[0], default=(0, rung))
    instead = (
        f" In single precision {more} take no longer, and 99 % of the errors are below {_short(better.error.p99)}: use these."
        if more > count
        else ""
    )
    return (
        f"{count} are enough, with fitted weights: 99 % of the errors are below {rung.error.p99:.2f}, the largest is {rung.error.max:.2f}.{instead}{safe}{before} "
        f"All {most} take {about(last.times.later / rung.times.later)} times as long{quick}, for a largest error of {last.error.max:.2f}."
    )


def is_baking_worth_it(results: Results) -> str:
    """Baked textures against the live tables: the colours, and what frames take where they were measured."""
    live, baked = (_rung(results["colour"], name) for name in ("live", "baked"))
    if live is None or baked is None:
        return ""
    text = (
        f"For accuracy hardly: the mean error falls from {live.error.mean:.3f} to {baked.error.mean:.3f}, 99 % from "
        f"{live.error.p99:.2f} to {baked.error.p99:.2f} (largest {live.error.max:.2f} and {baked.error.max:.2f}); 0.5 is where one begins to "
        "see it."
    )
    drawn, shown = (
        _rung(results["frame"], name) if "frame" in results else None for name in ("live, a frame", "baked, a frame")
    )
    if drawn and shown:
        ratio = drawn.times.later / shown.times.later
        faster = (
            "no faster, within the scatter" if _as_long(drawn, shown) or ratio <= 1.02 else f"{ratio:.2f} times as fast"
        )
        text += (
            f" A baked frame is {faster} ({_seconds(shown.times.later)} against {_seconds(drawn.times.later)}), after a bake of "
            f"{_seconds(shown.times.prepare)}."
        )
    small = [_rung(results["mip"], f"mean {of}, 8x8") if "mip" in results else None for of in ("thickness", "textures")]
    away = ""
    if small[0] and small[1]:
        away = (
            f" (8 times smaller 99 % of the errors are below {small[1].error.p99:.1f}, live {small[0].error.p99:.0f})"
        )
    return (
        text
        + f" Bake for heads seen small{away}, for export and for other renderers; while painting live follows every stroke."
    )


def how_many_gaussians(results: Results) -> str:
    """The fewest Gaussians that are as near as the most."""
    result = results["diffusion"]
    counted = [(int(m[1]), r) for r in result.rungs if (m := re.fullmatch(r"(\d) Gaussians?", r.name))]
    if len(counted) < 2:
        return ""
    counted.sort(key=lambda one: one[0])
    none, (most, last) = counted[0], counted[-1]
    grain = result.noise.mean if result.noise else 0.0
    best = min(r.error.mean for _, r in counted)
    worth = max(0.02, grain / 4, 0.1 * (none[1].error.mean - best))
    between = max(r.error.mean for _, r in counted) - best
    if between < grain / 4:
        dear = f"{most} take {last.times.later / none[1].times.later:.2f} times as long as none"
        times = "; their times do not differ by more than they scatter" if _as_long(last, none[1]) else f"; {dear}"
        return (
            f"It does not show in these pictures: 0 to {most} differ by {between:.2f}, and the reference's own grain is {grain:.2f}{times}. "
            "Measure nearer to the skin, or with more pixels and samples, where edges of shadows fill many pixels."
        )
    count, rung = next(one for one in counted if one[1].error.mean <= best + worth)
    text = f"{count}: mean error {rung.error.mean:.2f} against {none[1].error.mean:.2f} with none"
    if count == most:
        return text + "; each one less is further off."
    return (
        text
        + f" and {last.error.mean:.2f} with {most}, which take {last.times.later / rung.times.later:.2f} times as long a frame."
    )


def what_does_cycles_buy(results: Results) -> str:
    """The nearest picture of EEVEE against the nearest of Cycles."""
    result = results["picture"]
    cycles = [r for r in result.rungs if r.name.startswith("Cycles")]
    eevee = [r for r in result.rungs if r.name.startswith("EEVEE")]
    if not cycles or not eevee:
        return ""
    path, raster = (min(group, key=lambda r: r.error.mean) for group in (cycles, eevee))
    noisy = [r for r in cycles if r.error.mean > raster.error.mean]
    but = (
        f" Noise counts as error: {' and '.join(f'{r.name} ({r.error.mean:.2f})' for r in noisy)} "
        f"{'is' if len(noisy) == 1 else 'are'} farther off than that."
        if noisy
        else ""
    )
    return (
        f"{path.name} is {path.error.mean:.2f} from the reference in the mean (99 %: {path.error.p99:.1f}), {raster.name} "
        f"{raster.error.mean:.2f} (99 %: {raster.error.p99:.1f}), for {path.times.later / raster.times.later:.1f} times the time of a frame; "
        f"a graphics card, or none, changes that more than anything.{but}"
    )


def _seconds(value: float) -> str:
    return f"{value:.1f} s" if value >= 1 else f"{1e3 * value:.0f} ms"


OF_A_HEAD = frozenset({"diffusion", "picture"})
"""Ladders that are measured with a head."""

QUESTIONS: Sequence[tuple[str, str, Callable[[Results], str]]] = (
    ("colour", "How many bands do I need?", how_many_bands),
    ("diffusion", "How many Gaussians?", how_many_gaussians),
    ("colour", "Is baking worth it?", is_baking_worth_it),
    ("picture", "What does Cycles buy me?", what_does_cycles_buy),
)
"""The ladder that must be there, the question, and how the answer is found."""

__all__ = ["QUESTIONS", "answer", "in_short"]
