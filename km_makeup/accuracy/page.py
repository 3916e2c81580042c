"""The page of a measurement: for each ladder its answer in a sentence, a plot of error over time, and the table.

One file without anything from the network: plots are SVG inside it, and hovering over a point names its rung.
"""

from __future__ import annotations

import base64
import html
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..products.plots import plotting_library
from .answers import answer, in_short
from .ladder import Measured, Result, not_falling
from .report import fastest, time_of

SIZE = (860, 460)
FRONT, OTHER, CURRENT = "#b5345a", "#8a93a6", "#1f6f5c"
LETTER = 6.6
"""Width of a letter of 12 pixels, about."""

LEAST = 1e-4
"""Errors below this are drawn on the lowest line: a logarithmic axis has no 0."""

STYLE = """
:root { color-scheme: light dark; --ink: #22252b; --soft: #5c6470; --paper: #fbfaf8; --line: #dcd8d0; --mark: #b5345a; }
@media (prefers-color-scheme: dark) { :root { --ink: #e8e6e1; --soft: #a3a9b3; --paper: #17191d; --line: #363a42; } .plot { filter: invert(0.9) hue-rotate(180deg); } }
body { font: 15px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--paper); margin: 0 auto; padding: 2rem 1.2rem 4rem; max-width: 68rem; }
h1 { font-size: 1.7rem; margin: 0 0 .3rem; } h2 { font-size: 1.25rem; margin: 2.6rem 0 .4rem; }
p.soft, figcaption { color: var(--soft); } .answer { border-left: 3px solid var(--mark); padding: .1rem 0 .1rem .9rem; font-size: 1.05rem; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; margin-top: .8rem; }
th, td { text-align: right; padding: .22rem .55rem; border-bottom: 1px solid var(--line); white-space: nowrap; }
th:first-child, td:first-child, td:last-child, th:last-child { text-align: left; } td:last-child { white-space: normal; min-width: 16rem; color: var(--soft); }
tr.front td:first-child { color: var(--mark); font-weight: 600; } tr.current td:first-child::after { content: " ◀ now"; color: #1f6f5c; }
svg { max-width: 100%; height: auto; } circle.point { fill: transparent; cursor: help; } circle.point:hover { fill: rgba(181, 52, 90, .25); }
.shots { display: flex; flex-wrap: wrap; gap: 1rem; } .shots figure { margin: 0; } .shots img { width: 11rem; margin-right: 2px; }
dl.short dt { font-weight: 600; margin-top: .7rem; } dl.short dd { margin: 0 0 0 0; }
"""


GLOSSARY = (
    '<details><summary>What the words and columns mean</summary><p class="soft">Film: a layer of product, of absorption K and scattering S. R, '
    "T² and R_up: what a stack of films reflects, lets through twice, and reflects from below. Bands: wavelengths computed; fitted ones have "
    "weights made for films on skin, even ones lie in equal steps. Live: each film a small table in the shader. Baked: the stack as three "
    "textures. Air interface: the surface through which all light leaves. Skin basis: spectra made from colours as skins have them. Finish: "
    "roughness and reflectance of a surface; GGX and Kelemen (Huang et al. 2013, Eq 5) are two models of its highlight. D65, A: daylight, "
    "bulb. plan N: what the plan leaves out when every effect may change the picture by N. Across steps: not stopped at steps in depth. No slope: as if all skin faced the camera. <b>mean, 99 %, max</b>: of the error over all cases. <b>time</b>: median of later runs; <b>± %</b>: half the width of their middle "
    "half; ratios closer than that are no difference. Where a frame is timed at fewer samples than its "
    "error is taken at, all of the ladder are, in proportion. <b>first</b>: the first run, which may have to compile and load. <b>prepare</b>: paid once "
    "(fits, bakes). <b>MB</b>: most memory during a run.</p></details>"
)


def page(results: Sequence[Result], made: dict[str, str], current: Sequence[str] = ()) -> str:
    """The page as one HTML text.

    Parameters: the ladders measured; what they were measured on, as `report.machine` gives it; ``current`` the settings in
    force ("path LIVE", "bands 81"), whose rungs are marked.
    """
    parts = [_section(result, set(current)) for result in results if result.rungs]
    facts = ", ".join(f"{key} {value}" for key, value in made.items())
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>Accuracy and time</title><style>{STYLE}</style></head><body>"
        "<h1>What accuracy costs in time</h1>"
        '<p class="soft">Every point of a plot is a way to compute one thing (powder and mip-mapping: at several sizes). The truth is the '
        "same physics computed without short cuts, or path traced: not a photograph of skin. Further down is nearer to it, further left is "
        "faster; red points are those that no other beats in both, the green one is the setting in force. Times are of this machine: compare their ratios. Differences of "
        "colour are CIEDE2000: below 0.5 nobody sees them, 1 is seen side by side, 3 at a glance.</p>"
        f"{GLOSSARY}{_in_short(results)}{''.join(parts)}"
        f'<h2>Measured on</h2><p class="soft">{html.escape(facts)}</p></body></html>\n'
    )


