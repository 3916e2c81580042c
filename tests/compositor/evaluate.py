"""Running a compositor group on arrays, and what it gives, without rendering a scene."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from km_makeup.bake.files import read_image


def evaluate(
    group: bpy.types.NodeTree,
    images: Mapping[str, NDArray],
    values: Mapping[str, float],
    device: str = "CPU",
    seconds: list[float] | None = None,
) -> NDArray[np.float32]:
    """The group's Image (height, width, 4), row 0 at the bottom, of images (h, w) or (h, w, 3) and plain values.

    Into ``seconds``, where it is given, goes the time of every run; there are as many as it has room (None) for.
    """
    scene = bpy.data.scenes.new("evaluate")
    tree, sources = _tree(group, images, values)
    scene.compositing_node_group = tree
    height, width = next(iter(images.values())).shape[:2]
    settings = scene.render
    settings.engine, settings.compositor_device, settings.compositor_precision = "BLENDER_WORKBENCH", device, "FULL"
    settings.resolution_x, settings.resolution_y, settings.resolution_percentage = width, height, 100
    settings.image_settings.media_type = "IMAGE"
    settings.image_settings.file_format, settings.image_settings.color_depth = "OPEN_EXR", "32"
    settings.image_settings.exr_codec, settings.image_settings.color_mode = "ZIP", "RGBA"
    scene.camera = bpy.data.objects.new("evaluate", bpy.data.cameras.new("evaluate"))
    scene.collection.objects.link(scene.camera)
    for run in range(len(seconds) if seconds else 0):
        start = time.perf_counter()
        bpy.ops.render.render(scene=scene.name)
        seconds[run] = time.perf_counter() - start
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "out.exr"
        settings.filepath, settings.use_file_extension = str(path), False
        bpy.ops.render.render(write_still=True, scene=scene.name)
        result = read_image(path)[0]
    camera = scene.camera
    bpy.data.scenes.remove(scene)
    bpy.data.cameras.remove(camera.data)
    bpy.data.node_groups.remove(tree)
    for image in sources:
        bpy.data.images.remove(image)
    return result[::-1]


def _tree(
    group: bpy.types.NodeTree, images: Mapping[str, NDArray], values: Mapping[str, float]
) -> tuple[bpy.types.NodeTree, list[bpy.types.Image]]:
    """A compositor tree with the group between image nodes and the output, and the images."""
    tree = bpy.data.node_groups.new("evaluate", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    node = tree.nodes.new("CompositorNodeGroup")
    node.node_tree = group
    sources = []
    for name, array in images.items():
        height, width = array.shape[:2]
        rgba = np.ones((height, width, 4), np.float32)
        rgba[..., :3] = array if array.ndim == 3 else array[..., None]
        image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True, is_data=True)
        image.pixels.foreach_set(rgba.reshape(-1))
        source = tree.nodes.new("CompositorNodeImage")
        source.image = image
        if array.ndim == 3:
            tree.links.new(source.outputs["Image"], node.inputs[name])
        else:  # a colour would turn into a number by luminance, which rounds
            split = tree.nodes.new("CompositorNodeSeparateColor")
            tree.links.new(source.outputs["Image"], split.inputs["Image"])
            tree.links.new(split.outputs["Red"], node.inputs[name])
        sources.append(image)
    for name, value in values.items():
        node.inputs[name].default_value = value
    end = tree.nodes.new("NodeGroupOutput")
    tree.links.new(node.outputs["Image"], end.inputs["Image"])
    return tree, sources
