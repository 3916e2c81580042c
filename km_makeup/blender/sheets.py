"""Contact sheets: pictures in rows with a caption under each, captions in Blender's own font."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import blf
import imbuf
import numpy as np
from numpy.typing import NDArray

from ..bake.files import read_image, write_png
from ..errors import MakeupError

CAPTION = 34
MARGIN = 8
PAPER = 32


def contact_sheet(pictures: Sequence[tuple[str, Path]], target: Path, columns: int) -> Path:
    """Write one PNG of all pictures (8-bit, any sizes; each cell takes the largest), captions below them.

    Parameters: ``pictures`` as (caption, file), row by row.
    """
    if not pictures:
        raise MakeupError("A contact sheet needs at least one picture.")
    images = [_rgb(path) for _, path in pictures]
    height = max(image.shape[0] for image in images)
    width = max(image.shape[1] for image in images)
    rows = -(-len(images) // columns)
    cell = (height + CAPTION + MARGIN, width + MARGIN)
    sheet = np.full((rows * cell[0] + MARGIN, columns * cell[1] + MARGIN, 3), PAPER, np.uint8)
    for i, ((caption, _), image) in enumerate(zip(pictures, images)):
        top, left = MARGIN + (i // columns) * cell[0], MARGIN + (i % columns) * cell[1]
        sheet[top : top + image.shape[0], left : left + image.shape[1]] = image
        label = text_image(caption, width, CAPTION)
        sheet[top + height : top + height + CAPTION, left : left + width] = label
    write_png(target, sheet[::-1])
    return target


def _rgb(path: Path) -> NDArray[np.uint8]:
    pixels, _ = read_image(path)
    if pixels.dtype != np.uint8:
        raise MakeupError(f"{path} is no 8-bit picture; a contact sheet shows PNG files.")
    return pixels[..., :3]


def text_image(text: str, width: int, height: int, size: int = 16) -> NDArray[np.uint8]:
    """White text on the sheet's grey, (height, width, 3), cut off at the right where it is too long."""
    buffer = imbuf.new((width, height))
    blf.size(0, size)
    blf.color(0, 1, 1, 1, 1)
    blf.position(0, 4, (height - size) // 2 + 3, 0)
    with blf.bind_imbuf(0, buffer):
        blf.draw_buffer(0, text)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "caption.png"
        imbuf.write(buffer, filepath=str(file))
        pixels, _ = read_image(file)
    coverage = pixels[..., :1].astype(np.float32) / 255
    return np.rint(PAPER + (235 - PAPER) * np.broadcast_to(coverage, (height, width, 3))).astype(np.uint8)
