"""Random scenes for the plan: heads, cameras, lights and looks, drawn by a seed; built and rendered in the open Blender."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared" / "heads"
HEADS = {
    "lee": (SHARED / "lee_perry_smith" / "LeePerrySmith.obj", SHARED / "lee_perry_smith" / "Map-COL.jpg"),
    "light": (SHARED / "makehuman" / "head_female_caucasian.obj", None),
    "dark": (SHARED / "makehuman" / "head_female_african.obj", None),
    "mask": (SHARED / "mediapipe_face" / "canonical_face_model.obj", None),
}
LIGHTS = ("studio", "sun", "point", "soft", "world")
VIEWS = ("front", "three-quarter", "close-up")
TOLERANCES = (0.1, 0.5, 2.0)
SIZES = {"eevee": (120, 90), "cycles": (40, 30)}
SAMPLES = {"eevee": 4, "cycles": 8192}
"""EEVEE draws the same samples for all pictures, so few do. Cycles' noise must not hide what is looked for: two seeds of 2048 samples
differ by .53 (point lamp) to 1.05 (world), 99th percentile of a face, of 16384 by .43 to .53 in soft light and sun."""

SHADOW = 1e-3
"""Resolution of shadows in metres: finer than these pictures' pixels, and quick."""

GREY = 0.18
THINNEST_UM, THICKEST_UM = 0.02, 25.0


@dataclass(frozen=True)
class Painted:
    """A layer: product, thickness in µm, what its map shows, and whether it has a finish of its own."""

    product: str
    thickness_um: float
    paint: str
    seed: int


@dataclass(frozen=True)
class Case:
    """A scene: head, view and how many times farther than usual the camera is, light, look, engine, and how it is built."""

    number: int
    head: str
    view: str
    away: float
    light: str
    layers: tuple[Painted, ...]
    engine: str
    path: str
    scattering: str
    highlight: str

    def __str__(self) -> str:
        films = ", ".join(f"{one.product} {one.thickness_um:.3g} µm {one.paint}" for one in self.layers)
        built = " ".join(
            x.lower() for x in (self.path, self.scattering, self.highlight) if x not in ("CLOSURES", "LOBES")
        )
        return f"{self.head}, {self.view} x{self.away:g}, {self.light}, {self.engine} {built}, {films}"


