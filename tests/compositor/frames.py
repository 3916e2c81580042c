"""What scattering adds to a whole frame of EEVEE: the compositor's, EEVEE's own, none; and what Shader to RGB would.

    python -m tests.compositor.frames [--size 640x360] [--samples 1,16] [--rounds 5] [--write]

The sample head near, bare, one lamp; skin fills most of the picture. The ways take turns, after a frame of each that does not
count (shaders are compiled, maps go to the card). EEVEE scatters in every sample, the compositor once a picture: which of them is
faster depends on the samples. Shader to RGB is no part of KM Makeup; its row tells what an approach by it would cost. Time is
the processor's, of all threads, where a program stands for the graphics card: other jobs on the machine do not count.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator

import numpy as np

NONE, OWN, OURS, BY_RGB = "no scattering", "EEVEE's own", "compositor, six Gaussians", "no scattering, Shader to RGB"
COVERS = (
    *(f"km_makeup/blender/compositor/{name}.py" for name in ("diffusion", "surface", "levels", "pixels", "placing")),
    "tests/compositor/frames.py",
)


def main() -> int:
    """Render in turns, print seconds and what scattering adds."""
    parser = argparse.ArgumentParser(prog="python -m tests.compositor.frames", description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="640x360", help="pixels, width x height")
    parser.add_argument("--samples", default="1,16", help="EEVEE samples, with commas")
    parser.add_argument("--rounds", type=int, default=5, help="rounds; the least of them counts")
    parser.add_argument("--write", action="store_true", help="write tests/results/diffusion_frames.md")
    options = parser.parse_args()
    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="km_makeup-"))
    width, height = map(int, options.size.split("x"))
    text = table((width, height), [int(one) for one in options.samples.split(",")], options.rounds)
    print(text)
    if options.write:
        from tests import stamps

        command = f"python -m tests.compositor.frames --size {options.size} --samples {options.samples} --rounds {options.rounds} --write"
        stamps.write_markdown("diffusion_frames.md", "Diffusion: whole frames", command, COVERS, text)
    return 0


def table(size: tuple[int, int], counts: list[int], rounds: int) -> str:
    """A Markdown table, a row per number of samples and way."""
    import bpy

    from tests.compositor.heads import VIEWS, open_scene, show

    head = open_scene("sample", "bare")
    show(head, VIEWS["hard nose shadow"])
    for data in bpy.data.lights:
        data.shadow_maximum_resolution, data.shadow_filter_radius = 1e-3, 1
    ways: dict[str, Callable] = {NONE: _without, OWN: contextlib.nullcontext, OURS: _in_compositor, BY_RGB: _by_rgb}
    found: dict[tuple[int, str], list[float]] = {}
    for turn in range(rounds):
        for name, way in ways.items():
            with way(head):
                frame(size, 1)
                for count in counts:
                    found.setdefault((count, name), []).append(frame(size, count))
                    print(
                        f"round {turn + 1}, {name}, {count}: {found[count, name][-1]:.2f} s",
                        file=sys.stderr,
                        flush=True,
                    )
    lines = [
        f"{size[0]}x{size[1]}, {rounds} rounds, seconds of the processor, all threads; EEVEE by Mesa's software renderer where there is "
        "no graphics card, compositor on the CPU. Beyond no scattering: the median of what the rounds differ by, and its middle half.",
        "",
        "| samples | way | least seconds of a frame | beyond no scattering | middle half | by EEVEE's own |",
        "| --- | --- | ---: | ---: | ---: | ---: |",
    ]
    for count in counts:
        more = {name: np.subtract(found[count, name], found[count, NONE]) for name in ways}
        for name in ways:
            low, middle, high = np.quantile(more[name], (0.25, 0.5, 0.75))
            share = f"{middle / np.median(more[OWN]):.2f}" if np.median(more[OWN]) > 0 else "–"
            cells = (
                str(count),
                name,
                f"{min(found[count, name]):.2f}",
                f"{middle:+.2f}",
                f"{low:+.2f} to {high:+.2f}",
                share,
            )
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def frame(size: tuple[int, int], samples: int) -> float:
    """The processor's seconds of a rendered picture."""
    import bpy

    scene = bpy.context.scene
    scene.render.engine, scene.render.resolution_percentage = "BLENDER_EEVEE", 100
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.eevee.taa_render_samples = samples
    start = time.process_time()
    bpy.ops.render.render()
    return time.process_time() - start


@contextlib.contextmanager
def _without(head) -> Iterator[None]:
    from tests.compositor.heads import subsurface_weight

    with subsurface_weight(head, 0.0):
        yield


@contextlib.contextmanager
def _in_compositor(head) -> Iterator[None]:
    import bpy

    from km_makeup.blender import compositor

    before, head.km_makeup.scattering = head.km_makeup.scattering, "SCREEN"
    compositor.insert(bpy.context.scene)
    yield
    compositor.remove(bpy.context.scene)
    head.km_makeup.scattering = before


@contextlib.contextmanager
def _by_rgb(head) -> Iterator[None]:
    """The skin's shaders without scattering, made light of a texture as Shader to RGB does it."""
    made = []
    for material in {slot.material for slot in head.material_slots if slot.material}:
        tree = material.node_tree
        for output in [node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial"]:
            if output.inputs["Surface"].is_linked:
                shader = output.inputs["Surface"].links[0].from_socket
                node, light = tree.nodes.new("ShaderNodeShaderToRGB"), tree.nodes.new("ShaderNodeEmission")
                tree.links.new(shader, node.inputs[0])
                tree.links.new(node.outputs["Color"], light.inputs["Color"])
                tree.links.new(light.outputs[0], output.inputs["Surface"])
                made.append((tree, output, shader, (node, light)))
    with _without(head):
        yield
    for tree, output, shader, nodes in made:
        tree.links.new(shader, output.inputs["Surface"])
        for node in nodes:
            tree.nodes.remove(node)


if __name__ == "__main__":
    sys.exit(main())
