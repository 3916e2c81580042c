"""Export: the makeup of an object as textures of one plain Principled shader a material, and as a .glb."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..bake import Request, Shine, baking, write_picture
from ..effects import Plan
from ..errors import MakeupError
from ..files import ensure_folder, replacing, together
from ..makeup import interface_of
from ..makeup.flat import Surface, flattened, linear_bytes, relative_f0, srgb_bytes
from ..spectra import bands, convert
from ..steps import Steps, result_of
from . import images, udim
from .baking import layer_maps
from .flat_materials import FlatSkin, flat_skin, plain_material
from .makeup import light_of, plan_of, remove, skin_under, stack_of
from .skin import SkinTexture
from .update import paused

LINEAR = "Linear Rec.709"


@dataclass(frozen=True)
class Export:
    """What to export.

    ``exr`` writes linear Rec.709 in 16-bit EXR in place of 8-bit PNG (base colour in sRGB); ``gltf`` also a .glb; ``before`` the
    bare skin as well. ``resolution`` in texels, 0: that of the largest map or skin texture. ``place``: a "COPY" of the object
    beside it wears the plain materials, or the "OBJECT" itself in place of its makeup, or "FILES" only.
    """

    folder: Path
    exr: bool = False
    gltf: bool = False
    before: bool = False
    resolution: int = 0
    place: str = "FILES"


@dataclass(frozen=True)
class ExportReport:
    """The files in the order written, texels clipped to the range of the format, and inputs that were left out."""

    files: list[Path]
    clipped: int
    left_out: list[str]

    def __str__(self) -> str:
        text = f"Exported {', '.join(file.name for file in self.files)}"
        if self.clipped:
            text += f"; {self.clipped} texels are more saturated than sRGB and were clipped"
        if self.left_out:
            text += f"; left out, since nodes feed them: {', '.join(self.left_out)}"
        return text


@dataclass(frozen=True)
class _Skin:
    """One skin material with what becomes of it: textures by name, "base_color" linear Rec.709; the IOR of the plain material."""

    skin: FlatSkin
    textures: dict[str, NDArray]
    ior: float
    suffix: str


def export_steps(
    obj: bpy.types.Object, scene: bpy.types.Scene, export: Export
) -> Generator[tuple[int, int], None, ExportReport]:
    """Export in steps: yields (done, total), ends with the report. All files are written, or none.

    Raises MakeupError where nothing is painted, or the skin, the folder or a map is unusable; the scene is then as before.
    """
    images.forget_statistics()
    if export.gltf and export.exr:
        raise MakeupError("A .glb holds 8-bit PNG textures; choose PNG for the textures, or export without glTF.")
    under = skin_under(obj)
    plan = plan_of(obj, scene, any_view=True)
    if not plan.any_film:
        raise MakeupError(
            f"Nothing is painted on {obj.name!r}, so there is no look to export; paint a visible layer first."
        )
    originals = list(dict.fromkeys(entry.original for entry in obj.km_makeup.slots))
    skins = [flat_skin(obj, material) for material in originals]
    if udim.least_u(obj) and (export.gltf or export.place != "FILES"):
        raise MakeupError(
            f"The skin of {obj.name!r} reaches beyond the UDIM tiles that makeup lies on, and plain materials would show the look's "
            "textures there too; clear Skin > Tiles, or export the files only."
        )
    if export.place == "OBJECT" and udim.sharing(obj):
        raise MakeupError(
            f"{obj.name!r} shares its mesh with {udim.sharing(obj)[0].name!r}, which wears makeup on the same UDIM tiles; export a copy, or "
            "give this one a mesh of its own (Object > Relations > Make Single User > Object & Data)."
        )
    folder = ensure_folder(export.folder)
    shape = _shape(obj, plan, skins, export.resolution)
    looks, bare = [], []
    for number, skin in enumerate(skins):
        suffix = f"_{bpy.path.clean_name(skin.material.name)}" if len(skins) > 1 else ""
        request = _request(obj, plan, skin, shape, under.mean)
        steps = Steps(baking(request))
        for done, total in steps:
            yield number * total + done, len(skins) * total + 1
        baked = steps.result
        made = flattened(skin.surface(shape), baked.finish if request.shines else None, baked.R[..., :3], baked.albedo)
        looks.append(_textures(skin, baked.albedo, made, shape, suffix))
        if export.before:
            bare.append(_textures(skin, skin.colour(shape), skin.surface(shape), shape, f"{suffix}_bare"))
    files = _write(obj, scene, export, folder, looks, bare, _metadata(obj, plan))
    clipped = 0 if export.exr else sum(_clipped(one.textures["base_color"]) for one in looks)
    left_out = [f"{name} of {skin.material.name}" for skin in skins for name in skin.left_out]
    return ExportReport(files, clipped, left_out)


def export_all(obj: bpy.types.Object, scene: bpy.types.Scene, export: Export) -> ExportReport:
    """Export at once."""
    return result_of(export_steps(obj, scene, export))


def _shape(obj: bpy.types.Object, plan: Plan, skins: Sequence[FlatSkin], resolution: int) -> tuple[int, int]:
    """(height, width) of the textures: as asked, else of the largest map or skin texture, so that no detail is lost."""
    if resolution:
        return resolution, resolution
    maps = [obj.km_makeup.layers[i].map for i in plan.film_indices]
    shapes = [(one.size[1], one.size[0]) for one in maps] + [shape for skin in skins for shape in skin.shapes()]
    return max(shapes, key=lambda shape: shape[0] * shape[1])


def _request(obj: bpy.types.Object, plan: Plan, skin: FlatSkin, shape: tuple[int, int], reference: NDArray) -> Request:
    layers = [obj.km_makeup.layers[i] for i in plan.film_indices]
    products, coats = stack_of(obj, plan)
    light = light_of(obj)
    return Request(
        coats=coats,
        maps=layer_maps(obj, layers, shape),
        interface=interface_of(products),
        bands=bands(light, bpy.data.colorspace.working_space),
        strengths=[layer.strength for layer in layers],
        names=[f"The map of {layer.name or layer.product!r}" for layer in layers],
        reference=reference,
        skin=skin.colour(shape),
        light=light,
        shines=[Shine(p.finish.roughness, p.finish.f0) for p in products] if plan.finish.on else [],
    )


def _textures(skin: FlatSkin, colour: NDArray, surface: Surface, shape: tuple[int, int], suffix: str) -> _Skin:
    relative, ior = relative_f0(surface.f0, skin.ior)
    textures = {
        "base_color": convert(colour, bpy.data.colorspace.working_space, LINEAR),
        "roughness": surface.roughness,
        "specular": relative,
        "subsurface": surface.subsurface,
    }
    if np.any(surface.coat):
        textures["coat"] = surface.coat
    if skin.normals is not None:
        textures["normal"] = skin.normals.linear(shape)
    whole = {key: np.broadcast_to(np.asarray(v, np.float32), shape + np.shape(v)[2:]) for key, v in textures.items()}
    return _Skin(skin, whole, ior, suffix)


def _clipped(linear: NDArray) -> int:
    step = 0.5 / 255 / 12.92
    return int(np.count_nonzero(np.any((linear < -step) | (linear > 1 + step), axis=-1)))


def _metadata(obj: bpy.types.Object, plan: Plan) -> dict[str, str]:
    products, coats = stack_of(obj, plan)
    return {
        "version": __version__,
        "layers": "; ".join(f"{p.id} {1000 * c.thickness_mm:g} um" for p, c in zip(products, coats)),
        "light": light_of(obj) if obj.km_makeup.light != "OWN" else "own spectrum",
        "color_space": "base_color: sRGB in 8 bits, linear Rec.709 in floats; others are data",
        "specular": "F0 as a share of that of the material's IOR; Specular IOR Level is half of it",
    }


def _write(
    obj: bpy.types.Object,
    scene: bpy.types.Scene,
    export: Export,
    folder: Path,
    looks: list[_Skin],
    bare: list[_Skin],
    metadata: Mapping[str, str],
) -> list[Path]:
    """Write every file to a folder of their own, then all take their places; the scene gets the plain materials if asked."""
    stem = bpy.path.clean_name(obj.name)
    made = _Made()
    try:
        with tempfile.TemporaryDirectory(prefix=".km_makeup-", dir=folder) as aside:
            staged = _Staged(Path(aside), folder, obj, looks)
            for sets, variant in ((looks, ""), (bare, "_bare")):
                materials = []
                for one in sets:
                    plain = _one_skin(obj, one, stem, export, staged, made, metadata)
                    materials += [plain] if plain else []
                if export.gltf and sets:
                    twin = _copy(obj, scene, looks, materials, f"{obj.name}{variant}")
                    made.objects.append(twin)
                    _write_glb(scene, twin, *staged.file(f"{stem}{variant}.glb"))
            staged.take_places()
        for image, path in made.images:
            image.filepath_raw = _blend_path(path)
            image.reload()
    except BaseException:
        made.delete()
        raise
    kept = made.materials[: len(looks)]
    made.delete(keep=[] if export.place == "FILES" else kept)
    _put_in_scene(obj, scene, export.place, looks, kept)
    return staged.files


class _Made:
    """Data that an export makes in the file, to be deleted again."""

    def __init__(self) -> None:
        self.objects: list[bpy.types.Object] = []
        self.materials: list[bpy.types.Material] = []
        self.images: list[tuple[bpy.types.Image, Path]] = []

    def delete(self, keep: Sequence[bpy.types.Material] = ()) -> None:
        for obj in self.objects:
            mesh = obj.data
            bpy.data.objects.remove(obj)
            bpy.data.meshes.remove(mesh)
        self.objects.clear()
        for material in self.materials:
            if material not in keep:
                bpy.data.materials.remove(material)
        self.materials = list(keep)
        for image, _ in self.images:
            if not image.users:
                bpy.data.images.remove(image)


class _Staged:
    """Files on their way to a folder: written under their own names in another one, from which all take their places."""

    def __init__(self, aside: Path, folder: Path, obj: bpy.types.Object, skins: Sequence[_Skin]) -> None:
        self.files: list[Path] = []
        self._aside, self._folder, self._obj, self._skins = aside, folder, obj, skins

    def file(self, name: str) -> tuple[Path, Path]:
        """Where to write a file, and where it will be; MakeupError where that would replace an input."""
        path = self._folder / name
        _not_an_input(self._obj, self._skins, path)
        self.files.append(path)
        return self._aside / name, path

    def take_places(self) -> None:
        """Move all, once each has a place."""
        with together(self._folder):
            for path in self.files:
                with replacing(path) as temporary:
                    os.replace(self._aside / path.name, temporary)


def _not_an_input(obj: bpy.types.Object, skins: Sequence[_Skin], path: Path) -> None:
    """MakeupError where a file would replace a texture of the skin or a map."""
    used = [layer.map for layer in obj.km_makeup.layers] + [obj.km_makeup.exclusion]
    used += [one.image for skin in skins for one in skin.skin.inputs.values() if isinstance(one, SkinTexture)]
    for image in used:
        if image is None or not image.filepath or not path.exists():
            continue
        if Path(bpy.path.abspath(image.filepath)).resolve() == path.resolve():
            raise MakeupError(
                f"{path} would replace {image.name!r}, which the look is made from; choose another folder."
            )


def _one_skin(
    obj: bpy.types.Object,
    one: _Skin,
    stem: str,
    export: Export,
    staged: _Staged,
    made: _Made,
    metadata: Mapping[str, str],
) -> bpy.types.Material | None:
    """The textures of one skin, and the plain material that uses them where one is asked for."""
    textures = {}
    for key, values in one.textures.items():
        name = f"{stem}{one.suffix}_{key}"
        file, path = staged.file(f"{name}.{'exr' if export.exr else 'png'}")
        in_alpha = key == "specular" and not export.exr  # where glTF reads it
        pixels = np.repeat(values[..., None], 4 if in_alpha else 3, axis=-1) if values.ndim == 2 else values
        if not export.exr:
            pixels = srgb_bytes(pixels) if key == "base_color" else linear_bytes(pixels)
        write_picture(file, path, pixels, {**metadata, "texture": key, "ior": f"{one.ior:.6g}"})
        if export.gltf or export.place != "FILES":
            image = bpy.data.images.load(str(file))
            image.name = name
            image.alpha_mode = "CHANNEL_PACKED"
            image.colorspace_settings.name = (LINEAR if export.exr else "sRGB") if key == "base_color" else "Non-Color"
            made.images.append((image, path))
            textures[key] = image
    if not textures:
        return None
    material = plain_material(
        f"{one.skin.material.name} {'Bare' if one.suffix.endswith('_bare') else 'Makeup'} Exported",
        one.skin, obj.km_makeup.uv_map, textures, one.ior,
    )  # fmt: skip
    material["km_makeup_export"] = json.dumps(dict(metadata))
    made.materials.append(material)
    return material


def _blend_path(path: Path) -> str:
    """The path, relative where the .blend is saved."""
    return bpy.path.relpath(str(path)) if bpy.data.filepath else str(path)


def _copy(
    obj: bpy.types.Object,
    scene: bpy.types.Scene,
    skins: Sequence[_Skin],
    materials: Sequence[bpy.types.Material],
    name: str,
) -> bpy.types.Object:
    """A copy of the object and its mesh without makeup, wearing the plain materials, in the scene."""
    twin = obj.copy()
    twin.name, twin.data = name, obj.data.copy()
    udim.release(twin.data)
    with paused():
        twin.property_unset("km_makeup")
    scene.collection.objects.link(twin)
    wear = {one.skin.material: plain for one, plain in zip(skins, materials)}
    for entry in obj.km_makeup.slots:
        slot = twin.material_slots[entry.index]
        slot.link = "DATA"
        slot.material = wear[entry.original]
    return twin


def _write_glb(scene: bpy.types.Scene, obj: bpy.types.Object, file: Path, path: Path) -> None:
    """The object alone as a .glb, by Blender's exporter, which works in Object Mode."""
    import addon_utils

    if not addon_utils.check("io_scene_gltf2")[1]:
        addon_utils.enable("io_scene_gltf2")
    layers = bpy.context.view_layer.objects
    active = layers.active
    collection = bpy.data.collections.new("KM Makeup Export")
    scene.collection.children.link(collection)
    collection.objects.link(obj)
    layers.active = obj
    try:
        bpy.ops.export_scene.gltf(
            filepath=str(file), export_format="GLB", collection=collection.name, export_extras=True,
            export_animations=False, export_apply=obj.data.shape_keys is None, export_image_format="AUTO",
        )  # fmt: skip
    except RuntimeError as error:
        raise MakeupError(f"Cannot write {path} ({str(error).strip().splitlines()[-1]}).") from None
    finally:
        layers.active = active
        bpy.data.collections.remove(collection)
    if not file.is_file() or file.stat().st_size == 0:
        raise MakeupError(f"Cannot write {path}: Blender's glTF exporter wrote nothing; is the disk full?")


def _put_in_scene(
    obj: bpy.types.Object,
    scene: bpy.types.Scene,
    place: str,
    skins: Sequence[_Skin],
    materials: Sequence[bpy.types.Material],
) -> None:
    if place == "COPY":
        twin = _copy(obj, scene, skins, materials, f"{obj.name} Exported")
        twin.matrix_world.translation = obj.matrix_world.translation
        twin.matrix_world.translation.x += 1.2 * obj.dimensions.x
    elif place == "OBJECT":
        worn = [(entry.index, entry.original) for entry in obj.km_makeup.slots]
        images.keep(layer.map for layer in obj.km_makeup.layers)
        images.keep([obj.km_makeup.exclusion])
        udim.release(obj.data)
        remove(obj)
        wear = {one.skin.material: plain for one, plain in zip(skins, materials)}
        for index, original in worn:
            original.use_fake_user = True
            obj.material_slots[index].material = wear[original]
