"""How far Cycles scatters light below the skin by a subsurface radius, against what `profiles` reads from it.

    python -m tests.compositor.widths [--albedos .1,.2,.4,.6,.8,.95] [--samples 256] [--write]

Across a sharp shadow edge on a plane lies the step response of the profile. Burley's d is what brings the step response of
his profile nearest to it, a lower end of the light allowed: a random walk loses some. The radius is chosen so that d is to
be a quarter of a millimetre.
"""

from __future__ import annotations

import argparse
import functools
import math
import os
import sys
import tempfile

import bpy
import numpy as np
from numpy.typing import NDArray

from tests.compositor.sphere_and_edge import edge_scene, strip

COVERS = ("km_makeup/blender/compositor/profiles.py",)
ASIDE_MM, SCALE = 4.0, 12.0
D_MM = 0.25
METHODS = [
    item.identifier for item in bpy.types.ShaderNodeBsdfPrincipled.bl_rna.properties["subsurface_method"].enum_items
]
"""Those of the Blender at hand."""


def main() -> int:
    """Render, compare, print."""
    parser = argparse.ArgumentParser(prog="python -m tests.compositor.widths", description=__doc__.splitlines()[0])
    parser.add_argument("--albedos", default=".1,.2,.4,.6,.8,.95", help="albedos of the skin, with commas")
    parser.add_argument("--samples", type=int, default=256, help="Cycles samples")
    parser.add_argument("--write", action="store_true", help="write tests/results/diffusion_widths.md")
    options = parser.parse_args()
    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
    lines = [f"Blender {bpy.app.version_string}. Burley's d by the radius.", ""]
    lines += ["| method | albedo | measured | read | measured / read |", "| --- | --- | --- | --- | --- |"]
    for method in METHODS:
        for albedo in (float(text) for text in options.albedos.split(",")):
            found, told = measured(method, albedo, options.samples), read(method, albedo)
            lines.append(f"| {method} | {albedo:g} | {found:.4f} | {told:.4f} | {found / told:.2f} |")
            print(lines[-1], file=sys.stderr, flush=True)
    text = "\n".join(lines) + "\n"
    print(text)
    if options.write:
        from tests import stamps

        command = f"python -m tests.compositor.widths --albedos {options.albedos} --samples {options.samples} --write"
        stamps.write_markdown("diffusion_widths.md", "How far Cycles scatters by a radius", command, COVERS, text)
    return 0


def read(method: str, albedo: float) -> float:
    """Burley's d by the radius, as the profile of a head's own scattering is made from it."""
    from km_makeup.blender.compositor.profiles import burley_distances, method_of

    material = bpy.data.materials.new("Read")
    node = material.node_tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.subsurface_method = method
    found = float(burley_distances(np.ones(1), np.array([albedo]), method_of(node))[0])
    bpy.data.materials.remove(material)
    return found


def measured(method: str, albedo: float, samples: int) -> float:
    """The same, as Cycles renders it, in one of its scenes that is made for it."""
    radius = D_MM / read(method, albedo)
    count = int(2 * ASIDE_MM * SCALE) // 2 * 2
    place = (np.arange(count) + 0.5 - count / 2) / SCALE
    image = strip(edge_scene(albedo, method, samples, np.full(3, radius)), count, SCALE, (-0.1, 0, 0.5), (0, 0, 0))
    light = image.mean(axis=1)
    light = light if light[0] < light[-1] else light[::-1]

    def error(d: float) -> float:
        response = np.interp(place / d, *_step())
        return float(((response * (response @ light) / (response @ response) - light) ** 2).sum())

    return min(np.geomspace(0.2 * D_MM, 5 * D_MM, 200), key=error) / radius


@functools.lru_cache(maxsize=1)
def _step() -> tuple[NDArray, NDArray]:
    """Step response of Burley's profile of d = 1 at places."""
    from km_makeup.optics.diffusion import fit_gaussians

    profile = fit_gaussians(1.0, 8)
    place = np.linspace(-100, 100, 4001)
    widths = np.sqrt(2 * profile.variances)
    response = [[(1 + math.erf(x / width)) / 2 for width in widths] for x in place]
    return place, (np.array(response) @ profile.weights)[:, 0]


if __name__ == "__main__":
    sys.exit(main())
