"""Kubelka-Munk films and stacks of films, in forms that lose no digits.

One film of absorption K and scattering S (1/mm) and thickness X (mm) is described by its reflectance R,
its transmittance T and its absorptance A for diffuse light (Kubelka 1948, Eq 26-28). With k = K X/2,
p = k + S X, u = sqrt(k p), which is half of the usual exponent z = sqrt(K X (K X + 2 S X)), and
g = tanh(u)/u (1 at u = 0) they are

    R = S X g / ((1 + k g)(1 + p g))      T = sech(u)^2 / ((1 + k g)(1 + p g))      A = 2 k g / (1 + k g)

so that R + T = (1 - k g)/(1 + k g) and T - R = (1 - p g)/(1 + p g): the film lit from both sides alike, and oppositely.
Every result is a quotient of sums of positive terms, so nothing cancels, K/S is never formed, and K = 0, S = 0, X = 0 and
thick films need no branch. sech(u)^2 = 4 e/(1 + e)^2 with e = exp(-2 u), which tanh(u) would not give where it is near 1.

Films are laid on one another by Kubelka 1954, Eq 9-12, with the reflectance of the upper film *lit from
below* in the denominator (Huang et al. 2013 print Eq 3 with T1 R1 T1, which creates energy).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MakeupError
from .arrays import SLACK, Array, common_shape, floats, in_blocks, refuse_outside, short

# Optical thicknesses whose square overflows; they are as good as infinite, and exp(-2 u) is 0 long before.
_OPAQUE = {np.dtype(np.float64): 1e150, np.dtype(np.float32): 1e18}


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
        K, S or X negative, not a number, or infinite (X may be infinite), or of shapes that do not go together.

    Source: Kubelka 1948, Eq 26-28; Huang et al. 2013, Eq 1-2, in the stable form above.
    """
    K, S, X = floats(K, S, X)
    return Film(*in_blocks(_film, 3, 2, K, S, X))


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
        As `film`; a backing that reflects less than 0 or more than 1 (by more than 1e-5), or not a number.

    Source: Kubelka 1954, Eq 9; equal to Kubelka 1948, Eq 20.
    """
    K, S, X, Rg = floats(K, S, X, Rg)
    return in_blocks(_film_over, 1, 4, K, S, X, Rg)[0]


def opaque_reflectance(K: ArrayLike, S: ArrayLike) -> Array:
    """Reflectance R_inf of a film so thick that nothing shows through, S/(K + S + sqrt(K) sqrt(K + 2 S)).

    0 where K = S = 0, where no thickness hides anything. Within 1e-15 relative (float32: 5e-7).

    Source: Kubelka 1948, Eq 8, without a = 1 + K/S.
    """
    K, S = floats(K, S)
    check_film(K, S, np.zeros((), K.dtype))
    common_shape(K, S)
    total = K + S + np.sqrt(K) * np.sqrt(K + 2 * S)
    return S / np.where(total > 0, total, 1)


def over(R_top: ArrayLike, T2: ArrayLike, R_bottom: ArrayLike, Rg: ArrayLike) -> Array:
    """Reflectance of a stack (R from above, round-trip T T_up, R from below) over a backing Rg, each 0..1.

    Within 5e-15 (float32: 2e-6) of the exact value for the given numbers; a stack and a backing that both reflect
    all light pass none, so the backing's part is 0 there.

    Source: Kubelka 1954, Eq 9.
    """
    return in_blocks(_over, 1, 1, *floats(R_top, T2, R_bottom, Rg))[0]


def as_stack(one: Film | Stack) -> Stack:
    """A single film as a stack: the same from above and from below."""
    if isinstance(one, Stack):
        return one
    if not isinstance(one, Film):
        raise MakeupError(f"A stack is made of what film, stack or Interface.as_stack give, not of {short(one)}.")
    return Stack(R_top=one.R, R_bottom=one.R, T=one.T, A_top=one.A, A_bottom=one.A, T_up=one.T)


def lay(upper: Film | Stack, lower: Film | Stack) -> Stack:
    """One stack laid on another, with all the light that bounces between them.

    Exactly the identity where one of the two is nothing; for the given numbers within 4e-15 (float32: 2.2e-6) relative, and
    2 eps more where the parts of a stack do not add up to 1 to the last digit.

    Source: Kubelka 1954, Eq 9-12; where much light bounces the denominator is written as absorbed plus transmitted
    light, so that two white films do not cancel.
    """
    return Stack(*in_blocks(_lay, 6, 1, *floats(*as_stack(upper), *as_stack(lower))))


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


def _film(K: Array, S: Array, X: Array, R: Array, T: Array, A: Array, b: Array, work: Array) -> None:
    """R, T, A of films by the formulas of the module's head, in arrays given."""
    far = _far(K, S, X)
    if far is not None:
        X = np.where(far, 0, X).astype(X.dtype)
    k, s, p, u = work, R, b, T
    g = _parts(K, S, X, k, s, p, u, A)
    k *= g
    s *= g
    p *= g
    u *= -2
    e = np.exp(u, out=u)
    a = np.add(k, 1, out=A)
    b += 1
    b *= a
    R /= b
    np.divide(k, a, out=A)
    A += A
    below = np.add(e, 1, out=work)
    below *= below
    below *= b
    T /= below
    T *= 4
    if far is not None:
        _put_opaque(K, S, far, R, T, A)


