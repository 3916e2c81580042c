"""Files are written whole or not at all: to a temporary name beside the target, then renamed."""

from __future__ import annotations

import contextlib
import os
import tempfile
import uuid
from collections.abc import Iterator
from pathlib import Path

from .errors import MakeupError


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path to write to; when the block ends well it takes the place of ``path``.

    The temporary file keeps the suffix of ``path``, since image writers choose the format by it.

    Raises MakeupError where the folder is missing or read-only, or the disk is full.
    """
    path = Path(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise MakeupError(f"Cannot write {path}: {error.strerror}; choose a folder you may write to.") from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        with temporary.open("rb") as written:
            os.fsync(written.fileno())
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except OSError as error:
        raise MakeupError(f"Cannot write {path}: {error.strerror}; free some space or choose another folder.") from None
    finally:
        temporary.unlink(missing_ok=True)


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
    try:
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        raise MakeupError(f"Cannot write into {folder} ({error.strerror}); choose another output folder.") from None
