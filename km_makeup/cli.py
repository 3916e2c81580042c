"""The command line, the same under ``python -m km_makeup`` and ``blender --command km_makeup``.

Exit codes: 0 all done, 1 unexpected error, 2 bad input (one line says what to do), 3 some of it failed.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import json
import logging
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import MakeupError
from .jobs import BakeJob, ExportJob, HeadJob, RenderJob

if TYPE_CHECKING:
    from .accuracy.commands import SceneLadders, SceneRequest
    from .makeup import Look

OK, BROKEN, BAD_INPUT, PARTIAL = 0, 1, 2, 3

EXAMPLES = {
    "render": "example:\n  km_makeup render head.obj --skin albedo.png --layer lipstick-classic-red=lips.png@15um --out face.png\n"
    "  km_makeup render head.blend --look look.json --view front,close-up --reference 512 --out pictures",
    "bake": "example:\n  km_makeup bake head.blend --look look.json --resolution 4096 --out textures",
    "export": "example:\n  km_makeup export head.blend --look look.json --out exported --gltf",
    "doctor": "example:\n  km_makeup doctor",
}


class _Parser(argparse.ArgumentParser):
    """Usage errors are one line and exit code 2, like all bad input."""

    def error(self, message: str) -> Any:
        self.exit(BAD_INPUT, f"{self.prog}: {message} (see {self.prog} --help)\n")


def parser() -> argparse.ArgumentParser:
    """The argument parser of all commands."""
    top = _Parser(prog="km_makeup", description="Physically based makeup from spectral films, without a window.")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _render_parser(_command(commands, "render", "render a head with makeup to PNG or EXR", _render))
    _bake_parser(_command(commands, "bake", "bake the makeup of a head to textures", _bake))
    _export_parser(_command(commands, "export", "export a head with makeup as plain textures and glTF", _export))
    _command(commands, "doctor", "check Blender, packages, products and a small computation", _doctor)
    from .accuracy.commands import add_accuracy_command

    _look_parser(commands)
    from .lookbook import add_lookbook_command

    add_lookbook_command(commands, _blender_aside)
    from .products.commands import add_products_command

    add_products_command(commands)
    add_accuracy_command(commands, _open_scene)
    return top


def _open_scene(request: SceneRequest) -> SceneLadders:
    """The ladders of pictures, which Blender makes."""
    with _blender_aside():
        from .blender.measuring import open_scene

        return replace(open_scene(request), aside=_blender_aside)


def _command(commands: Any, name: str, about: str, run: Callable[[argparse.Namespace], int]) -> argparse.ArgumentParser:
    sub = commands.add_parser(
        name, help=about, description=about[0].upper() + about[1:] + ".", epilog=EXAMPLES[name],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    sub.add_argument(
        "--log", default="info", choices=["debug", "info", "warning", "error"], help="how much is said (default: info)"
    )
    sub.add_argument("--json", action="store_true", help="print the result as JSON on standard output")
    sub.set_defaults(run=run)
    return sub


def _head_arguments(sub: argparse.ArgumentParser) -> None:
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


def _render_parser(sub: argparse.ArgumentParser) -> None:
    _head_arguments(sub)
    sub.add_argument("--engine", default="eevee", choices=["eevee", "cycles"], help="render engine (default: eevee)")
    sub.add_argument("--colour", default="baked", choices=["live", "baked", "finished"],
                     help="live node films, baked textures, or the finished albedo per texel (default: baked)")  # fmt: skip
    sub.add_argument("--size", default="720x900", help="width x height in pixels (default: 720x900)")
    sub.add_argument("--samples", type=int, default=32, help="samples per pixel (default: 32)")
    sub.add_argument("--seed", type=int, default=0, help="noise seed of Cycles (default: 0)")
    sub.add_argument(
        "--view", default="front", help="front, three-quarter, close-up or a camera's name; several with commas"
    )
    sub.add_argument("--bare", action="store_true", help="render without makeup")
    sub.add_argument(
        "--reference", nargs="?", type=int, const=256, default=0, metavar="SAMPLES",
        help="also path trace each view in Cycles (default: 256 samples) and write the difference beside it",
    )  # fmt: skip
    sub.add_argument(
        "--out",
        default="makeup.png",
        help=".png or .exr, or a folder when there are several views (default: makeup.png)",
    )
    sub.add_argument("--save", help="also save the scene as this .blend")


def _bake_parser(sub: argparse.ArgumentParser) -> None:
    _head_arguments(sub)
    sub.add_argument("--resolution", type=int, default=0, help="width and height in texels (default: the maps')")
    sub.add_argument("--finished", action="store_true", help="also the finished albedo over the skin's texture")
    sub.add_argument("--float", action="store_true", help="32-bit textures instead of 16-bit half floats")
    sub.add_argument("--out", default="makeup_textures", help="folder for the textures (default: makeup_textures)")


def _export_parser(sub: argparse.ArgumentParser) -> None:
    _head_arguments(sub)
    sub.add_argument("--gltf", action="store_true", help="also the object with these textures as a .glb")
    sub.add_argument("--exr", action="store_true", help="linear 16-bit OpenEXR textures instead of 8-bit PNG")
    sub.add_argument("--before", action="store_true", help="also the bare skin in the same way")
    sub.add_argument(
        "--resolution",
        type=int,
        default=0,
        help="width and height in texels (default: the largest map's or skin texture's)",
    )
    sub.add_argument("--out", default="makeup_export", help="folder for the files (default: makeup_export)")


class _Ended(BaseException):
    """The process was asked to end: temporary files are tidied away on the way out."""


@contextlib.contextmanager
def _ending_tidily() -> Iterator[None]:
    """SIGTERM unwinds like Ctrl-C, so that no half-written file stays."""

    def end(*_: object) -> None:
        raise _Ended

    try:
        before = signal.signal(signal.SIGTERM, end)
    except ValueError:  # only the main thread may listen to signals
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


LOOK_EXAMPLE = """examples:
  km_makeup look show evening.json
  km_makeup look apply evening.json head.blend --out made-up.blend
  km_makeup look save made-up.blend --out mine.json"""


def _look_parser(commands: Any) -> None:
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
    from .makeup import Look

    _more_products(options.products)
    look = Look.load(_path(options.look))
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
    from .makeup import Look

    _more_products(options.products)
    out = _path(options.out, options.head)
    if out.suffix.lower() != ".blend":
        raise MakeupError(f"--out {options.out}: a head with makeup is saved as .blend; choose this suffix.")
    look = Look.load(_path(options.look))
    skin = _path(options.skin) if options.skin else None
    with _blender_aside():
        from .blender.commands import run_look_apply

        said = run_look_apply(_path(options.head), options.object, skin, look, options.maps, out)
    print(
        json.dumps({"file": str(out), "maps": said[0], "reason": said[1]}) if options.json else f"{said[0]}: {said[1]}"
    )
    return OK


def _look_save(options: argparse.Namespace) -> int:
    _more_products(options.products)
    out = _path(options.out, options.head)
    if out.suffix.lower() != ".json":
        raise MakeupError(f"--out {options.out}: looks are saved as .json; choose this suffix.")
    with _blender_aside():
        from .blender.commands import run_look_save

        count = run_look_save(_path(options.head), options.object, out)
    print(json.dumps({"file": str(out), "layers": count}) if options.json else f"{out}: {count} layers")
    return OK


def main(arguments: Sequence[str]) -> int:
    """Run one command; the exit code."""
    try:
        options = parser().parse_args(list(arguments))
    except SystemExit as end:
        return int(end.code or 0)
    logging.basicConfig(level=options.log.upper(), format="%(message)s", stream=sys.stderr, force=True)
    try:
        with _ending_tidily():
            return options.run(options)
    except MakeupError as error:
        print(f"km_makeup: {error}", file=sys.stderr)
        return BAD_INPUT
    except (KeyboardInterrupt, _Ended) as reason:
        print("km_makeup: stopped; files written before are whole", file=sys.stderr)
        return 130 if isinstance(reason, KeyboardInterrupt) else 143


@contextlib.contextmanager
def _blender_aside() -> Iterator[None]:
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


def _path(text: str, blend: str = "") -> Path:
    """A path; ``//`` starts at the folder of the .blend."""
    if text.startswith("//"):
        return Path(blend).resolve().parent / text[2:]
    return Path(text).expanduser()


