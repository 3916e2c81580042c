"""What the edge of a film looks like: a real film above scattering skin against the ways of drawing it.

    python -m tests.reference_render.film_edge            the table, and tests/results/film_edge.md (some minutes)
    python -m tests.reference_render.film_edge --samples 256 --case lipstick    one case, coarser, nothing written

Light that enters the skin beside a film and leaves under it has passed the film once. Truth is a shell with Diffuse(R) +
Translucent(T) 0.05 mm above skin that Cycles scatters by random walk, at three single bands (450, 550, 650 nm) at a time, as
the three channels of one render; R and T are Kubelka and Munk's of shipped products at those bands. Against it:

* closures: Diffuse(R) + Subsurface(T^2 rho/(1 - R rho)) in the skin's own surface, as the Cycles material has it (mixed by
  the larger of their channels);
* shell: Diffuse(R) + Transparent(T sqrt(1/(1 - R rho))) 0.05 mm above the bare skin, which dims light on its way in and out.

All are set to agree far from the edge: rho is what the slab really reads, and the albedo under the film the one that reads
what it should. What differs is the edge.

On a slab under a sun from above, and on a ball of 10 mm under a sun from the side of the camera. Reflectances are light
sent back over light received (slab), or radiance over that of a white surface facing the sun (ball).
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO

from km_makeup.optics import film
from km_makeup.products import Library
from km_makeup.spectra import WAVELENGTHS, delta_e
from tests.stamps import write_markdown

BANDS_NM = (650, 550, 450)
SKIN = (0.58, 0.36, 0.24)
"""Reflectance of the skin at the bands: light skin."""
RADIUS_MM = (3.67, 1.37, 0.68)
GAP_MM = 0.05
MM = 0.001
HALF_WIDTH_MM = 6.0
COLUMNS, ROWS = 120, 6
DISTANCES_MM = (-4, -2, -1, -0.5, -0.2, -0.05, 0.05, 0.2, 0.5, 1, 2, 4)
CASES = {
    "lipstick": ("lipstick-classic-red", 20.0),
    "foundation": ("foundation-light", 20.0),
    "eyeliner": ("eyeliner-black", 25.0),
}
CALIBRATION = 512
WAYS = ("truth", "closures", "shell")


@dataclass(frozen=True)
class Case:
    """A film at the bands: R, T (3,), over skin that reads rho (3,).

    ``weight`` is that of the scattering closure under the film and ``under`` its albedo, so that weight times what it
    reads is the skin's part.
    """

    name: str
    R: np.ndarray
    T: np.ndarray
    rho: np.ndarray
    under: np.ndarray
    weight: float = 1.0

    @property
    def through(self) -> np.ndarray:
        """Share of the bare skin's light that is left under the film, far from its edge."""
        return self.T**2 / (1 - self.R * self.rho)


def case_of(name: str) -> Case:
    product, thickness_um = CASES[name]
    found = Library.shipped().find(product)
    at = [int(np.argmin(np.abs(WAVELENGTHS - nm))) for nm in BANDS_NM]
    one = film(found.K[at], found.S[at], thickness_um / 1000)
    rho = reading(np.array(SKIN))
    bare = Case(f"{product} {thickness_um:g} µm", one.R, one.T, rho, np.array(SKIN))
    part = rho * bare.through
    weight = float(part.max() / (one.R.max() + part.max()))
    return replace(bare, under=albedo_for(part / weight), weight=weight)


def reading(albedo: np.ndarray) -> np.ndarray:
    """What a slab of scattering skin of that albedo reads (3,): random walk sends back up to a sixth less."""
    everywhere = Case("", np.zeros(3), np.ones(3), albedo, albedo)
    with tempfile.TemporaryDirectory(prefix="film-edge-") as folder:
        return profile(build(everywhere, "bare", "slab"), CALIBRATION, Path(folder)).mean(axis=0)


def albedo_for(wanted: np.ndarray) -> np.ndarray:
    """The albedo (3,) at which a slab reads what is wanted."""
    albedo = wanted.copy()
    for _ in range(3):
        albedo = np.clip(albedo * wanted / np.maximum(reading(albedo), 1e-9), 0, 1)
    return albedo


def empty_scene() -> bpy.types.Scene:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.world = bpy.data.worlds.new("Black")
    next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground").inputs[1].default_value = 0
    return scene


def add(scene: bpy.types.Scene, name: str, data: bpy.types.ID) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    scene.collection.objects.link(obj)
    return obj


def box(low: Sequence[float], high: Sequence[float]) -> bpy.types.Mesh:
    """A closed box in millimetres, normals outside."""
    mesh = bpy.data.meshes.new("box")
    (a, b, c), (d, e, f) = ([MM * x for x in corner] for corner in (low, high))
    points = [(a, b, c), (d, b, c), (d, e, c), (a, e, c), (a, b, f), (d, b, f), (d, e, f), (a, e, f)]
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    mesh.from_pydata(points, [], faces)
    return mesh


