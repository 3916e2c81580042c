"""Smooth maps of space that carry a few points to others: similarities and thin-plate splines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MakeupError


@dataclass(frozen=True, eq=False)
class Similarity:
    """``x -> scale R x + shift``: a rotation, one scale and a shift."""

    scale: float
    rotation: NDArray
    shift: NDArray

    def __call__(self, points: NDArray) -> NDArray:
        return self.scale * points @ self.rotation.T + self.shift

    def inverse(self) -> Similarity:
        """The way back."""
        back = self.rotation.T / self.scale
        return Similarity(1 / self.scale, self.rotation.T, -back @ self.shift)


def similarity(source: NDArray, target: NDArray, weights: NDArray | None = None) -> Similarity:
    """The similarity that carries ``source`` (k, 3) to ``target`` (k, 3) with the least sum of squares.

    Source: Umeyama 1991. MakeupError where fewer than three points, or all on a line, leave it open.
    """
    w = np.ones(len(source)) if weights is None else np.asarray(weights, float)
    w = w / w.sum()
    a, b = source - w @ source, target - w @ target
    U, D, Vt = np.linalg.svd((w[:, None] * b).T @ a)
    if len(source) < 3 or D[1] < 1e-9 * max(D[0], 1e-300):
        raise MakeupError("The landmarks lie on one line or in one place; set at least three that do not.")
    sign = np.array([1, 1, np.sign(np.linalg.det(U @ Vt))])
    rotation = (U * sign) @ Vt
    scale = float((D * sign).sum() / (w @ (a * a).sum(axis=1)))
    return Similarity(scale, rotation, w @ target - scale * rotation @ (w @ source))


@dataclass(frozen=True, eq=False)
class ThinPlate:
    """``x -> affine(x) + sum_k w_k |x - centre_k|``, the smoothest map of space through given points."""

    centres: NDArray
    weights: NDArray
    affine: NDArray

    def __call__(self, points: NDArray) -> NDArray:
        points = np.asarray(points, float)
        out = points @ self.affine[1:] + self.affine[0]
        for start in range(0, len(points), 65536):
            part = points[start : start + 65536]
            out[start : start + 65536] += _distances(part, self.centres) @ self.weights
        return out


def thin_plate(source: NDArray, target: NDArray, smoothing: float | NDArray = 0.0) -> ThinPlate:
    """The thin-plate spline in space that carries ``source`` (k, 3) to ``target`` (k, 3).

    Parameters: ``smoothing`` in units of length: 0 meets the points, more follows them loosely, one number or
    one a point. The kernel is |r|, the biharmonic one in three dimensions (Duchon 1977; Bookstein 1989 for the
    use on landmarks).

    MakeupError where fewer than four points, or all in one plane, leave it open.
    """
    source, target = np.asarray(source, float), np.asarray(target, float)
    k = len(source)
    P = np.concatenate([np.ones((k, 1)), source], axis=1)
    spread = np.linalg.svd(source - source.mean(axis=0), compute_uv=False) if k else np.zeros(3)
    if k < 4 or spread[-1] < 1e-6 * spread[0]:
        raise MakeupError("The landmarks lie in one plane; set at least four that do not.")
    system = np.zeros((k + 4, k + 4))
    # The kernel -|r| is the conditionally positive one, so smoothing is taken off the diagonal of +|r|.
    system[:k, :k] = _distances(source, source) - np.diag(np.broadcast_to(np.asarray(smoothing, float), (k,)))
    system[:k, k:], system[k:, :k] = P, P.T
    right = np.zeros((k + 4, 3))
    right[:k] = target
    try:
        solved = np.linalg.solve(system, right)
    except np.linalg.LinAlgError:
        raise MakeupError("Two landmarks lie in one place; move one of them.") from None
    return ThinPlate(source, solved[:k], solved[k:])


def _distances(a: NDArray, b: NDArray) -> NDArray:
    square = (a * a).sum(axis=1)[:, None] + (b * b).sum(axis=1) - 2 * a @ b.T
    return np.sqrt(np.maximum(square, 0))
