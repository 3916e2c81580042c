"""Makes what the ladders of mixed light and of highlights are judged by, and writes km_makeup/accuracy/reference_more.json.

    python -m tests.accuracy.make_more

In 40 digits by mpmath: films at every nanometre (`tests.accuracy.reference`) and the paper's Eq 5 (`tests.optics.oracle`). Nothing
of km_makeup is imported; its product files and skin spectra are read as data.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import mpmath as mp
import numpy as np

from tests.accuracy import reference
from tests.optics import oracle

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / "km_makeup" / "accuracy" / "reference_more.json"
PRODUCTS = ROOT / "km_makeup" / "products" / "shipped"
SKINS = ROOT / "km_makeup" / "spectra" / "skin_basis.json"
KEY, FILL = "D65", "A"
STACKS, PATCHES, SEED = 40, 400, 20261127
POWDER = "powder"


def main() -> int:
    """Compute and write."""
    content = {
        "about": "Mixed light and highlights, computed in 40 digits; made by python -m tests.accuracy.make_more",
        "mixed_light": mixed_light(),
        "highlights": highlights(),
    }
    TARGET.write_text(json.dumps(content, indent=0) + "\n", encoding="utf-8")
    print(f"written: {TARGET.relative_to(ROOT)}")
    return 0


@mp.workdps(reference.DIGITS)
def mixed_light() -> dict:
    """Stacks and what they send back of either light, as linear Rec.709 whose (1, 1, 1) is D65's white."""
    products = {f.stem: json.loads(f.read_text(encoding="utf-8")) for f in sorted(PRODUCTS.glob("*.json"))}
    skins = [reference.at_every_nanometre(v) for v in json.loads(SKINS.read_text(encoding="utf-8"))["skins"].values()]
    random, stacks = np.random.default_rng(SEED), []
    for number in range(STACKS):
        names = [str(n) for n in random.choice(sorted(products), 1 + number % 3, replace=False)]
        thickness = [round(float(products[n]["thickness_um"] * random.uniform(0.5, 1.5)), 2) for n in names]
        values = np.round(random.uniform(0.3, 1, len(names)), 4).tolist()
        mix = np.round(random.dirichlet(np.ones(3)), 4).tolist()
        skin = [mp.fsum(mp.mpf(repr(m)) * one[i] for m, one in zip(mix, skins)) for i in range(len(skins[0]))]
        seen = reference.made_up(skin, [_layer(products[n], t, v) for n, t, v in zip(names, thickness, values)])
        stacks.append({
            "layers": [{"product": n, "thickness_um": t} for n, t in zip(names, thickness)],
            "values": values, "skin": mix, "key": _raw(seen, KEY), "fill": _raw(seen, FILL),
        })  # fmt: skip
        print(f"\r{number + 1} of {STACKS}", end="", file=sys.stderr, flush=True)
    white = [mp.mpf(1)] * len(reference.WAVELENGTHS)
    return {"key": KEY, "fill": FILL, "white_key": _raw(white, KEY), "white_fill": _raw(white, FILL), "stacks": stacks}


def _layer(product: dict, um: float, value: float) -> reference.Layer:
    K, S = (reference.at_every_nanometre(product[name]) for name in ("K", "S"))
    whole, share = mp.mpf(repr(um)) / 1000, mp.mpf(repr(value))
    if product["form"] == POWDER:
        return reference.Layer(K, S, whole, share)
    return reference.Layer(K, S, whole * share)


def _raw(spectrum: list, light: str) -> list[float]:
    """Linear Rec.709 of a body under a light of luminance 1, the light's own tint kept."""
    rgb = reference.rgb_to_xyz() ** -1 * mp.matrix(reference.to_xyz(spectrum, light))
    return [round(float(c), 12) for c in rgb]


@mp.workdps(reference.DIGITS)
def highlights() -> dict:
    """Patches lit and seen from anywhere above, three finishes that cover shares of them, and the paper's highlight times cosine."""
    random = np.random.default_rng(SEED)
    finishes = [[0.45, 0.028], [0.55, 0.04], [0.22, 0.05]]  # skin, foundation, gloss: Principled roughness and F0
    patches = []
    while len(patches) < PATCHES:
        light, view = (_above(random) for _ in range(2))
        half = light + view
        half /= np.linalg.norm(half)
        normal = half + random.normal(0, 0.12, 3)  # near the mirror direction, where there is a highlight to be seen
        normal /= np.linalg.norm(normal)
        if normal @ light < 0.05 or normal @ view < 0.05:
            continue
        weights = np.round(random.dirichlet(np.ones(3)), 4)
        value = mp.fsum(
            mp.mpf(float(w)) * oracle.kelemen(normal, light, view, r * r, f0)
            for w, (r, f0) in zip(weights, finishes, strict=True)
        )
        cosine = mp.fsum(mp.mpf(float(a)) * mp.mpf(float(b)) for a, b in zip(normal, light, strict=True))
        patches.append({
            "normal": normal.tolist(), "light": light.tolist(), "view": view.tolist(),
            "weights": weights.tolist(), "highlight": float(value * cosine),
        })  # fmt: skip
    return {"finishes": finishes, "patches": patches}


def _above(random: np.random.Generator) -> np.ndarray:
    """A direction of the upper half space, evenly."""
    z, turn = random.uniform(0.1, 1), random.uniform(0, 2 * np.pi)
    r = np.sqrt(1 - z * z)
    return np.array([r * np.cos(turn), r * np.sin(turn), z])


if __name__ == "__main__":
    sys.exit(main())
