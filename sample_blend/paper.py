"""The figures of Huang et al. 2013 on the sample head, and every product on it; `sample_blend/run --paper` calls this.

Figure 3: the highlight of skin, of foundation, of both. Figures 7 and 8: spectra of products. Figures 9 and 10: an
RGB-coded map, the bare face and combinations of products, on the sample head and on Lee Perry-Smith's where present.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import others

from km_makeup.blender import looks, makeup, rendering, sheets, studio
from km_makeup.effects import Engine
from km_makeup.makeup import Layer, Look
from km_makeup.products import Library
from km_makeup.products.plots import plot_product

HERE = Path(__file__).resolve().parent
MAPS = HERE / "looks" / "maps"
SPECTRA = ("foundation-light", "blush-rose", "lipstick-classic-red")
COMBINATIONS = (  # foundation, lipstick, blush; as the paper's Figure 9 varies them
    ("foundation-fair", "lipstick-classic-red", "blush-rose"),
    ("foundation-medium", "lipstick-classic-red", "blush-rose"),
    ("foundation-medium", "lipstick-plum", "blush-berry"),
    ("foundation-fair", "lipstick-plum", None),
)
FOUNDATION_UM, BLUSH_UM, LIPSTICK_UM = 20.0, 7.0, 16.0
THIN_UM = 4.0  # of Figure 3: a thicker foundation leaves nothing of the skin's highlight
SHEET_MAPS = {  # kind of product: map, thickness (um)
    "foundation": ("foundation", 20.0),
    "concealer": ("concealer", 15.0),
    "setting": ("foundation", 6.0),
    "bronzer": ("contour", 8.0),
    "blush": ("blush", 8.0),
    "highlighter": ("highlight", 6.0),
    "eyeshadow": ("lids-smoke", 15.0),
    "eyeliner": ("liner", 14.0),
    "brow": ("brows", 6.0),
    "lipstick": ("lips", 16.0),
}


@dataclass(frozen=True)
class Stage:
    """How pictures are made: engine, size in pixels, samples, folder; ``say`` tells of progress."""

    engine: Engine
    size: tuple[int, int]
    samples: int
    out: Path
    say: Callable[[str], None]

    def picture(self, name: str, view: str) -> Path:
        """Render the open scene from the named camera."""
        self.say(f"rendering {name} ...")
        shot = rendering.Shot(bpy.data.objects[view], self.engine, self.size, self.samples, 0, self.out / f"{name}.png")
        self.say(f"wrote {name}.png in {rendering.render(bpy.context.scene, shot):.1f} s")
        return shot.path


def spectra(stage: Stage) -> list[Path]:
    """Figures 7 and 8: an SVG for each of three products."""
    made = []
    for name in SPECTRA:
        made.append(stage.out / f"figures-7-8-{name}.svg")
        plot_product(Library.shipped().find(name), made[-1])
        stage.say(f"wrote {made[-1].name}")
    return made


def highlights(stage: Stage) -> list[Path]:
    """Figure 3: the skin's highlight only, the foundation's only, both.

    In EEVEE lamp by lamp and by the paper's rule of what a film leaves of the skin's (its shader takes minutes to compile
    without a GPU), in Cycles by lobes and coverage.
    """
    head = open_sample()
    layer = Layer("foundation-light", THIN_UM, str(MAPS / "foundation.png"), "R", 1.0)
    looks.apply_look(head, Look("Figure 3", (layer,)))
    if stage.engine is Engine.EEVEE:
        head.km_makeup.highlight, head.km_makeup.highlight_rule = "LAMPS", "PAPER"
    pictures = []
    for caption, shown in (("skin", "SKIN"), ("foundation", "FILMS"), ("both", "ALL")):
        head.km_makeup.highlight_shown = shown
        pictures.append((f"highlight of {caption}", stage.picture(f"figure-3-{caption}", "close-up")))
    return [sheets.contact_sheet(pictures, stage.out / "figure-3.png", columns=3)]


def open_sample(skin: str = "light"):
    """The sample head in its file as it was saved, with one of its three skins; no effect is left out by the plan.

    The plan takes the light that spreads in this skin for too little to be seen, and its colour shifts by more than that.
    """
    head = studio.open_head(HERE / "head.blend", None, "Head").object
    head.km_makeup.everything = True
    if skin != "light":
        head.material_slots[0].material.node_tree.nodes["Albedo"].image = bpy.data.images[f"skin-albedo-{skin}"]
    return head


FOUNDATIONS = {"light": "foundation-fair", "medium": "foundation-tan", "deep": "foundation-deep"}


def skins(stage: Stage, look: str = "evening") -> list[Path]:
    """Light, medium and deep skin, bare and with the same products; the foundation in each skin's shade."""
    bare, made_up = [], []
    worn = Look.load(HERE / "looks" / f"{look}.json")
    for skin, foundation in FOUNDATIONS.items():
        head = open_sample(skin)
        bare.append((f"{skin} skin", stage.picture(f"skin-{skin}", "three-quarter")))
        layers = [replace(x, product=foundation) if x.product == "foundation-fair" else x for x in worn.layers]
        looks.apply_look(head, replace(worn, layers=tuple(layers)))
        made_up.append((f"{skin}, {look}", stage.picture(f"skin-{skin}-{look}", "three-quarter")))
    return [sheets.contact_sheet([*bare, *made_up], stage.out / "skins.png", columns=3)]


