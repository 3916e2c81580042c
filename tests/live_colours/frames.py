"""What live films cost a frame of EEVEE, and their noise, beside the plain skin, in one run.

    python -m tests.live_colours.frames --result     (writes tests/results/live_frames.md)

Skin fills most of 1280x720. Frames without a head, of the plain skin and of 1, 2 and 4 films over all of it take turns. A frame's time
is what two samples more take: what starting a render costs (maps to the card, the picture's file) is in neither. Each is the least of
its rounds, less that of the empty scene. Time is the processor's, of all threads: rendering is in software, and other jobs on the
machine do not count. Exit status: 0 within the bound, 1 beyond it, 2 bad arguments.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests import stamps

SIZE = (1280, 720)
SMALL = (320, 180)
"""Where noise is judged."""

FILMS = ("foundation-light", "blush-rose", "setting-powder", "lipstick-classic-red")
COUNTS = (0, 1, 2, 4)
MOST, LEAST_SKIN = 1.12, 0.6
"""Bounds: a frame of four films over one of plain skin; the share of the frame that is skin."""

FEW, MORE = 1, 3
"""Samples of the two pictures whose times are compared."""

SAMPLES, MANY = 4, 32
"""Samples of the two pictures whose difference is the noise."""

COVERS = [
    "km_makeup/blender/nodes/groups.py", "km_makeup/blender/nodes/weights.py", "km_makeup/blender/shaders.py",
    "km_makeup/blender/lobes.py", "tests/live_colours/frames.py",
]  # fmt: skip


def heads() -> dict[int, object]:
    """By number of films a ball that fills the frame, made up with as many; all of them hidden."""
    import bmesh
    import bpy

    from tests.blender import scenes
    from tests.live_colours import tiles

    tiles.empty_scene()
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    scenes.studio()
    bpy.context.scene.camera.location = (0, -0.2, 0)
    rng = np.random.default_rng(5)
    coarse = rng.integers(60, 256, (64, 64), dtype=np.uint8)
    found = {}
    for count in COUNTS:
        mesh = bpy.data.meshes.new(f"{count} films")
        shape = bmesh.new()
        shape.loops.layers.uv.new("UVMap")
        bmesh.ops.create_uvsphere(shape, u_segments=128, v_segments=64, radius=0.1, calc_uvs=True)
        shape.to_mesh(mesh)
        shape.free()
        mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
        obj = bpy.data.objects.new(mesh.name, mesh)
        bpy.context.scene.collection.objects.link(obj)
        material = scenes.skin(f"Skin {count}", textured=True)
        mesh.materials.append(material)
        if count:
            _make_up(obj, FILMS[:count], np.kron(coarse, np.ones((16, 16), np.uint8)))
        obj.hide_render = True
        found[count] = obj
    return found


def _make_up(obj, products, values: NDArray) -> None:
    from km_makeup.blender import images, makeup
    from km_makeup.blender.library import library
    from km_makeup.blender.update import paused

    makeup.set_up(obj)
    with paused():
        for number, product in enumerate(products):
            layer = obj.km_makeup.layers.add()
            layer.name, layer.product, layer.thickness_um = product, product, library().find(product).thickness_um
            layer.map = images.image_from_map(f"{obj.name} {number}", np.rot90(values, number))
    makeup.refresh(obj)


class Frames:
    """Renders the scene with one of the heads, or none (-1)."""

    def __init__(self, folder: Path) -> None:
        import bpy

        self.heads = heads()
        self.scene, self.folder = bpy.context.scene, folder
        self.scene.render.film_transparent = True

    def picture(self, count: int, size: tuple[int, int], samples: int) -> tuple[NDArray, float]:
        """The picture (height, width, 4) and the processor's seconds that it took."""
        import bpy
        import OpenImageIO

        settings = self.scene.render
        settings.resolution_x, settings.resolution_y, settings.resolution_percentage = *size, 100
        self.scene.eevee.taa_render_samples = samples
        settings.image_settings.media_type = "IMAGE"
        settings.image_settings.file_format, settings.image_settings.color_depth = "OPEN_EXR", "32"
        settings.image_settings.color_mode = "RGBA"
        file = self.folder / "frame.exr"
        settings.filepath, settings.use_file_extension = str(file), False
        for number, obj in self.heads.items():
            obj.hide_render = number != count
        start = time.process_time()
        bpy.ops.render.render(write_still=True)
        lasted = time.process_time() - start
        return OpenImageIO.ImageInput.open(str(file)).read_image("float").astype(np.float64), lasted


