"""Look files: JSON, schema 2, read and written whole; fields that are not known here are kept.

| schema | what it has |
| --- | --- |
| 1 | name; layers with product, thickness_um, map, channel, strength, enabled |
| 2 | also a layer's name; ``products`` that travel in the file; ``head``: what the maps were painted on |

A file without a schema is read as schema 1. `_MIGRATIONS` brings each version to the next one.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import MakeupError
from ..files import write_text
from ..products import Product
from ..products.files import product_of, product_text
from .look import THICKEST, Layer, Look, PaintedOn, check_number

SCHEMA = 2
LARGEST_FILE = 50_000_000
"""Bytes of the largest look file that is read; maps lie beside it."""

_LOOK = {"schema", "name", "layers", "products", "head"}
_LAYER = {"product", "thickness_um", "map", "channel", "strength", "enabled", "name"}
_HEAD = {"name", "uv_layout", "surface", "landmarks"}


def read_look(file: Path) -> Look:
    """The look of a file; MakeupError, in one sentence with the file's name, where it cannot be used."""
    data = _migrated(_json(file), str(file))
    where = str(file)
    layers = tuple(_layer(x, f"{where}, layer {i + 1}") for i, x in enumerate(data["layers"]))
    name = data.get("name", file.stem)
    if not isinstance(name, str):
        raise MakeupError(f"{where}: 'name' must be text, not {_short(name)}.")
    return Look(
        name=name,
        layers=layers,
        folder=file.parent,
        extra=_rest(data, _LOOK),
        products=_products(data.get("products", []), where),
        head=_head(data["head"], where) if data.get("head") is not None else None,
    )


