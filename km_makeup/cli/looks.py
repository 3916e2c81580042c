"""`look`: show a look, put it on a head, save it from one."""

from __future__ import annotations

import argparse
import json
from typing import Any

from ..errors import MakeupError
from .parts import OK, blender_aside, more_products, path_of

LOOK_EXAMPLE = """examples:
  km_makeup look show evening.json
  km_makeup look apply evening.json head.blend --out made-up.blend
  km_makeup look save made-up.blend --out mine.json"""


def add_look_command(commands: Any) -> None:
    about = "show a look, put it on a head, save it from one"
    top = commands.add_parser(
        "look", help=about, description=about[0].upper() + about[1:] + ".", epilog=LOOK_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    actions = top.add_subparsers(dest="action", required=True, metavar="ACTION")
    kinds = {
        "show": ("what a look holds", _look_show),
        "apply": ("put a look on a head and save the .blend", _look_apply),
        "save": ("write the makeup of a .blend as a look", _look_save),
    }
    for name, (what, run) in kinds.items():
        sub = actions.add_parser(
            name, help=what, description=what[0].upper() + what[1:] + ".", epilog=LOOK_EXAMPLE,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )  # fmt: skip
        sub.add_argument(
            "--log", default="info", choices=["debug", "info", "warning", "error"], help="how much is said"
        )
        sub.add_argument("--json", action="store_true", help="print the result as JSON on standard output")
        sub.add_argument("--products", action="append", default=[], help="a further folder of products")
        sub.set_defaults(run=run)
        if name in ("show", "apply"):
            sub.add_argument("look", help="a look file (.json)")
        if name in ("apply", "save"):
            sub.add_argument("head", help=".blend, .obj, .glb or .gltf")
            sub.add_argument("--object", help="name of the head's mesh object (default: found)")
        if name == "apply":
            sub.add_argument("--skin", help="albedo texture for a head without a skin material")
            sub.add_argument("--maps", default="auto", choices=["auto", "as-is", "transfer", "products"],
                             help="what becomes of the look's maps (default: the best for this head)")  # fmt: skip
            sub.add_argument("--out", required=True, help="the .blend to write")
        if name == "save":
            sub.add_argument("--out", required=True, help="the look file (.json) to write; maps go beside it")


def _look_show(options: argparse.Namespace) -> int:
    from ..makeup import Look

    more_products(options.products)
    look = Look.load(path_of(options.look))
    head = look.head
    if options.json:
        layers = [
            {
                "product": x.product,
                "thickness_um": x.thickness_um,
                "map": x.map,
                "strength": x.strength,
                "enabled": x.enabled,
            }
            for x in look.layers
        ]
        carried = [{"id": p.id, "licence": p.provenance.licence, "source": p.provenance.source} for p in look.products]
        print(
            json.dumps({"name": look.name, "layers": layers, "products": carried, "head": head.name if head else None})
        )
        return OK
    print(look.name)
    for number, x in enumerate(look.layers, 1):
        off = "" if x.enabled else ", hidden"
        print(f"{number:3} {x.product}  {x.thickness_um:.4g} um  x{x.strength:.3g}  {x.map or 'whole face'}{off}")
    for product in look.products:
        print(
            f"travels with it: {product.id}, {product.provenance.status}, {product.provenance.licence or 'no licence given'}"
        )
    if head is not None:
        shape = "with its shape" if head.surface else "without its shape"
        print(f"painted on: {head.name or 'a head'}, {shape}, {len(head.landmarks)} landmarks")
    return OK


def _look_apply(options: argparse.Namespace) -> int:
    from ..makeup import Look

    more_products(options.products)
    out = path_of(options.out, options.head)
    if out.suffix.lower() != ".blend":
        raise MakeupError(f"--out {options.out}: a head with makeup is saved as .blend; choose this suffix.")
    look = Look.load(path_of(options.look))
    skin = path_of(options.skin) if options.skin else None
    with blender_aside():
        from ..blender.commands import run_look_apply

        said = run_look_apply(path_of(options.head), options.object, skin, look, options.maps, out)
    print(
        json.dumps({"file": str(out), "maps": said[0], "reason": said[1]}) if options.json else f"{said[0]}: {said[1]}"
    )
    return OK


def _look_save(options: argparse.Namespace) -> int:
    more_products(options.products)
    out = path_of(options.out, options.head)
    if out.suffix.lower() != ".json":
        raise MakeupError(f"--out {options.out}: looks are saved as .json; choose this suffix.")
    with blender_aside():
        from ..blender.commands import run_look_save

        count = run_look_save(path_of(options.head), options.object, out)
    print(json.dumps({"file": str(out), "layers": count}) if options.json else f"{out}: {count} layers")
    return OK
