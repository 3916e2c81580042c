"""Plots of a product as one self-contained SVG: reflectances, K and S, and a thin film, with bands of uncertainty.

The left and the two right parts are the paper's Figures 7 and 8 (Huang et al. 2013), in its colours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..files import write_text
from ..optics import film
from ..optics.sensitivity import over_sensitivity
from ..spectra import WAVELENGTHS
from .formulation import seen_over
from .measurement import FilmReading
from .product import InterfaceKind, Product
from .swatches import BLACK, WHITE

Array = NDArray[np.float64]

RED, GREEN, BLUE, GREY, ORANGE = "#c0392b", "#2e8b57", "#2a5db0", "#8a8a8a", "#d98c21"
PANEL = (470, 380)
STYLE = (
    "Graph.Title {font_size: 15;} Graph.XName {font_size: 12; color: #444444;} Graph.LegendText {font_size: 12;}"
    "Graph.TickX {font_size: 11; stroke_width: 1; height: 4; margin: 12;}"
    "Graph.TickY {font_size: 11; stroke_width: 1; height: 4; margin: 5;}"
    "Graph.Legend {edge_width: 0; stroke_width: 0; font_size: 12;}"
)
MARGIN = 16
CONFIDENCE = 1.96
LOG_FROM = 30.0
"""Largest over smallest value of K and S from which their axis is logarithmic."""

FAINT = 1e-4
"""Part of the largest K or S below which a logarithmic axis does not follow them."""


@dataclass(frozen=True, eq=False)
class Line:
    """One spectrum of a panel, (n,) on ``nm``; ``error``: standard error, drawn as a band; ``dots``: readings, not a line."""

    name: str
    values: Array
    colour: str
    error: Array | None = None
    nm: Array | None = None
    dashed: bool = False
    dots: bool = False


def plot_product(product: Product, path: Path, readings: Sequence[Line] = ()) -> None:
    """Write the plots of a product as SVG, whole or not at all.

    ``readings``: measured reflectances that are drawn with the computed ones.

    Raises MakeupError where the file cannot be written or has another suffix.
    """
    if path.suffix.lower() != ".svg":
        raise MakeupError(f"{path} has no name of an SVG file; let it end in .svg.")
    write_text(path, product_svg(product, readings))


def product_svg(product: Product, readings: Sequence[Line] = ()) -> str:
    """The plots of a product as the text of an SVG file; the same product gives the same text."""
    import xml.etree.ElementTree as ET

    zp = plotting_library()
    panels = [
        (f"{product.name}: reflectance", [*reflectances(product), *readings], False),
        ("Absorption K, scattering S (1/mm)", coefficients(product), _spans(product)),
        (f"The film alone, {product.thickness_um:g} µm", thin_film(product), False),
    ]
    sheet = zp.LayoutH(column_gap=24)
    sheet.size(PANEL[0] * len(panels), PANEL[1])
    for title, lines, logarithmic in panels:
        sheet.add(_panel(zp, title, lines, logarithmic))
    root = sheet.svgxml()
    left, top, width, height = (float(value) for value in root.get("viewBox", "").split())
    width, height = width + 2 * MARGIN, height + MARGIN  # the library reckons with narrower letters than some have
    root.set("viewBox", f"{left - MARGIN:g} {top:g} {width:g} {height:g}")
    root.set("width", f"{width:g}")
    root.set("height", f"{height:g}")
    root.set("style", "background: white")
    return ET.tostring(root, encoding="unicode") + "\n"


def reflectances(product: Product) -> list[Line]:
    """As the paper's Figure 7: the worn film over black and over white R, the opaque film, the backings; as seen from the air."""
    black, white = (np.full(len(WAVELENGTHS), value) for value in (BLACK, WHITE))
    return [
        Line("R on black", _seen(product, product.thickness_um, black), RED),
        Line("R on white", _seen(product, product.thickness_um, white), ORANGE),
        Line("R∞", _seen(product, np.inf, black), GREEN),
        Line("Rg black", black, BLUE, dashed=True),
        Line("Rg white", white, GREY, dashed=True),
    ]


def coefficients(product: Product) -> list[Line]:
    """K and S, with their standard errors where they were measured."""
    return [Line("K", product.K, RED, product.K_error), Line("S", product.S, BLUE, product.S_error)]


