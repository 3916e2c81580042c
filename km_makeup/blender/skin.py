"""What the scene knows about the skin under the makeup: its colours, and its texture where it has one."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..makeup.maps import resized
from ..makeup.udim import TileLayout, tile_numbers
from . import images, udim
from .shaders import skin_colour_sockets
from .triangles import spread_over, triangles_of

GRID = 96
COLOURS = 12
POINTS = 4096
"""On a skin's surface, where the mean of its colour is taken."""

Tile = Callable[[int], NDArray[np.float32]]
"""Pixels of an image by the number of the tile."""


@dataclass(frozen=True)
class SkinTexture:
    """An image on the makeup's UV map; with a ``layout``, one whose tiles are gathered there."""

    image: bpy.types.Image
    layout: TileLayout | None

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) at which the makeup's UV map shows no less than the image."""
        if self.layout is None:
            return self.image.size[1], self.image.size[0]
        sizes = [one.size for one in self.image.tiles] if udim.is_tiled(self.image) else [self.image.size]
        return max(s[1] for s in sizes) * self.layout.columns, max(s[0] for s in sizes) * self.layout.columns

    def linear(self, shape: tuple[int, ...]) -> NDArray[np.float32]:
        """Linear RGB (height, width, 3) of the working space, at the shape asked for."""
        if self.layout is not None:
            return self.layout.gathered(self._tile, (shape[0], shape[1]))
        linear = self._tile(udim.FIRST)
        return np.stack([resized(np.ascontiguousarray(linear[..., i]), shape) for i in range(3)], axis=-1).astype(
            np.float32
        )

    def _tile(self, number: int) -> NDArray:
        return _linear(pixels_of(self.image, number), self.image)


def pixels_of(image: bpy.types.Image, number: int) -> NDArray[np.float32]:
    """What an image shows in a UDIM tile, as stored: that tile, or the whole image where it has none."""
    return udim.tile_pixels(image, number) if udim.is_tiled(image) else images.pixels(image)


def _linear(values: NDArray, image: bpy.types.Image) -> NDArray:
    return images.linear_colours(values[..., :3], image, bpy.data.colorspace.working_space)


@dataclass(frozen=True)
class Skin:
    """Colours (count, 3) in linear RGB of the working space, its extremes among them; their mean over the surface (3,).

    ``texture``, if it has one. ``known`` is False where the colour comes from nodes that are not followed; the colours are
    then those of human skin in general.
    """

    colours: NDArray
    mean: NDArray
    texture: SkinTexture | None
    known: bool


def skin_of(materials: list[bpy.types.Material], obj: bpy.types.Object) -> Skin:
    """The skin of an object's chosen materials.

    Raises MakeupError where a material has no shader that can carry makeup, or tiles that are not gathered.
    """
    udim.check_gathered(obj, materials)
    found: list[NDArray] = []
    means: list[NDArray] = []
    textures: list[SkinTexture | None] = []
    known = True
    for material in materials:
        for socket in skin_colour_sockets(material):
            if not socket.is_linked:
                found.append(np.array([tuple(socket.default_value)[:3]]))
                means.append(found[-1][0])
                continue
            node = image_node(socket)
            if node is None:
                known = False
            else:
                textures.append(on_makeup_map(node, obj))
                tile = functools.cache(
                    functools.partial(pixels_of, node.image)
                )  # millions of texels are read once for both
                found.append(_sample(node.image, _tiles(node.image, obj), tile))
                means.append(_mean(node, obj, material, found[-1], tile))
    if not found:
        from ..spectra.people import human_skins

        human = human_skins(bpy.data.colorspace.working_space)
        return Skin(human, human.mean(axis=0), None, False)
    colours = np.concatenate(found)
    one = textures[0] if len(set(textures)) == 1 else None
    return Skin(_representative(colours), np.mean(means, axis=0), one, known)


