"""Makes the colours that the ladder of film colours is judged by, and writes km_makeup/accuracy/reference.json.

    python -m tests.accuracy.make_reference

Everything is computed here anew, in 40 digits by mpmath and at every nanometre: Kubelka 1948 for a film, Kubelka 1954 for a stack,
Saunderson's interface, CIE 1931 colour functions and lights at 1 nm. Nothing of km_makeup is imported; its product
files and skin spectra are read as data. K, S and skins, given every 5 nm, are taken as straight in between. What the
ladder then calls error holds the 5 nm steps, the formulas, and the rounding of the product.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import colour
import mpmath as mp
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / "km_makeup" / "accuracy" / "reference.json"
PRODUCTS = ROOT / "km_makeup" / "products" / "shipped"
SKINS = ROOT / "km_makeup" / "spectra" / "skin_basis.json"
GRID, FINE = np.arange(380, 785, 5), np.arange(380, 781)
LIGHTS = ("D65", "A", "LED-B3")
INDEX = mp.mpf("1.45")
STACKS, TEXELS, SEED = 72, 5, 20261124
DIGITS = 40


def main() -> int:
    """Compute and write."""
    with mp.workdps(DIGITS):
        return make()


def make() -> int:
    """Compute in the precision that is set, and write."""
    products = {f.stem: json.loads(f.read_text(encoding="utf-8")) for f in sorted(PRODUCTS.glob("*.json"))}
    skins = [fine(values) for values in json.loads(SKINS.read_text(encoding="utf-8"))["skins"].values()]
    weights = {light: rgb_weights(light) for light in LIGHTS}
    random, stacks = np.random.default_rng(SEED), []
    for number in range(STACKS):
        names = [str(n) for n in random.choice(sorted(products), 1 + number % 4, replace=False)]
        thickness = [round(float(products[n]["thickness_um"] * random.uniform(0.5, 1.5)), 2) for n in names]
        values = np.round(random.beta(1.2, 0.9, (TEXELS, len(names))), 4)
        mix = np.round(random.dirichlet(np.ones(3), TEXELS), 4)
        light = LIGHTS[(number // 4) % 3]
        rgb = [
            colour_of(
                [(products[n], t, v) for n, t, v in zip(names, thickness, row)], mixed(skins, share), weights[light]
            )
            for row, share in zip(values, mix)
        ]
        stacks.append(
            {
                "light": light,
                "layers": [{"product": n, "thickness_um": t} for n, t in zip(names, thickness)],
                "values": values.tolist(),
                "skins": mix.tolist(),
                "rgb": [[round(float(c), 12) for c in one] for one in rgb],
            }
        )
        print(f"\r{number + 1} of {STACKS}", end="", file=sys.stderr, flush=True)
    content = {
        "about": "Linear Rec.709 of stacks on mixtures of the three measured skins; computed at 1 nm in 40 digits, made by "
        "python -m tests.accuracy.make_reference",
        "stacks": stacks,
    }
    TARGET.write_text(json.dumps(content, indent=0, ensure_ascii=False) + "\n", encoding="utf-8")
    print(f"\nwritten: {TARGET.relative_to(ROOT)}")
    return 0


def fine(values: list[float]) -> list[mp.mpf]:
    """A spectrum given every 5 nm, at every nanometre, straight in between."""
    return [mp.mpf(float(v)) for v in np.interp(FINE, GRID, values)]


def mixed(skins: list[list[mp.mpf]], shares: np.ndarray) -> list[mp.mpf]:
    """A mixture of skins."""
    return [sum((mp.mpf(float(s)) * one[i] for s, one in zip(shares, skins)), mp.mpf(0)) for i in range(len(FINE))]


def colour_of(layers: list, skin: list[mp.mpf], weights: list[list[mp.mpf]]) -> list[mp.mpf]:
    """Linear RGB of a stack over a skin of apparent reflectance ``skin``; layers (product, full thickness in um, value)."""
    spectra = [(fine(p["K"]), fine(p["S"])) for p, _, _ in layers]
    rgb = [mp.mpf(0)] * 3
    for i, rho in enumerate(skin):
        films = [
            film(K[i], S[i], mp.mpf(t) / 1000, mp.mpf(float(v)), p["form"] == "powder")
            for (K, S), (p, t, v) in zip(spectra, layers)
        ]
        seen = over(films, rho)
        rgb = [total + seen * w for total, w in zip(rgb, weights[i])]
    return rgb


def film(K: mp.mpf, S: mp.mpf, X: mp.mpf, value: mp.mpf, powder: bool) -> tuple[mp.mpf, mp.mpf]:
    """R, T of a layer painted ``value``: thinner for liquids and creams, on a part of the area for powders (Kubelka 1948, Eq 26-28)."""
    if powder:
        R, T = film(K, S, X, mp.mpf(1), False)
        return value * R, 1 - value + value * T
    if value == 0:
        return mp.mpf(0), mp.mpf(1)
    X = X * value
    a = 1 + K / S
    b = mp.sqrt(a * a - 1)
    if b == 0:
        return S * X / (1 + S * X), 1 / (1 + S * X)
    x = b * S * X
    c = a * mp.sinh(x) + b * mp.cosh(x)
    return mp.sinh(x) / c, b / c


def over(films: list[tuple[mp.mpf, mp.mpf]], apparent: mp.mpf) -> mp.mpf:
    """Apparent reflectance: the skin freed of its interface, films laid on (Kubelka 1954), the interface on top (Saunderson).

    The first surface's own reflection is the highlight's and is left out on both sides.
    """
    k1, k2 = interface()
    below = apparent / ((1 - k1) * (1 - k2) + k2 * apparent)
    for R, T in films:
        below = R + T * T * below / (1 - R * below)
    return (1 - k1) * (1 - k2) * below / (1 - k2 * below)


def interface() -> tuple[mp.mpf, mp.mpf]:
    """k1 at normal incidence (Fresnel) and k2 for diffuse light from inside, by integration of Fresnel's equations."""
    k1 = ((INDEX - 1) / (INDEX + 1)) ** 2
    return k1, inside(INDEX)


