"""The jobs that are killed: bakes, saves and writes to the library, each giving an old or a new set of files."""

from __future__ import annotations

import contextlib
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from km_makeup.bake import Request, bake, write_exrs
from km_makeup.bake.files import write_png
from km_makeup.bake.stream import FileRows, baking_to_files
from km_makeup.files import finish_swaps
from km_makeup.makeup import Look, coat
from km_makeup.optics import air_interface
from km_makeup.products import Library
from km_makeup.spectra import bands

from .kill_points import Job

SIZE = 160
TEXTURES = ("R", "T2", "R_up")


def jobs() -> Iterator[Job]:
    """All jobs, the quick ones first."""
    library = Library.shipped()
    maps = {new: [_painted(new, i) for i in range(2)] for new in (False, True)}
    yield Job("bake from file to file", partial(_file_to_file, _request(library), maps), read_bytes, finish_swaps)
    yield Job("bake in memory", partial(_in_memory, _request(library), maps), read_bytes, finish_swaps)
    yield Job("product into the library", partial(_product, library), read_bytes, finish_swaps)
    yield from blender_jobs(maps)


def read_bytes(folder: Path) -> dict[str, object]:
    """What every file below a folder holds, temporary ones left out."""
    files = {f.relative_to(folder): f for f in sorted(folder.rglob("*")) if f.is_file()}
    hidden = {place for place in files if any(part.startswith(".") for part in place.parts)}
    return {place.as_posix(): file.read_bytes() for place, file in files.items() if place not in hidden}


def _painted(new: bool, layer: int) -> np.ndarray:
    values = np.zeros((SIZE, SIZE), np.uint8)
    random = np.random.default_rng(layer)
    values[20:140, 30:120] = random.integers(0, 40, (120, 90)) + (90 if new else 20)
    return values


def _request(library: Library) -> Request:
    coats = [coat(library.find(name), 15) for name in ("foundation-light", "blush-rose")]
    return Request(coats, [], air_interface(1.45), bands(), half=True)


def _file_to_file(request: Request, maps: dict, folder: Path, new: bool) -> None:
    aside = folder.parent / f"maps-{new}"
    aside.mkdir(exist_ok=True)
    for i, values in enumerate(maps[new]):
        write_png(aside / f"{i}.png", values)
    sources = [FileRows(aside / f"{i}.png") for i in range(len(maps[new]))]
    for _ in baking_to_files(replace(request, maps=sources), {name: folder / f"{name}.exr" for name in TEXTURES}):
        pass


def _in_memory(request: Request, maps: dict, folder: Path, new: bool) -> None:
    made = bake(replace(request, maps=maps[new]))
    write_exrs({folder / f"{name}.exr": getattr(made, name)[..., :3] for name in TEXTURES})


def _product(library: Library, folder: Path, new: bool) -> None:
    product = replace(library.find("blush-rose"), id="mine", name="New" if new else "Old")
    Library.user(folder).save(product, overwrite=True)


def blender_jobs(maps: dict) -> Iterator[Job]:
    """Saves and bakes of a head in Blender; its map is the old or the new one."""
    import bpy

    from km_makeup import blender
    from km_makeup.blender import baking, images, looks, makeup
    from tests.blender import scenes

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    blender.register()
    head = scenes.head()
    head.data.materials.append(scenes.skin())
    makeup.set_up(head)
    for product in ("foundation-light", "blush-rose"):
        layer = head.km_makeup.layers.add()
        layer.product, layer.thickness_um, layer.map = product, 15, images.image_from_map(product, maps[False][0])
    makeup.refresh(head)

    def painted(new: bool) -> None:
        for layer, values in zip(head.km_makeup.layers, maps[new]):
            rgba = np.repeat(values.astype(np.float32)[..., None] / 255, 4, axis=-1)
            layer.map.pixels.foreach_set(rgba.reshape(-1))

    def baked(folder: Path, new: bool) -> None:
        painted(new)
        head.km_makeup.folder = str(folder)
        baking.bake_all(head, bpy.context.scene)

    def look(folder: Path, new: bool) -> None:
        painted(new)
        looks.save_look(head, folder / "look.json")

    def blend(folder: Path, new: bool) -> None:
        painted(new)
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / "head.blend"), copy=True, compress=False)

    def opened(folder: Path) -> dict[str, object]:
        """The maps in the .blend, as a fresh Blender reads them.

        Blender saves beside it (head.blend@), makes the file that is there its backup and then renames the new one; killed
        between those two, what the artist opens is the backup, head.blend1.
        """
        found: dict[str, object] = {}
        before = set(bpy.data.images)
        file = next((f for f in (folder / "head.blend", folder / "head.blend1") if f.exists()), folder)
        with contextlib.suppress(OSError), bpy.data.libraries.load(str(file)) as (source, target):
            target.images = [name for name in source.images if name in ("foundation-light", "blush-rose")]
        for image in [one for one in bpy.data.images if one not in before]:
            found[image.name.split(".")[0]] = images.map_values(image, "R").tobytes()
            bpy.data.images.remove(image)
        return found

    def read_look(folder: Path) -> dict[str, object]:
        """The look's files; of the head's shape its numbers, sorted: a .npz holds the time of day, and Blender makes the
        ball of the tests with its faces in another order in each process.
        """
        found = read_bytes(folder)
        for name in [name for name in found if name.endswith(".npz")]:
            with contextlib.suppress(OSError, ValueError, zipfile.BadZipFile), np.load(folder / name) as data:
                found[name] = {key: np.sort(data[key], axis=None).tobytes() for key in data}
        return found

    def look_again(folder: Path) -> object:
        return Look.load(folder / "look.json")

    yield Job("bake in Blender", baked, read_bytes, finish_swaps, False)
    yield Job("look saved in Blender", look, read_look, look_again, False)
    yield Job(".blend saved", blend, opened, lambda folder: None, False)
