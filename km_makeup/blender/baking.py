"""Baking the makeup of an object: maps and spectra in, textures on disk and in the file out."""

from __future__ import annotations

import hashlib
from collections.abc import Generator
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..bake import ArrayRows, Request, Shine
from ..bake.islands import Dilation, dilation
from ..bake.stream import baking_to_files
from ..effects import Plan
from ..errors import MakeupError
from ..files import check_folder, ensure_folder
from ..makeup import interface_of
from ..makeup.maps import resized
from ..spectra import bands
from ..steps import result_of
from . import gpu_bake, images, udim
from .heads import surface_of
from .makeup import light_of, plan_of, refresh, skin_under, stack_of
from .reducing import reduced
from .update import paused

TEXTURES = ("R", "T2", "R_up", "albedo", "finish")


@dataclass(frozen=True)
class BakeReport:
    """What a bake made: files by texture name, texels covered of all, and distinct combinations among them.

    `files` are the textures at the resolution of the bake; `planned` the smaller or fewer ones that the head shows, where
    the plan finds that they look the same.
    """

    files: dict[str, Path]
    texels: int
    covered: int
    distinct: int
    bands: int
    error: float
    out_of_gamut: int = 0
    planned: dict[str, Path] = field(default_factory=dict)

    def __str__(self) -> str:
        how = f"{self.distinct} distinct thickness combinations" if self.distinct else "each of them"
        text = (
            f"{', '.join(self.files)}: {self.covered} of {self.texels} texels covered, {how} computed at "
            f"{self.bands} bands"
        )
        if self.error:
            text += f" (CIEDE2000 {self.error:.3f} at most on a sample)"
        if self.out_of_gamut:
            text += (
                f"; {self.out_of_gamut} texels are more saturated than the working space and are clamped in the shader"
            )
        return text


def bake_steps(obj: bpy.types.Object, scene: bpy.types.Scene) -> Generator[tuple[int, int], None, BakeReport | None]:
    """Bake in steps: yields (done, total), ends with the report, or None where no film exists.

    Textures go to the object's folder; the materials then use them. Raises MakeupError before anything
    is written where a map, a product or the folder is unusable.
    """
    makeup = obj.km_makeup
    images.forget_statistics()
    plan = plan_of(obj, scene, baked=True)
    if not plan.any_film:
        refresh(obj, scene)
        return None
    if not plan.path.on:
        raise MakeupError(
            f"{obj.name!r} cannot be baked: {plan.path.reason}. Remove the keys, or leave Colour at Live."
        )
    if not makeup.folder.strip():
        raise MakeupError("No folder is given for the textures of the bake; choose one under Bake > Folder.")
    if makeup.folder.startswith("//") and not bpy.data.filepath:
        raise MakeupError(
            f"The folder {makeup.folder} lies beside the .blend, which is not saved yet; save it, or choose another folder."
        )
    folder = Path(bpy.path.abspath(makeup.folder))
    check_folder(folder)  # before maps are read, which takes a while; it is made when nothing else is in the way
    request = request_of(obj, plan)
    ensure_folder(folder)
    files = _files(obj, request, folder)
    metadata = _metadata(obj, plan, request)
    shown = files

    def planned() -> None:
        nonlocal shown
        shown = reduced(files, plan, request.reference, request.half, metadata)

    count = yield from baking_to_files(_top_first(request), files, metadata, gpu_bake.elsewhere, planned)
    _use(obj, shown)
    refresh(obj, scene)
    return BakeReport(
        files,
        request.maps[0].shape[0] * request.maps[0].shape[1],
        count.covered,
        count.distinct,
        count.bands,
        count.error,
        count.out_of_gamut,
        {} if shown is files else shown,
    )


def bake_all(obj: bpy.types.Object, scene: bpy.types.Scene) -> BakeReport | None:
    """Bake at once."""
    return result_of(bake_steps(obj, scene))


