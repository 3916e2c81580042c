"""Makes the asset library of this folder from the builders of KM Makeup: node groups, brushes, catalogs, tables of the pages.

    python -m node_groups.make_library [FOLDER]      in the checkout, with the bpy module 5.0; default: node_groups

5.0 is the oldest Blender that opens KM Makeup, and a newer one would write files that it cannot open.
`tests/library/test_library.py` holds what is here equal to what the builders make. Exit status 2: the wrong Blender.
"""

from __future__ import annotations

import re
import sys
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from km_makeup.blender.compositor.diffusion import diffusion_group
from km_makeup.blender.nodes.groups import KIND, SIGNATURE, STAMP, baked_group, film_group
from km_makeup.blender.nodes.highlights import LampKind, half_vector_group, kelemen_group, lamp_group
from km_makeup.makeup.coat import Coat, coat, interface_of
from km_makeup.makeup.transfer import Transfer, bare, fit_transfer
from km_makeup.optics.diffusion import SKIN
from km_makeup.products import Library, Product
from km_makeup.products.swatches import swatch_sheet, thumbnail, write_png
from km_makeup.spectra import bands, upsample_skin
from km_makeup.spectra.people import human_skins

from . import pictures

HERE = Path(__file__).resolve().parent
GROUPS, BRUSHES, CATALOGS = "makeup_groups.blend", "makeup_brushes.blend", "blender_assets.cats.txt"
PIXELS_PER_MM = 8.0
"""Of the diffusion asset: a head that fills a picture 1440 pixels high has about 6."""

MIDDLE_SKIN = 3
"""Of `human_skins`: the default of inputs that want a skin."""

PREVIEW, PICTURE = 128, 256
AUTHOR, LICENCE = "KM Makeup developers", "GPL-3.0-or-later"


@dataclass(frozen=True)
class Asset:
    """A datablock to be marked: its page (a .md of this folder), catalog, text of its tooltip, and picture by size."""

    block: bpy.types.ID
    page: str
    catalog: str
    description: str
    picture: Callable[[int], NDArray]


def film_of(product: Product) -> tuple[Coat, Transfer]:
    """A shipped product at its usual thickness, fitted to skins from light to deep under D65 in Linear Rec.709."""
    one = coat(product, product.thickness_um)
    return one, fit_transfer(one, bare(upsample_skin(human_skins())), interface_of([product]), bands())


def film_error(product: Product) -> float:
    """Worst CIEDE2000 of the film against 81 bands, at eight painted values over the ten skins."""
    from km_makeup.makeup.coat import on_skin
    from km_makeup.spectra import to_rgb
    from km_makeup.spectra.difference import delta_e

    one, transfer = film_of(product)
    skins = upsample_skin(human_skins())
    values = np.linspace(0.125, 1, 8)
    optics = on_skin([one.at(values[:, None])], interface_of([product]))
    seen = transfer.apply(np.repeat(values[:, None], len(skins), 1), np.repeat(to_rgb(skins)[None], 8, 0))
    return float(delta_e(to_rgb(optics.over(skins)), seen).max())


def group_assets() -> list[Asset]:
    """Every node group of the library, made by its builder."""
    found = []
    for product in Library.shipped().products:
        text = f"{product.name}, {product.thickness_um:g} µm at value 1: what it makes of the colour below"
        tree = film_group(film_of(product)[1], product.name)
        found.append(Asset(tree, "film", f"Films/{product.kind.title()}", text, lambda n, p=product: thumbnail(p, n)))
    found += [
        Asset(baked_group(), "baked_stack", "Films", "Baked films over any skin", pictures.baked_stack),
        Asset(half_vector_group(), "half_vector", "Highlights", "Directions for Kelemen lobes", pictures.half_vector),
        Asset(kelemen_group(), "kelemen", "Highlights", "Kelemen and Szirmay-Kalos's BRDF", pictures.kelemen_lobe),
    ]
    for kind in LampKind:
        text = f"Direction and irradiance of a {kind.value.lower()} lamp by Blender's rules, values typed in or driven"
        found.append(
            Asset(lamp_group(kind), "lamps", "Highlights/Lamps", text, lambda n, k=kind: pictures.lamp(k.value, n))
        )
    diffusion = diffusion_group(SKIN, PIXELS_PER_MM)
    found.append(Asset(diffusion, "diffusion", "Compositing", "Light spread in skin, in EEVEE", pictures.diffusion))
    return found


