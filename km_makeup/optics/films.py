"""Kubelka-Munk films and stacks of films, in forms that lose no digits.

One film of absorption K and scattering S (1/mm) and thickness X (mm) is described by its reflectance R,
its transmittance T and its absorptance A for diffuse light (Kubelka 1948, Eq 26-28). With k = K X,
s = S X, z = sqrt(k) sqrt(k + 2 s) every result below is a quotient of sums of positive terms, so nothing
cancels, K/S is never formed, and K = 0, S = 0 and X = 0 need no branch:

    tau = tanh(z)/z          D = 1 + (k + s) tau
    R = s tau / D      T = sech(z) / D      A = tau k (1 + (k + 2 s) tanh(z/2)/z) / D      1 - R = A + T

computed from q = sinh(z)/z and cosh(z), all multiplied by cosh(z), with tanh(z/2) = sinh(z)/(1 + cosh(z)).

Films are laid on one another by Kubelka 1954, Eq 9-12, with the reflectance of the upper film *lit from
below* in the denominator (Huang et al. 2013 print Eq 3 with T1 R1 T1, which creates energy).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError

Array = NDArray[np.floating]

# Values worked on at a time: their intermediate results stay in the processor's cache.
_BLOCK = 65536


class Film(NamedTuple):
    """Reflectance, transmittance and absorptance of one film, each 0..1, R + T + A = 1."""

    R: Array
    T: Array
    A: Array


class Stack(NamedTuple):
    """What a stack of films does to light that comes from above (top) and from below (bottom), each 0..1.

    ``T`` is the transmittance from above to below, ``T_up`` from below to above. They are equal for
    Kubelka-Munk films and differ where an air interface is part of the stack.
    """

    R_top: Array
    R_bottom: Array
    T: Array
    A_top: Array
    A_bottom: Array
    T_up: Array


def film(K: ArrayLike, S: ArrayLike, X: ArrayLike) -> Film:
    """Reflectance, transmittance and absorptance of one film over nothing.

    Parameters
    ----------
    K, S
        Absorption and scattering coefficients, 1/mm, >= 0, any broadcastable shapes.
    X
        Thickness, mm, >= 0; ``inf`` is the opaque film (or no film, where K = S = 0).

    Returns
    -------
    Film
        R, T, A with the broadcast shape; float32 where all arrays are float32. For K, S up to 1e6 /mm and any X,
        relative to the exact values: R, A and A + T = 1 - R within 1e-15 (float32: 5e-7), T within
        5 eps (1 + z), the conditioning of exp(-z); T is 0 below the smallest float. No input in range gives NaN.

    Raises
    ------
    MakeupError
        K, S or X negative, not a number, or infinite (X may be infinite).

    Source: Kubelka 1948, Eq 26-28; Huang et al. 2013, Eq 1-2, in the stable form above.
    """
    K, S, X = _floats(K, S, X)
    return Film(*_in_blocks(_film, 3, K, S, X))


def film_over(K: ArrayLike, S: ArrayLike, X: ArrayLike, Rg: ArrayLike) -> Array:
    """Reflectance of a film over an opaque backing, R + T^2 Rg/(1 - R Rg).

    Parameters
    ----------
    K, S, X
        As in `film`.
    Rg
        Reflectance of the backing, 0..1.

    Returns
    -------
    reflectance
        With the broadcast shape; exactly Rg at X = 0. Within 5e-15 of the exact value, and within 5e-15 relative
        apart from 10 eps (1 + z) of the part T^2 Rg that comes back from the backing.

    Raises
    ------
    MakeupError
        As `film`.

    Source: Kubelka 1954, Eq 9; equal to Kubelka 1948, Eq 20.
    """
    K, S, X, Rg = _floats(K, S, X, Rg)
    return _in_blocks(_film_over, 1, K, S, X, Rg)[0]


def opaque_reflectance(K: ArrayLike, S: ArrayLike) -> Array:
    """Reflectance R_inf of a film so thick that nothing shows through, S/(K + S + sqrt(K) sqrt(K + 2 S)).

    0 where K = S = 0, where no thickness hides anything. Within 1e-15 relative (float32: 5e-7).

    Source: Kubelka 1948, Eq 8, without a = 1 + K/S.
    """
    K, S = _floats(K, S)
    _check(K, S, np.zeros((), K.dtype))
    total = K + S + np.sqrt(K) * np.sqrt(K + 2 * S)
    return S / np.where(total > 0, total, 1)


def over(R_top: ArrayLike, T2: ArrayLike, R_bottom: ArrayLike, Rg: ArrayLike) -> Array:
    """Reflectance of a stack (R from above, round-trip T T_up, R from below) over a backing Rg, each 0..1.

    Within 5e-15 (float32: 2e-6) of the exact value for the given numbers; a stack and a backing that both reflect
    all light pass none, so the backing's part is 0 there.

    Source: Kubelka 1954, Eq 9.
    """
    R_top, T2, R_bottom, Rg = _floats(R_top, T2, R_bottom, Rg)
    d = (1 - R_bottom) + R_bottom * (1 - Rg)
    return R_top + T2 * Rg / np.where(d > 0, d, 1)


def as_stack(one: Film | Stack) -> Stack:
    """A single film as a stack: the same from above and from below."""
    if isinstance(one, Stack):
        return one
    return Stack(R_top=one.R, R_bottom=one.R, T=one.T, A_top=one.A, A_bottom=one.A, T_up=one.T)


def lay(upper: Film | Stack, lower: Film | Stack) -> Stack:
    """One stack laid on another, with all the light that bounces between them.

    Exactly the identity where one of the two is nothing.

    Source: Kubelka 1954, Eq 9-12; where much light bounces the denominator is written as absorbed plus transmitted
    light, so that two white films do not cancel.
    """
    fields = _floats(*as_stack(upper), *as_stack(lower))
    U, L = Stack(*fields[:6]), Stack(*fields[6:])
    bounce = U.R_bottom * L.R_top
    d = np.where(bounce < 0.5, 1 - bounce, (U.A_bottom + U.T_up) + U.R_bottom * (L.A_top + L.T))
    # d is 0 only between two perfect mirrors, and no light gets there.
    down, up = U.T / np.where(d > 0, d, 1), L.T_up / np.where(d > 0, d, 1)
    return Stack(
        R_top=U.R_top + down * L.R_top * U.T_up,
        R_bottom=L.R_bottom + up * U.R_bottom * L.T,
        T=down * L.T,
        A_top=U.A_top + down * (L.A_top + L.R_top * U.A_bottom),
        A_bottom=L.A_bottom + up * (U.A_bottom + U.R_bottom * L.A_top),
        T_up=up * U.T_up,
    )


def stack(films: Sequence[Film | Stack]) -> Stack:
    """The stack of films given from the bottom (nearest the skin) to the top (nearest the air).

    An air interface goes on top as `Interface.as_stack`. An empty list is no film at all: it lets all light pass.
    For n films the reflectances and absorptances are within 2e-15 n relative, the transmittances within
    5 eps n (1 + z), z the sum over the films.
    """
    nothing, all_light = np.zeros(()), np.ones(())
    whole = Stack(nothing, nothing, all_light, nothing, nothing, all_light)
    for index, one in enumerate(films):
        whole = as_stack(one) if index == 0 else lay(one, whole)
    return whole


def _floats(*values: ArrayLike) -> tuple[Array, ...]:
    """The values as arrays of one floating dtype, ready to broadcast.

    Arrays decide: float32 where all of them are float32 (or smaller), float64 otherwise; single numbers follow
    them, and are float64 where there is no array.
    """
    arrays = [np.asarray(value) for value in values]
    kinds = [a.dtype for a in arrays if a.ndim]
    dtype = np.result_type(np.float32, *kinds) if kinds else np.dtype(np.float64)
    return tuple(a.astype(dtype, copy=False) for a in arrays)


def _doubles(*values: ArrayLike) -> tuple[Array, ...]:
    """The values as float64 arrays, for what is not worth doing in float32."""
    return tuple(np.asarray(value, dtype=np.float64) for value in values)


def _in_blocks(kernel: Callable[..., tuple[Array, ...]], count: int, *inputs: Array) -> tuple[Array, ...]:
    """The ``count`` results of a kernel on broadcast inputs, block by block where they are large."""
    full = np.broadcast_arrays(*inputs)
    if full[0].ndim == 0:
        return tuple(result[0] for result in kernel(*(value.reshape(1) for value in full)))
    if full[0].size <= _BLOCK:
        return kernel(*full)
    to_allocate: list[Any] = [None] * count
    flags: list[Any] = [["readonly"]] * len(inputs) + [["writeonly", "allocate"]] * count
    walk = np.nditer(
        [*inputs, *to_allocate],
        flags=["external_loop", "buffered"],
        op_flags=flags,
        op_dtypes=[inputs[0].dtype] * (len(inputs) + count),
        buffersize=_BLOCK,
    )
    with walk:
        for block in walk:
            for out, result in zip(block[len(inputs) :], kernel(*block[: len(inputs)]), strict=True):
                out[...] = result
        return tuple(walk.operands[len(inputs) :])


def _film(K: Array, S: Array, X: Array) -> tuple[Array, ...]:
    """R, T, A of films; the formulas of the module's head times cosh z. In place, because memory is what it waits for."""
    terms = _terms(K, S, X)
    if terms is None:
        return _film_far(K, S, X)
    k, s, p, q, cosh = terms
    T = k + s
    T *= q
    T += cosh
    np.divide(1, T, out=T)
    cosh += 1
    A = np.divide(q, cosh, out=cosh)
    A *= p
    A += 1
    A *= k
    through = np.multiply(q, T, out=q)
    A *= through
    return np.multiply(s, through, out=s), T, A


