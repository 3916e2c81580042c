"""The surface between air and a film or skin, seen by diffuse light.

Saunderson 1942: of the light that arrives from outside the part k1 never enters; of the light that
arrives from inside the part k2 is turned back. K and S computed from pigments are *internal*; reflectances
as measured, skin textures among them, are *apparent*. The air side is the topmost layer of every stack:
free the skin of its interface (`internal`), stack internally, put the interface on top (`apparent`).

The first reflection k1 is not part of the diffuse light: it is the highlight. `apparent` and `internal` leave it
out; `saunderson` and `unsaunderson` deal with instruments, which may see it (specular included) or not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import MakeupError
from .arrays import SLACK, Array, common_shape, doubles, floats, refuse_outside, short
from .films import Stack

# Gauss-Legendre nodes of the Fresnel integral: 64 hold 2e-14 relative for n - 1 from 1e-12 to 3.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)
_INDEX_GREATEST = 1e6
# Readings of any instrument, wrong ones too; beyond them a number is no reflectance at all.
_READING_GREATEST = 1e3


class Interface(NamedTuple):
    """Reflectances of an air interface: ``k1`` from the air side, ``k2`` for diffuse light from inside, 0..1."""

    k1: float | Array
    k2: float | Array

    @property
    def as_stack(self) -> Stack:
        """The interface as the topmost layer of a stack, its first reflection k1 left to the highlight.

        k1 is booked as absorbed from above, so that R_top + T + A_top = 1 and no light is counted twice.
        """
        k1, k2 = np.asarray(self.k1, dtype=np.float64), np.asarray(self.k2, dtype=np.float64)
        zero = np.zeros(())
        return Stack(R_top=zero, R_bottom=k2, T=1 - k1, A_top=k1, A_bottom=zero, T_up=1 - k2)


class DiffuseFresnel(NamedTuple):
    """Fresnel reflectances of a smooth surface for diffuse light from outside and inside, and at normal incidence."""

    external: float | Array
    internal: float | Array
    normal: float | Array


def fresnel_diffuse(n: ArrayLike) -> DiffuseFresnel:
    """Reflectance of a smooth dielectric surface for perfectly diffuse light, from either side.

    Parameters
    ----------
    n
        Index of the body relative to the medium outside, any shape, 1e-6..1e6; below 1 the sides change places.

    Returns
    -------
    DiffuseFresnel
        ``external``, ``internal`` and ``normal``, each with the shape of n. Right to 1e-14 relative.

    Raises
    ------
    MakeupError
        An index that is not a number from 1e-6 to 1e6.

    Source: the integral of Fresnel's equations, 2 mu F(mu) dmu (Duntley 1942; Judd 1942), by quadrature with
    mu = sqrt(n^2 - 1) sinh t, in which R_s = exp(-4 t) and nothing is singular; above n = 4, where their closed
    form no longer cancels, by that; inside from outside by 1 - internal = (1 - external)/n^2 (Judd 1942, Eq 5).
    """
    (index,) = doubles(n)
    if not np.all((index >= 1 / _INDEX_GREATEST) & (index <= _INDEX_GREATEST)):
        raise MakeupError(
            f"The refractive index must be a positive number, 1e-6 to 1e6, not {short(n)}; skin is 1.4, most binders are 1.5."
        )
    m = np.maximum(index, 1 / index)
    contrast = (m - 1) * (m + 1)
    rare = np.where(m < 4, _diffuse_by_quadrature(np.minimum(m, 4)), _diffuse_closed(np.maximum(m, 4)))
    dense = (contrast + rare) / (m * m)
    normal = np.square((index - 1) / (index + 1))
    external, internal_ = np.where(index >= 1, rare, dense), np.where(index >= 1, dense, rare)
    return DiffuseFresnel(external[()], internal_[()], normal[()])


def _diffuse_by_quadrature(m: Array) -> Array:
    """Diffuse Fresnel reflectance from the thin side of a surface of relative index m, 1 <= m <= 4."""
    contrast = (m - 1) * (m + 1)
    end = np.arcsinh(1 / np.sqrt(np.where(contrast > 0, contrast, 1)))[..., None]
    t = 0.5 * end * (1 + _NODES)
    sinh, cosh, m2 = np.sinh(t), np.cosh(t), (m * m)[..., None]
    R_s = np.exp(-4 * t)
    R_p = ((m2 * sinh - cosh) / (m2 * sinh + cosh)) ** 2
    integral = np.sum(_WEIGHTS * sinh * cosh * (R_s + R_p), axis=-1) * 0.5 * end[..., 0]
    return contrast * integral


def _diffuse_closed(m: Array) -> Array:
    """Diffuse Fresnel reflectance from the thin side in closed form (Judd 1942, Eq 4), m >= 4."""
    m2, p, q = m * m, m * m + 1, m * m - 1
    return (
        0.5
        + (m - 1) * (3 * m + 1) / (6 * (m + 1) ** 2)
        + m2 * q * q / p**3 * np.log((m - 1) / (m + 1))
        - 2 * m * m2 * (m2 + 2 * m - 1) / (p * p * q)
        + 8 * m2 * m2 * (m2 * m2 + 1) / (p * p * p * q * q) * np.log(m)
    )


def air_interface(n: ArrayLike = 1.5, *, diffuse_light: bool = False) -> Interface:
    """The interface of air and a body of refractive index n.

    Parameters
    ----------
    n
        Refractive index of the body, any shape (one per wavelength is allowed); skin 1.4, binders 1.5.
    diffuse_light
        Whether the light outside is diffuse. False: it comes along the normal, k1 = ((n - 1)/(n + 1))^2, as in
        the usual instruments (n = 1.5: k1 = .0400, k2 = .5963). True: k1 is the diffuse value (.0918).

    Source: Saunderson 1942; `fresnel_diffuse`.
    """
    diffuse = fresnel_diffuse(n)
    return Interface(k1=diffuse.external if diffuse_light else diffuse.normal, k2=diffuse.internal)


def apparent(internal: ArrayLike, interface: Interface) -> Array:
    """Diffuse reflectance seen from the air, of a body of the given internal reflectance (0..1).

    Saunderson 1942 without the leading k1, which belongs to the highlight:
    (1 - k1)(1 - k2) R / (1 - k2 R). Right to 4 eps relative for any R in 0..1; what is no number of that range
    (by more than 1e-5) is refused with a `MakeupError`.
    """
    R, k1, k2 = _with_sides(internal, interface)
    refuse_outside("The internal reflectance of a body", R, 0, 1, SLACK)
    return (1 - k1) * (1 - k2) * R / ((1 - k2) + k2 * (1 - R))


def internal(apparent: ArrayLike, interface: Interface) -> Array:
    """The internal reflectance of a body from its diffuse reflectance seen from the air; inverse of `apparent`.

    A body can at most seem as bright as (1 - k1); what is brighter gives a value above 1, to be judged by the caller.
    Right to 4 eps relative for readings of 0 or more; what is no number within -1000..1000 is refused.
    """
    Ra, k1, k2 = _with_sides(apparent, interface)
    refuse_outside("A reflectance seen from the air", Ra, -_READING_GREATEST, _READING_GREATEST)
    return Ra / ((1 - k1) * (1 - k2) + k2 * Ra)


def saunderson(R: ArrayLike, interface: Interface, *, specular_included: bool = True) -> Array:
    """Reflectance that an instrument reads, from the internal reflectance R (0..1) of a body under its interface.

    R_m = k1 + (1 - k1)(1 - k2) R/(1 - k2 R); without the leading k1 where the instrument excludes the specular part.
    Right to 4 eps relative.

    Source: Saunderson 1942, Eq 4.
    """
    read = apparent(R, interface)
    return read + _with_sides(R, interface)[1] if specular_included else read


def unsaunderson(R_m: ArrayLike, interface: Interface, *, specular_included: bool = True) -> Array:
    """Internal reflectance from an instrument's reading R_m; inverse of `saunderson`.

    A reading below k1 gives a negative value, one above 1 a value above 1: the caller judges (inversion calls
    them out of range). Right to 4 eps (R + k1).

    Source: Saunderson 1942, Eq 5.
    """
    R, k1, _ = _with_sides(R_m, interface)
    return internal(R - k1 if specular_included else R, interface)


def _with_sides(R: ArrayLike, interface: Interface) -> tuple[Array, Array, Array]:
    """Reflectances and the two sides of an interface in one dtype; refuses an interface that is none."""
    R, k1, k2 = floats(R, *interface)
    common_shape(R, k1, k2)
    for side, k in (("k1", k1), ("k2", k2)):
        refuse_outside(f"{side} of an interface", k, 0, 1)
    return R, k1, k2
