"""The same picture path traced in Cycles, and how far the picture is from it.

Four renders: a mask of the head, the scene as it is, and Cycles twice with half the samples and different seeds. The
mean of the two is the reference; what they differ by is its grain. Every setting that is changed is put back.

In the reference the films are a surface of their own above the skin wherever they can be (`film_shell`), so that light which
enters the skin beside a film and leaves under it pays once.
"""

from __future__ import annotations

import json
import math
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..accuracy import PictureDifference, compare_pictures, map_colours, noise_floor
from ..bake.files import read_image, write_exr, write_png
from ..errors import MakeupError
from ..files import write_text
from . import compositor
from .film_shell import FilmShell, obstacle, shell_over
from .lamps import irradiance_at
from .sheets import contact_sheet

SAMPLES = 256
TRANSPARENT_BOUNCES = 64
"""Surfaces that light passes in a straight line at least: every shell is one."""
FULL_DELTA_E, FULL_FLIP = 10.0, 0.5
"""What is drawn as the brightest colour of a difference map."""


class Restoring:
    """Properties changed for a while: `set` remembers what was there, `restore` puts it back.

    In the order of the changes, since a depth of colour exists only in the file format that was there.
    """

    def __init__(self) -> None:
        self._kept: dict[tuple[int, str], tuple[bpy.types.bpy_struct, str, object]] = {}

    def set(self, owner: bpy.types.bpy_struct, **values: object) -> None:
        """Change properties of a Blender object; all are read before the first is changed, which may change others."""
        for name in values:
            self._kept.setdefault((owner.as_pointer(), name), (owner, name, getattr(owner, name)))
        for name, value in values.items():
            setattr(owner, name, value)

    def before(self, owner: bpy.types.bpy_struct, name: str) -> Any:
        """What a property was before the first change."""
        kept = self._kept.get((owner.as_pointer(), name))
        return kept[2] if kept else getattr(owner, name)

    def restore(self) -> None:
        """Everything as it was."""
        for owner, name, value in self._kept.values():
            setattr(owner, name, value)
        self._kept.clear()


@dataclass(frozen=True)
class ReferenceReport:
    """Files written, the picture's difference from the reference on the head, the reference's own grain, and the white.

    ``films``: how the reference draws them, in words.
    """

    files: dict[str, Path]
    difference: PictureDifference
    grain: PictureDifference
    white: tuple[float, float, float]
    seconds: dict[str, float]
    films: str = ""

    def __str__(self) -> str:
        return f"{self.difference}; grain of the reference ΔE2000 {self.grain.delta_e}; films {self.films}"

    def plain(self) -> dict[str, object]:
        """As JSON takes it."""
        return {
            "difference": self.difference.plain(),
            "grain": self.grain.plain(),
            "white": list(self.white),
            "films": self.films,
            "seconds": {name: round(value, 3) for name, value in self.seconds.items()},
            "files": {name: path.name for name, path in self.files.items()},
        }


