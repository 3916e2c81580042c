"""The live colour path: what each film does to the colour below it, as an affine map per thickness.

``out = a(value) + M(value) c`` with c the linear RGB of what lies below, in 32 steps of the painted value
spaced as its square. ``a`` is the film over black, computed; ``M`` is fitted by least squares to the
stack at hand: the substrates of each film are the skins of this head under the films below it. Kept that
way, the split into the films' own light and the skin's is true, and the residual is what the fit costs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..optics import Interface
from ..spectra import Bands
from .coat import Coat, on_skin

STOPS = 32
TABLE = 255
"""Blender evaluates a colour ramp through a table of 256 entries; stops on its entries are met exactly."""

RIDGE = 1e-4
SUBSTRATE_VALUES = (0.0, 0.1, 0.3, 0.6, 0.8, 1.0, 1.0, 1.0)
"""Painted values of a film under which the next one is fitted; the full one, which covers most of a map, counts more."""

DARKEST = 0.003
"""Reflectance below which differences are no longer weighted more."""


def stop_positions(stops: int = STOPS) -> NDArray:
    """Positions 0..1 of the stops on the ramp, (stops,); the painted value there is the position squared."""
    return np.round(np.arange(stops) * TABLE / (stops - 1)) / TABLE


@dataclass(frozen=True)
class Transfer:
    """One film as ``out = a + M c``: ``a`` (stops, 3), ``M`` (stops, 3, 3), c and out linear RGB columns."""

    a: NDArray
    M: NDArray
    residual: float

    def apply(self, value: NDArray, c: NDArray) -> NDArray:
        """Colour (..., 3) of the film painted ``value`` (...,) thick over the colours c (..., 3), as the nodes do it."""
        x = np.sqrt(np.clip(value, 0, 1))
        positions = stop_positions(len(self.a))
        table = np.concatenate([self.a, self.M.reshape(len(self.M), 9)], axis=1)
        row = np.stack([np.interp(x, positions, table[:, i]) for i in range(12)], axis=-1)
        return row[..., :3] + np.einsum("...ij,...j->...i", row[..., 3:].reshape(*x.shape, 3, 3), c)


def fit_transfers(
    coats: Sequence[Coat], skins: NDArray, interface: Interface | None, bands: Bands, stops: int = STOPS
) -> list[Transfer]:
    """The transfers of a stack's films, bottom to top.

    Parameters: ``coats`` at the wavelengths of ``bands``; ``skins`` (count, bands), apparent reflectance of
    the skins to be met; ``interface`` as `interface_of` gives it; ``stops`` how many thicknesses are tabulated.

    Each state in the chain is what would be seen through the air if the stack ended there.
    """
    ground = np.atleast_2d(skins)
    transfers = []
    for one in coats:
        transfers.append(fit_transfer(one, ground, interface, bands, stops))
        ground = under_next(one, ground, interface)
    return transfers


def fit_transfer(one: Coat, ground: NDArray, interface: Interface | None, bands: Bands, stops: int = STOPS) -> Transfer:
    """The transfer of one film over the reflectances ``ground`` (count, bands) that it will meet."""
    values = stop_positions(stops) ** 2
    optics = on_skin([one.at(values)], interface)
    W = bands.weights
    c = ground @ W
    out = optics.R[:, None] + optics.T2[:, None] * ground / np.maximum(1 - optics.R_up[:, None] * ground, 1e-9)
    target = out @ W
    a = optics.R @ W
    seen = target - a[:, None]
    # Lightness is a cube root: a difference in a channel is seen as its share of the channel to the power 2/3.
    M = _ridge(c, seen, np.maximum(np.abs(target), DARKEST) ** (-2 / 3))
    a[0], M[0] = 0, np.eye(3)
    fitted = a[:, None] + np.einsum("sij,gj->sgi", M, c)
    return Transfer(a, M, float(np.abs(fitted - target).max()))


def _ridge(c: NDArray, seen: NDArray, weight: NDArray) -> NDArray:
    """M (stops, 3, 3) with M c close to ``seen`` (stops, ground, 3), weighted by channel, pulled gently to a diagonal matrix.

    Skins of one colour do not determine nine numbers; the diagonal one that maps their mean is the
    natural choice, and deviations from it are paid for.
    """
    mean = c.mean(axis=0)
    diagonal = seen.mean(axis=1) / np.maximum(mean, 1e-6)
    prior = diagonal[:, :, None] * np.eye(3)
    rest = seen - diagonal[:, None] * c
    products = (c[:, :, None] * c[:, None, :]).reshape(len(c), 9)
    squared = (weight * weight).transpose(0, 2, 1)
    gram = (squared @ products).reshape(*squared.shape[:2], 3, 3)
    gram += RIDGE * np.trace(gram, axis1=2, axis2=3)[..., None, None] / 3 * np.eye(3)
    right = (squared * rest.transpose(0, 2, 1)) @ c
    return prior + np.linalg.solve(gram, right[..., None])[..., 0]


def under_next(one: Coat, ground: NDArray, interface: Interface | None) -> NDArray:
    """The reflectances that the next film will meet: those below, under this film at several values.

    The number is kept within bounds by taking every n-th, in a fixed order.
    """
    optics = on_skin([one.at(np.array(SUBSTRATE_VALUES))], interface)
    met = optics.R[:, None] + optics.T2[:, None] * ground / np.maximum(1 - optics.R_up[:, None] * ground, 1e-9)
    met = met.reshape(-1, ground.shape[1])
    return met[:: -(-len(met) // 96)]
