"""`products ...` on the command line: list, show, mix, match, shade, swatch, plot, import, check, rebuild.

``add_products_command`` hangs them below another parser; ``python -m km_makeup.products`` runs them alone.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MakeupError
from ..spectra import lab, reference_skins, upsample_skin
from .check import check_library
from .files import provenance_data, write_product
from .formulation import formulate
from .importing import FilmNames, Identity, Instrument, Radiance, import_product
from .library import Library
from .measurement import BARIUM_SULPHATE, NOISE
from .pigment import shipped_pigments
from .product import Finish, Form, Product
from .readers import Scale
from .recipe import Recipe, mix
from .shades import find_shades, skin_colour
from .swatches import swatch, swatch_sheet, write_png

OK, BAD_INPUT, PARTIAL = 0, 2, 3

OPAQUE_WHITE = 0.003
"""Volume fraction of white in a match of an opaque film."""

_EXAMPLES = {
    "list": "products list --kind lipstick",
    "show": "products show lipstick-berry",
    "mix": "products mix --id lipstick-mine --name Mine --kind lipstick --form cream --part carmine=1.2% --part titanium-dioxide=0.3% --out mine.json",
    "match": "products match '#a1343c' --pigments red-lake,carmine,carbon-black --fixed titanium-dioxide=0.3% --thickness 15um --skin medium",
    "shade": "products shade '#c69076'",
    "swatch": "products swatch lipstick-berry blush-rose --out swatches.png",
    "plot": "products plot lipstick-berry --out berry.svg",
    "import": "products import paints.csv --film 16A_ob:16A_b:60um --film 16A_ow:16A_w:60um --id white-mine --name Mine --kind foundation --form cream --source 'own measurement' --out mine.json",
    "check": "products check",
    "rebuild": "products rebuild --check",
}


def add_products_command(commands: Any) -> None:
    """Add `products` with its own commands to the sub-parsers of a command line."""
    group = commands.add_parser(
        "products", help="the library of products: list, show, mix, match, shade, swatch, plot, import, check, rebuild"
    )
    add_commands(group.add_subparsers(dest="products_command", required=True, metavar="COMMAND"))


def add_commands(commands: Any) -> None:
    """Add list, show, mix, ... to some sub-parsers; each sets ``run``, which returns an exit code."""
    one = _command(commands, "list", "list the products of the library", _list)
    one.add_argument("--kind", help="only this kind: foundation, lipstick, ...")
    one = _command(commands, "show", "show one product: where it comes from and what it looks like", _show)
    one.add_argument("product")
    one = _command(commands, "mix", "mix a product of pigments by volume fractions", _mix)
    _identity(one)
    one.add_argument("--part", action="append", default=[], metavar="PIGMENT=FRACTION", help="such as carmine=1.2%%")
    one = _command(commands, "match", "find the recipe that comes nearest to a colour (sRGB hex)", _match)
    one.add_argument("colour")
    one.add_argument("--pigments", default="", help="ids with commas; default: all that cosmetics commonly use")
    one.add_argument("--fixed", action="append", default=[], metavar="PIGMENT=FRACTION", help="a part that stays")
    one.add_argument("--thickness", default="", help="of the film, such as 15um; default: opaque")
    one.add_argument("--skin", default="medium", help="light, medium, deep or a colour in hex")
    one = _command(commands, "shade", "find the foundations nearest to a skin colour (sRGB hex)", _shade)
    one.add_argument("colour")
    one.add_argument("--kind", default="foundation")
    one.add_argument("--count", type=int, default=3)
    one = _command(commands, "swatch", "write a PNG of swatches on black, white and three skins", _swatch)
    one.add_argument("product", nargs="*", help="ids; default: all")
    one.add_argument("--out", type=Path, required=True)
    one = _command(commands, "plot", "write an SVG of a product: R, R∞, Rg; K and S; the thin film", _plot)
    one.add_argument("product")
    one.add_argument("--out", type=Path, required=True)
    one = _command(commands, "import", "make a product from measured films", _import)
    _identity(one)
    _measurement(one)
    _command(commands, "check", "check every product of the library", _check)
    one = _command(commands, "rebuild", "make the shipped products again from their recipes", _rebuild)
    one.add_argument("--check", action="store_true", help="write nothing, compare")
    one.add_argument("--pigments", action="store_true", help="derive the pigment table from published data too")


def _command(commands: Any, name: str, about: str, run: Callable[[argparse.Namespace], int]) -> argparse.ArgumentParser:
    one = commands.add_parser(
        name,
        help=about,
        description=about[0].upper() + about[1:] + ".",
        epilog=f"example:\n  km_makeup {_EXAMPLES[name]}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    one.add_argument("--json", action="store_true", help="print the result as JSON")
    one.add_argument("--folder", type=Path, help="the user's folder of products")
    one.add_argument("--log", default="info", choices=["debug", "info", "warning", "error"], help="how much is said")
    one.set_defaults(run=run)
    return one


def _identity(one: argparse.ArgumentParser) -> None:
    for name in ("--id", "--name", "--kind"):
        one.add_argument(name, required=True)
    one.add_argument("--form", choices=[str(form) for form in Form], default="cream")
    one.add_argument("--usual", default="20um", help="thickness of a usual application (default: 20um)")
    one.add_argument("--roughness", type=float, default=0.5, help="of its highlight, 0..1 (default: 0.5)")
    one.add_argument("--out", type=Path, required=True, help="the product file to write")


def _measurement(one: argparse.ArgumentParser) -> None:
    one.add_argument("file", type=Path)
    one.add_argument(
        "--film", action="append", default=[], metavar="FILM:BACKING:THICKNESSum",
        help="names of the spectra of a film and of its bare backing, and its thickness; `opaque` for a thick one",
    )  # fmt: skip
    one.add_argument("--noise", type=float, default=NOISE, help=f"standard deviation of a reading (default: {NOISE:g})")
    one.add_argument("--index", type=float, default=1.5, help="refractive index of the film (default: 1.5)")
    one.add_argument("--apparent", action="store_true", help="without Saunderson's correction")
    one.add_argument(
        "--specular-excluded", action="store_true", help="the readings are without the surface's reflection"
    )
    one.add_argument(
        "--scale", choices=[str(scale) for scale in Scale], help="of the values (default: told from the file)"
    )
    one.add_argument(
        "--light", metavar="NAME", help="the values are radiance: spectrum of the white standard in the light"
    )
    one.add_argument("--dark", metavar="NAME", help="spectrum read with the light off (with --light; default: 0)")
    one.add_argument("--standard", type=float, default=BARIUM_SULPHATE, help="reflectance of the white standard")
    one.add_argument("--source", required=True, help="who measured what, and how")
    one.add_argument("--licence", default="own measurement")
    one.add_argument("--plot", type=Path, metavar="FILE.svg", help="also draw the readings, K and S with their errors")


def _library(options: argparse.Namespace) -> Library:
    library = Library.user(options.folder)
    for problem in library.problems:
        print(problem, file=sys.stderr)
    return library


def _list(options: argparse.Namespace) -> int:
    known = _library(options).products
    products = [one for one in known if options.kind in (None, one.kind)]
    if options.kind and not products:
        raise MakeupError(
            f"No product is of the kind {options.kind!r}; use {', '.join(sorted({p.kind for p in known}))}."
        )
    if options.json:
        _print_json([_summary(one) for one in products])
    for one in [] if options.json else products:
        print(f"{one.id:24} {one.kind:12} {one.form:7} {one.thickness_um:5g} um  {one.provenance.status:27} {one.name}")
    return OK


def _show(options: argparse.Namespace) -> int:
    product = _library(options).find(options.product)
    colours = swatch(product)
    seen = {"opaque film": colours.masstone} | {f"on {name}": rows[1] for name, rows in colours.drawdowns.items()}
    if options.json:
        found = {name: [round(float(v), 2) for v in lab(rgb)] for name, rgb in seen.items()}
        _print_json(
            _summary(product)
            | {"provenance": provenance_data(product.provenance), "quality": list(product.quality), "lab_d65": found}
        )
        return OK
    source = product.provenance
    print(
        f"{product.id}: {product.name}, {product.kind}, {product.form}, {product.thickness_um:g} um, {product.interface}"
    )
    print(f"{source.status}: {source.source}")
    for sentence in product.quality:
        print(f"quality: {sentence}")
    if source.recipe:
        print("volume fractions: " + ", ".join(f"{name} {part:.4g}" for name, part in source.recipe.items()))
    for name, rgb in seen.items():
        L, a, b = lab(rgb)
        print(f"{name:14} L* {L:5.1f}  a* {a:5.1f}  b* {b:5.1f}  under D65")
    return OK


def _mix(options: argparse.Namespace) -> int:
    recipe = Recipe(
        options.id, options.name, options.kind, Form(options.form), _um(options.usual), Finish(options.roughness),
        dict(map(_part, options.part)),
    )  # fmt: skip
    return _write(mix(recipe), options)


def _match(options: argparse.Namespace) -> int:
    thickness = _um(options.thickness) if options.thickness else np.inf
    fixed = dict(map(_part, options.fixed))
    if not fixed and np.isinf(thickness):  # an opaque film's colour says nothing of the whole amount: the white sets it
        fixed = {"titanium-dioxide": OPAQUE_WHITE}
    common = [name for name in shipped_pigments() if name not in ("zinc-oxide", "filler", "iron-oxide-black", *fixed)]
    names = [name.strip() for name in options.pigments.split(",") if name.strip()] or common
    found = formulate(hex_colour(options.colour), names, thickness_um=thickness, skin=_skin(options.skin), fixed=fixed)
    if options.json:
        _print_json({"fractions": found.fractions, "delta_e": found.delta_e, "reached": found.reached})
    else:
        print(found)
    return OK


def _shade(options: argparse.Namespace) -> int:
    skin = hex_colour(options.colour)
    shades, colour = find_shades(skin, _library(options), options.count, options.kind), skin_colour(skin)
    if options.json:
        rows = [
            {"product": s.product.id, "worn": s.worn, "opaque": s.opaque, "undertone": str(s.undertone)} for s in shades
        ]
        _print_json({"undertone": str(colour.undertone), "hue": colour.hue, "shades": rows})
        return OK
    print(
        f"skin: L* {colour.lightness:.1f}, hue {colour.hue:.0f} degrees, typology angle {colour.typology_angle:.0f} degrees, {colour.undertone}"
    )
    for one in shades:
        print(one)
    return OK


def _swatch(options: argparse.Namespace) -> int:
    library = _library(options)
    products = [library.find(one) for one in options.product] or list(library.products)
    write_png(options.out, swatch_sheet(products))
    _say(
        options,
        {"file": str(options.out), "products": [one.id for one in products]},
        f"{options.out}: {len(products)} swatches",
    )
    return OK


def _plot(options: argparse.Namespace) -> int:
    from .plots import plot_product

    product = _library(options).find(options.product)
    plot_product(product, options.out)
    band = product.K_error is not None
    about = "with bands of 95 % confidence" if band else f"no bands, since it is {product.provenance.status}"
    _say(options, {"file": str(options.out), "bands": band}, f"{options.out}: {product.name}, {about}")
    return OK


def _import(options: argparse.Namespace) -> int:
    identity = Identity(
        options.id, options.name, options.kind, options.source, Form(options.form), options.licence, _um(options.usual),
        Finish(options.roughness),
    )  # fmt: skip
    instrument = Instrument(options.noise, None if options.apparent else options.index, not options.specular_excluded)
    radiance = Radiance(options.light, options.dark or "", options.standard) if options.light else None
    found = import_product(
        options.file, [_film(text) for text in options.film], identity, instrument,
        radiance=radiance, scale=Scale(options.scale) if options.scale else None,
    )  # fmt: skip
    for sentence in found.product.quality:
        print(sentence, file=sys.stderr)
    if options.plot:
        from .plots import plot_product, reading_lines

        plot_product(found.product, options.plot, reading_lines(found.films))
        print(f"{options.plot}: readings, K and S with 95 % confidence", file=sys.stderr)
    return _write(found.product, options)


def _check(options: argparse.Namespace) -> int:
    library = Library.user(options.folder)
    findings = check_library(library)
    _say(
        options,
        {
            "products": len(library.products),
            "findings": [{"product": f.product, "problem": f.problem} for f in findings],
        },
        "\n".join([*map(str, findings), f"{len(library.products)} products, {len(findings)} findings"]),
    )
    return PARTIAL if findings else OK


def _rebuild(options: argparse.Namespace) -> int:
    from .rebuild import main as rebuild

    flags = [flag for flag, on in (("--check", options.check), ("--pigments", options.pigments)) if on]
    return rebuild(flags)


def hex_colour(text: str) -> np.ndarray:
    """Linear Rec.709 of an sRGB colour such as #c69076; MakeupError where the text is none."""
    digits = text.strip().removeprefix("#")
    if re.fullmatch(r"[0-9a-fA-F]{3}", digits):
        digits = "".join(2 * digit for digit in digits)
    if not re.fullmatch(r"[0-9a-fA-F]{6}", digits):
        raise MakeupError(f"{text!r} is no colour; write it as #c69076.")
    curved = np.array([int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4)])
    return np.where(curved <= 0.04045, curved / 12.92, ((curved + 0.055) / 1.055) ** 2.4)


