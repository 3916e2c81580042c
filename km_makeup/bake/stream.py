"""Bakes larger than memory, and again after a change: maps are read from their files and textures written to theirs, a few
tiles at a time, and stripes of the textures that would be the same are left as they are.
"""

from __future__ import annotations

import contextlib
import hashlib
import shutil
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError
from ..files import common_folder, finish_swaps, replacing, together, write_text
from ..makeup.maps import CHANNELS
from ..steps import Steps
from .engine import (
    Count,
    Elsewhere,
    Prepared,
    Request,
    counted,
    filling,
    finished_albedo,
    layers_of,
    looking_again,
    preparing,
    size_of,
)
from .files import ExrWriter, check_end, damaged, open_image, write_exr
from .levels import Tile, read_tiles
from .splice import BLOCK_ROWS, Piece, read_blocks, write_spliced
from .texels import WORD
from .tiles import in_order, row_tiles

Result = TypeVar("Result")

STRIPE_TEXELS = 1 << 21
"""Texels that are skipped, or kept when a bake is stopped, together: 512 rows of 4096."""

STRIPES = "km_makeup/stripes"
"""Attribute of the files: of every stripe its key, and how many of its texels are painted and out of gamut."""


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
            raise damaged(self._path, self._file.geterror())
        self._next = stop
        return np.asarray(pixels).reshape(stop - start, self._shape[1])

    def close(self) -> None:
        """Let go of the file."""
        if self._file is not None:
            self._file.close()
            self._file = None


@dataclass(frozen=True)
class Stripe:
    """Rows that are written, kept and skipped together: where, and what they hold (the digest of all they depend on)."""

    start: int
    stop: int
    key: str = ""

    def tiles(self, width: int) -> list[tuple[int, int]]:
        """Its tiles."""
        return [(self.start + a, self.start + b) for a, b in row_tiles(self.stop - self.start, width)]


