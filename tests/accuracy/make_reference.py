"""Makes the colours that the ladder of film colours is judged by, and writes km_makeup/accuracy/reference.json.

    python -m tests.accuracy.make_reference

Random stacks of the shipped products on mixtures of the shipped skins, computed by `tests.accuracy.reference`: in 40 digits at
every nanometre. Nothing of km_makeup is imported; its product files and skin spectra are read as data. What the ladder then
calls error holds the 5 nm steps, the formulas, and the rounding of the product.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import mpmath as mp
import numpy as np

from tests.accuracy import reference

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / "km_makeup" / "accuracy" / "reference.json"
PRODUCTS = ROOT / "km_makeup" / "products" / "shipped"
SKINS = ROOT / "km_makeup" / "spectra" / "skin_basis.json"
LIGHTS = ("D65", "A", "LED-B3")
STACKS, TEXELS, SEED = 72, 5, 20261124


def main() -> int:
    """Compute and write."""
    content = {
        "about": "Linear Rec.709 of stacks on mixtures of the three measured skins; computed at 1 nm in 40 digits, made by "
        "python -m tests.accuracy.make_reference",
        "stacks": [],
    }
    for number, one in enumerate(stacks(STACKS)):
        content["stacks"].append(one | {"rgb": colours(one)})
        print(f"\r{number + 1} of {STACKS}", end="", file=sys.stderr, flush=True)
    TARGET.write_text(json.dumps(content, indent=0, ensure_ascii=False) + "\n", encoding="utf-8")
    print(f"\nwritten: {TARGET.relative_to(ROOT)}")
    return 0


def products() -> dict[str, dict]:
    """The shipped products as their files say."""
    return {f.stem: json.loads(f.read_text(encoding="utf-8")) for f in sorted(PRODUCTS.glob("*.json"))}


def stacks(count: int) -> list[dict]:
    """Light, layers with their full thickness in um, painted values (texels, layers) and shares of the skins (texels, 3)."""
    shipped, random, found = products(), np.random.default_rng(SEED), []
    for number in range(count):
        names = [str(n) for n in random.choice(sorted(shipped), 1 + number % 4, replace=False)]
        thickness = [round(float(shipped[n]["thickness_um"] * random.uniform(0.5, 1.5)), 2) for n in names]
        values = np.round(random.beta(1.2, 0.9, (TEXELS, len(names))), 4)
        mix = np.round(random.dirichlet(np.ones(3), TEXELS), 4)
        found.append(
            {
                "light": LIGHTS[(number // 4) % 3],
                "layers": [{"product": n, "thickness_um": t} for n, t in zip(names, thickness, strict=True)],
                "values": values.tolist(),
                "skins": mix.tolist(),
            }
        )
    return found


@mp.workdps(reference.DIGITS)
def colours(one: dict) -> list[list[float]]:
    """Linear Rec.709 of every texel of a stack."""
    shipped = products()
    skins = [reference.at_every_nanometre(v) for v in json.loads(SKINS.read_text(encoding="utf-8"))["skins"].values()]
    result = []
    for values, shares in zip(one["values"], one["skins"], strict=True):
        layers = [
            reference.painted(shipped[layer["product"]], layer["thickness_um"], value)
            for layer, value in zip(one["layers"], values, strict=True)
        ]
        seen = reference.made_up(reference.mixture(skins, shares), layers)
        result.append([round(float(c), 12) for c in reference.to_rgb(seen, one["light"])])
    return result


if __name__ == "__main__":
    sys.exit(main())
