"""How much of a weak lamp's light EEVEE gives at several Light Thresholds: a white sheet below it, against Cycles.

python -m tests.highlights.weak_lamps         prints the table (some seconds)
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import bpy

from tests.highlights import lit

THRESHOLDS = (0.01, 0.001, 1e-4, 1e-6, 0.0)
WATTS, METRES = 3.4, 1.1
"""The fill of the sample head's studio."""


def build() -> None:
    """A white sheet, a disc of light above it, a camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    sheet = bpy.data.materials.new("White")
    tree = sheet.node_tree
    tree.nodes.clear()
    white, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    white.inputs["Color"].default_value = (1, 1, 1, 1)
    tree.links.new(white.outputs[0], output.inputs["Surface"])
    lit.plane(0.3).data.materials.append(sheet)
    lit.lamp("AREA", (0, 0, METRES), energy=WATTS, shape="DISK", size=0.7)
    lit.camera((0, -0.3, 0.3), lens=80)


def mean(engine: str, samples: int) -> float:
    """Mean radiance of the sheet."""
    with tempfile.TemporaryDirectory() as folder:
        pixels = lit.render(Path(folder), engine, samples=samples)
    return float(pixels[pixels[..., 3] > 0.99][:, :3].mean())


def main() -> int:
    """Render, print."""
    build()
    truth = mean("CYCLES", 256)
    print(f"A lamp of {WATTS} W, {METRES} m away: light on a sheet below it, EEVEE over Cycles")
    for threshold in THRESHOLDS:
        bpy.context.scene.eevee.light_threshold = threshold
        print(f"  Light Threshold {threshold:<7g} {mean('BLENDER_EEVEE', 16) / truth:.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
