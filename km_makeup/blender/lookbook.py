"""Lookbooks rendered: pictures that are there already are left alone, bakes are shared, sheets come last."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from ..effects import Engine
from ..errors import MakeupError
from ..files import ensure_folder, finish_swaps, together, write_text
from ..makeup.book import Book, BookSkin, Group
from . import baking, looks, makeup, rendering, sheets, studio
from .library import library
from .update import paused

log = logging.getLogger("km_makeup")
COLUMNS = 8
"""Pictures in a row of a sheet at most, where there is one skin."""


@dataclass
class Made:
    """What a run did: pictures rendered and found, the bakes it needed, sheets written, and what failed and why."""

    rendered: list[Path] = field(default_factory=list)
    found: list[Path] = field(default_factory=list)
    bakes: int = 0
    sheets: list[Path] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)


def make_pictures(book: Book, groups: Sequence[Group], out: Path) -> Made:
    """Render the pictures of some groups that are not there yet, or are of something else by now.

    Raises MakeupError where the folder cannot be written to or a product is unknown, before anything is rendered; what
    goes wrong with single pictures is in the result.
    """
    folder, made = ensure_folder(out / "pictures"), Made()
    finish_swaps(folder)
    digests = {(g.file(v)): book.picture_digest(g, v, library()) for g in groups for v in book.views}
    current: BookSkin | None = None
    head: bpy.types.Object | None = None
    for number, group in enumerate(groups, 1):
        wanted = [v for v in book.views if not _is_there(folder / group.file(v), digests[group.file(v)])]
        made.found += [folder / group.file(v) for v in book.views if v not in wanted]
        if not wanted:
            continue
        try:
            if head is None or group.skin != current:
                head, current = _open(book, group.skin), group.skin
            log.info("%d of %d: %s, %s", number, len(groups), group.caption, ", ".join(wanted))
            _wear(book, group, head, out, made)
        except MakeupError as error:
            made.failed |= dict.fromkeys((group.file(v) for v in wanted), str(error))
            head = None  # a head in an unknown state is opened again
            continue
        for view in wanted:
            path = folder / group.file(view)
            try:
                _picture(book, head, view, path, digests[path.name])
                made.rendered.append(path)
            except MakeupError as error:
                made.failed[path.name] = str(error)
    return made


def _is_there(path: Path, digest: str) -> bool:
    """Whether a picture is there and is of what it should be."""
    note = _note(path)
    return path.exists() and note.exists() and note.read_text(encoding="utf-8").strip() == digest


def _note(path: Path) -> Path:
    return path.with_name(f".{path.stem}.digest")


def _open(book: Book, skin: BookSkin) -> bpy.types.Object:
    head = studio.open_head(skin.head, skin.texture, book.object).object
    for old, new in skin.images.items():
        for name in (old, new):
            if name not in bpy.data.images:
                raise MakeupError(f"{skin.head} has no image {name!r}, which the skin {skin.name!r} exchanges.")
        bpy.data.images[old].user_remap(bpy.data.images[new])
    with paused():
        if Path(book.light).suffix:
            head.km_makeup.light, head.km_makeup.light_file = "OWN", book.light
        else:
            head.km_makeup.light = book.light
    return head


def _wear(book: Book, group: Group, head: bpy.types.Object, out: Path, made: Made) -> None:
    """Put a makeup on, and bake it where textures of the same are not there."""
    look = book.worn(group, library())
    if look is None:
        if head.km_makeup.slots:
            makeup.remove(head)
        return
    looks.apply_look(head, look)
    if book.colour == "live":
        with paused():
            head.km_makeup.path = "LIVE"
        makeup.refresh(head)
        return
    folder = ensure_folder(out / "textures" / book.bake_digest(group, library()))
    with paused():
        head.km_makeup.folder, head.km_makeup.finished = str(folder.resolve()), False
        head.km_makeup.resolution, head.km_makeup.full_float = book.resolution, False
    before = {f: f.stat().st_mtime_ns for f in folder.glob("*.exr")}
    baking.bake_all(head, bpy.context.scene)
    made.bakes += {f: f.stat().st_mtime_ns for f in folder.glob("*.exr")} != before


def _picture(book: Book, head: bpy.types.Object, view: str, path: Path, digest: str) -> None:
    """A picture and, at once with it, the note on what it is of."""
    camera = studio.camera_for(head, view)
    shot = rendering.Shot(camera, Engine[book.engine.upper()], book.size, book.samples, book.seed, path)
    start = time.perf_counter()
    with together(path.parent):
        rendering.render(bpy.context.scene, shot)
        write_text(_note(path), digest + "\n")
    log.info("wrote %s in %.1f s", path.name, time.perf_counter() - start)


def make_sheets(book: Book, out: Path, made: Made) -> None:
    """A contact sheet of every view, skins as rows; views that lack pictures are reported."""
    for view in book.views:
        groups = book.groups()
        pictures = [(group.caption, out / "pictures" / group.file(view)) for group in groups]
        digests = [book.picture_digest(group, view, library()) for group in groups]
        missing = [path.name for (_, path), digest in zip(pictures, digests) if not _is_there(path, digest)]
        if missing:
            made.failed[f"sheet {view}"] = (
                f"{len(missing)} of its pictures are not there, {missing[0]} among them; make them first."
            )
            continue
        columns = len(book.makeups) if len(book.skins) > 1 else min(COLUMNS, len(pictures))
        sheet = out / f"sheet_{view}.png"
        sheets.contact_sheet(pictures, sheet, columns)
        log.info("wrote %s: %d pictures", sheet, len(pictures))
        made.sheets.append(sheet)
