"""The command ``lookbook``."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any

from .errors import MakeupError
from .files import ensure_folder, write_text

EXAMPLE = """example:
  km_makeup lookbook book.json --out lookbook
  km_makeup lookbook book.json --out lookbook --chunk 2/8
  km_makeup lookbook --template job.json   (an Open Job Description: the same on a render farm)
book.json, all but the head with a default:
  {"head": "head.blend", "skins": [{"name": "light"}, {"name": "deep", "texture": "deep.png"}],
   "looks": ["bare", "day.json"], "products": ["lipstick-berry=lips.png@15um"], "views": ["front", "close-up"],
   "engine": "eevee", "colour": "baked", "size": "400x500", "samples": 16}"""

OK, BAD_INPUT, PARTIAL = 0, 2, 3
"""Exit codes, as of every command."""

Aside = Callable[[], AbstractContextManager[None]]


def add_lookbook_command(commands: Any, aside: Aside) -> None:
    """Add the command to the parser; ``aside`` keeps what Blender prints off standard output."""
    about = "render skins x looks x products x views, as pictures and contact sheets"
    sub = commands.add_parser(
        "lookbook", help=about, description=about[0].upper() + about[1:] + ".", epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    sub.add_argument("book", nargs="?", help="a JSON file that says what is pictured; its paths are relative to it")
    sub.add_argument("--out", default="lookbook", help="folder for textures, pictures and sheets (default: lookbook)")
    what = sub.add_mutually_exclusive_group()
    what.add_argument("--chunk", metavar="I/N", help="the pictures of chunk I of N alone, without sheets")
    what.add_argument("--sheets", action="store_true", help="the contact sheets alone, of pictures that are there")
    what.add_argument("--template", metavar="FILE", help="write an Open Job Description template for lookbooks")
    sub.add_argument("--products", action="append", default=[], help="a further folder of products")
    sub.add_argument("--log", default="info", choices=["debug", "info", "warning", "error"], help="how much is said")
    sub.add_argument("--json", action="store_true", help="print the result as JSON on standard output")
    sub.set_defaults(run=partial(_lookbook, aside))


def _lookbook(aside: Aside, options: argparse.Namespace) -> int:
    from .makeup.book import read_book

    if options.template:
        print(_write_template(Path(options.template).expanduser()))
        return OK
    if not options.book:
        raise MakeupError("No lookbook is given; write km_makeup lookbook BOOK.json (see --help for what it holds).")
    known = os.environ.get("KM_MAKEUP_PRODUCTS")
    for folder in options.products:
        if not Path(folder).is_dir():
            raise MakeupError(f"The product folder {folder} does not exist; check --products.")
    os.environ["KM_MAKEUP_PRODUCTS"] = os.pathsep.join([*options.products, *([known] if known else [])])
    chunk = _chunk(options.chunk) if options.chunk else (1, 1)
    book = read_book(Path(options.book).expanduser())
    with aside():
        from .blender.commands import run_lookbook

        made = run_lookbook(book, Path(options.out).expanduser(), chunk, not options.sheets, not options.chunk)
    for name, problem in made.failed.items():
        print(f"km_makeup: {name}: {problem}", file=sys.stderr)
    if options.json:
        plain = {"rendered": made.rendered, "found": made.found, "sheets": made.sheets}
        files = {key: [str(path) for path in paths] for key, paths in plain.items()}
        print(json.dumps({**files, "bakes": made.bakes, "failed": made.failed}))
    else:
        for path in made.sheets or made.rendered:
            print(path)
    if not made.failed:
        return OK
    return PARTIAL if made.rendered or made.found else BAD_INPUT


def _write_template(target: Path) -> Path:
    ensure_folder(target.parent)
    template = Path(__file__).parent / "makeup" / "lookbook_job.json"
    write_text(target, template.read_text(encoding="utf-8"))
    return target


def _chunk(text: str) -> tuple[int, int]:
    number, _, count = text.partition("/")
    if not (number.isdigit() and count.isdigit() and 1 <= int(number) <= int(count)):
        raise MakeupError(f"--chunk {text!r} is no chunk; write it like 2/8, from 1/8 to 8/8.")
    return int(number), int(count)