def write_look(look: Look, file: Path) -> None:
    """Write a look, whole or not at all; the same look gives the same bytes."""
    data: dict[str, Any] = {**look.extra, "schema": SCHEMA, "name": look.name}
    data["layers"] = [_layer_data(layer) for layer in look.layers]
    if look.products:
        data["products"] = [json.loads(product_text(product)) for product in look.products]
    if look.head is not None:
        data["head"] = _head_data(look.head)
    write_text(file, json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def _json(file: Path) -> Any:
    try:
        if file.is_dir():
            raise MakeupError(f"{file} is a folder; give the look's .json file.")
        size = file.stat().st_size
        if size > LARGEST_FILE:
            raise MakeupError(
                f"The look file {file} is {size / 1e6:.0f} MB large, which no look is; check that it is the right file."
            )
        return json.loads(file.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise MakeupError(f"The look file {file} does not exist; check the path.") from None
    except OSError as error:
        raise MakeupError(f"The look file {file} cannot be read ({error.strerror}); check its permissions.") from None
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        reason = str(error)[:100]
        raise MakeupError(f"The look file {file} is not readable JSON ({reason}); mend or save it again.") from None


def _from_1(data: dict[str, Any]) -> dict[str, Any]:
    """Schema 1 has neither products nor head: what stands under these names there is somebody else's."""
    taken = {"products": "products (schema 1)", "head": "head (schema 1)"}
    return {taken.get(key, key): value for key, value in data.items()}


_MIGRATIONS: dict[int, Callable[[dict[str, Any]], dict[str, Any]]] = {1: _from_1}


def _migrated(data: Any, where: str) -> dict[str, Any]:
    """The data as this version writes them."""
    if not isinstance(data, dict) or not isinstance(data.get("layers"), list):
        raise MakeupError(f"{where} is not a look: it needs a list named 'layers'.")
    schema = data.get("schema", 1)
    if not isinstance(schema, int) or isinstance(schema, bool) or schema < 1:
        raise MakeupError(f"{where}: 'schema' must be a whole number from 1, not {_short(schema)}.")
    if schema > SCHEMA:
        raise MakeupError(f"{where} has schema {schema}, newer than this version reads ({SCHEMA}); update KM Makeup.")
    for version in range(schema, SCHEMA):
        data = _MIGRATIONS[version](data)
    return data


def _layer(data: Any, where: str) -> Layer:
    if not isinstance(data, dict) or not isinstance(data.get("product"), str) or not data["product"]:
        raise MakeupError(f"{where}: every layer needs the id of a 'product'.")
    thickness = check_number(data.get("thickness_um"), f"{where}: 'thickness_um' (micrometres)", 0, THICKEST)
    strength = check_number(data.get("strength", 1.0), f"{where}: 'strength'", 0, 1)
    channel = data.get("channel", "R")
    if channel not in ("R", "G", "B", "A"):
        raise MakeupError(f"{where}: 'channel' is {_short(channel)}; use R, G, B or A.")
    path, name = data.get("map", ""), data.get("name", "")
    if not isinstance(path, str) or "\0" in path:
        raise MakeupError(f"{where}: 'map' must be the path of an image, not {_short(path)}.")
    if not isinstance(name, str):
        raise MakeupError(f"{where}: 'name' must be text, not {_short(name)}.")
    enabled = data.get("enabled", True)
    if not isinstance(enabled, bool):
        raise MakeupError(f"{where}: 'enabled' must be true or false, not {_short(enabled)}.")
    return Layer(data["product"], thickness, path, channel, strength, enabled, _rest(data, _LAYER), name)


def _layer_data(layer: Layer) -> dict[str, Any]:
    named = {"name": layer.name} if layer.name else {}
    return {
        **layer.extra,
        **named,
        "product": layer.product,
        "thickness_um": layer.thickness_um,
        "map": layer.map,
        "channel": layer.channel,
        "strength": layer.strength,
        "enabled": layer.enabled,
    }


def _products(data: Any, where: str) -> tuple[Product, ...]:
    if not isinstance(data, list):
        raise MakeupError(f"{where}: 'products' must be a list of products, not {_short(data)}.")
    found: dict[str, Product] = {}
    for i, entry in enumerate(data):
        if not isinstance(entry, dict):
            raise MakeupError(f"{where}: product {i + 1} must be an object as in a product file, not {_short(entry)}.")
        try:
            product = product_of(entry)
        except MakeupError as error:
            raise MakeupError(f"{where}, product {i + 1} ({_short(entry.get('id'))}): {error}") from None
        if product.id in found:
            raise MakeupError(f"{where} carries the product {product.id!r} twice; remove one of them.")
        found[product.id] = product
    return tuple(found.values())


def _head(data: Any, where: str) -> PaintedOn:
    if not isinstance(data, dict):
        raise MakeupError(f"{where}: 'head' must be an object, not {_short(data)}.")
    texts = {}
    for key in ("name", "uv_layout", "surface"):
        texts[key] = data.get(key, "")
        if not isinstance(texts[key], str) or "\0" in texts[key]:
            raise MakeupError(f"{where}: the head's {key!r} must be text, not {_short(texts[key])}.")
    landmarks = data.get("landmarks", {})
    if not isinstance(landmarks, dict):
        raise MakeupError(f"{where}: the head's 'landmarks' must be an object of points, not {_short(landmarks)}.")
    points = {name: _point(value, f"{where}: landmark {name!r}") for name, value in landmarks.items()}
    return PaintedOn(texts["name"], texts["uv_layout"], texts["surface"], points, _rest(data, _HEAD))


def _head_data(head: PaintedOn) -> dict[str, Any]:
    return {
        **head.extra,
        "name": head.name,
        "uv_layout": head.uv_layout,
        "surface": head.surface,
        "landmarks": {name: list(point) for name, point in head.landmarks.items()},
    }


def _point(value: Any, what: str) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise MakeupError(f"{what} must be a list of three numbers (metres), not {_short(value)}.")
    x, y, z = (check_number(number, f"{what} (metres)", -1e6, 1e6) for number in value)
    return x, y, z


def _rest(data: dict[str, Any], known: set[str]) -> dict[str, Any]:
    return {key: value for key, value in data.items() if key not in known}


def _short(value: Any) -> str:
    """A value in a message, on one line and not too long."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
