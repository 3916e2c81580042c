"""Looks on an object: layers from a look file, and the look file from the layers."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..bake.files import read_map, write_png
from ..errors import MakeupError
from ..files import ensure_folder, together
from ..makeup import Layer, Look, PaintedOn, interface_of
from ..makeup.correspondence import Correspondence, Head, finding, lay, near_paint, transferred
from ..makeup.landmarks import NEEDED, propose
from ..makeup.maps import check_same_size
from ..makeup.surface import Surface
from ..makeup.udim import moved
from ..products import Library, Product
from ..steps import result_of
from . import images, udim
from .heads import head_of, landmarks_of, own_uv_layout_of, surface_of, uv_layout_of
from .library import carry, library
from .makeup import remove, set_up
from .update import one_update, paused

WHOLE = 64
"""Size in texels of the map of a layer that covers the whole face and has no image of its own, if no other map sets one."""

EMPTY = 2048
"""Size in texels of the empty maps of a look that is put on with its products only."""

LAYER_FIELDS = (
    "name", "product", "thickness_um", "strength", "enabled", "solo", "form", "own_finish", "roughness", "f0", "channel",
    "switch", "map",
)  # fmt: skip
EXTRA = "look_extra"
"""Custom property, on the makeup and on each layer: fields of the look file that are not known here, as JSON."""


class Method(StrEnum):
    """What becomes of a look's maps on a head."""

    AS_THEY_ARE = "as-is"
    TRANSFER = "transfer"
    PRODUCTS = "products"


METHODS = {
    Method.AS_THEY_ARE: ("Maps as They Are", "Use the look's maps on this head's UV map without a change"),
    Method.TRANSFER: ("Transfer Maps", "Bring the maps over the skin of both heads, by their landmarks"),
    Method.PRODUCTS: ("Products Only", "Take products, thicknesses and finishes; the maps start empty"),
}


@dataclass(frozen=True)
class Choice:
    """How a look is put on a head unless the user wants it otherwise, and why, as the end of a sentence."""

    method: Method
    reason: str


def choose(obj: bpy.types.Object, look: Look) -> Choice:
    """The way to put a look on this head."""
    if not any(layer.map for layer in look.layers):
        return Choice(Method.AS_THEY_ARE, "the look has no maps")
    if look.head is None or not look.head.uv_layout:
        return Choice(Method.AS_THEY_ARE, "the look does not say which head its maps were painted on")
    if look.head.uv_layout == uv_layout_of(obj):
        return Choice(Method.AS_THEY_ARE, "this head has the UV layout that the maps were painted on")
    if look.head.uv_layout == own_uv_layout_of(obj):
        return Choice(Method.AS_THEY_ARE, "the maps were painted on the UV map of this head's own textures")
    if look.head.surface:
        return Choice(Method.TRANSFER, f"the maps were painted on another UV layout, that of {look.head.name!r}")
    return Choice(Method.PRODUCTS, "the maps were painted on another UV layout, and the look lacks that head's shape")


def apply_look(obj: bpy.types.Object, look: Look, method: Method | None = None) -> Choice:
    """Put a look on an object in place of the layers it has; it is set up if it was not.

    Parameters: ``method`` what becomes of the maps (default: as `choose` finds).

    Everything is read and checked first: where a product or a map is unusable a MakeupError says which,
    and the object is as before.
    """
    return result_of(applying(obj, look, method))


def applying(
    obj: bpy.types.Object, look: Look, method: Method | None = None
) -> Generator[tuple[str, float], None, Choice]:
    """`apply_look` in steps: yields what comes next and the share that is done, 0..1; ends with what was chosen."""
    choice = choose(obj, look) if method is None else Choice(method, "as asked")
    products = _products_of(look)
    maps, excluded = _read_maps(look, choice.method)
    if choice.method is Method.TRANSFER and maps:
        maps, excluded = yield from _brought(obj, look, maps, excluded)
    yield "Building the layers", 0.95
    _lay(obj, look, products, maps, excluded, choice.method)
    return choice


def _products_of(look: Look) -> list[Product]:
    """The products of a look's layers, those that travel in it among them; MakeupError naming look and layer."""
    known, found = look.with_carried(library()), []
    for number, layer in enumerate(look.layers, 1):
        try:
            found.append(known.find(layer.product))
        except MakeupError as error:
            raise MakeupError(f"{_called(look, number, layer)}: {error}") from None
    try:
        interface_of(found)
    except MakeupError as error:
        raise MakeupError(f"The look {look.name!r}: {error}") from None
    return found


def _called(look: Look, number: int, layer: Layer) -> str:
    return f"The look {look.name!r}, layer {number} ({layer.name or layer.product})"


def _read_maps(look: Look, method: Method) -> tuple[dict[int, NDArray], NDArray | None]:
    """The maps of a look by layer, and its exclusion mask; MakeupError where one is unusable."""
    if method is Method.PRODUCTS:
        return {}, None
    paths = {i: path for i, layer in enumerate(look.layers) if (path := look.map_path(layer))}
    values = {}
    for i, path in paths.items():
        try:
            values[i] = read_map(path, look.layers[i].channel)
        except MakeupError as error:
            raise MakeupError(f"{_called(look, i + 1, look.layers[i])}: {error}") from None
    if values and method is Method.AS_THEY_ARE:
        check_same_size([(str(paths[i]), v) for i, v in values.items()])
    return values, read_map(look.folder / look.exclusion) if look.exclusion else None


