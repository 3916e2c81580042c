"""OpenEXR files put together from pieces of others: compressed blocks of rows are copied as they are.

OpenImageIO writes and compresses every piece. Only the frame around the blocks is handled here: header, table of places, and
for each block its first row and length (OpenEXR file layout, version 2, one part of scan lines).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from ..errors import MakeupError

MAGIC = 20000630
BLOCK_ROWS = 16
"""Rows that ZIP compresses together; pieces begin at multiples of it."""

NOT_SIMPLE = 0x200 | 0x800 | 0x1000
"""Bits of the version: tiles, deep data, several parts."""

Attributes = dict[bytes, tuple[bytes, bytes]]


@dataclass(frozen=True)
class Blocks:
    """A file's attributes (name to type and value), and where its blocks lie: (offset, length) from the top."""

    path: Path
    attributes: Attributes
    places: Sequence[tuple[int, int]]

    @property
    def rows(self) -> int:
        """Height in rows."""
        _, low, _, high = struct.unpack("<4i", self.attributes[b"dataWindow"][1])
        return high - low + 1

    def text(self, name: str) -> str:
        """A text attribute, empty where there is none."""
        kind, value = self.attributes.get(name.encode(), (b"", b""))
        return value.decode("utf-8", "replace") if kind == b"string" else ""


def read_blocks(path: Path) -> Blocks:
    """The frame of an OpenEXR of scan lines compressed by ZIP; MakeupError where it is none or ends too early."""
    try:
        with path.open("rb") as file:
            attributes = _read_header(file, path)
            _, low, _, high = struct.unpack("<4i", attributes[b"dataWindow"][1])
            if attributes[b"compression"][1] != b"\x03" or attributes[b"lineOrder"][1] != b"\x00":
                raise _broken(path)
            count = -(-(high - low + 1) // BLOCK_ROWS)
            offsets = struct.unpack(f"<{count}Q", file.read(8 * count))
            size = path.stat().st_size
            places = []
            for number, offset in enumerate(offsets):
                file.seek(offset)
                row, length = struct.unpack("<2i", file.read(8))
                if row != low + BLOCK_ROWS * number or length <= 0 or offset + 8 + length > size:
                    raise _broken(path)
                places.append((offset + 8, length))
            return Blocks(path, attributes, places)
    except (OSError, struct.error, KeyError, ValueError):
        raise _broken(path) from None


def _read_header(file: BinaryIO, path: Path) -> Attributes:
    magic, version = struct.unpack("<2i", file.read(8))
    if magic != MAGIC or version & 0xFF != 2 or version & NOT_SIMPLE:
        raise _broken(path)
    attributes: Attributes = {}
    while name := _word(file):
        kind = _word(file)
        (size,) = struct.unpack("<i", file.read(4))
        attributes[name] = (kind, file.read(size))
    return attributes


def _word(file: BinaryIO) -> bytes:
    word = b""
    while (letter := file.read(1)) != b"\0":
        if not letter or len(word) > 255:
            raise ValueError("no end of a name")
        word += letter
    return word


def _broken(path: Path) -> MakeupError:
    return MakeupError(f"{path} is no OpenEXR that pieces can be taken from; bake it again.")


@dataclass(frozen=True)
class Piece:
    """Rows of a file: ``count`` blocks from the ``first`` on."""

    source: Blocks
    first: int
    count: int


def write_spliced(file: Path, pieces: Sequence[Piece], height: int, texts: Mapping[str, str]) -> None:
    """Write an OpenEXR of ``height`` rows from pieces that have the same width and channels, top to bottom.

    ``texts`` are the file's text attributes; those of the pieces that begin with km_makeup are left out.
    """
    first = pieces[0].source
    attributes = {k: v for k, v in first.attributes.items() if not k.startswith(b"km_makeup/")}
    attributes |= {key.encode(): (b"string", value.encode()) for key, value in texts.items()}
    left, _, right, _ = struct.unpack("<4i", first.attributes[b"dataWindow"][1])
    window = struct.pack("<4i", left, 0, right, height - 1)
    for name in (b"dataWindow", b"displayWindow"):
        attributes[name] = (b"box2i", window)
    long_names = 0x400 if any(len(name) > 31 for name in attributes) else 0
    header = struct.pack("<2i", MAGIC, 2 | long_names)
    for name, (kind, value) in sorted(attributes.items()):
        header += name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    lengths = [length for piece in pieces for _, length in _places(piece)]
    place, offsets = len(header) + 8 * len(lengths), []
    for length in lengths:
        offsets.append(place)
        place += 8 + length
    with file.open("wb") as target:
        target.write(header + struct.pack(f"<{len(offsets)}Q", *offsets))
        row = 0
        for piece in pieces:
            with piece.source.path.open("rb") as source:
                for offset, length in _places(piece):
                    source.seek(offset)
                    target.write(struct.pack("<2i", row, length) + source.read(length))
                    row += BLOCK_ROWS


def _places(piece: Piece) -> Sequence[tuple[int, int]]:
    return piece.source.places[piece.first : piece.first + piece.count]
