"""A lookbook as plain data: which pictures it has, what each is called, and the digest of all that it depends on.

A picture is a skin with a makeup from a view. Makeups are the looks, each alone and with every one of the products on top.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from .. import __version__
from ..errors import MakeupError
from ..products import Library
from ..products.files import product_text
from .look import Layer, Look, check_number, parse_layer

SCHEMA = 1
BARE = "bare"
"""Name of the look without any product."""

_BOOK = {"schema", "head", "object", "light", "skins", "looks", "products", "views", "engine", "colour", "size", "samples",
         "seed", "resolution"}  # fmt: skip
_SKIN = {"name", "head", "texture", "images", "products"}


@dataclass(frozen=True)
class BookSkin:
    """A skin: the head's own, another head file, an albedo texture; images of the .blend and products to be exchanged."""

    name: str
    head: Path
    texture: Path | None = None
    images: Mapping[str, str] = field(default_factory=dict)
    products: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Makeup:
    """What is worn: a look with absolute map paths, None for bare skin, and its name on sheets."""

    name: str
    look: Look | None


@dataclass(frozen=True)
class Group:
    """The pictures of one skin with one makeup; they share a bake."""

    skin: BookSkin
    makeup: Makeup

    def file(self, view: str) -> str:
        """Name of a picture's file."""
        return "_".join(_slug(part) for part in (self.skin.name, self.makeup.name, view)) + ".png"

    @property
    def caption(self) -> str:
        """What stands under it on a sheet."""
        return f"{self.skin.name}, {self.makeup.name}"


