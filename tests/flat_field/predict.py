"""The flat field as the theory says it: linear RGB of films on skin, computed apart from the extension.

    python tests/flat_field/predict.py OUT.json [--products FOLDER]

Imports nothing from km_makeup. The equations are those printed, in mpmath with 40 digits:

* one film: R = sinh bSX/(a sinh bSX + b cosh bSX), T = b/(a sinh bSX + b cosh bSX), a = (S + K)/S, b = sqrt(a^2 - 1)
  (Kubelka 1948; Huang et al. 2013, Eq 1-2);
* a film on what lies below: R = R1 + T1^2 R2/(1 - R1 R2) (Kubelka 1954; Eq 3 of Huang et al., corrected);
* the air: R_apparent = (1 - k1)(1 - k2) R/(1 - k2 R) (Saunderson 1942), its first reflection k1 being the highlight.
  Skin is known through the air: its reflectance is freed of the interface, the films are laid on it, and the
  interface is put on top. Refractive index 1.45, k1 for light along the normal, k2 by integrating Fresnel's equations;
* a powder covers a share of the area: its R and T are averaged with those of nothing;
* colour: CIE 1931 2 degree observer and D65 at 5 nm (tables of colour-science), Bradford to the white of Rec.709.

Skins are three people of NIST's data as measured, without the reflection k1 of the surface, which the instrument saw;
the renderer is given their linear RGB and nothing else. Since it must guess the spectrum back from that colour, every
case is predicted twice: for the measured spectrum, and for the one upsampled from the colour (reimplemented from the
shipped basis): their difference is the upsampling's part. The basis is the regression over all 100 people of the data,
these three among them.
"""

from __future__ import annotations

import argparse
import csv
import functools
import json
from pathlib import Path
from typing import Any

import cases
import mpmath as mp

mp.mp.dps = 40
HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parents[1]
SHIPPED = CHECKOUT / "km_makeup" / "products" / "shipped"
SKINS_FILE = CHECKOUT.parent / "shared" / "spectra" / "nist_skin" / "nist_skin_avg_360_830nm.csv"
SKINS = {"light": "subject042", "medium": "subject034", "deep": "subject044"}
WAVELENGTHS = range(380, 781, 5)
INDEX = mp.mpf("1.45")

BRADFORD = mp.matrix(
    [["0.8951", "0.2664", "-0.1614"], ["-0.7502", "1.7135", "0.0367"], ["0.0389", "-0.0685", "1.0296"]]
)
PRIMARIES = (("0.64", "0.33"), ("0.30", "0.60"), ("0.15", "0.06"))
WHITE = ("0.3127", "0.3290")

Spectrum = list[mp.mpf]


