"""What a library is worth: every product physical, smooth, with a source; what was said to be measured has errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..optics import film, film_over
from ..spectra import WAVELENGTHS
from .library import Library
from .product import Product, Status

LARGEST_STEP = 0.08
"""Largest second difference of the reflectance of a film over mid grey, 5 nm apart: the steepest measured edges reach .06."""

STRONGEST = 20_000.0
"""1/mm: no pigment fills more than a film, and none is stronger than this over a whole film."""

THICKEST_UM = 2_000.0


@dataclass(frozen=True)
class Finding:
    """What was found wrong with one product, or with a file that is none."""

    product: str
    problem: str

    def __str__(self) -> str:
        return f"{self.product}: {self.problem}" if self.product else self.problem


def check_library(library: Library) -> list[Finding]:
    """All findings on a library, in the order of its products; empty where all is well."""
    findings = [Finding("", problem) for problem in library.problems]
    return findings + [
        Finding(product.id, problem) for product in library.products for problem in check_product(product)
    ]


def check_product(product: Product) -> list[str]:
    """What is wrong with a product, one sentence each."""
    return [*_physical(product), *_plausible(product), *_trusted(product)]


def _physical(product: Product) -> list[str]:
    thicknesses = np.array([0.1, 1.0, 10.0])[:, None] * product.thickness_um / 1000
    R, T, A = film(product.K, product.S, thicknesses)
    problems = []
    if not (np.isfinite(R).all() and np.isfinite(T).all()):
        problems.append("its film has a reflectance or transmittance that is not finite.")
    if (R + T > 1 + 1e-12).any() or np.abs(R + T + A - 1).max() > 1e-9:
        problems.append("its film gives back more light than it gets.")
    if not (product.K.any() or product.S.any()):
        problems.append("K and S are 0 everywhere: it is no product.")
    return problems


def _plausible(product: Product) -> list[str]:
    problems = []
    strongest = max(product.K.max(), product.S.max())
    if strongest > STRONGEST:
        problems.append(f"K or S reaches {strongest:g} 1/mm, more than any film can; check the unit.")
    if product.thickness_um > THICKEST_UM:
        problems.append(f"its thickness is {product.thickness_um:g} um; check the unit.")
    seen = film_over(product.K, product.S, product.thickness_um / 1000, np.full(len(WAVELENGTHS), 0.5))
    bend = np.abs(seen[2:] - 2 * seen[1:-1] + seen[:-2])
    if bend.max() > LARGEST_STEP:
        nm = WAVELENGTHS[1:-1][np.argmax(bend)]
        problems.append(
            f"its spectrum is not smooth at {nm:g} nm (a kink of {bend.max():.3f} in the film's reflectance)."
        )
    return problems


def _trusted(product: Product) -> list[str]:
    problems = []
    provenance = product.provenance
    if not provenance.licence.strip():
        problems.append("its provenance names no licence.")
    if provenance.status == Status.MEASURED and (product.K_error is None or product.S_error is None):
        problems.append("it is called measured and has no standard errors; import the measurement again.")
    return problems
