"""Look files: JSON, schema 2, read and written whole; fields that are not known here are kept.

| schema | what it has |
| --- | --- |
| 1 | name; layers with product, thickness_um, map, channel, strength, enabled |
| 2 | also a layer's name, form, finish, plan and solo; the exclusion mask; ``products`` that travel in the file; ``head``: what the maps were painted on |

A file without a schema is read as schema 1. `_MIGRATIONS` brings each version to the next one.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import MakeupError
from ..files import finish_swaps, write_text
from ..products import Product
from ..products.files import product_of, product_text
from ..products.product import Form
from .look import THICKEST, Layer, Look, PaintedOn, check_number

SCHEMA = 2
LARGEST_FILE = 50_000_000
"""Bytes of the largest look file that is read; maps lie beside it."""

_LOOK = {"schema", "name", "layers", "products", "head", "exclusion"}
_LAYER = {"product", "thickness_um", "map", "channel", "strength", "enabled", "name", "form", "finish", "plan", "solo"}
_HEAD = {"name", "uv_layout", "surface", "landmarks"}


def read_look(file: Path) -> Look:
    """The look of a file; MakeupError, in one sentence with the file's name, where it cannot be used."""
    finish_swaps(file.parent)
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
        exclusion=_path_of(data, "exclusion", where),
    )


def write_look(look: Look, file: Path) -> None:
    """Write a look, whole or not at all; the same look gives the same bytes."""
    data: dict[str, Any] = {**look.extra, "schema": SCHEMA, "name": look.name}
    data["layers"] = [_layer_data(layer) for layer in look.layers]
    if look.exclusion:
        data["exclusion"] = look.exclusion
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
    """What schema 1 has under names of schema 2 is somebody else's and kept under another name."""
    layers = [
        _renamed(x, ("name", "form", "finish", "plan", "solo")) if isinstance(x, dict) else x for x in data["layers"]
    ]
    return {**_renamed(data, ("products", "head", "exclusion")), "layers": layers}


def _renamed(data: dict[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    return {f"{key} (schema 1)" if key in names else key: value for key, value in data.items()}


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
    path, name = _path_of(data, "map", where), data.get("name", "")
    if not isinstance(name, str):
        raise MakeupError(f"{where}: 'name' must be text, not {_short(name)}.")
    enabled, solo = (_switch(data, key, usual, where) for key, usual in (("enabled", True), ("solo", False)))
    form = _choice(data, "form", ("", *Form), where)
    plan = _choice(data, "plan", ("", "on", "off"), where)
    finish = _finish(data.get("finish"), where)
    rest = _rest(data, _LAYER)
    return Layer(data["product"], thickness, path, channel, strength, enabled, rest, name, form, finish, plan, solo)


def _switch(data: dict[str, Any], key: str, usual: bool, where: str) -> bool:
    value = data.get(key, usual)
    if not isinstance(value, bool):
        raise MakeupError(f"{where}: {key!r} must be true or false, not {_short(value)}.")
    return value


def _path_of(data: dict[str, Any], key: str, where: str) -> str:
    path = data.get(key, "")
    if not isinstance(path, str) or "\0" in path:
        raise MakeupError(f"{where}: {key!r} must be the path of an image, not {_short(path)}.")
    return path


def _choice(data: dict[str, Any], key: str, choices: tuple[str, ...], where: str) -> str:
    value = data.get(key, "")
    if not isinstance(value, str) or value not in choices:
        raise MakeupError(f"{where}: {key!r} is {_short(value)}; use {', '.join(c for c in choices if c)}.")
    return value


def _finish(data: Any, where: str) -> tuple[float, float] | None:
    if data is None:
        return None
    if not isinstance(data, dict):
        raise MakeupError(f"{where}: 'finish' must be an object with roughness and f0, not {_short(data)}.")
    roughness = check_number(data.get("roughness"), f"{where}: the finish's 'roughness'", 0, 1)
    return roughness, check_number(data.get("f0"), f"{where}: the finish's 'f0'", 0, 1)


def _layer_data(layer: Layer) -> dict[str, Any]:
    own: dict[str, Any] = {key: getattr(layer, key) for key in ("name", "form", "plan", "solo") if getattr(layer, key)}
    if layer.finish is not None:
        own["finish"] = {"roughness": layer.finish[0], "f0": layer.finish[1]}
    return {
        **layer.extra,
        **own,
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
