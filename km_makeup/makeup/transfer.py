"""The live colour path: what each film does to the colour below it, as a map of RGB onto RGB per thickness.

``out = a(value) + M(value) d`` with ``d = c / (1 - u(value) c)`` channel by channel, c the linear RGB of what lies below,
in 32 steps of the painted value spaced as its square. ``a`` is the film over black, and ``u`` its reflectance from below as
each channel sees it (light goes to and fro between film and ground); both are computed. ``M`` is fitted by least squares
to the stack at hand: the substrates of each film are the skins of this head under the films below it, and those
films over black. Kept that way, the split into the films' own light and the skin's is true, and the residual is what
the fit costs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..optics import Interface
from ..spectra import Bands
from .coat import Coat, OnSkin, on_skin

STOPS = 32
TABLE = 255
"""Blender evaluates a colour ramp through a table of 256 entries; stops on its entries are met exactly."""

RIDGE = 1e-4
MOST_SEEN, MOST_FILMS = 96, 32
"""Reflectances kept of those that a film meets: over skin, and over black."""

INVISIBLE = 1e-4
"""Largest reflectance of what asks for no fit, since it is black."""

GREY = 0.3

SUBSTRATE_VALUES = (0.0, 0.1, 0.3, 0.6, 0.8, 1.0, 1.0, 1.0)
"""Painted values of a film under which the next one is fitted; the full one, which covers most of a map, counts more."""

DARKEST = 0.003
"""Reflectance below which differences are no longer weighted more."""

OVER_BLACK = 0.3
"""Weight in the fit of all colours that the films below have over black, beside those over skin.

Of 0.1, 0.3 and 1 the one with which films' and skin's part are best together: mean CIEDE2000 .073 (without any .072) and
parts beyond .01 on .16 % of texels (.38 %), most of them skins whose spectrum is not what their colour tells.
"""

LEAST_LOSS = 0.05
"""Least ``1 - u c``: colours far above 1 are no reflectances, and end there."""


def stop_positions(stops: int = STOPS) -> NDArray:
    """Positions 0..1 of the stops on the ramp, (stops,); the painted value there is the position squared."""
    return np.round(np.arange(stops) * TABLE / (stops - 1)) / TABLE


@dataclass(frozen=True)
class Transfer:
    """One film as ``out = a + M c / (1 - u c)``: ``a`` and ``u`` (stops, 3), ``M`` (stops, 3, 3), c and out linear RGB columns."""

    a: NDArray
    M: NDArray
    u: NDArray
    residual: float

    def apply(self, value: NDArray, c: NDArray) -> NDArray:
        """Colour (..., 3) of the film painted ``value`` (...,) thick over the colours c (..., 3), as the nodes do it."""
        x = np.sqrt(np.clip(value, 0, 1))
        positions = stop_positions(len(self.a))
        table = np.concatenate([self.a, self.u, self.M.reshape(len(self.M), 9)], axis=1)
        row = np.stack([np.interp(x, positions, table[:, i]) for i in range(15)], axis=-1)
        d = _to_and_fro(row[..., 3:6], c)
        return row[..., :3] + np.einsum("...ij,...j->...i", row[..., 6:].reshape(*x.shape, 3, 3), d)


@dataclass(frozen=True)
class Below:
    """The reflectances that a film will meet: ``seen`` (count, bands), and ``films`` (count, bands), those that the films below
    it have over black, none where there are no films.
    """

    seen: NDArray
    films: NDArray


def bare(skins: NDArray) -> Below:
    """What the lowest film meets: skins of apparent reflectance (count, bands) or (bands,).

    Skins that are all black, as an image that is not painted yet, tell nothing of what a film passes: grey ones stand for them.
    """
    seen = np.atleast_2d(skins)
    if seen.max() <= INVISIBLE:
        seen = np.full_like(seen, GREY)
    return Below(seen, seen[:0])


def fit_transfers(
    coats: Sequence[Coat], skins: NDArray, interface: Interface | None, bands: Bands, stops: int = STOPS
) -> list[Transfer]:
    """The transfers of a stack's films, bottom to top.

    Parameters: ``coats`` at the wavelengths of ``bands``; ``skins`` (count, bands), apparent reflectance of
    the skins to be met; ``interface`` as `interface_of` gives it; ``stops`` how many thicknesses are tabulated.

    Each state in the chain is what would be seen through the air if the stack ended there.
    """
    below = bare(skins)
    transfers = []
    for one in coats:
        transfers.append(fit_transfer(one, below, interface, bands, stops))
        below = under_next(one, below, interface)
    return transfers


def fit_transfer(one: Coat, below: Below, interface: Interface | None, bands: Bands, stops: int = STOPS) -> Transfer:
    """The transfer of one film over what it will meet; the residual is the largest difference of a channel over ``below.seen``."""
    values = stop_positions(stops) ** 2
    optics = on_skin([one.at(values)], interface)
    W = bands.weights
    count = len(below.seen)
    ground = np.concatenate([below.seen, below.films])
    share = np.full(len(ground), OVER_BLACK * count / max(1, len(below.films)))
    share[:count] = 1
    c = ground @ W
    passed = _through(optics, ground) @ W
    a, u = optics.R @ W, _seen_from_below(optics, below.seen, W)
    # Lightness is a cube root: a difference in a channel is seen as its share of the channel to the power 2/3.
    weight = np.maximum(np.abs(a[:, None] + passed), DARKEST) ** (-4 / 3) * share[:, None]
    d = _to_and_fro(u[:, None], c)
    M = _ridge(d, passed, weight)
    a[0], u[0], M[0] = 0, 0, np.eye(3)
    fitted = np.einsum("sij,sgj->sgi", M, _to_and_fro(u[:, None], c))
    return Transfer(a, M, u, float(np.abs(fitted - passed)[:, :count].max()))


def _through(optics: OnSkin, ground: NDArray) -> NDArray:
    """What comes back through a film (stops, bands) from what it lies on (count, bands): (stops, count, bands)."""
    return optics.T2[:, None] * ground / np.maximum(1 - optics.R_up[:, None] * ground, 1e-9)


def _seen_from_below(optics: OnSkin, ground: NDArray, W: NDArray) -> NDArray:
    """The film's reflectance from below in each channel, (stops, 3): its mean over the light that the channel gets through it."""
    light = optics.T2 * ground.mean(axis=0)
    seen = np.maximum(W, 0)
    return ((light * optics.R_up) @ seen) / np.maximum(light @ seen, 1e-12)


