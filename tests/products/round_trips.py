"""Simulated measurements and what comes back: do the stated standard errors hold, and are they as small as they can be?

    python -m tests.products.round_trips     prints the table and writes tests/results/product_round_trips.md (half a minute)

Films of shipped products are read through the air interface with the noise of an instrument, in each set-up, many times. The
truth must lie within 1.96 stated errors in 95 of 100 cases, and the median width of that interval is held against the bound of
Cramer and Rao: the least that any unbiased estimate from these readings can have (Fisher's information of ln K and ln S).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from km_makeup.optics import Status as Known
from km_makeup.optics import air_interface, film_over, opaque_reflectance, saunderson, unsaunderson
from km_makeup.optics.sensitivity import opaque_sensitivity, over_sensitivity
from km_makeup.products import Library
from km_makeup.products.measurement import FilmReading, measure
from km_makeup.products.product import Product
from tests.stamps import write_markdown

RESULT = "product_round_trips.md"
COMMAND = "python -m tests.products.round_trips"
COVERS = ["km_makeup/products/measurement.py", "tests/products/round_trips.py"]
"""The optics below have sweeps of their own; a part of this one runs with them every day."""

INTERFACE = air_interface(1.5)
BLACK, WHITE = np.full(81, 0.05), np.full(81, 0.85)
PRODUCTS = (
    "foundation-medium",
    "blush-rose",
    "lipstick-rose",
    "lipstick-classic-red",
    "concealer-tan",
    "eyeshadow-green",
)
NOISES = (0.0005, 0.002)
TRIALS = 16

THIN = {"liquid": 60.0, "cream": 30.0, "powder": 30.0}
"""um: the thin film of a set-up."""


def setups(product: Product) -> dict[str, list[tuple[float, np.ndarray]]]:
    """Thickness (um) and backing of the films of each set-up."""
    thin = THIN[product.form]
    return {
        "thin on black and opaque (the paper's)": [(thin, BLACK), (np.inf, BLACK)],
        "one film on two backings": [(thin, BLACK), (thin, WHITE)],
        "three thicknesses on two backings and opaque": [
            (thin * times, backing) for times in (0.3, 1.0, 3.0) for backing in (BLACK, WHITE)
        ] + [(np.inf, BLACK)],
    }  # fmt: skip


@dataclass(frozen=True)
class Found:
    """Of one set-up and noise: values by how well they can be known at all (relative bound), and what was stated of them."""

    bound: np.ndarray
    inside: np.ndarray
    stated: np.ndarray
    known: np.ndarray


def simulate(setup: str, noise: float, trials: int = TRIALS, products: tuple[str, ...] = PRODUCTS) -> Found:
    """All trials of all products: the relative bound, whether the truth lay inside, the stated relative error, and the status."""
    rng = np.random.default_rng(17)
    rows: list[tuple[np.ndarray, ...]] = []
    for name in products:
        product = Library.shipped().find(name)
        films = setups(product)[setup]
        bounds = cramer_rao(product, films, noise)
        clean = [_reading(product, *film) for film in films]
        for _ in range(trials):
            readings = [
                FilmReading(seen + rng.normal(0, noise, 81), backing, thickness)
                for seen, (thickness, backing) in zip(clean, films, strict=True)
            ]
            found = measure(readings, noise=noise)
            known = found.status == Known.OK
            for value, error, truth, bound in (
                (found.K, found.K_error, product.K, bounds[0]), (found.S, found.S_error, product.S, bounds[1]),
            ):  # fmt: skip
                inside = np.abs(value - truth) <= 1.96 * error
                rows.append((bound, inside, error / np.maximum(truth, 1e-12), known))
    return Found(*(np.concatenate(column) for column in zip(*rows, strict=True)))  # type: ignore[arg-type]


def _reading(product: Product, thickness_um: float, backing: np.ndarray) -> np.ndarray:
    inner = np.clip(unsaunderson(backing, INTERFACE), 0, 1)
    opaque = np.isinf(thickness_um)
    R = (
        opaque_reflectance(product.K, product.S)
        if opaque
        else film_over(product.K, product.S, thickness_um / 1000, inner)
    )
    return np.asarray(saunderson(R, INTERFACE))


def cramer_rao(product: Product, films: list[tuple[float, np.ndarray]], noise: float) -> tuple[np.ndarray, np.ndarray]:
    """The least standard errors of ln K and ln S, (81,) each: the inverse of Fisher's information of all readings."""
    information = np.zeros((81, 2, 2))
    k1, k2 = INTERFACE
    for thickness_um, backing in films:
        if np.isinf(thickness_um):
            to_K, to_S = opaque_sensitivity(product.K, product.S)
            R = opaque_reflectance(product.K, product.S)
        else:
            X = thickness_um / 1000
            R, to_K, to_S, _ = over_sensitivity(product.K * X, product.S * X, unsaunderson(backing, INTERFACE))
        slope = (1 - k1) * (1 - k2) / (1 - k2 * R) ** 2 / noise
        row = np.stack([to_K * slope, to_S * slope], axis=-1)
        information += row[:, :, None] * row[:, None, :]
    determinant = np.linalg.det(information)
    sure = determinant > 1e-12 * information[:, 0, 0] * information[:, 1, 1]
    inverse = np.linalg.inv(np.where(sure[:, None, None], information, np.eye(2)))
    return tuple(np.where(sure, np.sqrt(np.maximum(inverse[:, i, i], 0)), np.inf) for i in (0, 1))  # type: ignore[return-value]


