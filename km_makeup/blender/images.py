"""Pixels of Blender's images as arrays, and arrays as images."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..makeup import udim as tiles
from ..makeup.maps import CHANNELS, check_map
from ..makeup.statistics import MapStatistics
from ..makeup.statistics import statistics as map_statistics
from ..makeup.udim import TileLayout
from . import udim

IMAGE_KIND = "km_makeup_image"
COSMETIC_MAP = "cosmetic map"
"""Kind of the maps made or loaded here; they are kept in the .blend with their strokes whether a layer uses them or not."""


def pixels(image: bpy.types.Image) -> NDArray[np.float32]:
    """The image as stored, (height, width, 4), bottom row first; encoded values where it is not linear.

    Raises MakeupError where the image is tiled or has no data (its file is missing).
    """
    udim.check_map(image)
    width, height = image.size
    if width == 0 or height == 0:
        raise MakeupError(f"The image {image.name!r} has no pixels: {_lack(image)}.")
    flat = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(flat)
    return flat.reshape(height, width, 4)


def _lack(image: bpy.types.Image) -> str:
    """Why an image has no pixels, and what to do."""
    if image.packed_file:
        return "what is packed in this .blend is damaged; load the image again from its file"
    if Path(bpy.path.abspath(image.filepath)).is_file():
        return f"its file {image.filepath!r} is damaged or no image that Blender reads; save it again as PNG or EXR and reload it"
    return f"its file {image.filepath!r} is missing; find it (File > External Data)"


def map_values(image: bpy.types.Image, channel: str) -> NDArray:
    """One channel of a cosmetic map (height, width): bytes of an 8-bit image, float32 of a float one."""
    values = np.ascontiguousarray(pixels(image)[..., CHANNELS.index(channel)])
    if not image.is_float:
        return np.rint(values * 255).astype(np.uint8)
    return check_map(values, f"The map {image.name!r}")


def statistics(image: bpy.types.Image, channel: str) -> MapStatistics:
    """What is painted on a channel, as last read.

    Reading millions of texels takes longer than everything else that a change of a property needs, so a map that
    was found painted counts as painted until `forget_statistics`; one that was found empty is read again while it
    has unsaved strokes. Of a map that is read again, only rows that changed are looked at.
    """
    key = (image.session_uid, channel, tuple(image.size), image.filepath)
    known = _statistics.get(key)
    if known is None or key in _old or (image.is_dirty and known.maximum == 0):
        _statistics[key] = map_statistics(map_values(image, channel), known)
        _old.discard(key)
    return _statistics[key]


def forget_statistics(image: bpy.types.Image | None = None) -> None:
    """Read this map, or every map, again at the next call of `statistics`: undo changes pixels and leaves no mark."""
    _old.update(key for key in _statistics if image is None or key[0] == image.session_uid)


_statistics: dict[tuple, MapStatistics] = {}
_old: set[tuple] = set()


_packed: dict[int, tuple[int, int]] = {}
"""Size and checksum of what was packed last, by the session_uid of images."""


def pack(image: bpy.types.Image) -> None:
    """Pack an image with its strokes, and remember what was packed, for `mark_undone`."""
    image.pack()
    _packed[image.session_uid] = _held(image)


def _held(image: bpy.types.Image) -> tuple[int, int]:
    """Size and checksum of what is packed; zeros where nothing is."""
    packed = image.packed_file
    return (packed.size, zlib.crc32(packed.data)) if packed else (0, 0)


def mark_undone() -> None:
    """After an undo or a redo: maps whose packed bytes are no longer those that were packed last count as changed.

    Blender brings back what was packed before, keeps the pixels, and takes them for what is packed: a file that is saved then, or
    an image that is read again, would have lost the strokes.
    """
    for image in painted_maps():
        last = _packed.get(image.session_uid)
        if last is not None and not image.is_dirty and min(image.size) > 0 and _held(image) != last:
            flat = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
            image.pixels.foreach_get(flat)
            image.pixels.foreach_set(flat)  # what is set counts as changed


def painted_maps() -> list[bpy.types.Image]:
    """Cosmetic maps and exclusion masks of this file, whether a layer uses them or not."""
    used = [image for obj in bpy.data.objects if obj.km_makeup.layers for image in _maps(obj)]
    used += [image for image in bpy.data.images if image.get(IMAGE_KIND) == COSMETIC_MAP and image.library is None]
    return list(dict.fromkeys(used))


def unsaved_maps() -> list[bpy.types.Image]:
    """Those of them with strokes that are neither in the .blend nor in their files."""
    return [image for image in painted_maps() if image.is_dirty and image.users and min(image.size) > 0]


def _maps(obj: bpy.types.Object) -> list[bpy.types.Image]:
    makeup = obj.km_makeup
    every = [layer.map for layer in makeup.layers] + [makeup.exclusion]
    return [image for image in every if image is not None and image.library is None]


def linear_colours(values: NDArray, image: bpy.types.Image, space: str) -> NDArray:
    """Stored RGB values (..., 3) of an image as linear RGB of the working space.

    sRGB images are decoded (IEC 61966-2-1) and converted; linear and Non-Color ones are taken as they
    are. Raises MakeupError for encodings that are not known here.
    """
    from ..spectra import SPACES, convert

    encoding = image.colorspace_settings.name
    if encoding in ("Non-Color", space):
        return values
    if encoding == "sRGB":
        low = values / 12.92
        high = ((np.maximum(values, 0) + 0.055) / 1.055) ** 2.4
        return convert(np.where(values <= 0.04045, low, high), "Linear Rec.709", space)
    if encoding in SPACES:
        return convert(values, encoding, space)
    raise MakeupError(
        f"The skin texture {image.name!r} is in the colour space {encoding!r}; makeup reads sRGB, Non-Color and "
        f"{', '.join(SPACES)}: choose one of them in the image's settings."
    )


def new_map(name: str, width: int, height: int, full_float: bool = False, value: float = 0.0) -> bpy.types.Image:
    """A cosmetic map of one value, Non-Color, packed into the file so that it cannot be lost.

    Its pixels are set, since Blender packs only what was changed; on an image that is generated, undoing a change of a
    property after the first stroke takes the stroke too.
    """
    image = bpy.data.images.new(name, width, height, alpha=False, float_buffer=full_float, is_data=True)
    image[IMAGE_KIND] = COSMETIC_MAP
    image.pixels.foreach_set(np.tile(np.array([value] * 3 + [1], np.float32), width * height))
    image.update()
    pack(image)
    return image


def image_from_map(name: str, values: NDArray) -> bpy.types.Image:
    """A packed 8-bit or float image of a cosmetic map (height, width), bottom row first."""
    height, width = values.shape
    eight_bit = values.dtype == np.uint8
    image = bpy.data.images.new(name, width, height, alpha=False, float_buffer=not eight_bit, is_data=True)
    image[IMAGE_KIND] = COSMETIC_MAP
    grey = values.astype(np.float32) / (255 if eight_bit else 1)
    rgba = np.empty((height, width, 4), np.float32)
    rgba[..., :3] = grey[..., None]
    rgba[..., 3] = 1
    image.pixels.foreach_set(rgba.reshape(-1))
    image.update()
    pack(image)
    return image


def keep(maps: Iterable[bpy.types.Image | None]) -> None:
    """Keep images in the file though nothing uses them any more, with their unsaved strokes, until the user deletes them."""
    for image in maps:
        if image is not None and image.library is None:
            image.use_fake_user = True
            image[IMAGE_KIND] = COSMETIC_MAP
            if image.is_dirty and min(image.size) > 0:
                pack(image)


def shape_is_in_alpha(image: bpy.types.Image) -> bool:
    """Whether an image has one colour all over and its shape in alpha, as a stamp drawn on a transparent ground has."""
    values = pixels(image)
    return float(np.ptp(values[..., :3], axis=(0, 1)).max()) == 0 and float(np.ptp(values[..., 3])) > 0


def copy_of(image: bpy.types.Image) -> bpy.types.Image:
    """A packed map with the same pixels, unsaved strokes among them."""
    twin = bpy.data.images.new(
        image.name, *image.size, alpha=image.channels == 4, float_buffer=image.is_float, is_data=True
    )
    twin.pixels.foreach_set(pixels(image).reshape(-1))
    twin[IMAGE_KIND] = COSMETIC_MAP
    twin.update()
    pack(twin)
    return twin


@dataclass(frozen=True)
class MovedMap:
    """The four channels (height, width, 4) of a map on other UDIM tiles, and whether some of its paint has no place there."""

    values: NDArray[np.float32]
    loses: bool


def moved(image: bpy.types.Image, old: TileLayout | None, new: TileLayout | None) -> MovedMap:
    """A map as it is where tiles lie otherwise; MakeupError where it cannot be read, or not be replaced."""
    if image.library is not None:
        raise MakeupError(
            f"The map {image.name!r} is linked from another file, so its paint cannot follow the skin's tiles; make it local "
            "(Object > Relations > Make Local)."
        )
    values = pixels(image)
    planes = [tiles.moved(np.ascontiguousarray(values[..., i]), old, new) for i in range(4)]
    if image.channels < 4:
        planes[3] = np.ones_like(planes[0])
    lost = any(tiles.loses(values[..., i], old, new) for i in range(3))
    return MovedMap(np.stack(planes, axis=-1), lost)


def replaced(image: bpy.types.Image, by: MovedMap) -> bpy.types.Image:
    """A packed map of the same kind with other pixels; the map itself stays in the file where some of its paint is only there."""
    height, width = by.values.shape[:2]
    twin = bpy.data.images.new(
        image.name, width, height, alpha=image.channels == 4, float_buffer=image.is_float, is_data=True
    )
    twin[IMAGE_KIND] = COSMETIC_MAP
    twin.pixels.foreach_set(by.values.reshape(-1))
    twin.update()
    pack(twin)
    if by.loses:
        keep([image])
    return twin


def filled_like(image: bpy.types.Image | None, name: str, value: float) -> bpy.types.Image:
    """A packed map of one value, as large and deep as ``image``; 2048x2048 bytes where there is none."""
    width, height = image.size if image is not None and min(image.size) > 0 else (2048, 2048)
    is_float = image is not None and image.is_float
    return new_map(image.name if image is not None else name, width, height, is_float, value)


def load_map(path: str, channel: str, values: NDArray) -> bpy.types.Image:
    """The image file as a Non-Color cosmetic map, packed so that painting on it cannot be lost.

    ``values`` (height, width) are the file's now: the image that is already in the .blend is taken where its
    ``channel`` holds them. One that was painted on since, or is older than the file, stays as it is, and the
    file comes in beside it.
    """
    for image in bpy.data.images:
        same_file = image.filepath and bpy.path.abspath(image.filepath) == path and min(image.size) > 0
        if not same_file or image.colorspace_settings.name != "Non-Color":
            continue
        if np.array_equal(map_values(image, channel), values):
            return image
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    image[IMAGE_KIND] = COSMETIC_MAP
    if not image.packed_file:
        pack(image)
    return image


def load_texture(path: str, kind: str) -> bpy.types.Image:
    """A baked texture from its file, read again if it is in the file already."""
    for image in bpy.data.images:
        if image.get(IMAGE_KIND) == kind and bpy.path.abspath(image.filepath) == bpy.path.abspath(path):
            image.reload()
            return image
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    image[IMAGE_KIND] = kind
    return image
