"""A look: the stack of products on a face, with thicknesses, finishes and maps.

Layers stand in the order of application, bottom to top. A look can carry the head that its maps were painted
on, so that they can be brought to another, and the products that other machines may not have. `look_file`
reads and writes it.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..errors import MakeupError
from ..products import Library, Product

THICKEST = 1e5
"""Largest thickness of a layer in micrometres: ten centimetres, which is opaque."""


@dataclass(frozen=True)
class Layer:
    """One layer of a look.

    ``thickness_um`` is the film's thickness in micrometres where the map is 1; ``strength`` scales the map
    (0..1); ``map`` is the path of the cosmetic map, or empty for a film over the whole face;
    ``channel`` picks one channel of an RGB-coded map (Huang et al. 2013, Fig 9a): R, G, B or A;
    ``name`` is what the artist calls it, or empty for the product's name; ``form`` and ``finish`` (roughness and
    F0, 0..1) stand in place of the product's own; ``plan`` is "on" or "off" where the artist decided whether the
    film exists; ``solo`` shows it alone.
    """

    product: str
    thickness_um: float
    map: str = ""
    channel: str = "R"
    strength: float = 1.0
    enabled: bool = True
    extra: dict[str, Any] = field(default_factory=dict)
    name: str = ""
    form: str = ""
    finish: tuple[float, float] | None = None
    plan: str = ""
    solo: bool = False


@dataclass(frozen=True)
class PaintedOn:
    """The head that a look's maps were painted on.

    ``uv_layout`` is the fingerprint of its UV map (`surface.uv_fingerprint`); ``surface`` the path of the file
    with its shape, or empty; ``landmarks`` are points (x, y, z) in metres on that shape, by name.
    """

    name: str = ""
    uv_layout: str = ""
    surface: str = ""
    landmarks: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    extra: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Look:
    """Layers bottom to top, under a name. ``folder`` is where relative paths start.

    ``products`` are those that travel in the file; ``head`` is what the maps were painted on, if that is known;
    ``exclusion`` is the path of a map that is 1 where no makeup lies, or empty.
    """

    name: str
    layers: tuple[Layer, ...] = ()
    folder: Path = Path(".")
    extra: dict[str, Any] = field(default_factory=dict)
    products: tuple[Product, ...] = ()
    head: PaintedOn | None = None
    exclusion: str = ""

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Look:
        """Read a look file of this version or an older one.

        Raises MakeupError where the file is missing, is not JSON, or a field has the wrong type.
        """
        from .look_file import read_look

        return read_look(Path(path))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the look as JSON, whole or not at all; map paths are kept as they are."""
        from .look_file import write_look

        write_look(self, Path(path))

    def map_path(self, layer: Layer) -> Path | None:
        """The full path of a layer's map, or None where the layer has none."""
        return self.folder / layer.map if layer.map else None

    def with_carried(self, library: Library) -> Library:
        """The library, and what it lacks of the products that travel in this look."""
        known = {product.id for product in library.products}
        carried = tuple(product for product in self.products if product.id not in known)
        return replace(library, products=library.products + carried)

    def carrying(self, library: Library, shipped: Library) -> Look:
        """The look with those of its products that do not come with the extension inside it."""
        common = {product.id for product in shipped.products}
        wanted = dict.fromkeys(layer.product for layer in self.layers if layer.product not in common)
        return replace(self, products=tuple(library.find(one) for one in wanted))


def check_number(value: Any, what: str, low: float, high: float) -> float:
    """A finite number in [low, high], or a MakeupError that names it."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise MakeupError(f"{what} must be a number, not {value!r}.")
    if not low <= value <= high:
        raise MakeupError(f"{what} is {value:g}; it must lie between {low:g} and {high:g}.")
    return float(value)


def parse_layer(text: str) -> Layer:
    """A layer from the command line: ``PRODUCT[=MAP[#CHANNEL]][@THICKNESSum]``.

    ``lipstick-classic-red=lips.png@15um`` is that product, 15 micrometres thick where lips.png is white.
    """
    example = "lipstick-classic-red=lips.png@15um"
    head, at, thickness = text.rpartition("@")
    if not at:
        head, thickness = text, ""
    product, equals, path = head.partition("=")
    if not product:
        raise MakeupError(f"--layer {text!r} names no product; write it like {example}.")
    if equals and path.partition("#")[0] == "":
        raise MakeupError(f"--layer {text!r} names no map after '='; write it like {example}, or leave '=' out.")
    number = thickness.removesuffix("um").removesuffix("µm").strip()
    try:
        micrometres = float(number) if at else math.nan
    except ValueError:
        raise MakeupError(f"--layer {text!r}: {thickness!r} is no thickness; write it like {example}.") from None
    if at:
        check_number(micrometres, f"--layer {text!r}: the thickness (µm)", 0, THICKEST)
    channel = "R"
    if path[-2:-1] == "#" and path[-1] in "RGBA":
        path, channel = path[:-2], path[-1]
    return Layer(product, micrometres, path, channel)