class ReferenceRun:
    """The renders of a reference, one after the other: `prepare`, render, `collect`, until `prepare` says there is none.

    Without ``picture`` the scene as it is is not rendered, and there is nothing to `write`.
    ``restore`` must be called whatever happens. Raises MakeupError where there is nothing to compare with.
    """

    def __init__(
        self, scene: bpy.types.Scene, obj: bpy.types.Object, samples: int = SAMPLES, seed: int = 0, picture: bool = True
    ) -> None:
        engine: str = scene.render.engine
        if engine == "CYCLES":
            raise MakeupError(
                "The scene renders in Cycles, which is the reference itself; set the engine to EEVEE first."
            )
        if scene.camera is None:
            raise MakeupError(f"The scene {scene.name!r} has no camera; add one.")
        self.scene, self.obj, self.samples, self.seed = scene, obj, samples, seed
        self.pictures: dict[str, NDArray[np.float32]] = {}
        self.seconds: dict[str, float] = {}
        self._settings, self._started = Restoring(), 0.0
        self._rebuilt = False
        self._shell: FilmShell | None = None
        self.films = ""
        self._stages: list[tuple[str, Callable[[], None]]] = [
            *([("picture", lambda: None)] if picture else []),  # first: the others may rebuild the materials for Cycles
            ("mask", self._prepare_mask),
            ("reference", lambda: self._prepare_cycles(seed)),
            ("again", lambda: self._prepare_cycles(seed + 1)),
        ]
        self.count, self.current = len(self._stages), ""

    @property
    def left(self) -> int:
        """How many renders there are to come after this one."""
        return len(self._stages)

    def prepare(self) -> bool:
        """Set the scene up for the next render; False when all are made."""
        self._settings.restore()
        self._take_shell_off()
        if not self._stages:
            return False
        self.current, set_up = self._stages.pop(0)
        set_up()
        self._started = time.perf_counter()
        return True

    def collect(self) -> None:
        """Take the picture that was just rendered."""
        self.seconds[self.current] = time.perf_counter() - self._started
        self.pictures[self.current] = rendered(self.scene)
        if self.current == "mask" and self.pictures["mask"][..., 3].max() <= 0.5:
            raise MakeupError(
                f"{self.obj.name!r} is not in the picture of the camera {self.scene.camera.name!r}; aim it at the head."
            )

    def render(self) -> None:
        """All renders at once, without a window; the scene is as it was afterwards, whatever happens."""
        try:
            while self.prepare():
                bpy.ops.render.render()
                self.collect()
        finally:
            self.restore()

    def restore(self) -> None:
        """The scene as it was."""
        self._settings.restore()
        self._take_shell_off()
        if self._rebuilt:
            self._rebuild()
            self._rebuilt = False

    def write(self, target: Path) -> ReferenceReport:
        """Compare and write the reference, the maps, a sheet of all and the figures beside ``target`` (a .png or .exr)."""
        first, second = self.pictures["reference"], self.pictures["again"]
        picture, reference = self.pictures["picture"], (first + second) / 2
        white = white_of(self.scene, self.obj)
        options = {
            "mask": self.pictures["mask"][..., 3],
            "white": white,
            "space": bpy.data.colorspace.working_space,
        }
        report = ReferenceReport(
            files={name: target.with_name(f"{target.stem}_{name}{suffix}") for name, suffix in FILES.items()},
            difference=compare_pictures(picture, reference, **options),
            grain=noise_floor(first, second, averaged=True, **options),
            white=white,
            seconds=self.seconds,
            films=self.films,
        )
        return _write(self.scene, report, picture, reference)

    def _prepare_mask(self) -> None:
        """The head alone, and what hides it: one sample of Cycles, all other objects cut out."""
        settings, scene = self._settings, self.scene
        self._plain_cycles(1, self.seed)
        settings.set(scene.render, film_transparent=True, use_compositing=False)
        settings.set(scene.cycles, max_bounces=0)
        for other in scene.objects:
            if other != self.obj and not other.is_holdout:
                settings.set(other, is_holdout=True)

    def _prepare_cycles(self, seed: int) -> None:
        self._plain_cycles(max(1, self.samples // 2), seed)
        node = compositor.find(self.scene)
        if node is not None and not node.mute:
            self._settings.set(node, mute=True)  # Cycles scatters light in the skin by itself
        problem = obstacle(self.obj)
        if problem is None:
            bounces = max(self.scene.cycles.transparent_max_bounces, TRANSPARENT_BOUNCES)
            self._settings.set(self.scene.cycles, transparent_max_bounces=bounces)
            self._shell = shell_over(self.obj, self.scene)
        self.films = "a shell above the skin" if problem is None else f"in the skin's own surface: {problem}"

    def _take_shell_off(self) -> None:
        if self._shell is not None:
            self._shell.remove()
            self._shell = None

    def _plain_cycles(self, samples: int, seed: int) -> None:
        settings, scene = self._settings, self.scene
        settings.set(scene.render, engine="CYCLES")
        settings.set(
            scene.cycles,
            samples=samples,
            seed=seed,
            use_animated_seed=False,
            use_denoising=False,
            use_adaptive_sampling=False,
            sample_clamp_direct=0.0,
            sample_clamp_indirect=0.0,
        )
        if not self.obj.km_makeup.both_engines and self.obj.km_makeup.slots:
            self._rebuilt = True
            self._rebuild()

    def _rebuild(self) -> None:
        """Materials of a head that has them for the scene's engine only."""
        from .makeup import refresh

        refresh(self.obj, self.scene)


FILES = {
    "reference": ".exr",
    "delta_e": ".png",
    "flip": ".png",
    "comparison": ".png",
    "difference": ".json",
}


def make_reference(
    scene: bpy.types.Scene, obj: bpy.types.Object, target: Path, samples: int = SAMPLES, seed: int = 0
) -> ReferenceReport:
    """All at once, without a window: the report, the files beside ``target``."""
    run = ReferenceRun(scene, obj, samples, seed)
    run.render()
    return run.write(target)


def white_of(scene: bpy.types.Scene, obj: bpy.types.Object) -> tuple[float, float, float]:
    """What a white card at the head's middle reads that faces the strongest lamp, shadows left aside; 1 without any light.

    The world counts with its background colour where it is plain.
    """
    from .highlights import lamps_for

    place = sum((obj.matrix_world @ Vector(corner) for corner in obj.bound_box), Vector()) / 8
    lamps = lamps_for(obj, scene).chosen
    total = np.zeros(3)
    for lamp in lamps:
        cosine = max(0.0, _towards(lamps[0], place).dot(_towards(lamp, place)))
        total += cosine * np.array(irradiance_at(lamp, place)) / math.pi
    tree = scene.world.node_tree if scene.world else None
    for node in tree.nodes if tree else ():
        if node.bl_idname == "ShaderNodeBackground" and not node.inputs["Color"].is_linked:
            total += np.array(node.inputs["Color"].default_value[:3]) * node.inputs["Strength"].default_value
    if total.min() <= 0:
        return 1.0, 1.0, 1.0
    return float(total[0]), float(total[1]), float(total[2])


def _towards(lamp: bpy.types.Object, place: Vector) -> Vector:
    if lamp.data.type == "SUN":
        return lamp.matrix_world.to_quaternion() @ Vector((0, 0, 1))
    return (lamp.matrix_world.translation - place).normalized()


def rendered(scene: bpy.types.Scene) -> NDArray[np.float32]:
    """The picture that was just rendered, linear, (height, width, 4), top row first."""
    settings = Restoring()
    target = scene.render.image_settings
    settings.set(target, media_type="IMAGE", file_format="OPEN_EXR", color_depth="32", color_mode="RGBA")
    try:
        with tempfile.TemporaryDirectory(prefix="km-reference-") as folder:
            file = Path(folder) / "rendered.exr"
            bpy.data.images["Render Result"].save_render(str(file), scene=scene)
            return read_image(file)[0].astype(np.float32)
    finally:
        settings.restore()


def _write(
    scene: bpy.types.Scene, report: ReferenceReport, picture: NDArray[np.float32], reference: NDArray[np.float32]
) -> ReferenceReport:
    files = dict(report.files)
    write_exr(files["reference"], reference[::-1, :, :3], half=False)
    write_png(files["delta_e"], map_colours(report.difference.delta_e_map, FULL_DELTA_E)[::-1])
    if report.difference.flip_map is None:
        del files["flip"]
    else:
        write_png(files["flip"], map_colours(report.difference.flip_map, FULL_FLIP)[::-1])
    with tempfile.TemporaryDirectory(prefix="km-reference-") as folder:
        shown = {name: Path(folder) / f"{name}.png" for name in ("picture", "reference")}
        as_seen(scene, picture, shown["picture"])
        as_seen(scene, reference, shown["reference"])
        mean = report.difference.delta_e.mean
        rows = [
            ("Picture", shown["picture"]),
            ("Cycles", shown["reference"]),
            (f"ΔE2000, mean {mean:.2f}, white {FULL_DELTA_E:g}", files["delta_e"]),
        ]
        if "flip" in files and report.difference.flip:
            rows.append((f"FLIP, mean {report.difference.flip.mean:.3f}, white {FULL_FLIP:g}", files["flip"]))
        contact_sheet(rows, files["comparison"], len(rows))
    found = replace(report, files=files)
    write_text(files["difference"], json.dumps(found.plain(), indent=1) + "\n")
    return found


def as_seen(scene: bpy.types.Scene, pixels: NDArray[np.float32], file: Path) -> None:
    """A PNG of linear pixels under the scene's view settings."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("KM Reference", width, height, alpha=False, float_buffer=True)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels[::-1, :, :3]
    settings = Restoring()
    target = scene.render.image_settings
    settings.set(target, media_type="IMAGE", file_format="PNG", color_depth="8", color_mode="RGB")
    try:
        image.pixels.foreach_set(rgba.reshape(-1))
        image.update()
        image.save_render(str(file), scene=scene)
    finally:
        settings.restore()
        bpy.data.images.remove(image)
