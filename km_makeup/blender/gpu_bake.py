"""The many texels of float maps computed by the graphics card: the arithmetic of `bake.colours.optics` and `bake.colours.textures`
in a compute shader, within 2e-6 of it.

The card is never needed. It is taken where a sample of a bake's own texels took it less time than all cores together; how
far ahead it was is remembered for bakes of as many layers and bands.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import bpy
import gpu
import numpy as np
from numpy.typing import NDArray

from ..bake.engine import Prepared
from ..bake.texels import Work
from ..bake.tiles import cores
from .gpu_images import array_of

GROUP, ROW = 64, 1024
"""Texels that the card computes together, and texels in a row of the images they pass in."""

TABLE_ROW = 4096
SAMPLE = 1 << 16
"""Texels that both ways are timed with."""

_shader: gpu.types.GPUShader | None = None
_ahead: dict[tuple[int, int], float] = {}


def available() -> bool:
    """Whether this Blender has a context with compute shaders; a window has."""
    if bpy.app.background:
        return False
    try:
        return bool(gpu.capabilities.compute_shader_support_get())
    except (SystemError, AttributeError):
        return False


def elsewhere(prepared: Prepared) -> Prepared:
    """The same bake on the card where it is faster, else as it was; called where Blender's context is, not in a thread."""
    work = prepared.work
    if prepared.found is not None or work.exact or not available():
        return prepared
    card = on_card(work)
    key = len(work.layers), work.method.bands
    if key not in _ahead:
        _ahead[key] = ahead(work, card)
    return replace(prepared, work=card) if _ahead[key] > 1 else prepared


def on_card(work: Work) -> Work:
    """The same work done by the card."""
    return replace(work, elsewhere=Card(work).textures)


def ahead(work: Work, card: Work) -> float:
    """How many times less the card takes for a sample of texels than all cores."""
    random = np.random.default_rng(0)
    levels = [random.integers(1, layer.levels, SAMPLE) for layer in work.layers]
    seconds = []
    for one in (work, card):
        one.textures([level[:GROUP] for level in levels])  # whatever is to be compiled is
        start = time.perf_counter()
        for first in range(0, SAMPLE, one.block):
            one.textures([level[first : first + one.block] for level in levels])
        seconds.append(time.perf_counter() - start)
    return seconds[0] / cores() / seconds[1]