def film(K: mp.mpf, S: mp.mpf, X: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    """R and T of one film in the printed hyperbolic form; its limits where K, S or X is 0."""
    if X == 0 or (K == 0 and S == 0):
        return mp.mpf(0), mp.mpf(1)
    if S == 0:
        return mp.mpf(0), mp.exp(-K * X)
    if K == 0:
        return S * X / (1 + S * X), 1 / (1 + S * X)
    a = (S + K) / S
    b = mp.sqrt(a * a - 1)
    sinh, cosh = mp.sinh(b * S * X), mp.cosh(b * S * X)
    return sinh / (a * sinh + b * cosh), b / (a * sinh + b * cosh)


@functools.cache
def internal_reflection() -> mp.mpf:
    """Diffuse reflectance of the surface from inside: 1 - (1 - r)/n^2, r the integral of Fresnel's equations outside."""

    def reflected(mu: mp.mpf) -> mp.mpf:
        inside = mp.sqrt(1 - (1 - mu * mu) / INDEX**2)
        s = (mu - INDEX * inside) / (mu + INDEX * inside)
        p = (INDEX * mu - inside) / (INDEX * mu + inside)
        return mu * (s * s + p * p)

    return 1 - (1 - mp.quad(reflected, [0, 1])) / INDEX**2


def seen_through_air(internal: mp.mpf) -> mp.mpf:
    k1, k2 = ((INDEX - 1) / (INDEX + 1)) ** 2, internal_reflection()
    return (1 - k1) * (1 - k2) * internal / (1 - k2 * internal)


def freed_of_air(apparent: mp.mpf) -> mp.mpf:
    k1, k2 = ((INDEX - 1) / (INDEX + 1)) ** 2, internal_reflection()
    return apparent / ((1 - k1) * (1 - k2) + k2 * apparent)


@functools.cache
def to_rgb_weights() -> list[Spectrum]:
    """For R, G and B the weights of the 81 reflectances: a perfect white is (1, 1, 1)."""
    import colour

    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    lamp = colour.SDS_ILLUMINANTS["D65"]
    cmf = {int(nm): row for nm, row in zip(observer.wavelengths, observer.values, strict=True)}
    power = {int(nm): value for nm, value in zip(lamp.wavelengths, lamp.values, strict=True)}
    to_xyz = mp.matrix(3, len(WAVELENGTHS))
    for j, nm in enumerate(WAVELENGTHS):
        for i in range(3):
            to_xyz[i, j] = mp.mpf(float(cmf[nm][i])) * mp.mpf(float(power[nm]))
    to_xyz /= mp.fsum(to_xyz[1, j] for j in range(len(WAVELENGTHS)))
    light = mp.matrix([mp.fsum(to_xyz[i, j] for j in range(len(WAVELENGTHS))) for i in range(3)])
    white = _xyz(*WHITE)
    cone_from, cone_to = BRADFORD * light, BRADFORD * white
    adapt = BRADFORD**-1 * mp.diag([cone_to[i] / cone_from[i] for i in range(3)]) * BRADFORD
    columns = [_xyz(*xy) for xy in PRIMARIES]
    primaries = mp.matrix(3, 3)
    for j, column in enumerate(columns):
        for i in range(3):
            primaries[i, j] = column[i]
    rgb_to_xyz = primaries * mp.diag(list(primaries**-1 * white))
    weights = rgb_to_xyz**-1 * adapt * to_xyz
    return [[weights[i, j] for j in range(len(WAVELENGTHS))] for i in range(3)]


def _xyz(x: str, y: str) -> mp.matrix:
    x, y = mp.mpf(x), mp.mpf(y)
    return mp.matrix([x / y, 1, (1 - x - y) / y])


def to_rgb(reflectance: Spectrum) -> list[mp.mpf]:
    return [mp.fsum(w * r for w, r in zip(row, reflectance, strict=True)) for row in to_rgb_weights()]


def measured_skin(subject: str) -> Spectrum:
    """Reflectance of a person's forearm below its surface's shine, 380-780 nm @ 5 nm, the 3 nm readings joined by lines."""
    shine = ((INDEX - 1) / (INDEX + 1)) ** 2
    with SKINS_FILE.open(encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    table = {int(row["wavelength_nm"]): mp.mpf(row[subject]) for row in rows}
    result = []
    for nm in WAVELENGTHS:
        low = max(w for w in table if w <= nm)
        high = min(w for w in table if w >= nm)
        share = mp.mpf(nm - low) / (high - low) if high > low else mp.mpf(0)
        result.append(table[low] * (1 - share) + table[high] * share - shine)
    if min(result) <= 0:
        raise SystemExit(f"{subject}: nothing is left under the surface's shine; take another person")
    return result


class Product:
    """K and S in 1/mm of a product file, on the grid it must have."""

    def __init__(self, file: Path) -> None:
        data = json.loads(file.read_text(encoding="utf-8"))
        grid = data["spectrum"]
        if (grid["unit"], grid["start_nm"], grid["step_nm"], len(data["K"])) != ("1/mm", 380, 5, len(WAVELENGTHS)):
            raise SystemExit(f"{file}: this script reads 1/mm at 380-780 nm @ 5 nm only")
        self.id, self.kind, self.form, self.interface = data["id"], data["kind"], data["form"], data["interface"]
        self.thickness_um = float(data["thickness_um"])
        # The decimals as written: the extension reads the nearest floating-point numbers, 1e-16 away.
        self.K, self.S = ([mp.mpf(repr(v)) for v in data[name]] for name in "KS")

    @functools.cache  # noqa: B019  a few products, kept for the whole run
    def layer(self, thickness_um: float, value: int) -> list[tuple[mp.mpf, mp.mpf]]:
        """R and T per wavelength where a byte map reads ``value``."""
        share, X = mp.mpf(value) / 255, mp.mpf(repr(thickness_um)) / 1000
        if self.form != "powder":
            return [film(K, S, X * share) for K, S in zip(self.K, self.S, strict=True)]
        full = [film(K, S, X) for K, S in zip(self.K, self.S, strict=True)]
        return [(share * R, (1 - share) + share * T) for R, T in full]


def made_up(skin: Spectrum, layers: list[list[tuple[mp.mpf, mp.mpf]]], internal: bool) -> Spectrum:
    """Apparent reflectance of skin under layers, bottom to top."""
    result = []
    for i, apparent in enumerate(skin):
        rho = freed_of_air(apparent) if internal else apparent
        for layer in layers:
            R, T = layer[i]
            rho = R + T * T * rho / (1 - R * rho)
        result.append(seen_through_air(rho) if internal else rho)
    return result


def predict(products: dict[str, Product], chosen: list[cases.Case]) -> dict[str, Any]:
    """The prediction for every case, in plain numbers."""
    from upsample import upsampled

    spectra = {name: measured_skin(subject) for name, subject in SKINS.items()}
    colours = {name: [float(c) for c in to_rgb(spectrum)] for name, spectrum in spectra.items()}
    guesses = {name: upsampled(colours[name], to_rgb_weights()) for name in spectra}
    results = []
    for case in chosen:
        layers = [products[one.product].layer(one.thickness_um, one.value) for one in case.films]
        kinds = {products[one.product].interface for one in case.films}
        if len(kinds) > 1:
            raise SystemExit(f"{case.name}: internal and apparent products in one stack")
        internal = kinds == {"internal"}
        both = {
            "measured": to_rgb(made_up(spectra[case.skin], layers, internal)),
            "upsampled": to_rgb(made_up(guesses[case.skin], layers, internal)),
        }
        results.append({**case.as_json(), **{key: [float(c) for c in rgb] for key, rgb in both.items()}})
    return {"skins": colours, "subjects": SKINS, "cases": results}


def load_products(folders: list[Path]) -> dict[str, Product]:
    products = [Product(file) for folder in folders for file in sorted(folder.glob("*.json"))]
    if not products:
        raise SystemExit(f"no products in {', '.join(map(str, folders))}")
    return {product.id: product for product in products}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--products", type=Path, action="append", help="folders of product files (default: shipped)")
    parser.add_argument("--every", type=int, default=1, help="only every n-th case")
    parser.add_argument("--first", type=int, default=0, help="the first case taken")
    options = parser.parse_args()
    products = load_products(options.products or [SHIPPED])
    chosen = cases.all_cases([(p.id, p.kind, p.thickness_um) for p in products.values()], list(SKINS))
    prediction = predict(products, chosen[options.first :: options.every])
    options.out.write_text(json.dumps(prediction, indent=1) + "\n", encoding="utf-8")
    print(f"predicted {len(prediction['cases'])} cases from {len(products)} products: {options.out}")


if __name__ == "__main__":
    main()
