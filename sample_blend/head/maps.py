"""Cosmetic maps and looks: what is painted where, drawn from the anatomy in UV."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from . import fields
from .atlas import Atlas


def drawn(atlas: Atlas) -> dict[str, np.ndarray]:
    """Every map by name, (size, size) in 0..1."""
    lips = fields.lips(atlas) * (1 - fields.smooth(atlas.rings["mouth"], 2.0, 2.4))
    bare = (1 - fields.lips(atlas)) * (1 - fields.eye_opening(atlas)) * (1 - fields.nostril_opening(atlas))
    return {
        "foundation": fields.face(atlas) * bare,
        "lips": lips,
        "blush": fields.cheek(atlas) * bare,
        "lids": fields.upper_lid(atlas) * bare,
        "lids-wide": fields.upper_lid(atlas, 14.5, 9.0, 0.35) * bare,
        "lids-graphic": fields.upper_lid(atlas, 15.0, 11.0, 0.84) * bare,
        "contour": fields.contour(atlas) * bare,
        "lips-blotted": lips * fields.smooth(atlas.rings["mouth"], 0.95, 1.7),
    }


# product, thickness (um) where the map is white, map, strength; bottom to top
LOOKS = {
    "bare": [("foundation-fair", 5.0, "foundation", 0.6)],
    "day": [
        ("foundation-fair", 18.0, "foundation", 0.9),
        ("blush-rose", 5.0, "blush", 0.5),
        ("lipstick-coral", 12.0, "lips", 0.85),
    ],
    "evening": [
        ("foundation-fair", 16.0, "foundation", 1.0),
        ("blush-rose", 7.0, "blush", 0.6),
        ("eyeshadow-bronze", 15.0, "lids-wide", 0.9),
        ("lipstick-classic-red", 22.0, "lips", 1.0),
    ],
    "stage": [
        ("foundation-fair", 45.0, "foundation", 1.0),
        ("foundation-deep", 8.0, "contour", 0.8),
        ("blush-rose", 14.0, "blush", 0.9),
        ("eyeshadow-bronze", 30.0, "lids-wide", 1.0),
        ("lipstick-berry", 30.0, "lips", 1.0),
    ],
    "editorial": [
        ("foundation-fair", 16.0, "foundation", 0.9),
        ("eyeshadow-blue", 25.0, "lids-graphic", 1.0),
        ("lipstick-coral", 6.0, "lips-blotted", 0.8),
    ],
    "bridal": [
        ("foundation-fair", 15.0, "foundation", 0.9),
        ("blush-rose", 4.0, "blush", 0.5),
        ("eyeshadow-bronze", 6.0, "lids", 0.6),
        ("lipstick-coral", 9.0, "lips", 0.8),
    ],
}


def write(atlas: Atlas, folder: Path) -> list[Path]:
    """Write the maps as 8-bit grey PNG, an RGB-coded map of the evening look, and the look files."""
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
    rgb = [(p, t, "day-rgb", s, c) for (p, t, _, s), c in zip(LOOKS["day"], "RGB")]
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
