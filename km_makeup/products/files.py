"""Product files: JSON, one product a file; fields that are not known here are kept.

Files of older schemas are read as they are and brought up to date in memory (`MIGRATIONS`); nothing is rewritten unless the
product is saved. Files of newer schemas are refused, since what they mean is not known here.
"""

from __future__ import annotations

import json
import math
import os
import stat
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MakeupError
from ..files import write_new_text, write_text
from ..spectra import WAVELENGTHS, resample
from .product import Finish, Product, Provenance, Spectrum

SCHEMA = 2
"""1: the first. 2: `quality`, what was said of a measurement; a measured product always has it, if only as an empty list."""

LARGEST_FILE = 1_000_000
DIGITS = 6
"""Significant digits of K and S in a file."""

NUMBERS_A_ROW = 9

_FIELDS = {
    "schema", "id", "name", "kind", "form", "interface", "thickness_um", "finish", "provenance",
    "spectrum", "K", "S", "K_error", "S_error", "quality",
}  # fmt: skip
_BOTH = ("K", "S")
_SPECTRA = ("K", "S", "K_error", "S_error")
_SPECTRUM = {"unit": "1/mm", "start_nm": 380.0, "step_nm": 5.0}


def read_product(path: str | os.PathLike[str]) -> Product:
    """The product of a file.

    Raises MakeupError, with the file's name, where it is missing, too large, no JSON, written by a newer
    version, or a field is missing or cannot be right.
    """
    file = Path(path)
    try:
        return product_of(load_json(file))
    except MakeupError as error:
        raise MakeupError(f"Product file {file}: {error}") from None


def write_product(product: Product, path: str | os.PathLike[str]) -> None:
    """Write a product as JSON, whole or not at all."""
    write_text(Path(path), product_text(product))


def write_new_product(product: Product, path: str | os.PathLike[str]) -> None:
    """Write a product to a file that is not there yet, whole or not at all.

    Of two that do so at one moment, on one machine or on two that share the folder, one gets MakeupError.
    """
    write_new_text(Path(path), product_text(product))


def product_text(product: Product) -> str:
    """The text of a product's file: the same product gives the same text, byte for byte."""
    finish = product.finish
    data: dict[str, Any] = {
        "schema": SCHEMA,
        "id": product.id,
        "name": product.name,
        "kind": product.kind,
        "form": str(product.form),
        "interface": str(product.interface),
        "thickness_um": product.thickness_um,
        "finish": {"roughness": finish.roughness, "f0": finish.f0, **finish.extra},
        "provenance": provenance_data(product.provenance),
        **({"quality": list(product.quality)} if product.quality else {}),
        **product.extra,
        "spectrum": _SPECTRUM,
    }
    spectra = {name: getattr(product, name) for name in _SPECTRA}
    return json_text(data | {name: values for name, values in spectra.items() if values is not None})