def _film_over(K: Array, S: Array, X: Array, Rg: Array) -> tuple[Array]:
    """Films over backings: R + T^2 Rg/((1 - R) + R (1 - Rg)) as one quotient, which two whites do not cancel."""
    terms = _terms(K, S, X)
    if terms is None:
        R, T, A = _film_far(K, S, X)
        d = (A + T) + R * (1 - Rg)
        return (R + T * (T * Rg / np.where(d > 0, d, 1)),)
    k, s, p, q, cosh = terms
    s *= q
    k *= q
    cosh += k
    back = np.subtract(1, Rg, out=p)
    back *= s
    back += cosh
    R = np.divide(Rg, back, out=back)
    R += s
    cosh += s
    R /= cosh
    return (R,)


def _terms(K: Array, S: Array, X: Array) -> tuple[Array, ...] | None:
    """k, s, k + 2 s, sinh(z)/z and cosh z of films, arrays of their own; None where one film is thick or infinite."""
    _check(K, S, X)
    if not X.max(initial=0) < np.inf:
        return None
    k, s = K * X, S * X
    p = np.add(s, s)
    p += k
    z = np.multiply(k, p)
    # A little beyond the thick ones, so that those that `_film_far` leaves stay here whatever the last digit says.
    if not z.max(initial=0) < (1.01 * _thick(z.dtype)) ** 2:
        return None
    # The smallest normal number stands for 0, so that the quotient by z holds there too.
    np.sqrt(np.add(z, np.finfo(z.dtype).tiny, out=z), out=z)
    q = np.sinh(z)
    q /= z
    return k, s, p, q, np.cosh(z, out=z)


