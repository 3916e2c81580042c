"""The main job: the sample head, bare and in its looks, in EEVEE and one look in Cycles, with times and a sheet.

With --lookbook all six looks, the three skins and the three lights; with --paper the figures of Huang et al. 2013 and a sheet of every product;
with --close-ups lips, a lid, nose, cheek and an ear, bare and made up, at four pixels and more a pore.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
sys.path.insert(0, str(HERE.parent))
sys.path.insert(0, str(HERE))

LOOKS = ("day", "evening")
CYCLES_LOOK = "evening"
LOOKBOOK_PARTS = ("looks", "skins", "lights")
PAPER_PARTS = ("spectra", "highlights", "faces", "products")
CLOSE_PARTS = ("close-ups", "relief")
LOOKBOOK = ("bare", "day", "evening", "stage", "editorial", "bridal")


def say(text: str, start: float) -> None:
    """A progress line with the time since the start."""
    print(f"[{time.perf_counter() - start:6.1f} s] {text}", flush=True)


def arguments() -> argparse.Namespace:
    """Options of the command."""
    parser = argparse.ArgumentParser(
        prog="sample_blend/run",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="example: sample_blend/run --size 800x1000 --samples 64 --out pictures",
    )
    parser.add_argument("--out", default=str(HERE.parent / "out"), help="folder for the pictures (default: out)")
    parser.add_argument("--size", default="400x500", help="pixels of each picture (default: 400x500)")
    parser.add_argument(
        "--samples", type=int, default=16, help="EEVEE samples (default: 16); Cycles takes twice as many"
    )
    parser.add_argument("--view", default="three-quarter", help="camera (default: three-quarter)")
    parser.add_argument("--looks", default=",".join(LOOKS), help="looks to render, with commas (default: day,evening)")
    parser.add_argument("--readme", action="store_true", help="also write the sheets that README.md shows")
    parser.add_argument(
        "--lookbook", action="store_true", help="all six looks, three skins and three lights, a sheet each"
    )
    parser.add_argument("--paper", action="store_true", help="the paper's Figures 3 and 7 to 10, and every product")
    parser.add_argument("--close-ups", action="store_true", help="lips, lid, nose, cheek, ear, bare and made up")
    parser.add_argument(
        "--only",
        metavar="PARTS",
        help=f"parts of these sheets, with commas: {', '.join((*LOOKBOOK_PARTS, *PAPER_PARTS, *CLOSE_PARTS))}",
    )
    parser.add_argument(
        "--engine", choices=("eevee", "cycles"), default="cycles", help="of these sheets (default: cycles)"
    )
    return parser.parse_args()


def main() -> int:
    """Run the main job; exit code 2 with one line on bad input."""
    options = arguments()
    from km_makeup.errors import MakeupError

    try:
        if options.paper or options.lookbook or options.close_ups or options.only:
            return more(options)
        return run(options)
    except MakeupError as error:
        print(f"sample_blend/run: {error}", file=sys.stderr)
        return 2


def more(options: argparse.Namespace) -> int:
    """The six looks, the paper's figures, close-ups, or parts of these."""
    start = time.perf_counter()
    parts = _parts(options)
    import paper

    from km_makeup import blender
    from km_makeup.blender import looks, makeup, sheets
    from km_makeup.effects import Engine
    from km_makeup.files import ensure_folder
    from km_makeup.makeup import Look

    blender.register()
    width, _, height = options.size.partition("x")
    engine = Engine.CYCLES if options.engine == "cycles" else Engine.EEVEE
    samples = options.samples * (2 if engine is Engine.CYCLES else 1)
    stage = paper.Stage(
        engine, (int(width), int(height)), samples, ensure_folder(Path(options.out)), lambda text: say(text, start)
    )
    if "looks" in parts:
        head, pictures = paper.open_sample(), []
        for name in LOOKBOOK:
            look = Look.load(HERE / "looks" / f"{name}.json")
            looks.apply_look(head, look)
            pictures.append((look.name, stage.picture(f"look-{name}", options.view)))
        makeup.remove(head)
        for sheet in [stage.out / "looks.png", *([HERE / "looks.png"] if options.readme else [])]:
            sheets.contact_sheet(pictures, sheet, columns=len(pictures))
            say(f"wrote {sheet.name}", start)
    for part in parts:
        if part != "looks":
            say(f"wrote {', '.join(path.name for path in paper.PARTS[part](stage))}", start)
    return 0


