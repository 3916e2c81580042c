"""What EEVEE and Cycles make of skin's base colour on a flat field of scattering skin under a sun, where both should return it.

    python -m tests.reference_render.skin_field

Prints linear RGB as parts of the base colour, and what pixels differ by: EEVEE, Cycles' Burley and its random walk at anisotropy
0 and 0.8, which EEVEE does not know.
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from tests.highlights import lit

BASE = (0.41, 0.238, 0.177)
RADIUS_MM = (3.67, 1.37, 0.68)
USUAL = 0.8


def build() -> None:
    """A deep block of skin without a highlight, seen from above under a sun."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    material = bpy.data.materials.new("Skin")
    material.node_tree.nodes.clear()
    shader, output = (material.node_tree.nodes.new(f"ShaderNode{one}") for one in ("BsdfPrincipled", "OutputMaterial"))
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    shader.name, shader.subsurface_method = "Skin", "RANDOM_WALK_SKIN"
    shader.inputs["Base Color"].default_value = (*BASE, 1)
    shader.inputs["Subsurface Weight"].default_value = 1
    shader.inputs["Subsurface Radius"].default_value = RADIUS_MM
    shader.inputs["Subsurface Scale"].default_value = 0.001
    shader.inputs["Specular IOR Level"].default_value = 0
    lit.block().data.materials.append(material)
    lit.lamp("SUN", (0, 0, 2), energy=math.pi)
    lit.camera((0, 0, 1), lens=200)


def field(
    anisotropy: float, samples: int, method: str = "RANDOM_WALK_SKIN", engine: str = "CYCLES"
) -> NDArray[np.float32]:
    """Pixels (n, 3) of the flat field."""
    skin().subsurface_method = method
    if method != "BURLEY":
        skin().inputs["Subsurface Anisotropy"].default_value = anisotropy
    with tempfile.TemporaryDirectory() as folder:
        pixels: NDArray[np.float32] = lit.render(Path(folder), engine, samples=samples)
    return pixels[..., :3].reshape(-1, 3)


def skin() -> bpy.types.ShaderNodeBsdfPrincipled:
    """The skin's shader."""
    node: bpy.types.ShaderNodeBsdfPrincipled = bpy.data.materials["Skin"].node_tree.nodes["Skin"]
    return node


ROWS = {
    "EEVEE": (0.0, 16, "RANDOM_WALK_SKIN", "BLENDER_EEVEE"),
    "Cycles, Burley": (0.0, 1024, "BURLEY"),
    "Cycles, random walk": (0.0, 1024),
    f"Cycles, random walk, anisotropy {USUAL:g}": (USUAL, 1024),
}


def main() -> int:
    """Render, print."""
    build()
    for name, how in ROWS.items():
        pixels = field(*how) / np.array(BASE)
        mean, spread = (", ".join(f"{one:.3f}" for one in part) for part in (pixels.mean(axis=0), pixels.std(axis=0)))
        print(f"{name:36s} {mean} of the base colour, pixels differ by {spread}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