def _between(value: int, name: str, low: int, high: int) -> int:
    if not low <= value <= high:
        raise MakeupError(f"{name} is {value}; it must lie between {low} and {high}.")
    return value


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit() and 1 <= int(width) <= 65536 and 1 <= int(height) <= 65536):
        raise MakeupError(f"--size {text!r} is no size; write it like 720x900.")
    return int(width), int(height)


def _look(options: argparse.Namespace) -> Look:
    """The look that --look and --layer describe, maps as absolute paths."""
    from .makeup import Look, parse_layer

    layers = []
    name = "command line"
    if options.look:
        loaded = Look.load(_path(options.look, options.head))
        name = loaded.name
        layers += [replace(x, map=str(loaded.folder.resolve() / x.map) if x.map else "") for x in loaded.layers]
    for text in options.layer:
        layer = parse_layer(text)
        layers.append(replace(layer, map=str(_path(layer.map, options.head).resolve()) if layer.map else ""))
    return Look(name, tuple(layers))


def _head(options: argparse.Namespace) -> HeadJob:
    return HeadJob(
        head=_path(options.head),
        skin=_path(options.skin) if options.skin else None,
        object=options.object,
        look=_look(options),
        light=options.light,
    )


def _more_products(folders: Sequence[str]) -> None:
    """Put the folders of --products before those that the environment names."""
    for folder in folders:
        if not Path(folder).is_dir():
            raise MakeupError(f"The product folder {folder} does not exist; check --products.")
    known = os.environ.get("KM_MAKEUP_PRODUCTS")
    os.environ["KM_MAKEUP_PRODUCTS"] = os.pathsep.join([*folders, *([known] if known else [])])