CLASSES = ((0.0, 0.1), (0.1, 0.3), (0.3, np.inf))
"""Relative bounds: what these readings can tell to 10 %, to 30 %, and what they cannot."""


def summary(found: Found, low: float, high: float) -> tuple[int, float, float, float, float]:
    """Of a class: values, share called known, coverage and median width over the bound of the known ones; coverage of all."""
    these = (found.bound >= low) & (found.bound < high)
    known = these & found.known
    if not known.any():
        return (
            int(these.sum()),
            0.0,
            float("nan"),
            float("nan"),
            float(found.inside[these].mean()) if these.any() else float("nan"),
        )
    ratio = float(np.median(found.stated[known] / found.bound[known]))
    return (
        int(these.sum()),
        float(known.sum() / these.sum()),
        float(found.inside[known].mean()),
        ratio,
        float(found.inside[these].mean()),
    )


def text(trials: int = TRIALS) -> str:
    """The table over set-ups, noises and classes."""
    lines = [
        f"Products: {', '.join(PRODUCTS)}; thin film 60 um (liquid) or 30 um; {trials} trials each at 81 wavelengths; K and S together.",
        "Known: not called opaque, inconsistent or no film. Coverage: share of the known values whose 95 % interval holds the truth.",
        "Width: median of the stated error over the bound of Cramer and Rao. Coverage of all: those that are not known too, whose file",
        "states an error of a thousand times the largest value.",
        "",
        "| set-up | noise | what the readings can tell | values | known | coverage | width | coverage of all |",
        "| --- | ---: | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for setup in setups(Library.shipped().find(PRODUCTS[0])):
        for noise in NOISES:
            found = simulate(setup, noise, trials)
            for low, high in (*CLASSES, (0.0, np.inf)):
                name = "all" if (low, high) == (0.0, np.inf) else f"to {high:.0%}" if high < 1 else "less than to 30%"
                count, known, coverage, width, every = summary(found, low, high)
                cells = [f"{known:.1%}", f"{coverage:.1%}", f"{width:.2f}", f"{every:.1%}"] if count else ["-"] * 4
                cells = ["-" if cell.startswith("nan") else cell for cell in cells]
                lines.append(f"| {setup} | {noise:g} | {name} | {count} | {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def main() -> int:
    """Print the table and write it down."""
    result = text()
    print(result)
    print(write_markdown(RESULT, "Measurements simulated and inverted", COMMAND, COVERS, result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