class Card:
    """The tables of a bake on the card, and what is computed with them."""

    def __init__(self, work: Work) -> None:
        method, ground = work.method, work.ground
        self._layers, self._bands = len(work.layers), method.bands
        self._stride = max(layer.levels for layer in work.layers)
        table = np.zeros((self._layers, self._stride, self._bands, 4), np.float32)
        for place, one in zip(table, method.tables):
            for channel, values in enumerate((one.R, one.T, one.A)):
                place[: values.shape[1], :, channel] = values.T
        self._table = _texture(table.reshape(-1, 4), TABLE_ROW)
        weights = np.zeros((self._bands, 3, 4), np.float32)
        for place, one in enumerate((method.weights.R, method.weights.seen, method.weights.R_up)):
            weights[:, place, :3] = one
        self._skin = (0.0, 0.0, 0.0)
        if method.reference is not None:
            weights[:, 0, 3] = method.reference.spectrum
            self._skin = tuple(float(c) for c in method.reference.rgb)
        self._weights = _texture(weights.reshape(-1, 4), 3)
        self._has = (method.reference is not None, ground.interface is not None)
        interface = ground.interface
        self._k = (0.0, 0.0) if interface is None else (float(interface.k1), float(interface.k2))

    def textures(self, levels: Sequence[NDArray]) -> NDArray[np.float32]:
        """R, T2 and R_up, (3, 3 channels, texels), of levels, one (texels,) a layer."""
        count, groups = len(levels[0]), -(-self._layers // 4)
        packed = np.zeros((count, groups * 4), np.float32)
        for layer, level in enumerate(levels):
            packed[:, layer] = level
        asked = _texture(packed.reshape(-1, 4), ROW * groups)
        rows = -(-count // ROW)
        made = [gpu.types.GPUTexture((ROW, rows), format="RGBA32F") for _ in range(3)]
        shader = _compiled()
        shader.bind()
        for name, texture in (("films", self._table), ("weights", self._weights), ("asked", asked)):
            shader.uniform_sampler(name, texture)
        for name, texture in zip(("out_R", "out_T2", "out_R_up"), made):
            shader.image(name, texture)
        shader.uniform_int("sizes", (count, self._layers, self._bands, self._stride))
        shader.uniform_int("given", tuple(int(one) for one in self._has))
        shader.uniform_float("skin", self._skin)
        shader.uniform_float("surface", self._k)
        gpu.compute.dispatch(shader, ROW // GROUP, rows, 1)
        planes = [array_of(texture.read()).reshape(-1, 4)[:count, :3].T for texture in made]
        return np.stack(planes)


def forget() -> None:
    """Let go of the shader, which must not outlive the context."""
    global _shader
    _shader = None


def _texture(texels: NDArray[np.float32], width: int) -> gpu.types.GPUTexture:
    """Texels (count, 4) as a texture so many wide, filled up with zeros."""
    rows = -(-len(texels) // width)
    flat = np.zeros((rows * width, 4), np.float32)
    flat[: len(texels)] = texels
    data = gpu.types.Buffer("FLOAT", flat.size, flat.reshape(-1))
    return gpu.types.GPUTexture((width, rows), format="RGBA32F", data=data)


def _compiled() -> gpu.types.GPUShader:
    global _shader
    if _shader is None:
        info = gpu.types.GPUShaderCreateInfo()
        info.local_group_size(GROUP, 1)
        for slot, name in enumerate(("films", "weights", "asked")):
            info.sampler(slot, "FLOAT_2D", name)
        for slot, name in enumerate(("out_R", "out_T2", "out_R_up")):
            info.image(slot, "RGBA32F", "FLOAT_2D", name, qualifiers={"WRITE"})
        info.push_constant("IVEC4", "sizes")
        info.push_constant("IVEC2", "given")
        info.push_constant("VEC3", "skin")
        info.push_constant("VEC2", "surface")
        info.define("TABLE_ROW", str(TABLE_ROW))
        info.compute_source(SOURCE)
        _shader = gpu.shader.create_from_info(info)
    return _shader


SOURCE = """
vec3 film(int layer, float level, int band) {
    int at = (layer * sizes.w + int(level)) * sizes.z + band;
    return texelFetch(films, ivec2(at % TABLE_ROW, at / TABLE_ROW), 0).xyz;
}

void main() {
    ivec2 here = ivec2(gl_GlobalInvocationID.xy);
    int row = imageSize(out_R).x;
    if (here.y * row + here.x >= sizes.x) {
        return;
    }
    int groups = (sizes.y + 3) / 4;
    vec3 R = vec3(0.0), seen = vec3(0.0), R_up = vec3(0.0);
    for (int band = 0; band < sizes.z; band++) {
        // The stack so far: from above R, A and T, from below R and T.
        float top = 0.0, absorbed = 0.0, through = 1.0, bottom = 0.0, through_up = 1.0;
        for (int layer = 0; layer < sizes.y; layer++) {
            float level = texelFetch(asked, ivec2(here.x * groups + layer / 4, here.y), 0)[layer % 4];
            if (level == 0.0) {
                continue;
            }
            vec3 upper = film(layer, level, band);
            float bounce = upper.x * top;
            float d = bounce >= 0.5 ? (upper.z + upper.y) + upper.x * (absorbed + through) : 1.0 - bounce;
            d += d <= 0.0 ? 1.0 : 0.0;
            float down = upper.y / d, up = through_up / d;
            bottom = up * upper.x * through + bottom;
            absorbed = (top * upper.z + absorbed) * down + upper.z;
            top = down * top * upper.y + upper.x;
            through = down * through;
            through_up = up * upper.y;
        }
        float film_R = top, round_trip = through * through_up, film_R_up = bottom;
        if (given.y != 0) {
            float k2 = surface.y, c = (1.0 - surface.x) * (1.0 - k2);
            float d = (1.0 - k2) + k2 * (absorbed + through);
            float loss = absorbed + top * (1.0 - k2) + through * (1.0 - through_up);
            film_R = c * top / d;
            round_trip = through * through_up / (d * d);
            film_R_up = (bottom * d - k2 * loss) / (d * c);
        }
        vec4 first = texelFetch(weights, ivec2(0, band), 0);
        R += first.rgb * film_R;
        float other = round_trip;
        if (given.x != 0) {
            other = film_R + round_trip * first.a / max(1.0 - film_R_up * first.a, 1.2e-38);
        }
        seen += texelFetch(weights, ivec2(1, band), 0).rgb * other;
        R_up += texelFetch(weights, ivec2(2, band), 0).rgb * film_R_up;
    }
    if (given.x != 0) {
        seen = (seen - R) * (1.0 - R_up * skin) / max(skin, vec3(1e-6));
    }
    imageStore(out_R, here, vec4(R, 1.0));
    imageStore(out_T2, here, vec4(seen, 1.0));
    imageStore(out_R_up, here, vec4(R_up, 1.0));
}
"""