def stripes_of(height: int, width: int) -> list[Stripe]:
    """The map in stripes of about `STRIPE_TEXELS`, of whole blocks of the files' compression."""
    step = max(BLOCK_ROWS, STRIPE_TEXELS // width // BLOCK_ROWS * BLOCK_ROWS)
    return [Stripe(start, min(start + step, height)) for start in range(0, height, step)]


class StripeCanvas:
    """Textures that go to files of a stripe each, named by what they hold, as their tiles get ready."""

    def __init__(self, request: Request, width: int, stripes: Sequence[Stripe], folder: Path) -> None:
        self.dtype = request.dtype
        self._request, self._width, self._folder = request, width, folder
        self._left = list(stripes)
        self._open = contextlib.ExitStack()
        self._writers: list[ExrWriter] = []
        self._counts = np.zeros(2, int)

    def tile(self, start: int, stop: int) -> list[NDArray]:
        """Words of their own for every tile."""
        return [np.empty((stop - start) * self._width, WORD[self.dtype]) for _ in self._request.textures]

    def done(self, start: int, stop: int, words: Sequence[NDArray], counts: tuple[int, int]) -> None:
        """Write them, without alpha."""
        stripe = self._left[0]
        if start == stripe.start:
            self._begin(stripe)
        for writer, one in zip(self._writers, words):
            writer.rows(one.view(self.dtype).reshape(stop - start, self._width, 4)[..., :3])
        self._counts += counts
        if stop == stripe.stop:
            self._open.close()
            note = stripe_file(self._folder, stripe, "counts").with_suffix(".txt")
            write_text(note, f"{self._counts[0]} {self._counts[1]}")
            self._left.pop(0)

    def _begin(self, stripe: Stripe) -> None:
        self._writers, self._counts = [], np.zeros(2, int)
        self._open = contextlib.ExitStack()
        for name in self._request.textures:
            path = stripe_file(self._folder, stripe, name)
            temporary = self._open.enter_context(replacing(path))
            shape = (stripe.stop - stripe.start, self._width, 3)
            self._writers.append(self._open.enter_context(ExrWriter(temporary, path, shape, self._request.half, {})))

    def stop(self) -> None:
        """Let go of the stripe that is under way; the ones that are whole stay."""
        if self._left and self._writers:
            self._open.__exit__(GeneratorExit, GeneratorExit(), None)


def stripe_file(folder: Path, stripe: Stripe, texture: str) -> Path:
    """Where a texture's stripe lies while the bake is under way."""
    return folder / f"{stripe.key}-{texture}.exr"


@dataclass(frozen=True)
class Known:
    """A stripe that need not be computed: its pieces by texture, and the texels painted and out of gamut in it."""

    pieces: Mapping[str, Piece]
    counts: tuple[int, int]


def baking_to_files(
    request: Request,
    files: Mapping[str, Path],
    metadata: Mapping[str, str] | None = None,
    elsewhere: Elsewhere | None = None,
    beside: Callable[[], object] | None = None,
) -> Generator[tuple[int, int], None, Count]:
    """Bake to ``files`` (a path for each of ``request.textures``, and "albedo" where a skin is given), all of them or none.

    Yields (done, total). The request's maps are `FileRows`, or `ArrayRows` of the top row first, as is its skin. Memory stays bounded by the tiles under way, except
    for the table of combinations. Only stripes whose painted values or method differ from those of the files that are
    there are computed. A bake that is stopped or killed leaves those files as they are, and the stripes it finished in a
    hidden folder beside them, from which the next one goes on. ``elsewhere`` may compute them, such as a graphics card.
    ``beside`` writes further files that are to take their places with these; it reads them by `files.written`.

    Raises MakeupError as `fill`.
    """
    paths = {name: Path(files[name]) for name in request.textures}
    finish_swaps(common_folder(paths.values()))
    keyed = yield from _keyed(request, len(row_tiles(*size_of(request))))
    job = _Job(request, paths, keyed)
    try:
        yield from job.compute(elsewhere)
        return (yield from job.put_together(files, metadata or {}, beside))
    except MakeupError:
        shutil.rmtree(job.folder, ignore_errors=True)  # a full disk has use for the room
        raise


def _keyed(request: Request, tiles: int) -> Generator[tuple[int, int], None, tuple[Prepared, list[Stripe]]]:
    """The method, and the stripes with the keys of what they should hold."""
    stripes = stripes_of(*size_of(request))
    done, total, digests = 0, len(stripes) + 2 * tiles, []
    for digest in _painted_digests(request, stripes):
        digests.append(digest)
        done += 1
        yield done, total
    looking = Steps(preparing(request))
    for step in looking:
        done += step
        yield done, max(total, done)
    prepared = looking.result
    method = prepared.digest
    return prepared, [replace(s, key=_key(method, digest)) for s, digest in zip(stripes, digests)]


class _Job:
    """A bake to files: which stripes there are, which are known, and where new ones go."""

    def __init__(self, request: Request, paths: Mapping[str, Path], keyed: tuple[Prepared, list[Stripe]]) -> None:
        self.request, self.paths = request, paths
        self.prepared, self.stripes = keyed
        self.height, self.width = size_of(request)
        self.home = common_folder(paths.values())
        name = _key(*(path.name.encode() for path in paths.values()))
        self.folder = self.home / f".km_makeup-bake-{name[:12]}"
        self.known = self._known()

    def compute(self, elsewhere: Elsewhere | None = None) -> Generator[tuple[int, int], None, None]:
        """Compute the stripes that are not known, each kind once; yields (done, total)."""
        missing = {stripe.key: stripe for stripe in reversed(self.stripes) if stripe.key not in self.known}
        stripes = list(missing.values())[::-1]
        tiles = [tile for stripe in stripes for tile in stripe.tiles(self.width)]
        if not tiles:
            return
        self.folder.mkdir(exist_ok=True)
        done, total = 0, 2 * len(tiles)
        here = self.prepared if elsewhere is None else elsewhere(self.prepared)
        if len(stripes) < len(self.stripes):
            here = yield from _quietly(looking_again(here, tiles), len(tiles), total)
        canvas = StripeCanvas(self.request, self.width, stripes, self.folder)
        try:
            for _ in filling(here, tiles, canvas):
                done = min(done + 1, len(tiles))
                yield len(tiles) + done, total
        finally:
            canvas.stop()
        self.known = self._known()

    def put_together(
        self, files: Mapping[str, Path], metadata: Mapping[str, str], beside: Callable[[], object] | None
    ) -> Generator[tuple[int, int], None, Count]:
        """Put the files in place, those that are not what they should be."""
        known = [self.known[stripe.key] for stripe in self.stripes]
        texts = {f"km_makeup/{key}": value for key, value in metadata.items()}
        texts["km_makeup/bands"] = str(self.prepared.work.method.bands)
        texts[STRIPES] = " ".join(f"{s.key}:{one.counts[0]}:{one.counts[1]}" for s, one in zip(self.stripes, known))
        stale = not _same_texts(self.paths.values(), texts)
        albedo, of_albedo = None, {**texts, "km_makeup/skin": _skin_digest(self.request)}
        if self.request.skin is not None and not _same_texts([Path(files["albedo"])], of_albedo):
            albedo = yield from _quietly(finished_albedo(self.request), 1, 1)
        if stale or albedo is not None or beside:
            with together(self.home):
                for name, path in self.paths.items() if stale else ():
                    with replacing(path) as temporary:
                        _splice(temporary, path, [one.pieces[name] for one in known], self.height, texts)
                if albedo is not None:
                    plain = {key.removeprefix("km_makeup/"): value for key, value in of_albedo.items()}
                    write_exr(Path(files["albedo"]), albedo[::-1], self.request.half, plain)
                if beside:
                    beside()
        shutil.rmtree(self.folder, ignore_errors=True)
        return counted(self.prepared, np.sum([one.counts for one in known], axis=0))

    def _known(self) -> dict[str, Known]:
        """The stripes that lie in the files that are there, or were finished by a bake that was stopped."""
        found = self._in_files()
        for stripe in self.stripes:
            note = stripe_file(self.folder, stripe, "counts").with_suffix(".txt")
            if stripe.key in found or not note.exists():
                continue
            try:
                blocks = {name: read_blocks(stripe_file(self.folder, stripe, name)) for name in self.paths}
                painted, outside = (int(word) for word in note.read_text(encoding="utf-8").split())
            except (MakeupError, OSError, ValueError):
                continue
            if all(one.rows == stripe.stop - stripe.start for one in blocks.values()):
                pieces = {name: Piece(one, 0, len(one.places)) for name, one in blocks.items()}
                found[stripe.key] = Known(pieces, (painted, outside))
        return found

    def _in_files(self) -> dict[str, Known]:
        """Of the files that are there the stripes that hold what they should."""
        try:
            blocks = {name: read_blocks(path) for name, path in self.paths.items()}
        except MakeupError:
            return {}
        texts = {one.text(STRIPES) for one in blocks.values()}
        if len(texts) != 1 or any(one.rows != self.height for one in blocks.values()):
            return {}
        found = {}
        for stripe, text in zip(self.stripes, texts.pop().split()):
            key, _, counts = text.partition(":")
            first, last = stripe.start // BLOCK_ROWS, -(-stripe.stop // BLOCK_ROWS)
            if key == stripe.key:
                painted, _, outside = counts.partition(":")
                pieces = {name: Piece(one, first, last - first) for name, one in blocks.items()}
                found[key] = Known(pieces, (int(painted), int(outside)))
        return found


def _quietly(steps: Generator[int, None, Result], done: int, total: int) -> Generator[tuple[int, int], None, Result]:
    """The steps, without any progress."""
    whole = Steps(steps)
    for _ in whole:
        yield done, total
    return whole.result


def _skin_digest(request: Request) -> str:
    """What the finished albedo depends on besides the stack."""
    if request.skin is None:
        return ""
    return _key(np.ascontiguousarray(request.skin).tobytes(), repr((request.light, request.tolerance)).encode())


def _key(*parts: bytes) -> str:
    made = hashlib.blake2b(digest_size=12)
    for part in parts:
        made.update(part + b"/")
    return made.hexdigest()


def _painted_digests(request: Request, stripes: Sequence[Stripe]) -> Generator[bytes, None, None]:
    """Of every stripe a digest of what the layers' maps hold there."""
    layers = layers_of(request)

    def digest(tile: Tile) -> bytes:
        made = hashlib.blake2b(digest_size=16)
        for rows in tile.sources:
            made.update(np.ascontiguousarray(rows).data)
        return made.digest()

    yield from in_order(digest, read_tiles(layers, [(s.start, s.stop) for s in stripes]))


def _same_texts(paths: Iterable[Path], texts: Mapping[str, str]) -> bool:
    """Whether the files say of themselves what they should."""
    for path in paths:
        try:
            attributes = read_blocks(path).attributes
        except MakeupError:
            return False
        there = {
            name.decode(): value.decode("utf-8", "replace")
            for name, (_, value) in attributes.items()
            if name.startswith(b"km_makeup/")
        }
        if there != dict(texts):
            return False
    return True


def _splice(file: Path, path: Path, pieces: Sequence[Piece], height: int, texts: Mapping[str, str]) -> None:
    try:
        write_spliced(file, pieces, height, texts)
    except OSError as error:
        raise MakeupError(f"Cannot write {path}: {error.strerror}; is the disk full?") from None
    check_end(file, path)
