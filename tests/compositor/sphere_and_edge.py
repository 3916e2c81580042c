"""Diffusion on a 10 mm ball and across a sharp shadow edge, against integrals over the profile and against Cycles.

    python -m tests.compositor.sphere_and_edge [--scales 5,25,60] [--samples 512] [--write]

The diffusion is the numpy replica, which the nodes equal to 1e-5 (`test_nodes`), on exact geometry and light. Cycles has
the radius at which Burley's profile has the same second moment (BLENDER.md), and Random Walk (Skin), which white skin has none
for, the one that `profiles` reads as the same. On the ball Cycles' own distance from the integral stands beside: no
screen-space method can be nearer to both.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

COVERS = (
    "km_makeup/blender/compositor/diffusion.py",
    "km_makeup/blender/compositor/levels.py",
    "tests/compositor/replica.py",
)
BURLEY_MM = np.array([0.4445, 0.0987, 0.0595])
RADIUS_MM = 10.0
EDGE_MM = 12.0
ROWS = 8
METHODS = {"Burley": "BURLEY", "random walk": "RANDOM_WALK_SKIN"}


def main() -> int:
    """Compare and print."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.compositor.sphere_and_edge", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--scales", default="5,25,60", help="pixels per mm, with commas")
    parser.add_argument("--samples", type=int, default=2048, help="Cycles samples")
    parser.add_argument("--write", action="store_true", help="write tests/results/diffusion_sphere_edge.md")
    options = parser.parse_args()
    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
    text = table([float(s) for s in options.scales.split(",")], options.samples)
    print(text)
    if options.write:
        from tests import stamps

        settings = f"--scales {options.scales} --samples {options.samples}"
        command = f"python -m tests.compositor.sphere_and_edge {settings} --write"
        stamps.write_markdown("diffusion_sphere_edge.md", "Diffusion: ball and shadow edge", command, COVERS, text)
    return 0


def table(scales: list[float], samples: int) -> str:
    """Root mean square differences in red, green and blue, light 1."""
    lines = ["| scene | px/mm | compared | red | green | blue |", "| --- | --- | --- | --- | --- | --- |"]

    def row(scene: str, scale: float, name: str, difference: NDArray) -> None:
        rms = np.sqrt((difference**2).mean(axis=0))
        cells = " | ".join(f"{one:.4f}" for one in rms)
        lines.append(f"| {scene} | {scale:g} | {name} | {cells} |")
        print(lines[-1], file=sys.stderr, flush=True)

    balls = {scale: ball(scale, 1.0) for scale in scales}
    for albedo in (1.0, 0.6):
        for scale in scales:
            scene = f"ball, albedo {albedo:g}"
            ours, local, truth = (albedo * one for one in balls[scale])  # linear in the light
            row(scene, scale, "no diffusion − integral", local - truth)
            row(scene, scale, "diffusion − integral", ours - truth)
            for name, method in METHODS.items() if albedo < 1 else (("Burley", METHODS["Burley"]),):
                cycles = cycles_ball(scale, albedo, method, samples)
                row(scene, scale, f"diffusion − Cycles {name}", ours - cycles)
                row(scene, scale, f"Cycles {name} − integral", cycles - truth)
    for scale in scales:
        ours, local, truth = edge(scale)
        row("shadow edge", scale, "no diffusion − integral", local - truth)
        row("shadow edge", scale, "diffusion − integral", ours - truth)
        for name, albedo in (("Burley", 1.0), ("random walk", 0.6)):
            cycles = cycles_edge(scale, albedo, METHODS[name], samples)
            row("shadow edge", scale, f"diffusion − Cycles {name}", ours - cycles / albedo)
    return "\n".join(lines) + "\n"


