"""Parts of Blender's images on the graphics card: read a rectangle of one, write a rectangle into one with its mip-maps.

Python reaches an image's pixels as a whole only, which takes a quarter of a second at 4096 x 4096. The image's texture on
the card can be read and drawn into in parts. What is drawn there is seen at once and is gone when Blender fills the texture again
from the image, so the image has to follow.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from numpy.typing import NDArray

from ..bake.touch import Rectangle

LEVELS = 5
"""Mip levels that are written: rectangles lie on multiples of 2**(LEVELS - 1)."""

ALIGNED = 1 << (LEVELS - 1)

_shader: gpu.types.GPUShader | None = None


def usable(image: bpy.types.Image) -> bool:
    """Whether the image's texture on the card has all of its texels, and can be reached from here."""
    if bpy.app.background:
        return False
    texture = gpu.texture.from_image(image)
    return (texture.width, texture.height) == tuple(image.size)


def load(images: Iterable[bpy.types.Image]) -> None:
    """Put images on the card, which takes seconds for large ones, and the shader: not in the middle of a stroke."""
    if bpy.app.background:
        return
    for image in images:
        gpu.texture.from_image(image)
    _patch_shader()


def read(image: bpy.types.Image, place: Rectangle, level: int = 0) -> NDArray[np.uint8]:
    """A rectangle of an 8-bit image (rows, columns, 4), at a mip level; rows from the bottom."""
    height, width = place.bottom - place.top, place.right - place.left
    data = gpu.types.Buffer("UBYTE", (height, width, 4))
    frame = gpu.types.GPUFrameBuffer(color_slots=({"texture": gpu.texture.from_image(image), "mip": level},))
    with frame.bind():
        frame.read_color(place.left, place.top, width, height, 4, 0, "UBYTE", data=data)
    return array_of(data)


def array_of(data: gpu.types.Buffer) -> NDArray:
    """A buffer as an array. Blender 5.0 says in the wrong order how far apart elements of more than one dimension are."""
    shape = list(data.dimensions)
    data.dimensions = int(np.prod(shape))
    return np.asarray(data).reshape(shape)


def write(image: bpy.types.Image, place: Rectangle, texels: NDArray) -> None:
    """Draw texels (rows, columns, 4) into an image's texture and its mip-maps; the rectangle is `ALIGNED`."""
    height, width = texels.shape[:2]
    flat = np.ascontiguousarray(texels, dtype=np.float32).reshape(-1)
    patch = gpu.types.GPUTexture((width, height), format="RGBA32F", data=gpu.types.Buffer("FLOAT", flat.size, flat))
    target, shader = gpu.texture.from_image(image), _patch_shader()
    full_width, full_height = image.size
    for level in range(LEVELS):
        frame = gpu.types.GPUFrameBuffer(color_slots=({"texture": target, "mip": level},))
        size = max(full_width >> level, 1), max(full_height >> level, 1)
        left, bottom = place.left >> level, place.top >> level
        right, top = left + (width >> level), bottom + (height >> level)
        with frame.bind():
            frame.viewport_set(0, 0, *size)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("NONE")
            gpu.state.depth_mask_set(False)
            shader.bind()
            shader.uniform_sampler("patch_texels", patch)
            shader.uniform_int("origin", (left, bottom))
            shader.uniform_int("level", level)
            _rectangle(shader, (left, bottom, right, top), size).draw(shader)


def forget() -> None:
    """Let go of the shader, which must not outlive the context."""
    global _shader
    _shader = None


def _rectangle(shader: gpu.types.GPUShader, sides: Sequence[int], size: Sequence[int]) -> gpu.types.GPUBatch:
    x0, y0, x1, y1 = (2 * side / size[i % 2] - 1 for i, side in enumerate(sides))
    return batch_for_shader(shader, "TRI_STRIP", {"corner": [(x0, y0), (x1, y0), (x0, y1), (x1, y1)]})


def _patch_shader() -> gpu.types.GPUShader:
    global _shader
    if _shader is None:
        info = gpu.types.GPUShaderCreateInfo()
        info.vertex_in(0, "VEC2", "corner")
        info.sampler(0, "FLOAT_2D", "patch_texels")
        info.push_constant("IVEC2", "origin")
        info.push_constant("INT", "level")
        info.fragment_out(0, "VEC4", "texel")
        info.vertex_source("void main() { gl_Position = vec4(corner, 0.0, 1.0); }")
        info.fragment_source(
            """
            void main() {
                ivec2 first = (ivec2(gl_FragCoord.xy) - origin) << level;
                int count = 1 << level;
                vec4 total = vec4(0.0);
                for (int y = 0; y < count; y++) {
                    for (int x = 0; x < count; x++) {
                        total += texelFetch(patch_texels, first + ivec2(x, y), 0);
                    }
                }
                texel = total / float(count * count);
            }
            """
        )
        _shader = gpu.shader.create_from_info(info)
    return _shader