def _brought(
    obj: bpy.types.Object, look: Look, maps: dict[int, NDArray], excluded: NDArray | None
) -> Generator[tuple[str, float], None, tuple[dict[int, NDArray], NDArray | None]]:
    """The maps as they lie on this head: one correspondence for all of them, at the size of the largest."""
    yield "Finding the landmarks", 0.02
    target = head_of(obj)
    yield "Reading the head of the look", 0.3
    source = source_head(look)
    shape = max((values.shape for values in (*maps.values(), *([] if excluded is None else [excluded]))), key=np.prod)
    yield "Laying one head on the other", 0.4
    laid = near_paint(
        lay(source, target, (shape[0], shape[1])), [*maps.values(), *([] if excluded is None else [excluded])]
    )
    between: Correspondence | None = None
    for step in finding(laid):
        if isinstance(step, Correspondence):
            between = step
        else:
            yield "Bringing the maps over", 0.5 + 0.2 * step
    assert between is not None
    done = {}
    for k, (i, values) in enumerate(maps.items()):
        yield f"Bringing over map {k + 1} of {len(maps)}", 0.7 + 0.2 * k / len(maps)
        done[i] = _bytes(transferred(values, between))
    return done, None if excluded is None else _bytes(transferred(excluded, between))


def _bytes(values: NDArray) -> NDArray[np.uint8]:
    return np.rint(values * 255).astype(np.uint8)


def source_head(look: Look) -> Head:
    """The head that a look's maps were painted on; landmarks that it lacks are proposed."""
    if look.head is None or not look.head.surface:
        raise MakeupError(
            f"The look {look.name!r} does not hold the head that its maps were painted on, so they cannot be brought to "
            "another; use the maps as they are, or the products only."
        )
    surface = Surface.load(look.folder / look.head.surface)
    known = {name: np.array(point) for name, point in look.head.landmarks.items()}
    if any(name not in known for name in NEEDED):
        known = {**propose(surface).points, **known}
    return Head(surface, known)


def _lay(
    obj: bpy.types.Object,
    look: Look,
    products: list[Product],
    maps: dict[int, NDArray],
    excluded: NDArray | None,
    method: Method,
) -> None:
    """Replace the object's layers by the look's."""
    shape = next(iter(maps.values())).shape if maps else (WHOLE, WHOLE)
    as_gathered = look.head is not None and look.head.uv_layout == uv_layout_of(obj)
    with _all_or_nothing(obj), one_update(obj):
        carry(obj, [product for product in look.products if product.id in {layer.product for layer in look.layers}])
        if not obj.km_makeup.slots:
            set_up(obj)
        makeup = obj.km_makeup
        layout = udim.layout_of(obj.data, makeup.uv_map)
        if layout is not None and method is Method.AS_THEY_ARE and not as_gathered:
            maps = {i: moved(values, None, layout) for i, values in maps.items()}
            excluded = None if excluded is None else moved(excluded, None, layout)
            method = Method.TRANSFER  # they are no longer what is in the files
        images.keep(layer.map for layer in makeup.layers)
        makeup.layers.clear()
        for i, (layer, product) in enumerate(zip(look.layers, products)):
            entry = makeup.layers.add()
            _fill(entry, layer, product)
            label = f"{obj.name} {entry.name}"
            if method is Method.PRODUCTS and layer.map:
                entry.map, entry.channel = images.new_map(label, EMPTY, EMPTY), "R"
            elif method is Method.TRANSFER and i in maps:
                entry.map, entry.channel = images.image_from_map(label, maps[i]), "R"
            elif i in maps:
                entry.map = images.load_map(str(_path(look, layer)), layer.channel, maps[i])
            else:
                entry.map = images.image_from_map(f"Whole {product.name}", np.full(shape, 255, np.uint8))
        if method is not Method.PRODUCTS:
            makeup.exclusion = None if excluded is None else images.image_from_map(f"{obj.name} Exclusion", excluded)
        makeup.active = max(0, min(makeup.active, len(makeup.layers) - 1))
        makeup.path, makeup.show = "LIVE", True  # one sees what one puts on
        makeup["look"] = look.name
        makeup[EXTRA] = json.dumps(look.extra)


def _path(look: Look, layer: Layer) -> Path:
    return (look.folder / layer.map).resolve()