def draw(seed: int, count: int, products: list[str]) -> list[Case]:
    """``count`` scenes: heads and engines take turns, everything else is drawn."""
    random = np.random.default_rng(seed)
    cases = []
    for number in range(count):
        engine = "cycles" if number % 5 == 4 else "eevee"
        screen = engine == "eevee" and random.random() < 0.4
        layers = []
        for _ in range(int(random.integers(1, 4))):
            thickness = math.exp(random.uniform(math.log(THINNEST_UM), math.log(THICKEST_UM)))
            paint = str(random.choice(["blobs", "blobs", "all", "faint", "empty"], p=[0.3, 0.25, 0.2, 0.15, 0.1]))
            layers.append(Painted(str(random.choice(products)), thickness, paint, int(random.integers(1 << 30))))
        cases.append(
            Case(
                number,
                list(HEADS)[number * len(HEADS) // count],
                str(random.choice(VIEWS)),
                float(random.choice([1.0, 1.0, 2.5, 6.0])),
                str(random.choice(LIGHTS)),
                tuple(layers),
                engine,
                "BAKED" if random.random() < 0.5 else "LIVE",
                "SCREEN" if screen else "CLOSURES",
                "LAMPS" if engine == "eevee" and not screen and random.random() < 0.1 else "LOBES",
            )
        )
    return cases


def paint(kind: str, seed: int, size: int = 512) -> NDArray[np.uint8]:
    """A map: soft blobs, thin paint, all of the map, or nothing."""
    if kind == "empty":
        return np.zeros((size, size), np.uint8)
    if kind == "all":
        return np.full((size, size), 255, np.uint8)
    random = np.random.default_rng(seed)
    y, x = np.mgrid[0:size, 0:size] / size
    values = np.zeros((size, size))
    for _ in range(6):
        cx, cy, r = random.uniform(0.1, 0.9), random.uniform(0.1, 0.9), random.uniform(0.05, 0.25)
        values = np.maximum(values, np.clip(1.5 - np.hypot(x - cx, y - cy) / r, 0, 1))
    return np.rint(255 * values * (0.15 if kind == "faint" else 1)).astype(np.uint8)


class Stage:
    """A head in the open Blender, whose cameras, lamps and makeup are changed from case to case."""

    def __init__(self, head: str, folder: Path, size: tuple[int, int] | None = None, samples: int = 0) -> None:
        from km_makeup.blender import studio
        from km_makeup.blender.commands import ensure_registered

        ensure_registered()
        path, skin = HEADS[head]
        self.obj = studio.open_head(path, skin, None).object
        self.folder, self.size, self.samples = folder, size, samples

    def ready(self, case: Case) -> NDArray:
        """The case's scene with its layers, nothing built; what a white card sends back in its light."""
        import bpy

        from km_makeup.blender.reference import white_of

        self.set(case)
        self.dress(case)
        return np.array(white_of(bpy.context.scene, self.obj))

    def set(self, case: Case) -> None:
        """Camera, light, makeup and settings of a case; planning and building are left to `build`."""
        import bpy

        from km_makeup.blender import rendering, studio
        from km_makeup.effects import Engine

        scene = bpy.context.scene
        _light(scene, self.obj, case.light)
        for old in [one for one in scene.objects if one.type == "CAMERA"]:
            bpy.data.objects.remove(old)
        camera = studio.camera_for(self.obj, case.view)
        target = studio.nose_tip(self.obj)
        camera.location = target + (camera.location - target) * case.away
        scene.camera = camera
        size, samples = self.size or SIZES[case.engine], self.samples or SAMPLES[case.engine]
        rendering.set_frame(scene, Engine[case.engine.upper()], size, samples)
        scene.render.film_transparent = True
        scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
        bpy.context.view_layer.update()

    def dress(self, case: Case) -> None:
        """The case's layers on the head, nothing built yet."""
        import bpy

        from km_makeup.blender import compositor, images, makeup
        from km_makeup.blender.update import paused

        obj, scene = self.obj, bpy.context.scene
        compositor.forget(scene)
        compositor.remove(scene)
        if obj.km_makeup.slots:
            makeup.remove(obj)
        for image in [one for one in bpy.data.images if one.get(images.IMAGE_KIND)]:
            bpy.data.images.remove(image)
        images.forget_statistics()
        makeup.set_up(obj)
        settings = obj.km_makeup
        with paused():
            settings.both_engines = False
            settings.scattering, settings.highlight = case.scattering, case.highlight
            settings.path = "LIVE"
            settings.folder, settings.resolution = str(self.folder), 0
            for one in case.layers:
                layer = settings.layers.add()
                layer.name = layer.product = one.product
                layer.thickness_um = one.thickness_um
                layer.map = images.image_from_map(one.product, paint(one.paint, one.seed))
        if case.scattering == "SCREEN":
            compositor.ask(scene, compositor.Profile.OWN, (), 6, True)

    def build(self, case: Case, tolerance: float | None, said: Mapping[str, str] | None = None):
        """Build the makeup, planned for a tolerance, or with everything for None; the plan. ``said``: ON or OFF by effect."""
        import bpy

        from km_makeup.blender import baking, makeup
        from km_makeup.blender.update import paused

        with paused():
            self.obj.km_makeup.everything = tolerance is None
            self.obj.km_makeup.tolerance = tolerance or 0.0
            self.obj.km_makeup.path = "LIVE"
            self.obj.km_makeup.overrides.clear()
            for key, switch in (said or {}).items():
                one = self.obj.km_makeup.overrides.add()
                one.name, one.switch = key, switch
        scene = bpy.context.scene
        if case.path == "BAKED":
            baking.bake_all(self.obj, scene)
            return makeup.planned(self.obj)
        return makeup.refresh(self.obj, scene)

    def picture(self, seed: int = 0) -> NDArray[np.float32]:
        """The picture, linear RGBA; ``seed`` is for Cycles, EEVEE knows none."""
        import bpy

        from km_makeup.blender.reference import rendered

        scene = bpy.context.scene
        scene.cycles.seed = seed
        bpy.ops.render.render()
        return rendered(scene)

    def of_other_samples(self, picture: NDArray[np.float32]) -> NDArray[np.float32]:
        """What is in ``picture`` once more, of as many samples, none of which is the same.

        EEVEE has no seed: its samples are the first of one sequence, in every frame. Twice as many are the same ones and as many
        new ones, whose mean is then twice the mean of all less the mean of the first.
        """
        import bpy

        scene = bpy.context.scene
        if scene.render.engine == "CYCLES":
            return self.picture(1)
        samples = scene.eevee.taa_render_samples
        scene.eevee.taa_render_samples = 2 * samples
        both = self.picture()
        scene.eevee.taa_render_samples = samples
        return 2 * both - picture


def difference(one: NDArray, other: NDArray, white: NDArray) -> float:
    """99th percentile of CIEDE2000 on the head, before a grey that is GREY of a white card in the scene's light, which is white."""
    from km_makeup.spectra import delta_e

    head = np.minimum(one[..., 3], other[..., 3]) > 0.5
    if not head.any():
        raise RuntimeError("no pixel of the picture shows the head")
    before_grey = [a[head, :3] / white + GREY * (1 - a[head, 3:]) for a in (one, other)]
    return float(np.quantile(delta_e(*before_grey), 0.99))


def _light(scene, obj, kind: str) -> None:
    """Lamps and world around the head."""
    import bpy
    from mathutils import Vector

    from km_makeup.blender import studio

    for lamp in [one for one in scene.objects if one.type == "LIGHT"]:
        bpy.data.objects.remove(lamp)
    tip = studio.nose_tip(obj)
    grey = 0.05
    if kind == "studio":
        studio.add_studio(obj)
        for lamp in [one for one in scene.objects if one.type == "LIGHT"]:
            lamp.data.shadow_maximum_resolution = SHADOW
        return
    if kind == "world":
        grey = 0.8
    else:
        type_, place, size, power = {
            "sun": ("SUN", (-0.6, -0.9, 0.6), 0.01, 3.0),
            "point": ("POINT", (-0.5, -0.8, 0.4), 0.02, 30.0),
            "soft": ("AREA", (-0.8, -1.2, 0.8), 1.5, 40.0),
        }[kind]
        data = bpy.data.lights.new(kind, type_)
        data.energy = power
        if type_ == "SUN":
            data.angle = size
        elif type_ == "AREA":
            data.size = size
        else:
            data.shadow_soft_size = size
        data.shadow_maximum_resolution, data.shadow_filter_radius = SHADOW, 0
        lamp = bpy.data.objects.new(kind, data)
        lamp.location = tip + Vector(place)
        lamp.rotation_euler = (tip + Vector((0, 0.05, 0)) - lamp.location).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(lamp)
    world = bpy.data.worlds.new(kind)
    background = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (grey, grey, grey, 1)
    scene.world = world


def own_resources() -> None:
    """Keep the user's settings and extensions out of the bpy module; before it is imported."""
    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