def _not_over_an_input(out: Path, head: HeadJob) -> None:
    """MakeupError where the picture would replace the skin's texture or a map."""
    inputs = [head.skin, *(Path(layer.map) for layer in head.look.layers if layer.map)]
    if any(path and path.resolve() == out.resolve() for path in inputs):
        raise MakeupError(f"--out {out} would replace a picture that it is made from; choose another name.")


def _render(options: argparse.Namespace) -> int:
    _more_products(options.products)
    views = list(dict.fromkeys(view.strip() for view in options.view.split(",") if view.strip()))
    if not views:
        raise MakeupError("--view names no view; use front, three-quarter, close-up or a camera's name.")
    out = _path(options.out, options.head)
    save = _path(options.save, options.head) if options.save else None
    if len(views) > 1 and out.suffix.lower() in (".png", ".exr"):
        raise MakeupError(f"--out {options.out} is one picture, but there are {len(views)} views; give a folder.")
    if save and save.suffix.lower() != ".blend":
        raise MakeupError(f"--save {options.save}: scenes are saved as .blend; choose this suffix.")
    if options.reference and options.engine == "cycles":
        raise MakeupError("--reference compares with Cycles; use it with --engine eevee.")
    head = _head(options)
    _not_over_an_input(out, head)
    job = RenderJob(
        head=head,
        engine=options.engine,
        colour=options.colour,
        bare=options.bare,
        size=_size(options.size),
        samples=_between(options.samples, "--samples", 1, 2**24),
        seed=_between(options.seed, "--seed", 0, 2**31 - 1),
        targets={views[0]: out} if len(views) == 1 and out.suffix else {v: out / f"{v}.png" for v in views},
        save=save,
        reference_samples=_between(options.reference, "--reference", 0, 2**24),
    )
    with _blender_aside():
        from .blender.commands import run_render

        result = run_render(job)
    for view, problem in result.failed.items():
        print(f"km_makeup: view {view}: {problem}", file=sys.stderr)
    if options.json:
        pictures = [{"view": v, "file": str(p), "seconds": round(s, 3)} for v, p, s in result.pictures]
        compared = {"differences": result.differences} if result.differences else {}
        print(json.dumps({"pictures": pictures, "failed": result.failed, **compared}))
    if not result.failed:
        return OK
    return PARTIAL if result.pictures else BAD_INPUT


def _bake(options: argparse.Namespace) -> int:
    _more_products(options.products)
    job = BakeJob(
        head=_head(options),
        folder=_path(options.out, options.head),
        resolution=_between(options.resolution, "--resolution", 0, 16384),
        finished=options.finished,
        full_float=options.float,
    )
    with _blender_aside():
        from .blender.commands import run_bake

        files, seconds = run_bake(job)
    if options.json:
        print(json.dumps({"files": {k: str(v) for k, v in files.items()}, "seconds": round(seconds, 3)}))
    else:
        for path in files.values():
            print(path)
    return OK


def _export(options: argparse.Namespace) -> int:
    _more_products(options.products)
    if options.gltf and options.exr:
        raise MakeupError("--gltf holds 8-bit PNG textures; leave --exr away, or export twice.")
    job = ExportJob(
        head=_head(options),
        folder=_path(options.out, options.head),
        exr=options.exr,
        gltf=options.gltf,
        before=options.before,
        resolution=_between(options.resolution, "--resolution", 0, 16384),
    )
    with _blender_aside():
        from .blender.commands import run_export

        files = run_export(job)
    if options.json:
        print(json.dumps({"files": [str(file) for file in files]}))
    else:
        for file in files:
            print(file)
    return OK


def _doctor(options: argparse.Namespace) -> int:
    with _blender_aside():
        from .blender.commands import run_doctor

        findings = run_doctor()
    if options.json:
        print(json.dumps([finding.__dict__ for finding in findings], indent=2))
    else:
        for finding in findings:
            print(f"{'ok ' if finding.good else 'BAD'} {finding.what}: {finding.detail}")
    return OK if all(finding.good for finding in findings) else BROKEN
