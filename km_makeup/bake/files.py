"""Images in and out through OpenImageIO, imported on first use."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..files import common_folder, replacing, together
from ..makeup.maps import CHANNELS, check_map

ROWS = 64
"""Rows written at a time: a few of the blocks of 16 that the compression works on."""


def _oiio() -> ModuleType:
    try:
        import OpenImageIO
    except ImportError:
        raise MakeupError(
            "OpenImageIO is not there: Blender brings it; with the bpy module run tests/run or sample_blend/run once, "
            "which set it up."
        ) from None
    return OpenImageIO


def open_image(path: Path) -> tuple[Any, bool]:
    """An image file opened by OpenImageIO, and whether it is stored in bytes; MakeupError where it is missing or unreadable."""
    oiio = _oiio()
    if not path.is_file():
        raise MakeupError(f"The image {path} does not exist; check the path.")
    source = oiio.ImageInput.open(str(path), _as_stored(oiio))
    if source is None:
        raise MakeupError(
            f"The image {path} cannot be read ({' '.join(oiio.geterror().split())}); save it again as PNG or EXR."
        )
    return source, source.spec().format == oiio.TypeDesc("uint8")


def read_image(path: Path) -> tuple[NDArray, list[str]]:
    """An image as stored, (height, width, channels) uint8 or float32, top row first, and its channel names.

    16-bit integers come as float32 0..1. Raises MakeupError where the file is missing or unreadable.
    """
    source, eight_bit = open_image(Path(path))
    try:
        pixels = source.read_image("uint8" if eight_bit else "float")
        if pixels is None:
            raise damaged(path, source.geterror())
        names = list(source.spec().channelnames)
    finally:
        source.close()
    return np.atleast_3d(np.asarray(pixels)), names


def damaged(path: Path, reason: str) -> MakeupError:
    """The error for an image whose pixels cannot be read; OpenImageIO gives several reasons, of which one is said."""
    first = " ".join(reason.split()).split(":")[0] or "no pixels"
    said = "it is cut off" if "end of file" in reason.lower() else first
    return MakeupError(f"The image {path} is damaged ({said}); save it again as PNG or EXR.")


def _as_stored(oiio: ModuleType, *spec: object) -> Any:
    """A specification that keeps colours apart from alpha: the channels of a map are layers, none is a transparency."""
    wanted = oiio.ImageSpec(*spec)
    wanted.attribute("oiio:UnassociatedAlpha", 1)
    return wanted


def read_map(path: Path, channel: str = "R") -> NDArray:
    """One cosmetic map (height, width): the given channel of an image, bottom row first as Blender stores it.

    Raises MakeupError where the file, the channel or the values are unusable.
    """
    pixels, _ = read_image(path)
    index = CHANNELS.index(channel)
    if index >= pixels.shape[2]:
        raise MakeupError(f"{path} has {pixels.shape[2]} channel(s), so no channel {channel}; name one that it has.")
    return check_map(np.ascontiguousarray(pixels[::-1, :, index]), str(path))


def write_exr(path: Path, pixels: NDArray, half: bool = True, metadata: Mapping[str, str] | None = None) -> None:
    """One OpenEXR, as `write_exrs`."""
    write_exrs({path: pixels}, half, metadata)


def write_exrs(pictures: Mapping[Path, NDArray], half: bool = True, metadata: Mapping[str, str] | None = None) -> None:
    """OpenEXR files of linear values (height, width, channels), bottom row first: all of them or none.

    Each is written to a temporary name first; only when all are whole do they take their places (`files.together`).

    ``half`` writes 16-bit floats, otherwise 32-bit. ``metadata`` goes into the header; no time of day is
    written, so that the same pixels give the same bytes.
    """
    with together(common_folder(pictures)):
        for path, pixels in pictures.items():
            with replacing(Path(path)) as temporary:
                _write_exr(temporary, Path(path), pixels, half, metadata or {})


def _write_exr(file: Path, path: Path, pixels: NDArray, half: bool, metadata: Mapping[str, str]) -> None:
    height, width, channels = pixels.shape
    with ExrWriter(file, path, (height, width, channels), half, metadata) as writer:
        for top in range(0, height, ROWS):
            writer.rows(pixels[::-1][top : top + ROWS])


class ExrWriter:
    """An OpenEXR written from the top, rows at a time; a context manager that checks at its end that all of it is there.

    Parameters: ``file`` to write, ``path`` to name in messages, shape (height, width, channels), 16- or 32-bit floats.
    Raises MakeupError where the file cannot be written or the disk is full.
    """

    def __init__(
        self, file: Path, path: Path, shape: tuple[int, int, int], half: bool, metadata: Mapping[str, str]
    ) -> None:
        self._oiio, self._file, self._path, self._top = _oiio(), file, path, 0
        height, width, channels = shape
        spec = self._oiio.ImageSpec(width, height, channels, "half" if half else "float")
        spec.attribute("compression", "zip")
        spec.attribute("DateTime", "")
        for key, value in metadata.items():
            spec.attribute(f"km_makeup/{key}", value)
        self._target = self._oiio.ImageOutput.create(str(file))
        if self._target is None or not self._target.open(str(file), spec):
            raise MakeupError(
                f"Cannot write {path} ({self._oiio.geterror().strip()}); check the folder and the free space."
            )

    def rows(self, pixels: NDArray) -> None:
        """The next rows (rows, width, channels), from the top."""
        kept = np.float16 if pixels.dtype == np.float16 else np.float32
        stop = self._top + len(pixels)
        if not self._target.write_scanlines(self._top, stop, 0, np.ascontiguousarray(pixels, dtype=kept)):
            raise MakeupError(f"Cannot write {self._path} ({self._target.geterror().strip()}); is the disk full?")
        self._top = stop

    def __enter__(self) -> ExrWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        closed = self._target.close()
        if kind is not None:
            return
        if not closed:
            raise MakeupError(f"Cannot write {self._path} ({self._target.geterror().strip()}); is the disk full?")
        check_end(self._file, self._path)


def check_end(file: Path, path: Path) -> None:
    """MakeupError where the last rows of a file just written cannot be read.

    What a full disk refuses at the very end, when the file is closed, OpenImageIO does not report.
    """
    source = _oiio().ImageInput.open(str(file))
    whole = False
    if source is not None:
        spec = source.spec()
        whole = source.read_scanlines(spec.height - 1, spec.height, 0, 0, spec.nchannels) is not None
        source.geterror()
        source.close()
    if not whole:
        raise MakeupError(f"Cannot write {path}: it ends too early; is the disk full?")


def write_png(path: Path, pixels: NDArray) -> None:
    """An 8-bit PNG of the bytes (height, width[, channels]), bottom row first, whole or not at all."""
    with replacing(Path(path)) as temporary:
        write_picture(temporary, Path(path), pixels, {})


def write_picture(file: Path, path: Path, pixels: NDArray, metadata: Mapping[str, str]) -> None:
    """Bytes as PNG, floats as 16-bit OpenEXR, (height, width[, channels]), bottom row first, to ``file`` as it is.

    ``path`` is the name in messages: the file is to take its place (`files.replacing`). ``metadata`` goes into the header.
    """
    if pixels.dtype != np.uint8:
        _write_exr(file, path, np.atleast_3d(pixels), True, metadata)
        return
    oiio = _oiio()
    rows = np.atleast_3d(pixels)[::-1]
    spec = _as_stored(oiio, rows.shape[1], rows.shape[0], rows.shape[2], "uint8")
    for key, value in metadata.items():
        spec.attribute(f"km_makeup/{key}", value)
    target = oiio.ImageOutput.create(str(file))
    if target is None or not target.open(str(file), spec) or not target.write_image(np.ascontiguousarray(rows)):
        raise MakeupError(f"Cannot write {path} ({oiio.geterror().strip()}); check the folder and the free space.")
    target.close()
    check_end(file, path)