def noise(frames: Frames, count: int) -> float:
    """Rms of a frame's difference from one of many samples, over its mean, on the skin."""
    few, _ = frames.picture(count, SMALL, SAMPLES)
    many, _ = frames.picture(count, SMALL, MANY)
    skin = many[..., 3] > 0.999
    skin &= np.roll(skin, 2, 0) & np.roll(skin, -2, 0) & np.roll(skin, 2, 1) & np.roll(skin, -2, 1)
    return float(np.sqrt(((few - many)[skin][:, :3] ** 2).mean()) / many[skin][:, :3].mean())


def measure(rounds: int) -> tuple[dict[int, list[float]], dict[int, float], float]:
    """Processor seconds of each kind of frame in every round, noise, and the share of the frame that is skin."""
    with tempfile.TemporaryDirectory(prefix="km_makeup-frames-") as folder:
        frames = Frames(Path(folder))
        picture = None
        for count in COUNTS:  # compiles the shaders
            picture, lasted = frames.picture(count, SIZE, 1)
            print(f"{count} films: {lasted:.0f} s with its shaders", file=sys.stderr, flush=True)
        assert picture is not None
        share = float((picture[..., 3] > 0.5).mean())
        seconds: dict[int, list[float]] = {count: [] for count in (-1, *COUNTS)}
        for number in range(rounds):
            for count in (list(seconds), list(seconds)[::-1])[number % 2]:
                few, more = (frames.picture(count, SIZE, samples)[1] for samples in (FEW, MORE))
                seconds[count].append((more - few) / (MORE - FEW))
            print(f"round {number + 1}: {seconds}", file=sys.stderr, flush=True)
        return seconds, {count: noise(frames, count) for count in COUNTS}, share


def report(seconds: dict[int, list[float]], noises: dict[int, float], share: float) -> tuple[str, bool]:
    """The table, and whether the bounds hold.

    What other work there is makes a frame slower, never faster: the least of the rounds is the least disturbed. Beside it the
    middle of the rounds' own ratios, whose frames were disturbed alike.
    """
    empty = np.array(seconds[-1])
    own = {count: np.array(seconds[count]) - empty for count in COUNTS}
    least = {count: min(seconds[count]) - empty.min() for count in COUNTS}
    ratios = {count: least[count] / least[0] for count in COUNTS}
    paired = {count: float(np.median(own[count] / own[0])) for count in COUNTS}
    text = (
        f"EEVEE, {SIZE[0]}x{SIZE[1]}, a sample (({MORE} less {FEW}) / {MORE - FEW}), software rendering, seconds of the processor; skin fills {share:.0%}. "
        f"The least of {len(seconds[0])} rounds, and the median of the ratios within each; that of the empty scene ({empty.min():.2f} s) taken off. "
        f"Noise at {SAMPLES} samples against {MANY}, over the mean colour.\n\n"
        "| films | least seconds | over plain skin | median of the rounds' ratios | slowest round, s | noise | over plain skin |\n"
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |\n"
    )
    for count in COUNTS:
        text += (
            f"| {count or 'plain skin'} | {least[count]:.2f} | {ratios[count]:.3f} | {paired[count]:.3f} | {own[count].max():.2f} | "
            f"{noises[count]:.4f} | {noises[count] / noises[0]:.2f} |\n"
        )
    return text, ratios[4] <= MOST and paired[4] <= MOST and share >= LEAST_SKIN


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.live_colours.frames",
        description="Time and noise of EEVEE's frames with 1, 2 and 4 live films, over the plain skin's.",
        epilog="Example: python -m tests.live_colours.frames --rounds 3 --result",
    )
    parser.add_argument("--rounds", type=int, default=3, help="frames of each kind (3)")
    parser.add_argument("--result", action="store_true", help="write tests/results/live_frames.md")
    arguments = parser.parse_args()
    if arguments.rounds < 1:
        parser.error("--rounds must be at least 1")
    text, holds = report(*measure(arguments.rounds))
    print(text)
    if arguments.result:
        command = f"python -m tests.live_colours.frames --rounds {arguments.rounds} --result"
        stamps.write_markdown("live_frames.md", "What live films cost a frame", command, COVERS, text)
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