def ball(radius_mm: float, half: bool) -> bpy.types.Mesh:
    """A ball of many faces; ``half``: only where x < 0."""
    import bmesh

    mesh = bpy.data.meshes.new("ball")
    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=6, radius=radius_mm * MM)
    if half:
        geometry = [*shape.verts, *shape.edges, *shape.faces]
        bmesh.ops.bisect_plane(
            shape, geom=geometry, plane_co=(0, 0, 0), plane_no=(1, 0, 0), clear_outer=True, clear_inner=False
        )
    shape.to_mesh(mesh)
    shape.free()
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    return mesh


def material(build) -> bpy.types.Material:
    made = bpy.data.materials.new("material")
    tree = made.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(build(tree), output.inputs["Surface"])
    return made


def shader(tree: bpy.types.NodeTree, kind: str, colour: Sequence[float]) -> bpy.types.NodeSocket:
    node = tree.nodes.new(kind)
    node.inputs["Color"].default_value = (*(float(c) for c in colour), 1)
    if kind == "ShaderNodeSubsurfaceScattering":
        node.falloff = "RANDOM_WALK"
        node.inputs["Scale"].default_value = MM
        node.inputs["Radius"].default_value = RADIUS_MM
    return node.outputs[0]


def mixed(tree, kind: str, first: bpy.types.NodeSocket, second: bpy.types.NodeSocket) -> bpy.types.Node:
    node = tree.nodes.new(kind)
    sockets = [socket for socket in node.inputs if socket.type == "SHADER"]
    tree.links.new(first, sockets[0])
    tree.links.new(second, sockets[1])
    return node