def image_node(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The image texture that feeds a socket with nothing between."""
    node, out = socket.links[0].from_node, socket.links[0].from_socket
    while node.bl_idname == "NodeReroute" and node.inputs[0].is_linked:
        node, out = node.inputs[0].links[0].from_node, node.inputs[0].links[0].from_socket
    if node.bl_idname != "ShaderNodeTexImage" or node.image is None or out.name != "Color" or node.mute:
        return None
    return node


def colour_uv_maps(material: bpy.types.Material) -> set[str]:
    """The UV maps by name that the textures of a skin's colour are drawn on, where nodes say so."""
    nodes = (image_node(socket) for socket in skin_colour_sockets(material) if socket.is_linked)
    places = (n.inputs["Vector"].links[0].from_node for n in nodes if n is not None and n.inputs["Vector"].is_linked)
    return {place.uv_map for place in places if place.bl_idname == "ShaderNodeUVMap" and place.uv_map}


def on_makeup_map(node: bpy.types.Node, obj: bpy.types.Object) -> SkinTexture | None:
    """What an image texture shows as an image on the makeup's UV map; None where it lies otherwise."""
    drawn = _drawn_on(node, obj)
    if drawn is None:
        return None
    uv_map = obj.km_makeup.uv_map
    layout = udim.layout_of(obj.data, uv_map)
    if drawn == uv_map:
        return SkinTexture(node.image, None)
    return SkinTexture(node.image, layout) if layout and drawn == udim.source_of(obj.data, uv_map) else None


def _drawn_on(node: bpy.types.Node, obj: bpy.types.Object) -> str | None:
    """The UV map that an image texture lies on as it is; None where it lies otherwise."""
    drawn = next((layer.name for layer in obj.data.uv_layers if layer.active_render), "")
    vector = node.inputs["Vector"]
    if vector.is_linked:
        source, place = vector.links[0].from_node, vector.links[0].from_socket.name
        if source.bl_idname == "ShaderNodeUVMap":
            drawn = source.uv_map or drawn
        elif source.bl_idname != "ShaderNodeTexCoord" or place != "UV":
            return None
    return drawn if node.projection == "FLAT" else None


def _tiles(image: bpy.types.Image, obj: bpy.types.Object) -> tuple[int, ...]:
    """The tiles of an image that makeup lies on; none of one that is not tiled."""
    if not udim.is_tiled(image):
        return ()
    layout = udim.layout_of(obj.data, obj.km_makeup.uv_map)
    return layout.tiles if layout else (udim.FIRST,)


_samples: dict[tuple, NDArray] = {}


def forget_samples() -> None:
    """Read every skin texture, and where UV maps lie, again when it is asked for."""
    _samples.clear()
    udim.forget_uvs()


def _key(image: bpy.types.Image) -> tuple:
    """What the colours of an image without unsaved strokes depend on."""
    space = bpy.data.colorspace.working_space
    return image.session_uid, tuple(image.size), image.filepath, image.colorspace_settings.name, space


def _sample(image: bpy.types.Image, tiles: tuple[int, ...], tile: Tile) -> NDArray:
    """Colours of a texture; kept, since reading millions of texels takes longer than all fits, unless it has unsaved strokes."""
    key = (*_key(image), tiles)
    if image.is_dirty or key not in _samples:
        _samples[key] = np.concatenate(_readable(image, tiles or (udim.FIRST,), tile))
    return _samples[key]


def _mean(
    node: bpy.types.Node, obj: bpy.types.Object, material: bpy.types.Material, otherwise: NDArray, tile: Tile
) -> NDArray:
    """Mean colour of a texture over the faces that have the material; that of ``otherwise`` where it cannot be told."""
    image, mesh, drawn = node.image, obj.data, _drawn_on(node, obj)
    if drawn not in mesh.uv_layers or len(mesh.uv_layers[drawn].uv) != len(mesh.loops):  # none while it is edited
        return otherwise.mean(axis=0)
    slots = tuple(i for i, slot in enumerate(obj.material_slots) if slot.material in _with_copies(material, obj))
    key = (*_key(image), mesh.session_uid, drawn, len(mesh.loops), slots)
    if image.is_dirty or key not in _samples:
        uv = spread_over(triangles_of(mesh, drawn), slots, POINTS)
        colours = _colours_at(image, uv, tile)
        _samples[key] = (colours if len(colours) else otherwise).mean(axis=0)
    return _samples[key]


def _with_copies(material: bpy.types.Material, obj: bpy.types.Object) -> set[bpy.types.Material]:
    """A material and what the object has in its place."""
    return {material, *(entry.made for entry in obj.km_makeup.slots if entry.original == material and entry.made)}


def _colours_at(image: bpy.types.Image, uv: NDArray, tile: Tile) -> NDArray:
    """Colours (count, 3) of the texels at places on a UV map, in the tiles of the image that have pixels."""
    numbers = tile_numbers(uv) if udim.is_tiled(image) else np.full(len(uv), udim.FIRST)
    found = [np.zeros((0, 3))]
    for number in np.unique(numbers):
        try:
            values = tile(int(number))
        except MakeupError:
            continue
        height, width = values.shape[:2]
        x, y = (np.floor((uv[numbers == number] % 1) * (width, height))).astype(int).T
        found.append(_linear(values[np.minimum(y, height - 1), np.minimum(x, width - 1)].astype(float), image))
    return np.concatenate(found)


def _readable(image: bpy.types.Image, tiles: tuple[int, ...], tile: Tile) -> list[NDArray]:
    """Colours of those tiles that have pixels; MakeupError where none has."""
    found, problem = [], None
    for number in tiles:
        try:
            found.append(_read(tile(number), image))
        except MakeupError as error:
            problem = error
    if problem is not None and not found:
        raise problem
    return found


def _read(values: NDArray, image: bpy.types.Image) -> NDArray:
    height, width = values.shape[:2]
    rows = np.linspace(0, height - 1, min(GRID, height)).astype(int)
    columns = np.linspace(0, width - 1, min(GRID, width)).astype(int)
    return _linear(values[np.ix_(rows, columns)].reshape(-1, 4).astype(float), image)


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
