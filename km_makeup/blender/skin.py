"""What the scene knows about the skin under the makeup: its colours, and its texture where it has one."""

from __future__ import annotations

import re
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from . import images, udim
from .shaders import skin_colour_sockets

GRID = 96
COLOURS = 12


@dataclass(frozen=True)
class Skin:
    """Colours (count, 3) in linear RGB of the working space that stand for the skin; its texture, if it has one.

    ``known`` is False where the colour comes from nodes that are not followed; the colours are then
    those of human skin in general.
    """

    colours: NDArray
    texture: bpy.types.Image | None
    known: bool

    @property
    def mean(self) -> NDArray:
        """Mean colour (3,)."""
        return self.colours.mean(axis=0)


def skin_of(materials: list[bpy.types.Material], uv_map: str) -> Skin:
    """The skin of an object's chosen materials.

    Raises MakeupError where a material has no shader that can carry makeup, or a tiled texture.
    """
    udim.check_skin(materials)
    space = bpy.data.colorspace.working_space
    found: list[NDArray] = []
    texture = None
    known = True
    for material in materials:
        for socket in skin_colour_sockets(material):
            if not socket.is_linked:
                found.append(np.array([tuple(socket.default_value)[:3]]))
                continue
            image = _direct_image(socket, uv_map)
            if image is None:
                known = False
            else:
                texture = image
                found.append(_sample(image, space))
    if not found:
        from ..spectra.people import human_skins

        return Skin(human_skins(space), None, False)
    colours = np.concatenate(found)
    return Skin(_representative(colours), texture, known)


def _direct_image(socket: bpy.types.NodeSocket, uv_map: str) -> bpy.types.Image | None:
    """The image that feeds a colour socket with nothing between, on the makeup's UV map."""
    node = socket.links[0].from_node
    while node.bl_idname == "NodeReroute" and node.inputs[0].is_linked:
        node = node.inputs[0].links[0].from_node
    if node.bl_idname != "ShaderNodeTexImage" or node.image is None or socket.links[0].from_socket.name != "Color":
        return None
    vector = node.inputs["Vector"]
    if vector.is_linked:
        source = vector.links[0].from_node
        if source.bl_idname != "ShaderNodeUVMap" or source.uv_map not in ("", uv_map):
            return None
    return node.image


_samples: dict[tuple, NDArray] = {}


def forget_samples() -> None:
    """Read every skin texture again when it is asked for."""
    _samples.clear()


def _sample(image: bpy.types.Image, space: str) -> NDArray:
    """Colours of a texture; kept, since reading millions of texels takes longer than all fits, unless it has unsaved strokes."""
    key = (image.session_uid, tuple(image.size), image.filepath, image.colorspace_settings.name, space)
    if image.is_dirty or key not in _samples:
        _samples[key] = _read(image, space)
    return _samples[key]


def _read(image: bpy.types.Image, space: str) -> NDArray:
    values = images.pixels(image)[..., :3]
    height, width = values.shape[:2]
    rows = np.linspace(0, height - 1, min(GRID, height)).astype(int)
    columns = np.linspace(0, width - 1, min(GRID, width)).astype(int)
    return images.linear_colours(values[np.ix_(rows, columns)].reshape(-1, 3).astype(float), image, space)


def _representative(colours: NDArray) -> NDArray:
    """A few colours spread over the given ones: farthest-point sampling from the one nearest the median.

    The outermost two per cent in luminance (eyes, gaps between UV islands) are left aside.
    """
    light = colours.mean(axis=1)
    low, high = np.quantile(light, [0.02, 0.98])
    kept = np.unique(np.round(colours[(light >= low) & (light <= high) & (light > 0.005)], 4), axis=0)
    if len(kept) == 0:
        kept = np.unique(colours, axis=0)
    chosen = [int(np.argmin(np.abs(kept - np.median(kept, axis=0)).sum(axis=1)))]
    distance = np.linalg.norm(kept - kept[chosen[0]], axis=1)
    while len(chosen) < min(COLOURS, len(kept)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(kept - kept[chosen[-1]], axis=1))
    return kept[chosen]


NOT_SKIN = {
    "eye", "eyes", "eyeball", "cornea", "iris", "sclera", "pupil", "lens", "tear", "tearline", "caruncle", "lash", "lashes",
    "eyelash", "eyelashes", "brow", "brows", "eyebrow", "eyebrows", "hair", "beard", "stubble", "tooth", "teeth", "tongue",
    "gum", "gums", "nail", "nails", "cloth", "clothes", "shirt", "glasses", "helper",
}  # fmt: skip
"""Words in a material's name by which it is taken for something else than skin."""


def looks_like_skin(material: bpy.types.Material, name: str) -> bool:
    """Whether a material that makeup can lie on is skin by its ``name`` and lets no light through."""
    words = set(re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()))
    transmission = [
        socket.node.inputs["Transmission Weight"]
        for socket in skin_colour_sockets(material)
        if "Transmission Weight" in socket.node.inputs
    ]
    glass = any(not one.is_linked and one.default_value > 0.5 for one in transmission)
    return not words & NOT_SKIN and not glass