_inside: dict[str, mp.mpf] = {}


def inside(n: mp.mpf) -> mp.mpf:
    """Diffuse reflectance of the interface from inside, total reflection included."""
    key = mp.nstr(n, 30)
    if key not in _inside:

        def unpolarised(u: mp.mpf) -> mp.mpf:
            s2 = n * n * (1 - u * u)
            if s2 >= 1:
                return mp.mpf(1)
            t = mp.sqrt(1 - s2)
            return (((n * u - t) / (n * u + t)) ** 2 + ((u - n * t) / (u + n * t)) ** 2) / 2

        edge = mp.sqrt(1 - 1 / (n * n))
        _inside[key] = edge**2 + mp.quad(lambda u: 2 * u * unpolarised(u), [edge, mp.mpf(1)])
    return _inside[key]


def rgb_weights(light: str) -> list[list[mp.mpf]]:
    """Weights at every nanometre: spectrum to linear Rec.709, white (1, 1, 1), Bradford to D65."""
    shape = colour.SpectralShape(380, 780, 1)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape).values
    power = colour.SDS_ILLUMINANTS[light].copy().align(shape).values
    xyz = observer * power[:, None]
    xyz = xyz / xyz[:, 1].sum()
    white = xyz.sum(axis=0)
    space = colour.RGB_COLOURSPACES["sRGB"]
    to_xyz = colour.normalised_primary_matrix(space.primaries, space.whitepoint)
    target = to_xyz.sum(axis=1)
    cone = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
    adapt = np.linalg.inv(cone) @ np.diag((cone @ target) / (cone @ white)) @ cone
    rgb = xyz @ (np.linalg.inv(to_xyz) @ adapt).T
    return [[mp.mpf(float(v)) for v in row] for row in rgb]


if __name__ == "__main__":
    sys.exit(main())