def json_text(data: Mapping[str, Any]) -> str:
    """JSON with long arrays of numbers in rows, so that people can read the file and compare versions."""
    lines = [f"  {json.dumps(key)}: {_value_text(value)}" for key, value in data.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _value_text(value: Any) -> str:
    if not isinstance(value, np.ndarray):
        return json.dumps(value, indent=2, ensure_ascii=False).replace("\n", "\n  ")
    numbers = [f"{number:.{DIGITS}g}" for number in value]
    rows = [", ".join(numbers[i : i + NUMBERS_A_ROW]) for i in range(0, len(numbers), NUMBERS_A_ROW)]
    return "[\n    " + ",\n    ".join(rows) + "\n  ]"


def load_json(file: Path, largest: int = LARGEST_FILE) -> dict[str, Any]:
    """The object in a JSON file; MakeupError where there is none, or a number is NaN or infinite."""
    try:
        about = file.stat()
        if not stat.S_ISREG(about.st_mode):
            raise MakeupError("it is no file; give the file itself.")
        if about.st_size > largest:
            raise MakeupError(f"it is larger than {largest / 1e6:g} MB, which no such file is; check what it is.")
        data = json.loads(file.read_text(encoding="utf-8-sig"), parse_constant=_no_constant)
    except OSError as error:
        raise MakeupError(f"it cannot be read ({error.strerror}); check the path.") from None
    except UnicodeDecodeError:
        raise MakeupError("it is not UTF-8 text; save it as JSON in UTF-8.") from None
    except (ValueError, RecursionError) as error:
        if isinstance(error, MakeupError):
            raise
        raise MakeupError(
            f"it is not readable JSON ({str(error)[:80]}); mend it or import the product again."
        ) from None
    if not isinstance(data, dict):
        raise MakeupError("it holds no JSON object; a product file starts with {.")
    return data


def _no_constant(text: str) -> float:
    raise MakeupError(f"it holds {text}; every number must be finite.")


def product_of(data: dict[str, Any]) -> Product:
    """The product that a file's object, or one inside a look, describes; MakeupError where it cannot be right."""
    data = migrated(data)
    finish = object_of(data, "finish", {})
    names = [name for name in _SPECTRA if name in _BOTH or name in data]
    spectra = dict(zip(names, spectra_of(data, names), strict=True))
    return Product(
        id=text_of(data, "id"),
        name=text_of(data, "name"),
        kind=text_of(data, "kind"),
        form=text_of(data, "form"),  # type: ignore[arg-type]
        interface=text_of(data, "interface"),  # type: ignore[arg-type]
        thickness_um=number_of(data, "thickness_um", 20.0),
        finish=Finish(
            number_of(finish, "roughness", 0.5), number_of(finish, "f0", 0.04), _rest(finish, {"roughness", "f0"})
        ),
        provenance=provenance_of(object_of(data, "provenance")),
        quality=tuple(_texts(data, "quality")),
        extra=_rest(data, _FIELDS),
        **spectra,
    )


def migrated(data: dict[str, Any]) -> dict[str, Any]:
    """A product file's object as the present schema has it; MakeupError for a schema that is none or newer."""
    schema = data.get("schema")
    if isinstance(schema, bool) or not isinstance(schema, int) or schema < 1:
        raise MakeupError(f"its schema is {str(schema)[:40]!r}; it must be a number from 1 to {SCHEMA}.")
    if schema > SCHEMA:
        raise MakeupError(f"its schema is {schema}; this version reads up to {SCHEMA}. Update the extension.")
    for version in range(schema, SCHEMA):
        data = MIGRATIONS[version](data)
    return data


def _from_1(data: dict[str, Any]) -> dict[str, Any]:
    """Schema 1 wrote no words on quality: a `quality` in such a file belongs to somebody else and is kept under another name."""
    known = {key: value for key, value in data.items() if key != "quality"}
    foreign = {"quality_of_schema_1": data["quality"]} if "quality" in data else {}
    return {**known, **foreign, "schema": 2}


MIGRATIONS: Mapping[int, Callable[[dict[str, Any]], dict[str, Any]]] = {1: _from_1}
"""By schema: what brings a file's object to the next one."""


def _texts(data: dict[str, Any], name: str) -> list[str]:
    values = data.get(name, [])
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise MakeupError(f"{name} is no list of texts.")
    return values


def provenance_of(data: dict[str, Any]) -> Provenance:
    """The provenance in a file's object."""
    recipe = object_of(data, "recipe", {})
    return Provenance(
        status=text_of(data, "status"),  # type: ignore[arg-type]
        source=text_of(data, "source"),
        licence=text_of(data, "licence", ""),
        maker=text_of(data, "maker", ""),
        shade=text_of(data, "shade", ""),
        recipe={name: number_of(recipe, name) for name in recipe},
        extra=_rest(data, {"status", "source", "licence", "maker", "shade", "recipe"}),
    )


def provenance_data(provenance: Provenance) -> dict[str, Any]:
    """A provenance as the object that a file holds; empty fields are left out."""
    fields = {
        "status": str(provenance.status),
        "source": provenance.source,
        "licence": provenance.licence,
        "maker": provenance.maker,
        "shade": provenance.shade,
        "recipe": dict(provenance.recipe),
    }
    return {name: value for name, value in fields.items() if value} | dict(provenance.extra)


def spectra_of(data: dict[str, Any], names: Sequence[str], unit: str = "1/mm") -> list[Spectrum]:
    """The spectra of a file on WAVELENGTHS, from the grid that the file states."""
    grid = object_of(data, "spectrum", {**_SPECTRUM, "unit": unit})
    if grid.get("unit", unit) != unit:
        raise MakeupError(f"the unit of K and S is {str(grid['unit'])[:40]!r}; it must be {unit}.")
    start, step = number_of(grid, "start_nm"), number_of(grid, "step_nm")
    rows = [_numbers(data, name) for name in names]
    count = len(rows[0])
    if step <= 0 or count < 2 or start > 400 or start + step * (count - 1) < 700:
        raise MakeupError(
            f"{names[0]} covers {start:g} nm and {count} steps of {step:g} nm; it must cover at least 400-700 nm."
        )
    nm = start + step * np.arange(count)
    for name, row in zip(names, rows, strict=True):
        if len(row) != count:
            raise MakeupError(f"{name} has {len(row)} values and {names[0]} has {count}; give as many of both.")
    same = count == len(WAVELENGTHS) and np.array_equal(nm, WAVELENGTHS)
    return [np.array(row) if same else resample(nm, row) for row in rows]


def _numbers(data: dict[str, Any], name: str) -> list[float]:
    values = data.get(name)
    if not isinstance(values, list):
        raise MakeupError(f"{name} is missing or no list of numbers.")
    return [number_of({name: value}, name) for value in values]


def number_of(data: dict[str, Any], name: str, default: float | None = None) -> float:
    """A finite number of a file's object; MakeupError where it is missing or something else."""
    value = data.get(name, default)
    try:
        number = math.nan if isinstance(value, bool | str) or value is None else float(value)
    except (TypeError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise MakeupError(f"{name} is {str(value)[:40]!r}; it must be a finite number.")
    return number


def text_of(data: dict[str, Any], name: str, default: str | None = None) -> str:
    """A text of a file's object; MakeupError where it is missing or something else."""
    value = data.get(name, default)
    if not isinstance(value, str):
        raise MakeupError(f"{name} is missing or no text.")
    return value


def object_of(data: dict[str, Any], name: str, default: dict[str, Any] | None = None) -> dict[str, Any]:
    """An object within a file's object; MakeupError where it is missing or something else."""
    value = data.get(name, default)
    if not isinstance(value, dict):
        raise MakeupError(f"{name} is missing or no JSON object.")
    return value


def _rest(data: dict[str, Any], known: set[str]) -> dict[str, Any]:
    return {key: value for key, value in data.items() if key not in known}
