"""The command line, the same under ``python -m km_makeup`` and ``blender --command km_makeup``.

Exit codes: 0 all done, 1 unexpected error, 2 bad input (one line says what to do), 3 some of it failed.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import logging
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import MakeupError
from ..jobs import BakeJob, ExportJob, HeadJob, RenderJob
from . import plan
from .parts import (
    BAD_INPUT,
    BROKEN,
    OK,
    PARTIAL,
    add_head_arguments,
    between,
    blender_aside,
    head_of,
    more_products,
    path_of,
    size_of,
)

if TYPE_CHECKING:
    from ..accuracy.commands import SceneLadders, SceneRequest

EXAMPLES = {
    "render": "example:\n  km_makeup render head.obj --skin albedo.png --layer lipstick-classic-red=lips.png@15um --out face.png\n"
    "  km_makeup render head.blend --look look.json --view front,close-up --reference 512 --out pictures\n"
    "  km_makeup render head.blend --look look.json --diffuse --out glowing.png",
    "bake": "example:\n  km_makeup bake head.blend --look look.json --resolution 4096 --out textures",
    "export": "example:\n  km_makeup export head.blend --look look.json --out exported --gltf",
    "plan": "examples:\n  km_makeup plan head.blend\n  km_makeup plan head.blend --look look.json --engine cycles --tolerance 1 --json",
    "doctor": "example:\n  km_makeup doctor\n  km_makeup doctor head.blend",
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
    about = "list the effects that a head's pictures call for, with reasons"
    plan.add_arguments(_command(commands, "plan", about, plan.run))
    doctor = _command(
        commands, "doctor", "check Blender, packages, products, a computation, and a head's file", _doctor
    )
    doctor.add_argument(
        "head", nargs="?", help="also look for what makes pictures of this head's file slow without need"
    )
    from ..accuracy.commands import add_accuracy_command
    from .looks import add_look_command

    add_look_command(commands)
    from ..lookbook import add_lookbook_command

    add_lookbook_command(commands, blender_aside)
    from ..products.commands import add_products_command

    add_products_command(commands)
    add_accuracy_command(commands, _open_scene)
    return top


def _open_scene(request: SceneRequest) -> SceneLadders:
    """The ladders of pictures, which Blender makes."""
    with blender_aside():
        from ..blender.measuring import open_scene

        return replace(open_scene(request), aside=blender_aside)


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


def _render_parser(sub: argparse.ArgumentParser) -> None:
    add_head_arguments(sub)
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
    plan.add_diffusion_argument(sub)
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
    plan.add_effects_arguments(sub)


def _bake_parser(sub: argparse.ArgumentParser) -> None:
    add_head_arguments(sub)
    sub.add_argument("--resolution", type=int, default=0, help="width and height in texels (default: the maps')")
    sub.add_argument("--finished", action="store_true", help="also the finished albedo over the skin's texture")
    sub.add_argument("--float", action="store_true", help="32-bit textures instead of 16-bit half floats")
    plan.add_effects_arguments(sub)
    sub.add_argument("--out", default="makeup_textures", help="folder for the textures (default: makeup_textures)")


def _export_parser(sub: argparse.ArgumentParser) -> None:
    add_head_arguments(sub)
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


def _not_over_an_input(out: Path, head: HeadJob) -> None:
    """MakeupError where the picture would replace the skin's texture or a map."""
    inputs = [head.skin, *(Path(layer.map) for layer in head.look.layers if layer.map)]
    if any(path and path.resolve() == out.resolve() for path in inputs):
        raise MakeupError(f"--out {out} would replace a picture that it is made from; choose another name.")


def _render(options: argparse.Namespace) -> int:
    more_products(options.products)
    views = list(dict.fromkeys(view.strip() for view in options.view.split(",") if view.strip()))
    if not views:
        raise MakeupError("--view names no view; use front, three-quarter, close-up or a camera's name.")
    out = path_of(options.out, options.head)
    save = path_of(options.save, options.head) if options.save else None
    if len(views) > 1 and out.suffix.lower() in (".png", ".exr"):
        raise MakeupError(f"--out {options.out} is one picture, but there are {len(views)} views; give a folder.")
    if save and save.suffix.lower() != ".blend":
        raise MakeupError(f"--save {options.save}: scenes are saved as .blend; choose this suffix.")
    if options.reference and options.engine == "cycles":
        raise MakeupError("--reference compares with Cycles; use it with --engine eevee.")
    if options.diffuse is not None and options.engine == "cycles":
        raise MakeupError("--diffuse is EEVEE's; Cycles scatters light in the skin itself: leave one of them out.")
    head = head_of(options)
    _not_over_an_input(out, head)
    job = RenderJob(
        head=head,
        engine=options.engine,
        colour=options.colour,
        bare=options.bare,
        size=size_of(options.size),
        samples=between(options.samples, "--samples", 1, 2**24),
        seed=between(options.seed, "--seed", 0, 2**31 - 1),
        targets={views[0]: out} if len(views) == 1 and out.suffix else {v: out / f"{v}.png" for v in views},
        save=save,
        reference_samples=between(options.reference, "--reference", 0, 2**24),
        effects=plan.effects_of(options),
    )
    with blender_aside():
        from ..blender.commands import run_render

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
    more_products(options.products)
    job = BakeJob(
        head=head_of(options),
        folder=path_of(options.out, options.head),
        resolution=between(options.resolution, "--resolution", 0, 16384),
        finished=options.finished,
        full_float=options.float,
        effects=plan.effects_of(options),
    )
    with blender_aside():
        from ..blender.commands import run_bake

        files, seconds = run_bake(job)
    if options.json:
        print(json.dumps({"files": {k: str(v) for k, v in files.items()}, "seconds": round(seconds, 3)}))
    else:
        for path in files.values():
            print(path)
    return OK


def _export(options: argparse.Namespace) -> int:
    more_products(options.products)
    if options.gltf and options.exr:
        raise MakeupError("--gltf holds 8-bit PNG textures; leave --exr away, or export twice.")
    job = ExportJob(
        head=head_of(options),
        folder=path_of(options.out, options.head),
        exr=options.exr,
        gltf=options.gltf,
        before=options.before,
        resolution=between(options.resolution, "--resolution", 0, 16384),
    )
    with blender_aside():
        from ..blender.commands import run_export

        files = run_export(job)
    if options.json:
        print(json.dumps({"files": [str(file) for file in files]}))
    else:
        for file in files:
            print(file)
    return OK


def _doctor(options: argparse.Namespace) -> int:
    with blender_aside():
        from ..blender.commands import run_doctor

        findings = run_doctor(path_of(options.head) if options.head else None)
    if options.json:
        print(json.dumps([finding.__dict__ for finding in findings], indent=2))
    else:
        for finding in findings:
            print(f"{'ok ' if finding.good else 'BAD'} {finding.what}: {finding.detail}")
    return OK if all(finding.good for finding in findings) else BROKEN