@dataclass(frozen=True)
class BrushKind:
    """A product's brush: diameter in pixels, strength 0..1, Blender's falloff, spacing in % of the diameter; which of
    size and strength follow the pen's pressure."""

    name: str
    size: int
    strength: float
    falloff: str
    spacing: int
    pressure: str
    description: str


BRUSH_KINDS = (
    BrushKind("KM Foundation", 140, 0.35, "SMOOTH", 8, "strength", "Broad and even; builds up over strokes"),
    BrushKind("KM Blush", 180, 0.12, "SMOOTHER", 6, "strength", "Wide and soft, with no edge; builds up slowly"),
    BrushKind("KM Powder", 220, 0.08, "SMOOTH", 8, "strength", "A large puff: a veil at each stroke"),
    BrushKind("KM Shadow", 60, 0.25, "SMOOTHER", 6, "strength", "For lids: small and blended"),
    BrushKind("KM Lipstick", 36, 0.9, "SPHERE", 4, "strength", "Covers at once, a narrow soft edge"),
    BrushKind("KM Liner", 8, 1.0, "ROOT", 3, "size", "A line as thick as the pen is pressed"),
)


def brush_assets() -> list[Asset]:
    """A brush for each sort of product, for Texture Paint; colours come from the paint mode, white being full thickness."""
    found = []
    for kind in BRUSH_KINDS:
        brush = bpy.data.brushes.new(kind.name, mode="TEXTURE_PAINT")
        brush.size, brush.strength, brush.spacing, brush.blend = kind.size, kind.strength, kind.spacing, "MIX"
        brush.curve_distance_falloff_preset = kind.falloff
        brush.use_pressure_size, brush.use_pressure_strength = kind.pressure == "size", kind.pressure == "strength"
        brush.color = (1, 1, 1)
        found.append(
            Asset(
                brush,
                "brushes",
                "Brushes",
                kind.description,
                lambda n, k=kind: pictures.dab(max(k.size / 220, 0.1), max(k.strength, 0.2), k.falloff, n),
            )
        )
    return found


def catalog_id(path: str) -> str:
    """The same for the same path on every machine: files that use a catalog find it again."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, f"km_makeup/{path}"))


def catalog_text(paths: set[str]) -> str:
    """The catalog file of Blender's, every path with the ones it lies in."""
    whole = {"/".join(path.split("/")[: n + 1]) for path in paths for n in range(path.count("/") + 1)}
    lines = [f"{catalog_id(path)}:{path}:{path.replace('/', '-')}" for path in sorted(whole)]
    return "\n".join(["# Made by make_library.py; Blender's asset catalogs.", "VERSION 1", "", *lines]) + "\n"


def full_path(asset: Asset) -> str:
    return f"Makeup/{asset.catalog}"


def mark(asset: Asset) -> None:
    """Make the datablock an asset with sensible defaults.

    What the builders remember on groups is taken away: KM Makeup must never take a group that an artist appended, and
    perhaps changed, for its own.
    """
    block = asset.block
    if isinstance(block, bpy.types.NodeTree):
        _set_defaults(block)
    block.asset_mark()
    data = block.asset_data
    data.catalog_id = catalog_id(full_path(asset))
    data.author, data.license, data.description = AUTHOR, LICENCE, asset.description
    data.tags.new("makeup")
    image = asset.picture(PREVIEW)
    rgba = np.full((PREVIEW, PREVIEW, 4), 255, np.uint8)
    rgba[..., : image.shape[-1]] = image
    preview = block.preview_ensure()
    preview.image_size = (PREVIEW, PREVIEW)
    preview.image_pixels_float.foreach_set((rgba[::-1] / np.float32(255)).astype(np.float32).reshape(-1))


def _set_defaults(tree: bpy.types.NodeTree) -> None:
    """Values with which a group shows something at once when it is dropped into a tree."""
    skin = (*human_skins()[MIDDLE_SKIN], 1.0)
    for item in tree.interface.items_tree:
        if item.item_type != "SOCKET" or item.in_out != "INPUT":
            continue
        if item.name == "Value":
            item.min_value, item.max_value, item.subtype = 0.0, 1.0, "FACTOR"
            item.default_value = 1.0
        elif item.name in ("Below", "Skin"):
            item.default_value = skin