def _skin(text: str) -> np.ndarray:
    skins = reference_skins()
    return np.asarray(skins[text] if text in skins else upsample_skin(hex_colour(text)))


def _part(text: str) -> tuple[str, float]:
    name, _, amount = text.partition("=")
    value = amount.strip()
    try:
        fraction = float(value.removesuffix("%")) / (100 if value.endswith("%") else 1)
    except ValueError:
        raise MakeupError(f"{text!r} is no part of a mixture; write it as carmine=1.2%.") from None
    return name.strip(), fraction


def _um(text: str) -> float:
    try:
        return float(text.strip().removesuffix("um"))
    except ValueError:
        raise MakeupError(f"{text!r} is no thickness; write it as 15um.") from None


def _film(text: str) -> FilmNames:
    parts = text.rsplit(":", 2)
    if len(parts) != 3:
        raise MakeupError(f"{text!r} is no film; write it as FILM:BACKING:60um, with the names of the spectra.")
    return FilmNames(parts[0], parts[1], np.inf if parts[2] == "opaque" else _um(parts[2]))


def _write(product: Product, options: argparse.Namespace) -> int:
    if options.out.suffix != ".json":
        raise MakeupError(f"{options.out} has no name of a product file; let it end in .json.")
    write_product(product, options.out)
    L, a, b = lab(swatch(product).masstone)
    _say(
        options,
        _summary(product) | {"file": str(options.out)},
        f"{options.out}: opaque film L* {L:.1f} a* {a:.1f} b* {b:.1f}",
    )
    return OK


def _summary(product: Product) -> dict[str, Any]:
    return {
        "id": product.id,
        "name": product.name,
        "kind": product.kind,
        "form": str(product.form),
        "thickness_um": product.thickness_um,
        "interface": str(product.interface),
        "status": str(product.provenance.status),
    }


def _say(options: argparse.Namespace, data: dict[str, Any], text: str) -> None:
    if options.json:
        _print_json(data)
    else:
        print(text)


def _print_json(data: Any) -> None:
    print(json.dumps(data, indent=2, ensure_ascii=False))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; its exit code: 0 done, 2 bad input, 3 findings."""
    parser = argparse.ArgumentParser(prog="python -m km_makeup.products", description="The library of products.")
    add_commands(parser.add_subparsers(required=True, metavar="COMMAND"))
    options = parser.parse_args(arguments)
    try:
        return int(options.run(options))
    except MakeupError as error:
        print(f"km_makeup: {error}", file=sys.stderr)
        return BAD_INPUT
