"""Bakes larger than memory: maps are read from their files and textures written to theirs, a few tiles at a time."""

from __future__ import annotations

import contextlib
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..files import replacing
from ..makeup.maps import CHANNELS
from .engine import Count, Request, fill
from .files import ExrWriter, open_image
from .texels import WORD


class FileRows:
    """One channel of an image file as rows from the top, read when they are asked for.

    Reading goes forward: an earlier row opens the file again. Raises MakeupError where the file, the channel or its
    pixels are unusable.
    """

    def __init__(self, path: Path, channel: str = "R") -> None:
        self._path, self._next = Path(path), 0
        self._file: Any = None
        source, eight_bit = open_image(self._path)
        spec = source.spec()
        source.close()
        self._channel = CHANNELS.index(channel)
        if self._channel >= spec.nchannels:
            raise MakeupError(f"{path} has {spec.nchannels} channel(s), so no channel {channel}; name one that it has.")
        self._type = "uint8" if eight_bit else "float"
        self._shape = (spec.height, spec.width)

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width)."""
        return self._shape

    @property
    def dtype(self) -> np.dtype:
        """uint8 for 8-bit files, float32 for others."""
        return np.dtype(np.uint8 if self._type == "uint8" else np.float32)

    def rows(self, start: int, stop: int) -> NDArray:
        """Rows start to stop from the top, (rows, width)."""
        if self._file is None or start < self._next:
            self.close()
            self._file, _ = open_image(self._path)
        channel = self._channel
        pixels = self._file.read_scanlines(start, stop, 0, channel, channel + 1, self._type)
        if pixels is None:
            reason = " ".join(self._file.geterror().split())
            raise MakeupError(f"The image {self._path} is damaged ({reason}); save it again as PNG or EXR.")
        self._next = stop
        return np.asarray(pixels).reshape(stop - start, self._shape[1])

    def close(self) -> None:
        """Let go of the file."""
        if self._file is not None:
            self._file.close()
            self._file = None


@dataclass
class FileCanvas:
    """Textures that go to OpenEXR files as their tiles get ready."""

    dtype: np.dtype
    width: int
    writers: Sequence[ExrWriter]

    def tile(self, start: int, stop: int) -> list[NDArray]:
        """Words of their own for every tile."""
        return [np.empty((stop - start) * self.width, WORD[self.dtype]) for _ in self.writers]

    def done(self, start: int, stop: int, words: Sequence[NDArray]) -> None:
        """Write them, without alpha."""
        for writer, one in zip(self.writers, words):
            writer.rows(one.view(self.dtype).reshape(stop - start, self.width, 4)[..., :3])


def baking_to_files(
    request: Request, files: Mapping[str, Path], metadata: Mapping[str, str] | None = None
) -> Generator[tuple[int, int], None, Count]:
    """Bake to ``files`` (a path for each of ``request.textures``), all of them or none; yields (done, total).

    The request's maps are `FileRows`, or `ArrayRows` of the top row first. Memory stays bounded by the tiles under way, except
    for the table of combinations. Raises MakeupError as `fill`, and where the finished albedo is asked for, which needs
    the whole skin texture in memory.
    """
    if request.skin is not None:
        raise MakeupError("The finished albedo is not made in pieces; bake without it, or at a lower resolution.")
    height, width = request.maps[0].shape
    # Two stacks: every file is whole and closed before the first takes its place.
    with contextlib.ExitStack() as places, contextlib.ExitStack() as open_files:
        writers = []
        for name in request.textures:
            path = Path(files[name])
            temporary = places.enter_context(replacing(path))
            writer = ExrWriter(temporary, path, (height, width, 3), request.half, metadata or {})
            writers.append(open_files.enter_context(writer))
        return (yield from fill(request, FileCanvas(request.dtype, width, writers)))