def _in_short(results: Sequence[Result]) -> str:
    """Questions that a reader comes with, and what was measured about them."""
    asked = in_short(results)
    if not asked:
        return ""
    rows = "".join(f"<dt>{html.escape(question)}</dt><dd>{html.escape(found)}</dd>" for question, found in asked)
    return f'<h2>In short</h2><dl class="short">{rows}</dl>'


def _section(result: Result, current: set[str]) -> str:
    ladder = result.ladder
    return (
        f'<h2 id="{html.escape(ladder.name)}">{html.escape(ladder.title)}</h2>'
        f'<p class="answer">{html.escape(answer(result))}</p>'
        f'<figure style="margin:0"><div class="plot">{plot(result, current)}</div><figcaption>99th percentile of the error in '
        f"{html.escape(ladder.unit)} against {html.escape(ladder.reference)}; {time_of(result)} of {html.escape(ladder.run_of)}, as a "
        f"multiple of the fastest{_line(result)}.{_grain(result)}{'' if result.whole else ' Measuring was stopped: times are of fewer runs.'}</figcaption></figure>"
        f"{_table(result, current)}{_notes(result)}{_shots(result)}"
    )


def _grain(result: Result) -> str:
    """What the reference's own noise is worth."""
    if result.noise is None:
        return ""
    return (
        f" The reference's own grain is {result.noise.mean:.2f} in the mean and {result.noise.p99:.2f} at 99 %: nothing can be told "
        "apart below that."
    )


def _notes(result: Result) -> str:
    """Rungs that do not fall as theory says, and what is known about the ladder."""
    lines = [f"Not as theory says: {html.escape(one)}." for one in not_falling(result)]
    if lines and result.noise is not None:
        lines.append("The noise of a picture counts as its error, and path tracing with few samples is noisy.")
    lines += [html.escape(one) for one in result.ladder.notes]
    return f'<ul class="soft">{"".join(f"<li>{one}</li>" for one in lines)}</ul>' if lines else ""


def _shots(result: Result) -> str:
    """The rungs' pictures beside their differences."""
    figures = []
    for rung in result.rungs:
        if not rung.shots:
            continue
        images = "".join(
            f'<img alt="{html.escape(f"{rung.name}: {shot.caption}")}" title="{html.escape(shot.caption)}" '
            f'src="data:image/png;base64,{base64.b64encode(shot.png).decode()}">'
            for shot in rung.shots
        )
        words = f"{rung.name}: mean {rung.error.mean:.2f}, {_duration(rung.times.later)}"
        figures.append(f"<figure>{images}<figcaption>{html.escape(words)}</figcaption></figure>")
    if not figures:
        return ""
    shown = ", ".join(
        next(r for r in result.rungs if r.shots).shots[i].caption
        for i in range(len(next(r for r in result.rungs if r.shots).shots))
    )
    return f'<p class="soft">From left to right: {html.escape(shown)}.</p><div class="shots">{"".join(figures)}</div>'


def _duration(seconds: float) -> str:
    return f"{seconds:.2f} s" if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


def _line(result: Result) -> str:
    """What the dotted line is, where the plot has one."""
    return "; the dotted green line is where an error begins to matter" if _line_shows(result) else ""


def _line_shows(result: Result) -> bool:
    errors = [max(r.error.p99, LEAST) for r in result.rungs]
    return min(errors) < result.ladder.visible < max(errors)


def plot(result: Result, current: set[str]) -> str:
    """Error over time as SVG, both axes logarithmic."""
    zp = plotting_library()
    base = fastest(result)
    x = {r.name: r.times.later / base for r in result.rungs}
    y = {r.name: max(r.error.p99, LEAST) for r in result.rungs}
    graph = zp.GraphLogXY()
    graph.css(
        "Graph.XName {font_size: 12;} Graph.YName {font_size: 12;} Graph.TickX {font_size: 11;} Graph.TickY {font_size: 11;}"
    )
    graph.axesnames("time, multiple of the fastest", f"99 % of the errors lie below, {result.ladder.unit}")
    graph.xrange(*_span(x.values())).yrange(*_span(y.values()))
    low, high = _span(x.values())
    if _line_shows(result):
        graph.add(zp.PolyLine([low, high], [result.ladder.visible] * 2).color(CURRENT).strokewidth(1).stroke(":"))
    front = sorted((r for r in result.rungs if r.on_front), key=lambda r: x[r.name])
    if len(front) > 1:
        line = zp.PolyLine([x[r.name] for r in front], [y[r.name] for r in front])
        graph.add(line.color(FRONT).strokewidth(1).stroke("--"))
    for rung in result.rungs:
        graph.add(zp.Scatter([x[rung.name]], [y[rung.name]]).marker("o", 4).color(_colour(rung, current)))
    graph.size(*SIZE)
    root = graph.svgxml()
    _add_hover(root, result, base, current)
    return ET.tostring(root, encoding="unicode")