def ball_places(scale: float) -> NDArray[np.float64]:
    """Places of the pixels along the equator, mm, where the ball is seen less than 69 degrees off."""
    width = int(2.2 * RADIUS_MM * scale) | 1
    return (np.arange(width) - width // 2) / scale


def ball(scale: float, albedo: float) -> tuple[NDArray, NDArray, NDArray]:
    """Along the equator of a ball lit from the side: diffused, not diffused, and the integral over chords."""
    from km_makeup.optics.diffusion import SKIN
    from tests.compositor import replica
    from tests.compositor.test_nodes import chords

    place = ball_places(scale)
    # Rows farther than the widest Gaussian carries do not matter.
    rows = place[np.abs(place) < min(RADIUS_MM * 1.05, 8.5)]
    x, y = np.meshgrid(place, rows)
    squared = x * x + y * y
    on = squared < RADIUS_MM**2
    depth = np.where(on, RADIUS_MM - np.sqrt(np.maximum(RADIUS_MM**2 - squared, 0)), 1000.0) / 1000
    light = (on * np.maximum(x / RADIUS_MM, 0))[..., None] * np.ones(3)
    colour = np.full_like(light, albedo)
    frame = replica.Frame(light * albedo, light, colour, np.ones_like(light), on.astype(float), depth)
    image = replica.diffuse(frame, replica.Lens(0.0, 0.001 / scale), SKIN, max(scale, 4.0))["image"][len(rows) // 2]
    chosen = np.abs(place) < RADIUS_MM * np.sin(1.2)
    angles = np.linspace(-1.2, 1.2, 49)
    truth = albedo * chords(angles, RADIUS_MM)
    smooth = [np.interp(place[chosen], RADIUS_MM * np.sin(angles), truth[:, c]) for c in range(3)]
    return image[chosen], frame.image[len(rows) // 2][chosen], np.stack(smooth, axis=1)


def edge(scale: float) -> tuple[NDArray, NDArray, NDArray]:
    """Across a shadow edge on a white plane: diffused, not diffused, and the profile's own step response."""
    from math import erf

    from km_makeup.optics.diffusion import SKIN
    from tests.compositor import replica

    count = int(2 * EDGE_MM * scale) // 2 * 2
    place = (np.arange(count) + 0.5 - count / 2) / scale
    light = np.tile((place > 0)[None, :, None], (ROWS, 1, 3)).astype(float)
    white = np.ones_like(light)
    frame = replica.Frame(light, light, white, white, np.ones((ROWS, count)), np.full((ROWS, count), 0.5))
    image = replica.diffuse(frame, replica.Lens(0.0, 0.001 / scale), SKIN, max(scale, 4.0))["image"][1]
    response = [[(1 + erf(x / np.sqrt(2 * v))) / 2 for v in SKIN.variances] for x in place]
    chosen = np.abs(place) < EDGE_MM / 2
    return image[chosen], light[1][chosen], (np.array(response) @ SKIN.weights)[chosen]


def cycles_ball(scale: float, albedo: float, method: str, samples: int) -> NDArray:
    """The equator as Cycles renders it, at the same places."""
    import bpy

    scene = _scene(albedo, method, samples, radius_of(BURLEY_MM, albedo, method))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=RADIUS_MM / 1000, segments=256, ring_count=128)
    _dress(bpy.context.object, (0.0, np.pi / 2, 0.0))
    place = ball_places(scale)
    image = strip(scene, place.size, scale, (0, -0.5, 0), (np.pi / 2, 0, 0))
    return image[np.abs(place) < RADIUS_MM * np.sin(1.2)]


def cycles_edge(scale: float, albedo: float, method: str, samples: int) -> NDArray:
    """The shadow edge as Cycles renders it."""
    scene = edge_scene(albedo, method, samples, radius_of(BURLEY_MM, albedo, method))
    count = int(2 * EDGE_MM * scale) // 2 * 2
    place = (np.arange(count) + 0.5 - count / 2) / scale
    image = strip(scene, count, scale, (-0.1, 0, 0.5), (0, 0, 0))
    if image[0].mean() > image[-1].mean():
        image = image[::-1]
    return image[np.abs(place) < EDGE_MM / 2]


def edge_scene(albedo: float, method: str, samples: int, radius_mm: NDArray):
    """A plane with the shadow of a plane far to the side under a slanting sun; it begins at x = -0.1."""
    import bpy

    scene = _scene(albedo, method, samples, radius_mm)
    bpy.ops.mesh.primitive_plane_add(size=0.5)
    _dress(bpy.context.object, (0.0, np.pi / 4, 0.0), energy=np.pi * 2**0.5)
    bpy.ops.mesh.primitive_plane_add(size=0.1, location=(0, 0, 0.05))
    return scene


def radius_of(d: NDArray, albedo: NDArray | float, method: str) -> NDArray:
    """The radius that is read as Burley's d by one of the methods that all versions of Blender mean the same by."""
    from km_makeup.blender.compositor.profiles import burley_distances

    return d / burley_distances(np.ones(3), np.broadcast_to(albedo, 3), method)


def _scene(albedo: float, method: str, samples: int, radius_mm: NDArray):
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.max_bounces, scene.cycles.use_denoising = samples, 0, False
    material = bpy.data.materials.new("Skin")
    node = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    node.inputs["Base Color"].default_value = (albedo, albedo, albedo, 1)
    node.inputs["Specular IOR Level"].default_value = 0
    node.inputs["Subsurface Weight"].default_value = 1
    node.subsurface_method = method
    node.inputs["Subsurface Radius"].default_value = tuple(np.asarray(radius_mm) / 1000)
    node.inputs["Subsurface Scale"].default_value = 1.0
    return scene


def _dress(obj, rotation: tuple[float, float, float], energy: float = np.pi) -> None:
    import bpy

    obj.data.materials.append(bpy.data.materials["Skin"])
    obj.data.polygons.foreach_set("use_smooth", [True] * len(obj.data.polygons))
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.rotation_euler = energy, 0, rotation
    bpy.context.scene.collection.objects.link(sun)


def strip(scene, count: int, scale: float, place: tuple, rotation: tuple) -> NDArray:
    """The mean of a few rows through an orthographic camera."""
    import bpy

    from km_makeup.bake.files import read_image

    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.data.clip_start = "ORTHO", count / scale / 1000, 0.01
    camera.location, camera.rotation_euler = place, rotation
    scene.collection.objects.link(camera)
    scene.camera = camera
    settings = scene.render
    settings.resolution_x, settings.resolution_y, settings.resolution_percentage = count, ROWS, 100
    settings.filter_size = 0.5
    settings.image_settings.media_type = "IMAGE"
    settings.image_settings.file_format, settings.image_settings.color_depth = "OPEN_EXR", "32"
    settings.image_settings.exr_codec = "ZIP"
    with tempfile.TemporaryDirectory() as folder:
        settings.filepath, settings.use_file_extension = str(Path(folder) / "strip.exr"), False
        bpy.ops.render.render(write_still=True)
        return read_image(Path(settings.filepath))[0][..., :3].mean(axis=0).astype(float)


if __name__ == "__main__":
    sys.exit(main())
