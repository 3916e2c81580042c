"""The command line, the same under ``python -m km_makeup`` and ``blender --command km_makeup``.

Exit codes: 0 all done, 1 unexpected error, 2 bad input (one line says what to do), 3 some of it failed.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from .errors import MakeupError

log = logging.getLogger("km_makeup")

OK, BROKEN, BAD_INPUT, PARTIAL = 0, 1, 2, 3

EXAMPLES = {
    "render": "example:\n  km_makeup render head.obj --skin albedo.png --layer lipstick-classic-red=lips.png@15um --out face.png",
    "bake": "example:\n  km_makeup bake head.blend --look look.json --resolution 4096 --out textures",
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
    _command(commands, "doctor", "check Blender, packages, products and a small computation", _doctor)
    return top


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
        help="a layer, bottom to top; without a map the whole face, without a thickness the product's usual one",
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
    sub.add_argument("--out", default="makeup.png", help=".png or .exr, or a folder when there are several views")
    sub.add_argument("--save", help="also save the scene as this .blend")


def _bake_parser(sub: argparse.ArgumentParser) -> None:
    _head_arguments(sub)
    sub.add_argument("--resolution", type=int, default=0, help="width and height in texels (default: the maps')")
    sub.add_argument("--finished", action="store_true", help="also the finished albedo over the skin's texture")
    sub.add_argument("--float", action="store_true", help="32-bit textures instead of 16-bit half floats")
    sub.add_argument("--out", default="makeup_textures", help="folder for the textures")


def main(arguments: Sequence[str]) -> int:
    """Run one command; the exit code."""
    try:
        options = parser().parse_args(list(arguments))
    except SystemExit as end:
        return int(end.code or 0)
    logging.basicConfig(level=options.log.upper(), format="%(message)s", stream=sys.stderr, force=True)
    try:
        return options.run(options)
    except MakeupError as error:
        print(f"km_makeup: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("km_makeup: stopped; files written before are whole", file=sys.stderr)
        return 130


def _path(text: str, blend: str = "") -> Path:
    """A path; ``//`` starts at the folder of the .blend."""
    if text.startswith("//"):
        return Path(blend).resolve().parent / text[2:]
    return Path(text).expanduser()


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit() and 1 <= int(width) <= 65536 and 1 <= int(height) <= 65536):
        raise MakeupError(f"--size {text!r} is no size; write it like 720x900.")
    return int(width), int(height)


def _look(options: argparse.Namespace) -> Any:
    """The look that --look and --layer describe, maps as absolute paths."""
    from .makeup import Look, parse_layer

    layers = []
    name = "command line"
    if options.look:
        loaded = Look.load(_path(options.look, options.head))
        name = loaded.name
        from dataclasses import replace

        layers += [replace(x, map=str(loaded.map_path(x).resolve()) if x.map else "") for x in loaded.layers]
    for text in options.layer:
        layer = parse_layer(text)
        from dataclasses import replace

        layers.append(replace(layer, map=str(_path(layer.map, options.head).resolve()) if layer.map else ""))
    return Look(name, tuple(layers))


def _start(options: argparse.Namespace) -> None:
    """What every command that needs Blender does first."""
    import os

    if options.products:
        for folder in options.products:
            if not Path(folder).is_dir():
                raise MakeupError(f"The product folder {folder} does not exist; check --products.")
        os.environ["KM_MAKEUP_PRODUCTS"] = os.pathsep.join(
            [*options.products, *filter(None, [os.environ.get("KM_MAKEUP_PRODUCTS")])]
        )
    import bpy

    from . import blender

    if not hasattr(bpy.types.Object, "km_makeup"):
        blender.register()


def _prepare(options: argparse.Namespace, bare: bool) -> Any:
    """The head in the scene with its look on, and what was said about it."""
    _start(options)
    from .blender import looks, studio

    look = _look(options)
    head = studio.open_head(_path(options.head), _path(options.skin) if options.skin else None, options.object)
    for line in head.said:
        log.info(line)
    obj = head.object
    _set_light(obj, options.light)
    if look.layers and not bare:
        looks.apply_look(obj, look)
    for layer in obj.km_makeup.layers:
        log.info(
            "layer: %s, %.3g µm, map %s", layer.product, layer.thickness_um, layer.map.name if layer.map else "none"
        )
    return obj