def thin_film(product: Product) -> list[Line]:
    """R0 and T of the worn film without a backing, as the paper's Figure 8; errors of K and S taken as independent."""
    X = product.thickness_um / 1000
    R, T, _ = film(product.K, product.S, X)
    if product.K_error is None or product.S_error is None:
        return [Line("R₀", R, GREEN), Line("T", T, GREY)]
    slopes = over_sensitivity(product.K * X, product.S * X, np.zeros(len(WAVELENGTHS)))
    relative = [e / np.maximum(v, 1e-12) for e, v in ((product.K_error, product.K), (product.S_error, product.S))]
    error = np.hypot(slopes.k * relative[0], slopes.s * relative[1])
    return [Line("R₀", R, GREEN, np.minimum(error, 1)), Line("T", T, GREY)]


def _seen(product: Product, thickness_um: float, backing: Array) -> Array:
    if product.interface == InterfaceKind.APPARENT:
        from ..optics import film_over, opaque_reflectance

        if np.isinf(thickness_um):
            return np.asarray(opaque_reflectance(product.K, product.S))
        return np.asarray(film_over(product.K, product.S, thickness_um / 1000, backing))
    return seen_over(product.K, product.S, thickness_um, backing)


def _spans(product: Product) -> bool:
    both = np.concatenate([product.K, product.S])
    return bool(both.max() > LOG_FROM * max(both.min(), 1e-300))


def _panel(zp: Any, title: str, lines: Sequence[Line], logarithmic: bool) -> Any:
    """One graph with its bands below its lines, axes that hold all of them, and a legend."""
    graph = (zp.GraphLogY if logarithmic else zp.Graph)()
    graph.css(STYLE)
    graph.title(title).axesnames("wavelength (nm)")
    graph.xrange(380, 780).xticks([400, 500, 600, 700])
    low, high = _range(lines, logarithmic)
    graph.yrange(low, high)
    for line in lines:
        if line.error is not None:
            graph.add(_band(zp, line, low, high, logarithmic))
    for line in lines:
        nm = WAVELENGTHS if line.nm is None else line.nm
        values = np.clip(line.values, low if logarithmic else -np.inf, np.inf)
        drawn = zp.Scatter if line.dots else zp.PolyLine
        curve = drawn(nm.tolist(), values.tolist()).name(line.name).color(line.colour)
        graph.add(curve.marker("o", 2.5) if line.dots else curve.strokewidth(2).stroke("--" if line.dashed else "-"))
    return graph.legend("right")


def _range(lines: Sequence[Line], logarithmic: bool) -> tuple[float, float]:
    top = max(float(np.max(line.values)) for line in lines)
    if not logarithmic:
        return 0.0, 1.0 if top <= 1 else 1.15 * top
    bottom = max(min(float(line.values.min()) for line in lines), FAINT * top)
    return float(10 ** np.floor(np.log10(bottom))), float(10 ** np.ceil(np.log10(top)))


def _band(zp: Any, line: Line, low: float, high: float, logarithmic: bool) -> Any:
    """The values with 95 % confidence, as an area that is cut off at the axes."""
    assert line.error is not None
    nm = WAVELENGTHS if line.nm is None else line.nm
    upper, lower = (np.clip(line.values + side * CONFIDENCE * line.error, low, high) for side in (1, -1))
    if logarithmic:
        upper, lower = np.log10(upper), np.log10(lower)
    edge = [*zip(nm.tolist(), upper.tolist(), strict=True), *zip(nm[::-1].tolist(), lower[::-1].tolist(), strict=True)]
    return zp.Polygon(edge).color("none").fill(f"{line.colour} 20%")


def plotting_library() -> Any:
    """The plotting library, set to draw the same on every machine."""
    try:
        import ziaplot
    except ImportError:
        raise MakeupError("Plots need the package ziaplot, which the extension brings; install it with pip.") from None
    ziaplot.config.text = "text"
    ziaplot.config.precision = 2
    return ziaplot


def reading_lines(films: Sequence[FilmReading]) -> list[Line]:
    """The readings of films and of their backings as dots, for `plot_product`."""
    lines, colours = [], (RED, ORANGE, "#8e44ad", "#16a085")
    for number, reading in enumerate(films):
        opaque = np.isinf(reading.thickness_um)
        name = "read, opaque" if opaque else f"read, {reading.thickness_um:g} µm"
        colour = GREEN if opaque else colours[number % len(colours)]
        lines.append(Line(name, reading.reflectance, colour, dots=True))
    return lines
