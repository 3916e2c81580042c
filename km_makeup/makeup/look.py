"""A look: the stack of products on a face, with thicknesses, finishes and maps, as a file.

The file is JSON, read and written whole; layers stand in the order of application, bottom to top. Fields
that this version does not know are kept.
"""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..errors import MakeupError
from ..files import write_text

SCHEMA = 1
THICKEST = 1e5
"""Largest thickness of a layer in micrometres: ten centimetres, which is opaque."""


@dataclass(frozen=True)
class Layer:
    """One layer of a look.

    ``thickness_um`` is the film's thickness in micrometres where the map is 1; ``strength`` scales the map
    (0..1); ``map`` is the path of the cosmetic map, or empty for a film over the whole face;
    ``channel`` picks one channel of an RGB-coded map (Huang et al. 2013, Fig 9a): R, G, B or A.
    """

    product: str
    thickness_um: float
    map: str = ""
    channel: str = "R"
    strength: float = 1.0
    enabled: bool = True
    extra: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Look:
    """Layers bottom to top, under a name. ``folder`` is where relative map paths start."""

    name: str
    layers: tuple[Layer, ...] = ()
    folder: Path = Path(".")
    extra: dict[str, Any] = field(default_factory=dict)

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Look:
        """Read a look file.

        Raises MakeupError where the file is missing, is not JSON, or a field has the wrong type.
        """
        file = Path(path)
        try:
            data = json.loads(file.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise MakeupError(f"The look file {file} does not exist; check the path.") from None
        except IsADirectoryError:
            raise MakeupError(f"{file} is a folder; give the look's .json file.") from None
        except (json.JSONDecodeError, UnicodeDecodeError) as error:
            raise MakeupError(f"The look file {file} is not readable JSON ({error}); mend or save it again.") from None
        return replace(_look_from(data, str(file)), folder=file.parent)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the look as JSON, whole or not at all; map paths are kept as they are."""
        data = {**self.extra, "schema": SCHEMA, "name": self.name, "layers": [_layer_to(x) for x in self.layers]}
        write_text(Path(path), json.dumps(data, indent=2, ensure_ascii=False) + "\n")

    def map_path(self, layer: Layer) -> Path | None:
        """The full path of a layer's map, or None where the layer has none."""
        return self.folder / layer.map if layer.map else None


_KNOWN = {"product", "thickness_um", "map", "channel", "strength", "enabled"}


def _look_from(data: Any, where: str) -> Look:
    if not isinstance(data, dict) or not isinstance(data.get("layers"), list):
        raise MakeupError(f"{where} is not a look: it needs a list named 'layers'.")
    schema = data.get("schema", SCHEMA)
    if not isinstance(schema, int) or isinstance(schema, bool):
        raise MakeupError(f"{where}: 'schema' must be a whole number, not {schema!r}.")
    if schema > SCHEMA:
        raise MakeupError(f"{where} has schema {schema}, newer than this version reads ({SCHEMA}); update KM Makeup.")
    layers = tuple(_layer_from(x, f"{where}, layer {i + 1}") for i, x in enumerate(data["layers"]))
    extra = {k: v for k, v in data.items() if k not in ("schema", "name", "layers")}
    return Look(name=str(data.get("name", Path(where).stem)), layers=layers, extra=extra)


def _layer_from(data: Any, where: str) -> Layer:
    if not isinstance(data, dict) or not isinstance(data.get("product"), str):
        raise MakeupError(f"{where}: every layer needs the id of a 'product'.")
    thickness = check_number(data.get("thickness_um"), f"{where}: 'thickness_um' (micrometres)", 0, THICKEST)
    strength = check_number(data.get("strength", 1.0), f"{where}: 'strength'", 0, 1)
    channel = data.get("channel", "R")
    if channel not in ("R", "G", "B", "A"):
        raise MakeupError(f"{where}: 'channel' is {channel!r}; use R, G, B or A.")
    path = data.get("map", "")
    if not isinstance(path, str):
        raise MakeupError(f"{where}: 'map' must be the path of an image, not {path!r}.")
    enabled = data.get("enabled", True)
    if not isinstance(enabled, bool):
        raise MakeupError(f"{where}: 'enabled' must be true or false, not {enabled!r}.")
    extra = {k: v for k, v in data.items() if k not in _KNOWN}
    return Layer(data["product"], thickness, path, channel, strength, enabled, extra)


def _layer_to(layer: Layer) -> dict[str, Any]:
    return {
        **layer.extra,
        "product": layer.product,
        "thickness_um": layer.thickness_um,
        "map": layer.map,
        "channel": layer.channel,
        "strength": layer.strength,
        "enabled": layer.enabled,
    }


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
