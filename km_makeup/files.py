"""Files are written whole or not at all: to a temporary name beside the target, then renamed.

Files that belong together take their places together: `together` notes in a small file which temporary file is to become
which before it renames the first, so that renaming which was cut short is brought to its end by `finish_swaps`.
"""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
import time
import uuid
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from pathlib import Path

from .errors import MakeupError

PART = ".part"
"""In the name of every temporary file."""

SWAP = ".km_makeup-swap-"
"""Start of the name of the note on files that are about to take their places."""

ABANDONED = 24 * 3600
"""Seconds after which a temporary file is what a killed process left, and is removed."""

_gathered: ContextVar[list[tuple[Path, Path]] | None] = ContextVar("_gathered", default=None)


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path to write to; when the block ends well it takes the place of ``path``.

    Inside `together` it does so when that block ends. The temporary file keeps the suffix of ``path``, since image
    writers choose the format by it.

    Raises MakeupError where the folder is missing or read-only, or the disk is full.
    """
    path = Path(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=PART + path.suffix, dir=path.parent)
    except OSError as error:
        raise MakeupError(f"Cannot write {path}: {error.strerror}; choose a folder you may write to.") from None
    os.close(handle)
    temporary, kept = Path(name), False
    try:
        yield temporary
        with temporary.open("rb") as written:
            os.fsync(written.fileno())
        os.chmod(temporary, 0o666 & ~_umask())
        gathered = _gathered.get()
        if gathered is None:
            os.replace(temporary, path)
        else:
            gathered.append((temporary, path))
            kept = True
    except OSError as error:
        raise MakeupError(f"Cannot write {path}: {error.strerror}; free some space or choose another folder.") from None
    finally:
        if not kept:
            temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def together(folder: Path) -> Iterator[None]:
    """Files written with `replacing` in this block, all below ``folder``, take their places when it ends: all or none.

    What an earlier process that was killed left half done in the folder is finished first. Raises MakeupError as
    `replacing`; no file is replaced then, or, where the drive fails while they are being renamed, the rest follows at
    the next `finish_swaps`.
    """
    if _gathered.get() is not None:  # part of a larger set
        yield
        return
    folder = Path(folder).absolute()
    finish_swaps(folder)
    gathered: list[tuple[Path, Path]] = []
    token = _gathered.set(gathered)
    try:
        try:
            yield
        finally:
            _gathered.reset(token)
        note = _note(folder, gathered)
        gathered = []  # they are the note's now
        _carry_out(folder, note)
    except OSError as error:
        raise MakeupError(
            f"Cannot write into {folder}: {error.strerror}; free some space or choose another folder."
        ) from None
    finally:
        for temporary, _ in gathered:
            temporary.unlink(missing_ok=True)


def written(path: Path) -> Path:
    """Where a file lies that was written: inside `together` it has yet to take its place."""
    return next(
        (temporary for temporary, target in reversed(_gathered.get() or []) if target == Path(path)), Path(path)
    )


def finish_swaps(folder: Path) -> list[Path]:
    """Bring sets of files that a killed process was putting in place to their end; the files that came so.

    Temporary files that were abandoned long ago are removed. A folder that cannot be read or written is left as it is.
    """
    folder, came = Path(folder).absolute(), []
    try:
        inside = list(folder.iterdir())
        for file in inside:
            if file.name.startswith(SWAP) and file.suffix == ".json":
                came += _carry_out(folder, file)
        for file in inside:
            if file.name.startswith(".") and PART in file.name:
                _remove_abandoned(file)
    except OSError:
        return came
    return came


def common_folder(paths: Iterable[Path]) -> Path:
    """The folder that all the files are in or below."""
    return Path(os.path.commonpath([Path(path).absolute().parent for path in paths]))


def _note(folder: Path, gathered: list[tuple[Path, Path]]) -> Path:
    """Write down, whole, which file is to become which."""
    pairs = [[os.path.relpath(one.absolute(), folder) for one in pair] for pair in gathered]
    note = folder / f"{SWAP}{uuid.uuid4().hex}.json"
    write_text(note, json.dumps(pairs))
    _sync_folder(folder)
    return note


def _carry_out(folder: Path, note: Path) -> list[Path]:
    """Do what a note says as far as it is not done, and remove it; the files that came.

    A note that names anything but temporary files and places below its folder was not written here, and is left alone.
    """
    try:
        pairs = [(folder / a, folder / b) for a, b in json.loads(note.read_text(encoding="utf-8"))]
    except FileNotFoundError:  # another process was faster
        return []
    except (ValueError, TypeError):
        return []
    if not all(_below(folder, a) and _below(folder, b) and PART in a.name for a, b in pairs):
        return []
    came = []
    for temporary, path in pairs:
        with contextlib.suppress(FileNotFoundError):  # it has its place already
            os.replace(temporary, path)
            came.append(path)
    for parent in {folder, *(path.parent for path in came)}:
        _sync_folder(parent)
    note.unlink(missing_ok=True)
    return came


def _below(folder: Path, file: Path) -> bool:
    """Whether a path lies in the folder or below it."""
    return Path(os.path.normpath(file)).is_relative_to(folder)


def _sync_folder(folder: Path) -> None:
    """Names of a folder reach the disk, where the system can be asked for it."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _remove_abandoned(file: Path) -> None:
    with contextlib.suppress(FileNotFoundError):
        if time.time() - file.stat().st_mtime > ABANDONED:
            file.unlink()


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_new_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file that is not there yet, whole or not at all; MakeupError where it is, or comes at this moment."""
    whole = path.with_name(f".{path.stem}-{uuid.uuid4().hex}{path.suffix}")
    write_text(whole, text)
    try:
        _claim(whole, path)
    except FileExistsError:
        raise MakeupError(f"{path} exists; choose another name or ask to overwrite it.") from None
    except OSError as error:
        raise MakeupError(f"Cannot write {path}: {error.strerror}; choose a folder you may write to.") from None
    finally:
        whole.unlink(missing_ok=True)


def _claim(whole: Path, path: Path) -> None:
    """Give a file the name ``path`` if nobody has it; FileExistsError otherwise."""
    try:
        os.link(whole, path)
    except FileExistsError:
        raise
    except OSError:  # a drive without links: take the name first, then fill it at one stroke
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        os.replace(whole, path)


def ensure_folder(folder: Path) -> Path:
    """The folder, made where it is missing; MakeupError where it cannot be made or written to."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MakeupError(f"Cannot make the folder {folder}: {error.strerror}; choose another output folder.") from None
    check_folder(folder)
    return folder


def check_folder(folder: Path) -> None:
    """Refuse a folder that cannot be written to, or made where it is missing, without making it: MakeupError."""
    folder = Path(folder)
    nearest = next((one for one in (folder, *folder.parents) if one.exists()), folder)
    try:
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        raise MakeupError(f"Cannot write into {nearest} ({error.strerror}); choose another output folder.") from None
