"""Cosmetic maps and looks: what is painted where, drawn from the anatomy in UV."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from . import fields
from .atlas import Atlas


def drawn(atlas: Atlas) -> dict[str, np.ndarray]:
    """Every map by name, (size, size) in 0..1."""
    lips = fields.lips(atlas) * (1 - fields.smooth(atlas.rings["mouth"], 1.88, 2.04))
    lips = lips * _worn(atlas)
    bare = (1 - fields.lips(atlas)) * (1 - fields.eye_opening(atlas)) * (1 - fields.nostril_opening(atlas))
    free = bare * (1 - 0.85 * fields.brow(atlas))  # base products are wiped off the brows
    return {
        "foundation": fields.face(atlas) * free,
        "concealer": fields.under_eye(atlas) * free,
        "lips": lips,
        "lips-blotted": lips * fields.smooth(atlas.rings["mouth"], 0.95, 1.7),
        "blush": fields.cheek(atlas) * free,
        "contour": fields.contour(atlas) * free,
        "highlight": fields.highlight(atlas) * free,
        "lids": fields.lid_wash(atlas) * free,
        "lids-crease": fields.lid_crease(atlas) * free,
        "lids-smoke": fields.lid_smoke(atlas) * free,
        "lids-graphic": fields.lid_graphic(atlas) * free,
        "liner": fields.eyeliner(atlas) * bare,
        "liner-fine": fields.eyeliner(atlas, 1.5, 0.7) * bare,
        "brows": fields.brow(atlas) * bare,
    }


def _worn(atlas: Atlas) -> np.ndarray:
    """A lipstick's thickness as a bullet lays it, 0.35 to 1: thick on the ridges between creases, thin in them and at the wet line."""
    from .textures import lip_creases

    crease = fields.smooth(lip_creases(atlas), -1.7, 0.5)
    ring = atlas.rings["mouth"]
    middle = 1 - 0.30 * fields.smooth(ring, 1.55, 1.95) - 0.20 * fields.smooth(ring, 1.22, 1.0)
    return (0.6 + 0.4 * crease) * middle


# product, thickness (um) where the map is white, map, strength; bottom to top
LOOKS = {
    "bare": [("foundation-fair", 5.0, "foundation", 0.6)],
    "day": [
        ("foundation-fair", 12.0, "foundation", 0.85),
        ("concealer-light", 6.0, "concealer", 0.7),
        ("blush-peach", 4.0, "blush", 0.55),
        ("eyeshadow-taupe", 5.0, "lids", 0.5),
        ("brow-brown", 3.0, "brows", 0.6),
        ("lipstick-coral", 8.0, "lips", 0.7),
    ],
    "evening": [
        ("foundation-fair", 14.0, "foundation", 0.95),
        ("bronzer-warm", 3.0, "contour", 0.5),
        ("blush-peach", 5.0, "blush", 0.5),
        ("eyeshadow-bronze", 12.0, "lids-smoke", 0.85),
        ("eyeliner-black", 12.0, "liner", 0.95),
        ("brow-brown", 4.0, "brows", 0.7),
        ("lipstick-classic-red", 8.0, "lips", 1.0),
    ],
    "stage": [
        ("foundation-fair", 40.0, "foundation", 1.0),
        ("bronzer-warm", 6.0, "contour", 0.6),
        ("blush-rose", 5.0, "blush", 0.55),
        ("eyeshadow-plum", 18.0, "lids-smoke", 0.9),
        ("highlighter-champagne", 6.0, "highlight", 0.8),
        ("eyeliner-black", 20.0, "liner", 1.0),
        ("brow-brown", 8.0, "brows", 0.9),
        ("lipstick-berry", 18.0, "lips", 1.0),
    ],
    "editorial": [
        ("foundation-fair", 12.0, "foundation", 0.9),
        ("highlighter-champagne", 4.0, "highlight", 0.7),
        ("eyeshadow-blue", 16.0, "lids-graphic", 0.95),
        ("eyeliner-black", 10.0, "liner-fine", 0.9),
        ("lipstick-nude", 8.0, "lips-blotted", 0.9),
    ],
    "bridal": [
        ("foundation-fair", 14.0, "foundation", 0.9),
        ("concealer-light", 6.0, "concealer", 0.7),
        ("blush-rose", 4.0, "blush", 0.45),
        ("highlighter-champagne", 3.0, "highlight", 0.7),
        ("eyeshadow-ivory", 5.0, "lids", 0.6),
        ("eyeshadow-taupe", 7.0, "lids-crease", 0.7),
        ("eyeliner-brown", 8.0, "liner-fine", 0.9),
        ("brow-brown", 3.0, "brows", 0.6),
        ("lipstick-coral", 8.0, "lips", 0.75),
    ],
}
RGB_CODED = (("foundation-fair", 14.0, 0.9), ("blush-rose", 5.0, 0.5), ("lipstick-coral", 12.0, 0.85))  # R, G, B


def write(atlas: Atlas, folder: Path) -> list[Path]:
    """Write the maps as 8-bit grey PNG, an RGB-coded map of three products, and the look files."""
    from PIL import Image

    maps = folder / "maps"
    maps.mkdir(parents=True, exist_ok=True)
    pictures = {name: (np.clip(m, 0, 1) * 255 + 0.5).astype(np.uint8) for name, m in drawn(atlas).items()}
    made = []
    for name, picture in pictures.items():
        made.append(maps / f"{name}.png")
        Image.fromarray(picture, "L").save(made[-1], optimize=True)
    coded = np.dstack([pictures["foundation"], pictures["blush"], pictures["lips"]])
    made.append(maps / "day-rgb.png")
    Image.fromarray(coded, "RGB").save(made[-1], optimize=True)
    for name, layers in LOOKS.items():
        made.append(_look(folder / f"{name}.json", name, layers))
    rgb = [(p, t, "day-rgb", s, c) for (p, t, s), c in zip(RGB_CODED, "RGB", strict=True)]
    made.append(_look(folder / "day-rgb.json", "day, RGB-coded map", rgb))
    return made


def _look(path: Path, name: str, layers) -> Path:
    entries = []
    for product, thickness, picture, strength, *channel in layers:
        entries.append(
            {
                "product": product,
                "thickness_um": thickness,
                "map": f"maps/{picture}.png",
                "channel": channel[0] if channel else "R",
                "strength": strength,
                "enabled": True,
            }
        )
    data = {"schema": 1, "name": name.capitalize(), "layers": entries}
    path.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
    return path