def _set_light(obj: Any, light: str) -> None:
    from .blender.update import paused
    from .spectra import light_spectrum

    own = Path(light).suffix.lower() in {".csv", ".txt", ".tsv"}
    light_spectrum(light)
    if not own and light not in ("D65", "D55", "A"):
        raise MakeupError(f"--light {light!r}: use D65, D55, A or a CSV file with wavelength in nm and power.")
    with paused():
        obj.km_makeup.light = "OWN" if own else light
        if own:
            obj.km_makeup.light_file = str(Path(light).resolve())


def _bake_into(obj: Any, folder: Path, finished: bool, resolution: int = 0, full_float: bool = False) -> Any:
    import bpy

    from .blender import baking
    from .blender.update import paused

    with paused():
        obj.km_makeup.folder, obj.km_makeup.finished = str(folder.resolve()), finished
        obj.km_makeup.resolution, obj.km_makeup.full_float = resolution, full_float
    steps = baking.bake_steps(obj, bpy.context.scene)
    told = time.monotonic()
    while True:
        try:
            done, total = next(steps)
        except StopIteration as end:
            return end.value
        if time.monotonic() - told > 2:
            log.info("bake: %d of %d", done, total)
            told = time.monotonic()


def _render(options: argparse.Namespace) -> int:
    from .files import ensure_folder

    size = _size(options.size)
    if options.samples < 1:
        raise MakeupError("--samples must be at least 1.")
    views = [view.strip() for view in options.view.split(",") if view.strip()]
    out = _path(options.out, options.head)
    targets = {views[0]: out} if len(views) == 1 and out.suffix else {v: out / f"{v}.png" for v in views}
    for target in targets.values():
        ensure_folder(target.parent)
    obj = _prepare(options, options.bare)
    return _render_views(options, obj, size, targets)


def _render_views(options: argparse.Namespace, obj: Any, size: tuple[int, int], targets: dict[str, Path]) -> int:
    import bpy

    from .blender import makeup, rendering, studio
    from .effects import Engine

    engine = Engine[options.engine.upper()]
    for target in targets.values():
        rendering.check_format(target)
    if obj.km_makeup.slots and not options.bare:
        if options.colour == "live":
            makeup.refresh(obj)
        else:
            start = time.perf_counter()
            folder = next(iter(targets.values())).parent / "textures"
            report = _bake_into(obj, folder, options.colour == "finished")
            log.info("bake: %s, %.2f s", report or "no film to bake", time.perf_counter() - start)
    elif obj.km_makeup.slots:
        makeup.remove(obj)
    done, failed = [], []
    for view, target in targets.items():
        try:
            camera = studio.camera_for(obj, view)
            log.info("render: %s, %s, %dx%d, %d samples", view, options.engine, *size, options.samples)
            seconds = rendering.render(
                bpy.context.scene, rendering.Shot(camera, engine, size, options.samples, options.seed, target)
            )
        except MakeupError as error:
            if len(targets) == 1:
                raise
            print(f"km_makeup: {view}: {error}", file=sys.stderr)
            failed.append(view)
            continue
        log.info("wrote %s in %.1f s", target, seconds)
        done.append({"view": view, "file": str(target), "seconds": round(seconds, 3)})
    if options.save:
        bpy.ops.wm.save_as_mainfile(filepath=str(_path(options.save).resolve()), copy=True)
    if options.json:
        print(json.dumps({"pictures": done, "failed": failed}))
    return PARTIAL if failed and done else BAD_INPUT if failed else OK


def _bake(options: argparse.Namespace) -> int:
    from .files import ensure_folder

    folder = ensure_folder(_path(options.out, options.head))
    obj = _prepare(options, bare=False)
    if not obj.km_makeup.slots:
        raise MakeupError("There is no makeup to bake; give --look or --layer, or a .blend that has some.")
    start = time.perf_counter()
    report = _bake_into(obj, folder, options.finished, options.resolution, options.float)
    seconds = time.perf_counter() - start
    log.info("bake: %s, %.2f s", report or "nothing is painted", seconds)
    if options.json:
        files = {k: str(v) for k, v in report.files.items()} if report else {}
        print(json.dumps({"files": files, "seconds": round(seconds, 3)}))
    return OK


def _doctor(options: argparse.Namespace) -> int:
    _start(argparse.Namespace(products=[]))
    from .blender.doctor import examine

    findings = examine()
    if options.json:
        print(json.dumps([finding.__dict__ for finding in findings], indent=2))
    else:
        for finding in findings:
            print(f"{'ok ' if finding.good else 'BAD'} {finding.what}: {finding.detail}")
    return OK if all(finding.good for finding in findings) else BROKEN
