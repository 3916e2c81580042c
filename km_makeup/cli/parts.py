"""What the commands share: arguments that name a head and its look, and standard output kept for results."""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import logging
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import MakeupError
from ..jobs import HeadJob

if TYPE_CHECKING:
    from ..makeup import Look

OK, BROKEN, BAD_INPUT, PARTIAL = 0, 1, 2, 3


def add_head_arguments(sub: argparse.ArgumentParser) -> None:
    """The head, its skin and what to put on it."""
    sub.add_argument("head", help=".blend, .obj, .glb or .gltf; // is the folder of the .blend")
    sub.add_argument("--skin", help="albedo texture for a head without a skin material")
    sub.add_argument("--object", help="name of the head's mesh object (default: found)")
    sub.add_argument(
        "--layer", action="append", default=[], metavar="PRODUCT[=MAP[#CHANNEL]][@THICKNESSum]",
        help="a layer, bottom to top; without a map all of the object's skin, without a thickness the product's usual one",
    )  # fmt: skip
    sub.add_argument("--look", help="a look file (.json); --layer adds layers on top of it")
    sub.add_argument(
        "--light", default="D65", help="D65, D55, A or a CSV spectrum: the light that colours are computed for"
    )
    sub.add_argument(
        "--products", action="append", default=[], help="a further folder of products (also KM_MAKEUP_PRODUCTS)"
    )


@contextlib.contextmanager
def blender_aside() -> Iterator[None]:
    """What Blender and its importers write to standard output is not shown, unless with --log debug, and then on standard error.

    Standard output is for results; Blender's lines name temporary files that are gone when they are read.
    """
    libc = ctypes.cdll.ucrtbase if os.name == "nt" else ctypes.CDLL(None)
    sys.stdout.flush()
    libc.fflush(None)
    standard_output = os.dup(1)
    shown = logging.getLogger().isEnabledFor(logging.DEBUG)
    aside = os.dup(2) if shown else os.open(os.devnull, os.O_WRONLY)
    os.dup2(aside, 1)
    os.close(aside)
    try:
        with (
            open(os.devnull, "w", encoding="utf-8") as nowhere,
            contextlib.redirect_stdout(sys.stderr if shown else nowhere),
        ):
            yield
    finally:
        libc.fflush(None)
        os.dup2(standard_output, 1)
        os.close(standard_output)


def path_of(text: str, blend: str = "") -> Path:
    """A path; ``//`` starts at the folder of the .blend."""
    if text.startswith("//"):
        return Path(blend).resolve().parent / text[2:]
    return Path(text).expanduser()


def between(value: int, name: str, low: int, high: int) -> int:
    """The value; MakeupError where it lies outside."""
    if not low <= value <= high:
        raise MakeupError(f"{name} is {value}; it must lie between {low} and {high}.")
    return value


def size_of(text: str) -> tuple[int, int]:
    """Width and height in pixels of a text like 720x900."""
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit() and 1 <= int(width) <= 65536 and 1 <= int(height) <= 65536):
        raise MakeupError(f"--size {text!r} is no size; write it like 720x900.")
    return int(width), int(height)


def look_of(options: argparse.Namespace) -> Look:
    """The look that --look and --layer describe, maps as absolute paths."""
    from ..makeup import Look, parse_layer

    layers = []
    name = "command line"
    if options.look:
        loaded = Look.load(path_of(options.look, options.head))
        name = loaded.name
        layers += [replace(x, map=str(loaded.folder.resolve() / x.map) if x.map else "") for x in loaded.layers]
    for text in options.layer:
        layer = parse_layer(text)
        layers.append(replace(layer, map=str(path_of(layer.map, options.head).resolve()) if layer.map else ""))
    return Look(name, tuple(layers))


def head_of(options: argparse.Namespace) -> HeadJob:
    """The head that the arguments name, with its look."""
    return HeadJob(
        head=path_of(options.head),
        skin=path_of(options.skin) if options.skin else None,
        object=options.object,
        look=look_of(options),
        light=options.light,
    )


def more_products(folders: Sequence[str]) -> None:
    """Put the folders of --products before those that the environment names."""
    for folder in folders:
        if not Path(folder).is_dir():
            raise MakeupError(f"The product folder {folder} does not exist; check --products.")
    known = os.environ.get("KM_MAKEUP_PRODUCTS")
    os.environ["KM_MAKEUP_PRODUCTS"] = os.pathsep.join([*folders, *([known] if known else [])])
