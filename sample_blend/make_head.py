"""Make the sample head: ``sample_blend/head.blend``, its cosmetic maps and looks.

    .venv/bin/python sample_blend/make_head.py [--out FOLDER] [--quick] [--skin light|medium|deep]
    .venv/bin/python sample_blend/make_head.py --check      whether head.blend and the maps are what the script makes

Run with bpy 5.0.1, so that Blender 5.0 and 5.2 both open the file. Needs NumPy, SciPy, Pillow and colour-science, and
../shared/spectra/chromophores. The same contents every time.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
CHROMOPHORES = HERE.parents[1] / "shared" / "spectra" / "chromophores"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--out", type=Path, default=HERE, help="folder for head.blend and looks/ (default: sample_blend)"
    )
    parser.add_argument("--quick", action="store_true", help="albedo 512 texels wide, for a look at the shape")
    parser.add_argument(
        "--skin", choices=("light", "medium", "deep"), default="light", help="the skin's melanin (default: light)"
    )
    parser.add_argument("--check", action="store_true", help="make it elsewhere and compare; exit code 1 if it differs")
    arguments = parser.parse_args()
    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km-makeup-"))
    sys.path.insert(0, str(HERE))
    if arguments.check:
        return check(arguments)
    make(arguments)
    return 0


def make(arguments: argparse.Namespace) -> None:
    """Build the scene in the open Blender and save it, with looks and maps, in the folder."""
    from head import atlas, ear, maps, mesh, scene, textures

    start = time.perf_counter()

    def say(what: str) -> None:
        print(f"{time.perf_counter() - start:6.1f} s  {what}", flush=True)

    say("laying the mesh on the anatomy")
    half = mesh.build()
    ear.add(half)
    whole = mesh.mirrored(half)
    say(f"{len(whole.vertices)} vertices, {len(whole.faces)} faces; cosmetic maps")
    arguments.out.mkdir(parents=True, exist_ok=True)
    small = atlas.make(half, 1024)
    maps.write(small, arguments.out / "looks")
    say("skin and eye pictures")
    tile = atlas.make(half, 512 if arguments.quick else 2048)
    skin, detail = textures.albedo(tile, CHROMOPHORES, textures.SKINS[arguments.skin]), textures.detail(tile)
    eye = textures.eye()
    say("scene")
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    with tempfile.TemporaryDirectory() as folder:
        pictures = Path(folder)
        scene.head(
            whole,
            scene.picture("skin-albedo", skin, pictures),
            scene.picture("skin-detail", detail, pictures, colour=False),
        )
        for other, melanin in textures.SKINS.items():
            if other != arguments.skin and not arguments.quick:
                image = scene.picture(f"skin-albedo-{other}", textures.albedo(small, CHROMOPHORES, melanin), pictures)
                image.use_fake_user = True
        scene.eyes(scene.picture("eye", eye, Path(folder)), half)
        scene.hair(half)
        scene.lights()
        scene.cameras()
        scene.settings()
        scene.opening()
        scene.save(arguments.out.resolve() / "head.blend")
    say(f"wrote {arguments.out / 'head.blend'}")


def check(arguments: argparse.Namespace) -> int:
    """Make everything in a temporary folder; the exit code tells whether head.blend and the maps hold the same."""
    import bpy
    from head.contents import contents, differences, pictures, unlike
    from PIL import Image, ImageChops

    with tempfile.TemporaryDirectory() as folder:
        arguments.out = Path(folder)
        make(arguments)
        bpy.ops.wm.open_mainfile(filepath=str(arguments.out / "head.blend"))
        made, painted = contents(), pictures()
        bpy.ops.wm.open_mainfile(filepath=str(HERE / "head.blend"))
        different = differences(made, contents()) + unlike(painted, pictures())
        for path in sorted((arguments.out / "looks").rglob("*.png")):
            other = HERE / path.relative_to(arguments.out)
            if not other.exists() or ImageChops.difference(Image.open(other), Image.open(path)).getbbox():
                different.append(str(path.relative_to(arguments.out)))
    size = (HERE / "head.blend").stat().st_size / 1e6
    print(
        f"{len(made) + len(painted)} data-blocks, {len(different)} differ: {', '.join(different) or 'none'}; {size:.1f} MB committed"
    )
    return int(bool(different))


if __name__ == "__main__":
    sys.exit(main())
