"""What EEVEE hands over for a scene, as arrays: rendered once, it can be diffused in many ways without rendering again."""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy
import numpy as np

from km_makeup.blender.compositor import placing
from tests.compositor.replica import Frame


def hand_over(scene: bpy.types.Scene, size: tuple[int, int], samples: int) -> tuple[Frame, dict[str, float]]:
    """The passes that the diffusion group reads (row 0 at the bottom), and the group's lens inputs; EEVEE, camera set.

    The scene has the group in its compositor; it is left as it was found but for the render settings.
    """
    node = placing.find(scene)
    tree = scene.compositing_node_group
    settings = scene.render
    settings.engine, settings.use_file_extension = "BLENDER_EEVEE", True
    settings.resolution_x, settings.resolution_y = size
    settings.resolution_percentage = 100
    scene.eevee.taa_render_samples = samples
    output = tree.nodes.new("CompositorNodeOutputFile")
    output.format.media_type = "MULTI_LAYER_IMAGE"
    output.format.file_format, output.format.color_depth, output.format.exr_codec = "OPEN_EXR_MULTILAYER", "32", "ZIP"
    for target in placing.SOURCES.values():
        output.file_output_items.new("RGBA", target)
        tree.links.new(node.inputs[target].links[0].from_socket, output.inputs[target])
    with tempfile.TemporaryDirectory() as folder:
        output.directory, output.file_name = folder, "passes"
        node.mute = True
        bpy.ops.render.render()
        node.mute = False
        found = _read(next(Path(folder).glob("*.exr")))
    tree.nodes.remove(output)
    lens = {name: float(node.inputs[name].default_value) for name in placing.DRIVERS}
    frame = Frame(
        found["Image"][..., :3],
        found["Light"][..., :3],
        found["Colour"][..., :3],
        found["Share"][..., :3],
        found["Mask"][..., 0],
        found["Depth"][..., 0],
    )
    return frame, lens


def _read(path: Path) -> dict[str, np.ndarray]:
    """Layers of a multilayer EXR, (height, width, 4), row 0 at the bottom."""
    import OpenImageIO

    image = OpenImageIO.ImageBuf(str(path))
    layers: dict[str, list[tuple[int, np.ndarray]]] = {}
    for part in range(image.nsubimages):
        one = OpenImageIO.ImageBuf(str(path), part, 0)
        pixels = one.get_pixels(OpenImageIO.FLOAT)
        for index, name in enumerate(one.spec().channelnames):
            layer, _, channel = name.rpartition(".")
            order = "RGBAXYZWV".find(channel)
            layers.setdefault(layer.split(".")[0], []).append((order, pixels[..., index]))
    return {
        name: np.stack([plane for _, plane in sorted(planes, key=lambda p: p[0])], axis=-1)[::-1]
        for name, planes in layers.items()
    }


def inputs_of(frame: Frame) -> dict[str, np.ndarray]:
    """The same by the names of the group's inputs."""
    names = ("image", "light", "colour", "share", "mask", "depth")
    return {name.capitalize(): getattr(frame, name) for name in names}