def by_side(tree, left: bpy.types.NodeSocket, right: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """The left shader where x < 0."""
    geometry, split = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeSeparateXYZ")
    right_side = tree.nodes.new("ShaderNodeMath")
    right_side.operation, right_side.inputs[1].default_value = "GREATER_THAN", 0
    tree.links.new(geometry.outputs["Position"], split.inputs[0])
    tree.links.new(split.outputs["X"], right_side.inputs[0])
    node = mixed(tree, "ShaderNodeMixShader", left, right)
    tree.links.new(right_side.outputs[0], node.inputs[0])
    return node.outputs[0]


def skin_with(case: Case, way: str) -> bpy.types.Material:
    def build(tree):
        bare = shader(tree, "ShaderNodeSubsurfaceScattering", case.under if way == "bare" else SKIN)
        if way != "closures":
            return bare
        under = shader(tree, "ShaderNodeSubsurfaceScattering", case.under)
        alone = shader(tree, "ShaderNodeBsdfDiffuse", case.R / (1 - case.weight))
        made_up = mixed(tree, "ShaderNodeMixShader", alone, under)
        made_up.inputs[0].default_value = case.weight
        return by_side(tree, made_up.outputs[0], bare)

    return material(build)


def shell_of(case: Case, way: str) -> bpy.types.Material:
    def build(tree):
        diffuse = shader(tree, "ShaderNodeBsdfDiffuse", case.R)
        if way == "truth":
            passed = shader(tree, "ShaderNodeBsdfTranslucent", case.T)
            return mixed(tree, "ShaderNodeAddShader", diffuse, passed).outputs[0]
        passed = shader(tree, "ShaderNodeBsdfTransparent", np.sqrt(case.through))
        above = mixed(tree, "ShaderNodeAddShader", diffuse, passed).outputs[0]
        below = shader(tree, "ShaderNodeBsdfTransparent", np.sqrt(case.through))
        node = mixed(tree, "ShaderNodeMixShader", above, below)
        geometry = tree.nodes.new("ShaderNodeNewGeometry")
        tree.links.new(geometry.outputs["Backfacing"], node.inputs[0])
        return node.outputs[0]

    return material(build)


def build(case: Case, way: str, form: str) -> bpy.types.Scene:
    scene = empty_scene()
    skin = box((-30, -30, -25), (30, 30, 0)) if form == "slab" else ball(10, half=False)
    skin.materials.append(skin_with(case, way))
    add(scene, "Skin", skin)
    if way in ("truth", "shell"):
        if form == "slab":
            shell = bpy.data.meshes.new("shell")
            corners = [(-30, -30), (0, -30), (0, 30), (-30, 30)]
            shell.from_pydata([(MM * x, MM * y, MM * GAP_MM) for x, y in corners], [], [(0, 1, 2, 3)])
        else:
            shell = ball(10 + GAP_MM, half=True)
        shell.materials.append(shell_of(case, way))
        add(scene, "Shell", shell)
    sun = add(scene, "Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle = math.pi, 0
    if form == "ball":
        sun.rotation_euler = (0, 0.7, 0)
    camera = add(scene, "Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.location = "ORTHO", (0, 0, 0.2)
    width_mm = HALF_WIDTH_MM if form == "slab" else 10.5
    camera.data.ortho_scale = 2 * width_mm * MM
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = COLUMNS, ROWS
    return scene


def profile(scene: bpy.types.Scene, samples: int, folder: Path) -> np.ndarray:
    """Mean of the rows (COLUMNS, 3)."""
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = samples, False, False
    scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = scene.cycles.transmission_bounces = 64
    scene.cycles.transparent_max_bounces = 64
    scene.cycles.pixel_filter_type = "BOX"
    scene.render.resolution_percentage = 100
    settings = scene.render.image_settings
    settings.media_type, settings.file_format, settings.color_depth = "IMAGE", "OPEN_EXR", "32"
    scene.render.filepath, scene.render.use_file_extension = str(folder / "edge.exr"), False
    bpy.ops.render.render(write_still=True)
    pixels = OpenImageIO.ImageInput.open(scene.render.filepath).read_image("float")[..., :3]
    return pixels.astype(np.float64).mean(axis=0)


def distances(form: str) -> np.ndarray:
    """Distance of each column from the film's edge in mm along the surface, negative under the film; NaN off the ball."""
    width_mm = HALF_WIDTH_MM if form == "slab" else 10.5
    x = ((np.arange(COLUMNS) + 0.5) / COLUMNS * 2 - 1) * width_mm
    if form == "slab":
        return x
    with np.errstate(invalid="ignore"):
        return 10 * np.arcsin(x / 10)


def measure(case: Case, form: str, samples: int) -> dict[str, np.ndarray]:
    """Profiles (COLUMNS, 3) by way."""
    with tempfile.TemporaryDirectory(prefix="film-edge-") as folder:
        return {way: profile(build(case, way, form), samples, Path(folder)) for way in WAYS}


def seen(form: str) -> np.ndarray:
    """Columns that show a lit part of the surface, and no rim where a pixel spans a millimetre."""
    where = distances(form)
    return np.isfinite(where) & ((where > -8) if form == "ball" else True) & (np.abs(where) < 9)


def errors(found: dict[str, np.ndarray], form: str) -> dict[str, np.ndarray]:
    """CIEDE2000 to the truth of each other way by column, the three bands taken as red, green and blue; 0 where unseen."""
    return {way: np.where(seen(form), delta_e(found[way], found["truth"]), 0) for way in WAYS[1:]}


def summary(case: Case, form: str, found: dict[str, np.ndarray]) -> str:
    """One row: the worst column of each way, how far from the edge closures stay wrong by 1, and their mean within 1 mm."""
    where, wrong = distances(form), errors(found, form)
    reach = np.abs(where[wrong["closures"] > 1])
    near = seen(form) & (np.abs(where) < 1)
    return (
        f"| {case.name} | {form} | {wrong['closures'].max():.2f} | {wrong['closures'][near].mean():.2f} | "
        f"{reach.max() if len(reach) else 0:.1f} | {wrong['shell'].max():.2f} | {wrong['shell'][near].mean():.2f} |"
    )


def table(case: Case, form: str, found: dict[str, np.ndarray]) -> str:
    """Reflectances at the bands by distance from the edge."""
    where, wrong = distances(form), errors(found, form)
    lines = [
        f"\n{case.name}, {form}: R {_three(case.R)}, T {_three(case.T)}, skin {_three(case.rho)} at 650, 550, 450 nm\n",
        "| mm from the edge | truth | closures | shell | ΔE closures | ΔE shell |",
        "| ---: | --- | --- | --- | ---: | ---: |",
    ]
    for mm in DISTANCES_MM:
        column = int(np.nanargmin(np.abs(where - mm)))
        values = " | ".join(_three(found[way][column]) for way in WAYS)
        lines.append(
            f"| {where[column]:.2f} | {values} | {wrong['closures'][column]:.2f} | {wrong['shell'][column]:.2f} |"
        )
    return "\n".join(lines)


def _three(values: np.ndarray) -> str:
    return " ".join(f"{x:.3f}" for x in values)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--case", action="append", choices=list(CASES))
    parser.add_argument("--form", action="append", choices=["slab", "ball"])
    options = parser.parse_args()
    rows, tables = [], []
    for name in options.case or CASES:
        case = case_of(name)
        for form in options.form or ("slab", "ball"):
            found = measure(case, form, options.samples)
            rows.append(summary(case, form, found))
            tables.append(table(case, form, found))
            print(tables[-1], flush=True)
    text = HEAD + "\n".join(rows) + "\n" + "\n".join(tables) + "\n"
    print("\n" + HEAD + "\n".join(rows))
    if not (options.case or options.form):
        print(write_markdown("film_edge.md", "The edge of a film on scattering skin", COMMAND, COVERS, text))


HEAD = """Film at negative distances. ΔE: CIEDE2000 to the truth, the bands taken as red, green and blue.

| film | form | closures: worst ΔE | mean within 1 mm | wrong by 1 up to mm | shell: worst ΔE | mean within 1 mm |
| --- | --- | ---: | ---: | ---: | ---: | ---: |
"""
COMMAND = "python -m tests.reference_render.film_edge"
COVERS = ("tests/reference_render/film_edge.py",)


if __name__ == "__main__":
    sys.exit(main())