def _to_and_fro(u: NDArray, c: NDArray) -> NDArray:
    return c / np.maximum(1 - u * c, LEAST_LOSS)


def _ridge(d: NDArray, passed: NDArray, weight: NDArray) -> NDArray:
    """M (stops, 3, 3) with M d close to ``passed``, all (stops, ground, 3) with squared weights; pulled gently to a diagonal matrix.

    Skins of one colour do not determine nine numbers; the diagonal one that maps their mean is the
    natural choice, and deviations from it are paid for.
    """
    diagonal = passed.mean(axis=1) / np.maximum(d.mean(axis=1), 1e-6)
    prior = diagonal[:, :, None] * np.eye(3)
    rest = passed - diagonal[:, None] * d
    products = (d[..., :, None] * d[..., None, :]).reshape(*d.shape[:2], 9)
    squared = weight.transpose(0, 2, 1)
    gram = (squared @ products).reshape(*squared.shape[:2], 3, 3)
    gram += RIDGE * np.trace(gram, axis1=2, axis2=3)[..., None, None] / 3 * np.eye(3)
    right = (squared * rest.transpose(0, 2, 1)) @ d
    return prior + np.linalg.solve(gram, right[..., None])[..., 0]


def under_next(one: Coat, below: Below, interface: Interface | None) -> Below:
    """The reflectances that the next film will meet: those below, under this film at several values.

    The number is kept within bounds by taking every n-th, in a fixed order.
    """
    optics = on_skin([one.at(np.array(SUBSTRATE_VALUES))], interface)
    black = np.zeros((1, below.seen.shape[1]))
    films = _few(_over(optics, np.concatenate([below.films, black])), MOST_FILMS)
    return Below(_few(_over(optics, below.seen), MOST_SEEN), films[films.max(axis=1) > INVISIBLE])


def _over(optics: OnSkin, ground: NDArray) -> NDArray:
    return (optics.R[:, None] + _through(optics, ground)).reshape(-1, ground.shape[1])


def _few(rows: NDArray, most: int) -> NDArray:
    return rows[:: -(-len(rows) // most)]