def request_of(obj: bpy.types.Object, plan: Plan) -> Request:
    """What a bake of the object's films computes."""
    makeup = obj.km_makeup
    layers = [makeup.layers[i] for i in plan.film_indices]
    products, coats = stack_of(obj, plan)
    light, space = light_of(obj), bpy.data.colorspace.working_space
    skin = skin_under(obj)
    maps = layer_maps(obj, layers, makeup.resolution or None)
    texture = None
    if makeup.finished:
        if skin.texture is None:
            raise MakeupError(
                f"{obj.name!r}: the finished albedo needs the skin's colour as one image on the UV map "
                f"{makeup.uv_map!r}; bake without Finished Albedo, or bake the skin's colour to an image first."
            )
        texture = skin.texture.linear(maps[0].shape)
    return Request(
        coats=coats,
        maps=maps,
        interface=interface_of(products),
        bands=bands(light, space),
        strengths=[layer.strength for layer in layers],
        names=[f"The map of {layer.name or layer.product!r}" for layer in layers],
        reference=skin.mean,
        skin=texture,
        light=light,
        shines=[Shine(p.finish.roughness, p.finish.f0) for p in products] if plan.finish.on else [],
        half=not makeup.full_float,
        tolerance=plan.bake_tolerance,
    )


def layer_maps(
    obj: bpy.types.Object, layers: list[bpy.types.PropertyGroup], size: int | tuple[int, ...] | None
) -> list[NDArray]:
    """The layers' maps at one size: the one that was asked for, else that of the largest; without what is excluded.

    Texels past the edges of the UV islands hold the value of the nearest texel on the surface, so that no seam shows.
    """
    makeup = obj.km_makeup
    maps = [images.map_values(layer.map, layer.channel) for layer in layers]
    size = size or max((values.shape for values in maps), key=lambda shape: shape[0] * shape[1])
    maps = [resized(values, size) for values in maps]
    if makeup.exclusion is not None:
        mask = resized(images.map_values(makeup.exclusion, "R"), maps[0].shape)
        free = 1 - mask.astype(np.float32) / np.float32(255 if mask.dtype == np.uint8 else 1)
        maps = [one.astype(np.float32) / np.float32(255 if one.dtype == np.uint8 else 1) * free for one in maps]
    past = past_islands(obj, maps[0].shape)
    maps = [past.fill(values) for values in maps]
    if udim.least_u(obj):
        for values in maps:
            values[np.ix_([0, -1], [0, -1])] = 0  # where faces of other tiles lie, and what filtering reads there
    return maps


def past_islands(obj: bpy.types.Object, shape: tuple[int, ...]) -> Dilation:
    """What carries painted values past the edges of the object's UV islands, kept until its UVs change."""
    triangles = surface_of(obj).uv
    key = (hashlib.blake2b(np.ascontiguousarray(triangles).tobytes()).digest(), *shape)
    if key not in _past:
        while len(_past) >= KEPT:
            _past.pop(next(iter(_past)))
        _past[key] = dilation(triangles, *shape)
    return _past[key]


KEPT = 4
_past: dict[tuple, Dilation] = {}


def _top_first(request: Request) -> Request:
    """The same for files, whose first row is the top one; Blender's is the bottom one."""
    skin = None if request.skin is None else request.skin[::-1]
    return replace(request, maps=[ArrayRows(np.asarray(one)[::-1]) for one in request.maps], skin=skin)


def _files(obj: bpy.types.Object, request: Request, folder: Path) -> dict[str, Path]:
    keys = [*request.textures, *(["albedo"] if request.skin is not None else [])]
    return {key: folder / f"{bpy.path.clean_name(obj.name)}_{key}.exr" for key in keys}


def _metadata(obj: bpy.types.Object, plan: Plan, request: Request) -> dict[str, str]:
    """What made the textures, for their headers."""
    products, coats = stack_of(obj, plan)
    return {
        "version": __version__,
        "layers": "; ".join(f"{p.id} {1000 * c.thickness_mm:g} um" for p, c in zip(products, coats)),
        "light": request.bands.light,
        "working_space": request.bands.space,
        "skin_reference": " ".join(f"{c:.6f}" for c in request.reference) if request.reference is not None else "",
        "formula": "R + T2 c / (1 - R_up c), c the colour of the bare skin",
    }


def _use(obj: bpy.types.Object, files: dict[str, Path]) -> None:
    """Point the object's baked textures at the files, by relative paths where the .blend is saved."""
    with paused():
        for key in TEXTURES:
            path = files.get(key)
            image = images.load_texture(str(path), f"{obj.name}_{key}") if path else None
            if image is not None and bpy.data.filepath:
                image.filepath = bpy.path.relpath(str(path))
            setattr(obj.km_makeup, f"baked_{key}", image)
        obj.km_makeup.baked_simply = "R_up" not in files
        obj.km_makeup.path = "BAKED"