@dataclass(frozen=True)
class Book:
    """A lookbook: skins and makeups, seen from views, and how the pictures are made.

    ``size`` in pixels; ``colour`` live or baked; ``resolution`` of the bakes in texels, 0 for the maps' own.
    """

    object: str | None
    light: str
    skins: tuple[BookSkin, ...]
    makeups: tuple[Makeup, ...]
    views: tuple[str, ...]
    engine: str
    colour: str
    size: tuple[int, int]
    samples: int
    seed: int
    resolution: int

    def groups(self) -> list[Group]:
        """Skins times makeups, in the order of the sheets."""
        return [Group(skin, makeup) for skin in self.skins for makeup in self.makeups]

    def chunk(self, number: int, count: int) -> list[Group]:
        """The groups of one process: those of chunk ``number`` (from 1) of ``count``; some of them empty when there are few."""
        every = self.groups()
        return every[(number - 1) * len(every) // count : number * len(every) // count]

    def worn(self, group: Group, library: Library) -> Look | None:
        """The look of a group, with the products that its skin asks for instead."""
        look = group.makeup.look
        if look is None:
            return None
        known = look.with_carried(library)
        exchange = group.skin.products
        layers = tuple(replace(x, product=exchange.get(x.product, x.product)) for x in look.layers)
        for layer in layers:
            known.find(layer.product)
        return replace(look, layers=layers)

    def bake_digest(self, group: Group, library: Library) -> str:
        """Of all that the textures of a group depend on: the same for two groups that can share them."""
        look = self.worn(group, library)
        skin = group.skin
        made: list[object] = [__version__, self.light_digest, self.object, self.resolution, file_digest(skin.head)]
        made += [skin.texture and file_digest(skin.texture), sorted(skin.images.items())]
        if look is not None:
            known = look.with_carried(library)
            for layer in look.layers:
                own = (
                    layer.thickness_um,
                    layer.channel,
                    layer.strength,
                    layer.enabled,
                    layer.form,
                    layer.finish,
                    layer.plan,
                )
                made += [own, product_text(known.find(layer.product)), layer.map and file_digest(Path(layer.map))]
            made.append(look.exclusion and file_digest(look.folder / look.exclusion))
        return hashlib.blake2b(repr(made).encode(), digest_size=12).hexdigest()

    def picture_digest(self, group: Group, view: str, library: Library) -> str:
        """Of all that a picture depends on."""
        how = (view, self.engine, self.colour, self.size, self.samples, self.seed)
        return hashlib.blake2b(repr((how, self.bake_digest(group, library))).encode(), digest_size=12).hexdigest()

    @property
    def light_digest(self) -> str:
        """The light's name, or the digest of its file."""
        return file_digest(Path(self.light)) if Path(self.light).suffix else self.light


@cache
def _digest_at(path: Path, time_ns: int, size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "blake2b").hexdigest()[:24]


def file_digest(path: Path) -> str:
    """Of what a file holds; MakeupError where it is missing."""
    try:
        found = path.stat()
        return _digest_at(path, found.st_mtime_ns, found.st_size)
    except OSError as error:
        raise MakeupError(f"{path} cannot be read ({error.strerror}); check the lookbook's paths.") from None


def read_book(file: Path) -> Book:
    """The lookbook of a JSON file; its paths are relative to it. MakeupError says what is wrong with it and where."""
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise MakeupError(f"The lookbook {file} cannot be read ({error.strerror}); check the path.") from None
    except ValueError as error:
        raise MakeupError(f"The lookbook {file} is no JSON ({error}); mend it.") from None
    reader = _Reader(file, data)
    book = reader.book()
    names = [group.file(view) for group in book.groups() for view in book.views]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        raise MakeupError(f"{file}: two pictures would be called {twice}; give skins, looks and products other names.")
    return book


class _Reader:
    """Reads the fields of a lookbook, with the file's name in every complaint."""

    def __init__(self, file: Path, data: Any) -> None:
        self._file, self._folder = file, file.resolve().parent
        self._data = self._object(data, "the lookbook", _BOOK)
        if data.get("schema", SCHEMA) != SCHEMA:
            self._fail(f"its schema is {data['schema']!r}, and this version reads {SCHEMA}; update KM Makeup")

    def book(self) -> Book:
        if "head" not in self._data:
            self._fail("'head' is missing: the .blend, .obj, .glb or .gltf to put makeup on")
        light = self._text(self._data, "light", "D65")
        width, _, height = self._text(self._data, "size", "400x500").partition("x")
        if not (width.isdigit() and height.isdigit() and 1 <= int(width) <= 65536 and 1 <= int(height) <= 65536):
            self._fail(f"'size' {self._data.get('size')!r} is no size; write it like 400x500")
        return Book(
            object=self._text(self._data, "object", "") or None,
            light=str(self._folder / light) if Path(light).suffix else light,
            skins=tuple(self._skins()),
            makeups=tuple(self._makeups()),
            views=tuple(self._texts("views", ["front"])),
            engine=self._choice("engine", ("eevee", "cycles")),
            colour=self._choice("colour", ("baked", "live")),
            size=(int(width), int(height)),
            samples=self._number("samples", 16, 1, 2**24),
            seed=self._number("seed", 0, 0, 2**31 - 1),
            resolution=self._number("resolution", 0, 0, 16384),
        )

    def _skins(self) -> Iterator[BookSkin]:
        own = self._folder / self._text(self._data, "head", "")
        entries = self._data.get("skins", [{"name": "skin"}])
        if not isinstance(entries, list) or not entries:
            self._fail("'skins' must be a list of skins")
        for entry in entries:
            skin = self._object(entry, "a skin", _SKIN)
            if not self._text(skin, "name", ""):
                self._fail("a skin has no 'name'")
            texture = self._text(skin, "texture", "")
            yield BookSkin(
                name=skin["name"],
                head=self._folder / self._text(skin, "head", "") if "head" in skin else own,
                texture=self._folder / texture if texture else None,
                images=self._exchange(skin, "images"),
                products=self._exchange(skin, "products"),
            )

    def _makeups(self) -> Iterator[Makeup]:
        layers = [self._layer(text) for text in self._texts("products", [], empty=True)]
        for name in self._texts("looks", [BARE]):
            look = None if name == BARE else self._look(name)
            title = BARE if look is None else look.name
            yield Makeup(title, look)
            base = look or Look("", ())
            for layer in layers:
                both = f"{title} + {layer.product}" if look else layer.product
                yield Makeup(both, replace(base, name=both, layers=(*base.layers, layer)))

    def _look(self, name: str) -> Look:
        look = Look.load(self._folder / name)
        maps = (str(look.folder.resolve() / x.map) if x.map else "" for x in look.layers)
        return replace(look, layers=tuple(replace(x, map=m) for x, m in zip(look.layers, maps)))

    def _layer(self, text: str) -> Layer:
        layer = parse_layer(text)
        return replace(layer, map=str(self._folder / layer.map)) if layer.map else layer

    def _exchange(self, data: dict[str, Any], key: str) -> dict[str, str]:
        pairs = data.get(key, {})
        if not isinstance(pairs, dict) or not all(isinstance(value, str) for value in pairs.values()):
            self._fail(f'a skin\'s {key!r} must say what comes instead of what, like {{"one": "another"}}')
        return pairs

    def _object(self, data: Any, what: str, known: set[str]) -> dict[str, Any]:
        if not isinstance(data, dict):
            self._fail(f"{what} must be an object in braces")
        for key in data:
            if key not in known:
                self._fail(f"{what} has no {key!r}; it has {', '.join(sorted(known))}")
        return data

    def _text(self, data: dict[str, Any], key: str, usual: str) -> str:
        value = data.get(key, usual)
        if not isinstance(value, str) or "\0" in value:
            self._fail(f"{key!r} must be text, not {value!r}")
        return value

    def _texts(self, key: str, usual: list[str], empty: bool = False) -> list[str]:
        values = self._data.get(key, usual)
        if not isinstance(values, list) or not all(isinstance(v, str) and v for v in values) or not (values or empty):
            self._fail(f"{key!r} must be a list of texts")
        return values

    def _choice(self, key: str, choices: tuple[str, ...]) -> str:
        value = self._text(self._data, key, choices[0])
        if value not in choices:
            self._fail(f"{key!r} is {value!r}; use {' or '.join(choices)}")
        return value

    def _number(self, key: str, usual: int, low: int, high: int) -> int:
        return int(check_number(self._data.get(key, usual), f"{self._file}: {key!r}", low, high))

    def _fail(self, what: str) -> None:
        raise MakeupError(f"{self._file}: {what}.")


def _slug(text: str) -> str:
    return re.sub(r"[^\w.+-]+", "-", text.strip(), flags=re.ASCII).strip("-").lower() or "x"