def _fill(entry: bpy.types.PropertyGroup, layer: Layer, product: Product) -> None:
    """A layer's settings from a look's."""
    entry.name, entry.product = layer.name or product.name, product.id
    entry.thickness_um = product.thickness_um if np.isnan(layer.thickness_um) else layer.thickness_um
    entry.strength, entry.enabled, entry.solo, entry.channel = layer.strength, layer.enabled, layer.solo, layer.channel
    entry.form = layer.form.upper() or "PRODUCT"
    entry.switch = layer.plan.upper() or "AUTO"
    entry.own_finish = layer.finish is not None
    roughness, f0 = layer.finish or (product.finish.roughness, product.finish.f0)
    entry.roughness, entry.f0 = max(roughness, 0.02), f0
    entry[EXTRA] = json.dumps(layer.extra)


@contextlib.contextmanager
def _all_or_nothing(obj: bpy.types.Object) -> Iterator[None]:
    """Layers, slots and images are as before where the block ends in a MakeupError."""
    makeup = obj.km_makeup
    layers = [{field: getattr(entry, field) for field in LAYER_FIELDS} for entry in makeup.layers]
    extras = [entry.get(EXTRA, "") for entry in makeup.layers]
    path, show, exclusion, had_slots, images_before = (
        makeup.path, makeup.show, makeup.exclusion, bool(makeup.slots), set(bpy.data.images),
    )  # fmt: skip
    try:
        yield
    except MakeupError:
        with paused():
            makeup.layers.clear()
            for fields, extra in zip(layers, extras):
                entry = makeup.layers.add()
                for field, value in fields.items():
                    setattr(entry, field, value)
                if extra:
                    entry[EXTRA] = extra
            makeup.path, makeup.show, makeup.exclusion = path, show, exclusion
            if not had_slots:
                remove(obj, keep_layers=True)
                udim.forget(obj)
        for image in set(bpy.data.images) - images_before:
            bpy.data.images.remove(image)
        raise


def look_of(obj: bpy.types.Object) -> Look:
    """The object's layers as a look without files."""
    makeup = obj.km_makeup
    layers = tuple(_layer_of(entry) for entry in makeup.layers)
    return Look(str(makeup.get("look", obj.name)), layers, extra=_extra_of(makeup))


def _layer_of(entry: bpy.types.PropertyGroup) -> Layer:
    return Layer(
        product=entry.product,
        thickness_um=round(entry.thickness_um, 6),
        channel=entry.channel,
        strength=round(entry.strength, 6),
        enabled=entry.enabled,
        solo=entry.solo,
        extra=_extra_of(entry),
        name="" if entry.name == _product_name(entry.product) else entry.name,
        form="" if entry.form == "PRODUCT" else entry.form.lower(),
        finish=(round(entry.roughness, 6), round(entry.f0, 6)) if entry.own_finish else None,
        plan="" if entry.switch == "AUTO" else entry.switch.lower(),
    )


def _product_name(product_id: str) -> str:
    return next((product.name for product in library().products if product.id == product_id), "")


def _extra_of(group: bpy.types.PropertyGroup) -> dict:
    try:
        kept = json.loads(group.get(EXTRA, "") or "{}")
    except ValueError:
        return {}
    return kept if isinstance(kept, dict) else {}


def save_look(obj: bpy.types.Object, path: Path, with_head: bool = True) -> Look:
    """Write the object's layers as a look file; maps as 8-bit PNG and the head's shape beside it in ``<name>_maps``.

    Parameters: ``with_head``: whether the head's shape is kept, so that the maps can be brought to other heads.
    Products that do not come with the extension travel inside the file.

    Raises MakeupError where there are no layers or the folder cannot be written to.
    """
    makeup = obj.km_makeup
    if not makeup.layers:
        raise MakeupError(f"{obj.name!r} has no layers to save; add one first.")
    for entry in makeup.layers:
        if entry.map is None:
            raise MakeupError(
                f"The layer {entry.name or entry.product!r} has no map, and a look without one covers the whole face; "
                "load a map or remove the layer."
            )
    look = replace(look_of(obj), name=path.stem, folder=path.parent).carrying(library(), Library.shipped())
    values = [images.map_values(entry.map, entry.channel) for entry in makeup.layers]
    surface = surface_of(obj) if with_head else None
    folder = ensure_folder(path.parent / f"{path.stem}_maps")
    layers = []
    with together(path.parent):
        for i, (layer, one) in enumerate(zip(look.layers, values)):
            name = f"{folder.name}/{i + 1}-{layer.product}.png"
            write_png(path.parent / name, one if one.dtype == np.uint8 else _bytes(one))
            layers.append(replace(layer, map=name, channel="R"))
        look = replace(look, layers=tuple(layers))
        if makeup.exclusion is not None:
            mask = images.map_values(makeup.exclusion, "R")
            write_png(folder / "exclusion.png", mask if mask.dtype == np.uint8 else _bytes(mask))
            look = replace(look, exclusion=f"{folder.name}/exclusion.png")
        if surface is not None:
            surface.save(folder / "head.npz")
            look = replace(look, head=_painted_on(obj, f"{folder.name}/head.npz"))
        look.save(path)
    return look


def _painted_on(obj: bpy.types.Object, surface: str) -> PaintedOn:
    points = {name: tuple(round(float(x), 7) for x in p) for name, p in sorted(landmarks_of(obj).items())}
    return PaintedOn(obj.name, uv_layout_of(obj), surface, points)