def _add_hover(root: ET.Element, result: Result, base: float, current: set[str]) -> None:
    """Circles over the points, in the order they were drawn, with the rungs' names as titles, and names beside them where there is room."""
    points = [e for e in root.iter("path") if "marker-start" in e.attrib or "marker-mid" in e.attrib]
    places = [m for e in points if (m := re.fullmatch(r"\s*M\s*([-\d.]+)[ ,]([-\d.]+)[\sL]*", e.get("d", "")))]
    if len(places) != len(result.rungs):
        return  # another version of the library draws points in another way: the plot stands without hovering
    at = [(float(m[1]), float(m[2])) for m in places]
    taken = [_Box(x - 5, y - 5, x + 5, y + 5) for x, y in at]
    colours = {rung.name: _colour(rung, current) for rung in result.rungs}
    for rung, (x, y) in zip(result.rungs, at):
        place = {"cx": f"{x:g}", "cy": f"{y:g}"}
        ET.SubElement(root, "circle", {**place, "r": "4.5", "fill": colours[rung.name]})
        circle = ET.SubElement(root, "circle", {**place, "r": "9", "class": "point", "fill": "transparent"})
        ET.SubElement(circle, "title").text = _hover(rung, result, base)
    for rung, (x, y) in sorted(
        zip(result.rungs, at), key=lambda one: (colours[one[0].name] == OTHER, not one[0].on_front)
    ):
        now = " (now)" if colours[rung.name] == CURRENT else ""
        _label(root, rung.name + now, colours[rung.name], x, y, taken)


def _colour(rung: Measured, current: set[str]) -> str:
    """Green for the setting in force, red for the front, grey for the rest."""
    return CURRENT if rung.setting and rung.setting in current else FRONT if rung.on_front else OTHER


class _Box(NamedTuple):
    """A rectangle that is taken, in pixels."""

    left: float
    top: float
    right: float
    bottom: float

    def meets(self, other: _Box) -> bool:
        """Whether the two share any point."""
        return (
            self.left < other.right and other.left < self.right and self.top < other.bottom and other.top < self.bottom
        )


def _label(root: ET.Element, text: str, colour: str, x: float, y: float, taken: list[_Box]) -> None:
    """A name beside its point where nothing stands yet; none where everything around is taken: hovering tells it."""
    width = LETTER * len(text)
    for side, down in ((1, -8), (1, 15), (-1, -8), (-1, 15), (1, -22), (-1, 29), (1, 29), (-1, -22)):
        left = x + 9 if side > 0 else x - 9 - width
        box = _Box(left, y + down - 10, left + width, y + down + 3)
        if box.left < 60 or box.right > SIZE[0] - 4 or any(box.meets(other) for other in taken):
            continue
        taken.append(box)
        label = ET.SubElement(
            root, "text",
            {"x": f"{x + 9 * side:g}", "y": f"{y + down:g}", "font-size": "12", "font-family": "sans-serif", "fill": colour,
             "text-anchor": "start" if side > 0 else "end"},
        )  # fmt: skip
        label.text = text
        return


def _hover(rung: Measured, result: Result, base: float) -> str:
    return (
        f"{rung.name}: {rung.about}\nerror mean {rung.error.mean:.4f}, 99 % {rung.error.p99:.4f}, max {rung.error.max:.4f} "
        f"{result.ladder.unit}\n{_duration(rung.times.later)}, {rung.times.later / base:.1f} times the fastest"
    )


def _span(values: Any) -> tuple[float, float]:
    """An axis a little longer than its values."""
    logs = np.log10(list(values))
    margin = max(0.1, 0.06 * float(np.ptp(logs)))
    return float(10 ** (logs.min() - margin)), float(10 ** (logs.max() + margin))


def _table(result: Result, current: set[str]) -> str:
    base = fastest(result)
    flip = any(r.flip for r in result.rungs)
    head = [
        "",
        "mean",
        "99 %",
        "max",
        *(["FLIP"] if flip else []),
        "time",
        "× fastest",
        "± %",
        "first",
        "prepare",
        "MB",
        "what it is",
    ]
    lines = []
    for r in result.rungs:
        spread = 100 * r.times.spread / r.times.later if r.times.later else 0
        cells = [
            r.name, *(f"{one:.3f}" for one in r.error), *([f"{r.flip.mean:.3f}" if r.flip else "–"] if flip else []),
            _duration(r.times.later), f"{r.times.later / base:.1f}", f"{spread:.0f}", _duration(r.times.first),
            _duration(r.times.prepare), f"{r.times.memory_mb:.1f}" if np.isfinite(r.times.memory_mb) else "–", r.about,
        ]  # fmt: skip
        kind = " ".join(
            name for name, on in (("front", r.on_front), ("current", bool(r.setting) and r.setting in current)) if on
        )
        lines.append(f'<tr class="{kind}">{"".join(f"<td>{html.escape(c)}</td>" for c in cells)}</tr>')
    header = "".join(f"<th>{html.escape(one)}</th>" for one in head)
    return f'<div class="scroll"><table><thead><tr>{header}</tr></thead><tbody>{"".join(lines)}</tbody></table></div>'