def _film_over(K: Array, S: Array, X: Array, Rg: Array, R: Array, k: Array, s: Array, p: Array, work: Array) -> None:
    """Films over backings, R + T^2 Rg/((1 - R) + R (1 - Rg)), as one quotient, which two whites do not cancel.

    (s g + q^2 Rg/(d + s g (1 - Rg)))/(d + s g) with q = sech(u)^2 and d = 1 + k g (2 + p g).
    """
    refuse_outside("The reflectance of a backing", Rg, 0, 1, SLACK)
    far = _far(K, S, X)
    if far is not None:
        X = np.where(far, 0, X).astype(X.dtype)
    u = R
    g = _parts(K, S, X, k, s, p, u, work)
    k *= g
    s *= g
    p *= g
    u *= -2
    e = np.exp(u, out=u)
    below = np.add(e, 1, out=work)
    below *= below
    e /= below
    e *= e
    e *= 16
    e *= Rg
    p += 2
    p *= k
    p += 1
    back = np.subtract(1, Rg, out=work)
    back *= s
    back += p
    R /= back
    R += s
    p += s
    R /= p
    if far is not None:
        _put_opaque(K, S, far, R)


def _parts(K: Array, S: Array, X: Array, k: Array, s: Array, p: Array, u: Array, g: Array) -> Array:
    """k, s, p, u and g of the module's head, in arrays given."""
    half = np.multiply(X, 0.5, out=g)
    np.multiply(K, half, out=k)
    np.multiply(S, X, out=s)
    np.add(s, k, out=p)
    np.multiply(k, p, out=u)
    # The smallest normal number stands for 0, so that the quotient by u holds there too.
    u += np.finfo(u.dtype).tiny
    np.sqrt(u, out=u)
    np.tanh(u, out=g)
    g /= u
    return g


def _far(K: Array, S: Array, X: Array) -> NDArray[np.bool_] | None:
    """Which films let nothing through, because they are infinite or as good as infinite; None where that is no question.

    Refuses what is no film.
    """
    largest = check_film(K, S, X)
    opaque = _OPAQUE[X.dtype]
    if (largest[0] + largest[1]) * largest[2] < opaque:
        return None
    # Film by film and by the same bound (z is at most (K + S) X), so that none depends on what is beside it.
    root = np.sqrt(K) * np.sqrt(K + 2 * S)
    infinite = X > np.finfo(X.dtype).max / 16 / (1 + K + S)
    thick = root * np.where(infinite, 0, X) > opaque
    return thick | (infinite & (K + S > 0)) | np.isinf(X)