def forget_builders() -> None:
    """Take the builders' marks off every group, inner ones too."""
    for tree in bpy.data.node_groups:
        for key in (KIND, SIGNATURE, STAMP):
            if key in tree:
                del tree[key]


def write(folder: Path) -> None:
    """The two .blend files and the catalogs into a folder; the open file is replaced by an empty one."""
    paths = set()
    for name, make in ((GROUPS, group_assets), (BRUSHES, brush_assets)):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        for brush in list(bpy.data.brushes):
            bpy.data.brushes.remove(brush)
        assets = make()
        for asset in assets:
            mark(asset)
        forget_builders()
        paths |= {full_path(asset) for asset in assets}
        bpy.data.libraries.write(str(folder / name), {asset.block for asset in assets}, compress=True)
    (folder / CATALOGS).write_text(catalog_text(paths), "utf-8")


START, END = "<!-- made by make_library.py -->", "<!-- end -->"


def socket_table(tree: bpy.types.NodeTree) -> str:
    """The inputs and outputs of a group as rows of a page."""
    lines = ["| socket | default | what it is |", "| --- | --- | --- |"]
    for item in tree.interface.items_tree:
        if item.item_type == "SOCKET":
            put = "" if item.in_out == "OUTPUT" or item.hide_value else _default(item.default_value)
            lines.append(f"| {item.in_out.lower()} `{item.name}` | {put} | {item.description} |")
    return "\n".join(lines)


def _default(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    return ", ".join(f"{number:.3g}" for number in tuple(value)[:3])


def film_table() -> str:
    """Every film with its thickness and how far the fit is off."""
    lines = ["| group | µm at value 1 | ΔE at most |", "| --- | --- | --- |"]
    for product in Library.shipped().products:
        lines.append(f"| `KM Film {product.name}` | {product.thickness_um:g} | {film_error(product):.2f} |")
    return "\n".join(lines)


def brush_table() -> str:
    """Every brush with its settings."""
    lines = ["| brush | diameter, px | strength | falloff | spacing, % | pen pressure | for |", "| --- " * 7 + "|"]
    for k in BRUSH_KINDS:
        falloff = k.falloff.title()
        row = (f"`{k.name}`", k.size, k.strength, falloff, k.spacing, k.pressure, k.description)
        lines.append("| " + " | ".join(str(cell) for cell in row) + " |")
    return "\n".join(lines)


def page_tables() -> Iterator[tuple[str, str]]:
    """For each page its name and the tables that it must carry. In an empty file."""
    by_page: dict[str, list[Asset]] = {}
    for asset in group_assets():
        by_page.setdefault(asset.page, []).append(asset)
    for page, assets in by_page.items():
        for asset in assets:
            _set_defaults(asset.block)
        if page == "film":
            yield page, "\n\n".join([socket_table(assets[0].block), film_table()])
        else:
            yield page, "\n\n".join(f"`{asset.block.name}`\n\n{socket_table(asset.block)}" for asset in assets)
    yield "brushes", brush_table()


def filled(text: str, tables: str) -> str:
    """A page's text with its tables put between the marks."""
    return re.sub(f"{START}.*?{END}", lambda _: f"{START}\n{tables}\n{END}", text, flags=re.DOTALL)


def write_pages(folder: Path) -> None:
    """The tables into the pages, and the pictures beside them."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    for page, tables in page_tables():
        path = folder / f"{page}.md"
        path.write_text(filled(path.read_text("utf-8"), tables), "utf-8")
    images = {"film": swatch_sheet(Library.shipped().products, 96, 8)}
    for name in ("baked_stack", "half_vector", "diffusion"):
        images[name] = getattr(pictures, name)(PICTURE)
    images["kelemen"] = pictures.kelemen_lobe(PICTURE)
    images["lamps"] = np.concatenate([pictures.lamp(kind.value, PICTURE) for kind in LampKind], axis=1)
    images["brushes"] = np.concatenate([asset.picture(PICTURE // 2) for asset in brush_assets()], axis=1)
    for name, image in images.items():
        write_png(folder / "pictures" / f"{name}.png", image)


def main() -> int:
    if bpy.app.version[:2] != (5, 0):
        print(
            f"Blender {bpy.app.version_string} would write files that 5.0 cannot open; use the bpy module 5.0.",
            file=sys.stderr,
        )
        return 2
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    write(folder)
    if folder == HERE:
        (folder / "pictures").mkdir(exist_ok=True)
        write_pages(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