def _parts(options: argparse.Namespace) -> list[str]:
    """Which sheets are asked for; MakeupError where one is not known."""
    from km_makeup.errors import MakeupError

    known = (*LOOKBOOK_PARTS, *PAPER_PARTS, *CLOSE_PARTS)
    chosen = [part.strip() for part in (options.only or "").split(",") if part.strip()]
    for part in chosen:
        if part not in known:
            raise MakeupError(f"--only {part}: there is no such part; choose of {', '.join(known)}.")
    if chosen:
        return chosen
    wanted = (
        (options.lookbook, LOOKBOOK_PARTS),
        (options.paper, PAPER_PARTS),
        (options.close_ups, CLOSE_PARTS),
    )
    return [part for asked, these in wanted if asked for part in these]


def run(options: argparse.Namespace) -> int:
    """Open the head, bake and render, write the sheet."""
    start = time.perf_counter()
    import logging

    import bpy

    from km_makeup import blender
    from km_makeup.blender import baking, looks, makeup, rendering, sheets, studio
    from km_makeup.effects import Engine
    from km_makeup.files import ensure_folder
    from km_makeup.makeup import Look

    logging.basicConfig(level="INFO", format="%(message)s")
    blender.register()
    out = ensure_folder(Path(options.out))
    width, _, height = options.size.partition("x")
    head = studio.open_head(HERE / "head.blend", None, "Head").object
    say(f"opened sample_blend/head.blend: {len(head.data.vertices)} vertices", start)
    pictures: list[tuple[str, Path]] = []
    times: list[tuple[str, float]] = []

    def picture(name: str, caption: str, engine: Engine) -> None:
        samples = options.samples * (2 if engine is Engine.CYCLES else 1)
        say(f"rendering {caption}: {width}x{height}, {samples} samples ...", start)
        camera = studio.camera_for(head, options.view)
        shot = rendering.Shot(camera, engine, (int(width), int(height)), samples, 0, out / f"{name}.png")
        seconds = rendering.render(bpy.context.scene, shot)
        pictures.append((caption, shot.path))
        times.append((caption, seconds))
        say(f"wrote {shot.path.name} in {seconds:.1f} s", start)

    picture("bare-eevee", "bare skin, EEVEE", Engine.EEVEE)
    wanted = [name.strip() for name in options.looks.split(",") if name.strip()]
    for name in wanted:
        look = Look.load(HERE / "looks" / f"{name}.json")
        looks.apply_look(head, look)
        for layer in head.km_makeup.layers:
            say(
                f"{look.name}: {layer.name}, {layer.thickness_um:.3g} µm on {100 * layer.coverage:.1f} % of the map",
                start,
            )
        head.km_makeup.folder = str(out / "textures" / name)
        begun = time.perf_counter()
        report = baking.bake_all(head, bpy.context.scene)
        times.append((f"{look.name}: bake", time.perf_counter() - begun))
        say(f"{look.name}: baked {report}", start)
        picture(f"{name}-eevee", f"{look.name}, EEVEE", Engine.EEVEE)
        if name == CYCLES_LOOK or wanted == [name]:
            picture(f"{name}-cycles", f"{look.name}, Cycles", Engine.CYCLES)
    makeup.remove(head)
    picture("bare-cycles", "bare skin, Cycles", Engine.CYCLES)
    sheet = sheets.contact_sheet(pictures, out / "contact-sheet.png", columns=len(pictures))
    if options.readme:
        sheets.contact_sheet(pictures, HERE / "contact-sheet.png", columns=len(pictures))
    print("\nseconds  step")
    for what, seconds in times:
        print(f"{seconds:7.2f}  {what}")
    print(f"\n{len(pictures)} pictures and {sheet} in {time.perf_counter() - start:.1f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