def _thick(dtype: np.dtype) -> float:
    """z from which tanh(z/2) is 1 to the last digit, well before sinh z overflows."""
    return 40.0 if dtype == np.float64 else 20.0


def _film_far(K: Array, S: Array, X: Array) -> tuple[Array, ...]:
    """R, T, A of films some of which are thick or infinite: of those T = 2 exp(-z) z/(k + s + z), tanh = 1."""
    K, S, X = np.broadcast_arrays(K, S, X)
    root = np.sqrt(K) * np.sqrt(K + 2 * S)
    # As good as infinite: beyond it k + 2 s overflows.
    infinite = X > np.finfo(X.dtype).max / 8 / (1 + K + S)
    z = root * np.where(infinite, 0, X)
    far = (infinite & (K + S > 0)) | (z >= _thick(z.dtype))
    total = np.where(far, K + S + root, 1)
    T = 2 * np.exp(-z) * (root / total) * ~infinite
    near = _film(K, S, np.where(far | infinite, 0, X).astype(X.dtype))
    thick = S / total, T, (K + root) / total
    return tuple(np.where(far, a, b) for a, b in zip(thick, near, strict=True))


def _check(K: Array, S: Array, X: Array) -> None:
    """Refuse what is no film: K, S or X negative or not a number, K or S infinite."""
    not_negative = K.min(initial=0) >= 0 and S.min(initial=0) >= 0 and X.min(initial=0) >= 0
    if not_negative and K.max(initial=0) < np.inf and S.max(initial=0) < np.inf:
        return
    for name, value, unit in (("K", K, "1/mm"), ("S", S, "1/mm"), ("X", X, "mm")):
        wrong = ~(value >= 0) | (np.isinf(value) & (name != "X"))
        if wrong.any():
            raise MakeupError(
                f"{name} of a film must be a number of 0 {unit} or more, not {value[wrong].flat[0]}; mend its source."
            )