def light_setups(stage: Stage, look: str = "evening") -> list[Path]:
    """The three lights, front and three-quarter, made up."""
    head = open_sample()
    looks.apply_look(head, Look.load(HERE / "looks" / f"{look}.json"))
    groups = {c.name: c for c in bpy.data.collections if c.name.startswith("Light ")}
    pictures = []
    for name in ("Light studio", "Light window", "Light tungsten"):
        for other, group in groups.items():
            group.hide_render = group.hide_viewport = other != name
        for view in ("front", "three-quarter"):
            caption = f"{name.removeprefix('Light ')}, {view}"
            pictures.append((caption, stage.picture(f"light-{caption.replace(', ', '-')}", view)))
    return [sheets.contact_sheet(pictures, stage.out / "lights.png", columns=6)]


def combination(products: tuple[str | None, ...], rgb_map: Path) -> Look:
    """Foundation in the red channel, blush in the green, lipstick in the blue of one map."""
    foundation, lipstick, blush = products
    layers = [Layer(foundation, FOUNDATION_UM, str(rgb_map), "R", 0.9)]
    if blush:
        layers.append(Layer(blush, BLUSH_UM, str(rgb_map), "G", 0.6))
    layers.append(Layer(lipstick, LIPSTICK_UM, str(rgb_map), "B", 0.95))
    return Look(" + ".join(p.partition("-")[2] for p in products if p), tuple(layers))


def faces(stage: Stage) -> list[Path]:
    """Figures 9 (sample head, four combinations) and 10 (Lee Perry-Smith, two)."""
    head = open_sample()
    pictures = _combined(stage, head, "figure-9", MAPS / "day-rgb.png", COMBINATIONS)
    made = [sheets.contact_sheet(pictures, stage.out / "figure-9.png", columns=3)]
    if not others.LEE.file.exists():
        stage.say("Figure 10 is left out: ../shared/heads/lee_perry_smith is not here")
        return made
    open_sample()
    others.clear_sample()
    head = others.load(others.LEE)
    head.km_makeup.everything = True
    with tempfile.TemporaryDirectory() as folder:
        rgb_map = others.write_rgb(head, Path(folder) / "lee-rgb.png", albedo=others.LEE.albedo)
        pictures = _combined(stage, head, "figure-10", rgb_map, (COMBINATIONS[0], COMBINATIONS[3]))
    return [*made, sheets.contact_sheet(pictures, stage.out / "figure-10.png", columns=4)]


def _combined(stage: Stage, head, figure: str, rgb_map: Path, combinations) -> list[tuple[str, Path]]:
    pictures = [
        ("RGB-coded map", _map_picture(stage, figure, rgb_map)),
        ("bare", stage.picture(f"{figure}-bare", "front")),
    ]
    for k, products in enumerate(combinations):
        look = combination(products, rgb_map)
        looks.apply_look(head, look)
        pictures.append((look.name, stage.picture(f"{figure}-{k + 1}", "front")))
    return pictures


def _map_picture(stage: Stage, figure: str, rgb_map: Path) -> Path:
    """The map, cut to the pictures' shape."""
    from PIL import Image

    width, height = stage.size
    image = Image.open(rgb_map).convert("RGB")
    scale = height / image.height
    image = image.resize((round(image.width * scale), height))
    left = max(0, (image.width - width) // 2)
    path = stage.out / f"{figure}-map.png"
    image.crop((left, 0, left + width, height)).save(path)
    return path


def products(stage: Stage, columns: int = 8) -> list[Path]:
    """Every shipped product alone on the face."""
    head = open_sample()
    small = replace(stage, size=tuple(max(1, round(0.55 * n)) for n in stage.size))
    pictures = [("bare", small.picture("product-bare", "close-up"))]
    for product in Library.shipped().products:
        name, thickness = SHEET_MAPS[product.id.split("-")[0]]
        looks.apply_look(head, Look(product.name, (Layer(product.id, thickness, str(MAPS / f"{name}.png")),)))
        pictures.append((product.name, small.picture(f"product-{product.id}", "close-up")))
    makeup.remove(head)
    return [sheets.contact_sheet(pictures, stage.out / "products.png", columns=columns)]


def _close_ups(stage: Stage) -> list[Path]:
    from close_ups import close_ups

    return close_ups(stage)


def _relief(stage: Stage) -> list[Path]:
    from close_ups import relief

    return relief(stage)


PARTS: dict[str, Callable[[Stage], list[Path]]] = {
    "skins": skins,
    "lights": light_setups,
    "spectra": spectra,
    "highlights": highlights,
    "faces": faces,
    "products": products,
    "close-ups": _close_ups,
    "relief": _relief,
}
"""Sheets by name: each renders its pictures and returns the sheets' files."""