def _put_opaque(
    K: Array, S: Array, far: NDArray[np.bool_], R: Array, T: Array | None = None, A: Array | None = None
) -> None:
    """Write R, T and A of the opaque films over those that no thickness could be given for."""
    root = np.sqrt(K) * np.sqrt(K + 2 * S)
    solid = far & (K + S > 0)
    total = np.where(solid, K + S + root, 1)
    np.copyto(R, S / total, where=solid)
    if T is not None and A is not None:
        np.copyto(T, 0, where=solid)
        np.copyto(A, (K + root) / total, where=solid)


def _over(R_top: Array, T2: Array, R_bottom: Array, Rg: Array, R: Array, d: Array) -> None:
    """R_top + T2 Rg/d with d = (1 - R_bottom) + R_bottom (1 - Rg)."""
    refuse_outside("The reflectance of a backing", Rg, 0, 1, SLACK)
    np.subtract(1, Rg, out=d)
    d *= R_bottom
    d += np.subtract(1, R_bottom, out=R)
    # d is 0 only between two perfect mirrors, and no light gets there.
    d += d <= 0
    np.multiply(T2, Rg, out=R)
    R /= d
    R += R_top


def _lay(*fields: Array) -> None:
    """The fields of `Stack` of an upper and of a lower stack, 6 of each, give those of the whole; and one array to work in."""
    U, L, whole, d = Stack(*fields[:6]), Stack(*fields[6:12]), Stack(*fields[12:18]), fields[18]
    bounce = np.multiply(U.R_bottom, L.R_top, out=d)
    much = bounce >= 0.5
    np.subtract(1, bounce, out=d)
    if much.any():
        np.copyto(d, (U.A_bottom + U.T_up) + U.R_bottom * (L.A_top + L.T), where=much)
    # d is 0 only between two perfect mirrors, and no light gets there.
    d += d <= 0
    down, up = np.divide(U.T, d, out=whole.T), np.divide(L.T_up, d, out=whole.T_up)
    _lit(U.R_top, U.A_top, down, L.R_top, L.A_top, U.T_up, U.A_bottom, whole.R_top, whole.A_top)
    _lit(L.R_bottom, L.A_bottom, up, U.R_bottom, U.A_bottom, L.T, L.A_top, whole.R_bottom, whole.A_bottom)
    down *= L.T
    up *= U.T_up


def _lit(
    R: Array,
    A: Array,
    through: Array,
    next_R: Array,
    next_A: Array,
    back_T: Array,
    back_A: Array,
    to_R: Array,
    to_A: Array,
) -> None:
    """R and A of two stacks lit from one side: of the first, and of what gets through it to the next and back."""
    np.multiply(next_R, back_A, out=to_A)
    to_A += next_A
    to_A *= through
    to_A += A
    np.multiply(through, next_R, out=to_R)
    to_R *= back_T
    to_R += R


def check_film(K: Array, S: Array, X: Array) -> tuple[float, float, float]:
    """The largest K, S and X. Refuse what is no film: K, S or X negative or not a number, K or S infinite."""
    largest = float(K.max(initial=0)), float(S.max(initial=0)), float(X.max(initial=0))
    not_negative = K.min(initial=0) >= 0 and S.min(initial=0) >= 0 and X.min(initial=0) >= 0
    if not (not_negative and largest[0] < np.inf and largest[1] < np.inf):
        wrong = {"K": ~((K >= 0) & (K < np.inf)), "S": ~((S >= 0) & (S < np.inf)), "X": ~(X >= 0)}
        name = next(name for name, where in wrong.items() if where.any())
        value, unit = {"K": (K, "1/mm"), "S": (S, "1/mm"), "X": (X, "mm")}[name]
        raise MakeupError(
            f"{name} of a film must be a number of 0 {unit} or more, not {value[wrong[name]].flat[0]}; mend its source."
        )
    return largest
