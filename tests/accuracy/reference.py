"""The colour of films on skin at every nanometre, computed apart from the extension: what the colour ladders are measured against.

Imports nothing from km_makeup, and nothing here is clever: mpmath with 40 digits, the equations as they are printed, one
wavelength after another. A cosmetic measured every 5 nm has no other truth in between than a rule; here it is the straight
line, for K, S, the skin and the light (CIE 15 defines D65 between its tabulated values by the straight line too).

* one film: Kubelka 1948, Eq 26-27, and their limits where K or S is 0;
* films on one another and on a backing: Kubelka 1954, Eq 9-12, with the upper film lit from below in the denominator;
* the surface to the air: Saunderson 1942, k1 for light along the normal, k2 by integrating Fresnel's equations; a skin is
  known through it, so it is taken off, the films are laid on, and it is put on top; its first reflection is the highlight;
* a powder covers a share of the area: its R and T are averaged with those of nothing;
* colour: CIE 1931 2 degree observer at 1 nm, a perfect white is (1, 1, 1) under every light, Bradford from the light's
  white to that of Rec.709; CIELAB and CIEDE2000 (Sharma, Wu, Dalal 2005) with that white.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import mpmath as mp

DIGITS = 40
FIRST, LAST = 380, 780
WAVELENGTHS = range(FIRST, LAST + 1)

Number = mp.mpf
Spectrum = list[mp.mpf]


@dataclass(frozen=True)
class Layer:
    """A film: K and S in 1/mm at every nanometre, thickness in mm, and the share of the area that it covers."""

    K: Spectrum
    S: Spectrum
    X: Number
    share: Number | int = 1


@mp.workdps(DIGITS)
def at_every_nanometre(values: Sequence[float | str], first: int = FIRST, step: int = 5) -> Spectrum:
    """Values every ``step`` nm from ``first`` on, joined by straight lines, at every nanometre from 380 to 780."""
    table = [mp.mpf(repr(v)) if isinstance(v, float) else mp.mpf(v) for v in values]
    if first > FIRST or first + step * (len(table) - 1) < LAST:
        raise ValueError(f"values from {first} nm every {step} nm end before {LAST} nm or begin after {FIRST} nm")
    result = []
    for nm in WAVELENGTHS:
        index, rest = divmod(nm - first, step)
        share = mp.mpf(rest) / step
        result.append(table[index] if rest == 0 else table[index] * (1 - share) + table[index + 1] * share)
    return result


@mp.workdps(DIGITS)
def mixture(spectra: Sequence[Spectrum], shares: Sequence[float]) -> Spectrum:
    """Shares of spectra summed."""
    return [
        mp.fsum(mp.mpf(repr(s)) * one[i] for s, one in zip(shares, spectra, strict=True))
        for i in range(len(spectra[0]))
    ]


@mp.workdps(DIGITS)
def painted(product: dict, um: float, value: float) -> Layer:
    """A product as its file says, of a full thickness in um, painted ``value``: as much thinner, or as a powder on as much of the area."""
    K, S = (at_every_nanometre(product[name]) for name in ("K", "S"))
    whole, share = mp.mpf(repr(um)) / 1000, mp.mpf(repr(value))
    return Layer(K, S, whole, share) if product["form"] == "powder" else Layer(K, S, whole * share)


@mp.workdps(DIGITS)
def film(K: Number, S: Number, X: Number) -> tuple[Number, Number]:
    """R and T of one film."""
    if X == 0 or (K == 0 and S == 0):
        return mp.mpf(0), mp.mpf(1)
    if S == 0:
        return mp.mpf(0), mp.exp(-K * X)
    if K == 0:
        return S * X / (1 + S * X), 1 / (1 + S * X)
    with mp.workdps(2 * DIGITS):  # a^2 - 1 and what is nearly opaque cancel
        a = 1 + K / S
        b = mp.sqrt(a * a - 1)
        below = a * mp.sinh(b * S * X) + b * mp.cosh(b * S * X)
        return mp.sinh(b * S * X) / below, b / below


@mp.workdps(DIGITS)
def lay(upper: tuple, lower: tuple) -> tuple[Number, Number, Number, Number]:
    """R from above, R from below, T down, T up of two stacks on one another."""
    over, under, down, up = upper
    low_over, low_under, low_down, low_up = lower
    d = 1 - under * low_over
    return (
        over + down * low_over * up / d,
        low_under + low_up * under * low_down / d,
        down * low_down / d,
        low_up * up / d,
    )


@mp.workdps(DIGITS)
def stack(layers: Sequence[Layer], index: int) -> tuple[Number, Number, Number, Number]:
    """The layers, bottom to top, at the wavelength of that index; without any, what lets all light pass."""
    whole = (mp.mpf(0), mp.mpf(0), mp.mpf(1), mp.mpf(1))
    for layer in layers:
        R, T = film(layer.K[index], layer.S[index], layer.X)
        R, T = layer.share * R, layer.share * T + (1 - layer.share)
        whole = lay((R, R, T, T), whole)
    return whole


@cache
@mp.workdps(DIGITS)
def surface(n: str) -> tuple[Number, Number]:
    """k1 along the normal and k2 for diffuse light from inside, of a body of index n (as text)."""
    index = mp.mpf(n)

    def reflected(mu: Number) -> Number:
        inside = mp.sqrt(1 - (1 - mu * mu) / index**2)
        s = (mu - index * inside) / (mu + index * inside)
        p = (index * mu - inside) / (index * mu + inside)
        return mu * (s * s + p * p)

    return ((index - 1) / (index + 1)) ** 2, 1 - (1 - mp.quad(reflected, [0, 1])) / index**2


@mp.workdps(DIGITS)
def made_up(skin: Spectrum, layers: Sequence[Layer], n: str | None = "1.45") -> Spectrum:
    """Reflectance of made-up skin as seen, at every nanometre; ``n`` None leaves the surface out (the paper's way)."""
    result = []
    for index, seen in enumerate(skin):
        over, under, down, up = stack(layers, index)
        if n is None:
            result.append(over + down * up * seen / (1 - under * seen))
            continue
        k1, k2 = surface(n)
        inside = seen / ((1 - k1) * (1 - k2) + k2 * seen)
        rho = over + down * up * inside / (1 - under * inside)
        result.append((1 - k1) * (1 - k2) * rho / (1 - k2 * rho))
    return result


@mp.workdps(DIGITS)
def light(name: str) -> Spectrum:
    """Power of a light at every nanometre: E, A by its formula (CIE 15), others by colour-science's tables."""
    if name == "E":
        return [mp.mpf(1)] * len(WAVELENGTHS)
    if name == "A":
        top = mp.expm1(mp.mpf("1.435e7") / (2848 * 560))
        return [100 * (mp.mpf(560) / nm) ** 5 * top / mp.expm1(mp.mpf("1.435e7") / (2848 * nm)) for nm in WAVELENGTHS]
    import colour

    table = colour.SDS_ILLUMINANTS[name]
    given = {int(nm): float(value) for nm, value in zip(table.wavelengths, table.values, strict=True)}
    step = int(table.shape.interval)
    return at_every_nanometre([given[nm] for nm in range(FIRST, LAST + 1, step)], FIRST, step)


@cache
@mp.workdps(DIGITS)
def observer() -> tuple[Spectrum, Spectrum, Spectrum]:
    """The CIE 1931 2 degree observer at every nanometre."""
    import colour

    table = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    rows = {int(nm): row for nm, row in zip(table.wavelengths, table.values, strict=True)}
    return tuple([mp.mpf(repr(float(rows[nm][i]))) for nm in WAVELENGTHS] for i in range(3))


@mp.workdps(DIGITS)
def to_xyz(reflectance: Spectrum, name: str = "D65") -> Spectrum:
    """X, Y, Z of a body under a light, Y = 1 for a perfect white."""
    power = light(name)
    white = mp.fsum(p * y for p, y in zip(power, observer()[1], strict=True))
    return [
        mp.fsum(p * c * r for p, c, r in zip(power, curve, reflectance, strict=True)) / white for curve in observer()
    ]


BRADFORD = mp.matrix(
    [["0.8951", "0.2664", "-0.1614"], ["-0.7502", "1.7135", "0.0367"], ["0.0389", "-0.0685", "1.0296"]]
)
PRIMARIES, WHITE = (("0.64", "0.33"), ("0.30", "0.60"), ("0.15", "0.06")), ("0.3127", "0.3290")


def _xyz(x: str, y: str) -> mp.matrix:
    return mp.matrix([mp.mpf(x) / mp.mpf(y), 1, (1 - mp.mpf(x) - mp.mpf(y)) / mp.mpf(y)])


@cache
@mp.workdps(DIGITS)
def rgb_to_xyz() -> mp.matrix:
    """Linear Rec.709 to X, Y, Z, from its primaries and white."""
    columns = [_xyz(*xy) for xy in PRIMARIES]
    primaries = mp.matrix(3, 3)
    for j, column in enumerate(columns):
        for i in range(3):
            primaries[i, j] = column[i]
    return primaries * mp.diag(list(primaries**-1 * _xyz(*WHITE)))


@mp.workdps(DIGITS)
def to_rgb(reflectance: Spectrum, name: str = "D65") -> Spectrum:
    """Linear Rec.709 of a body under a light, a perfect white being (1, 1, 1)."""
    light_white = mp.matrix(to_xyz([mp.mpf(1)] * len(WAVELENGTHS), name))
    cone_from, cone_to = BRADFORD * light_white, BRADFORD * _xyz(*WHITE)
    adapt = BRADFORD**-1 * mp.diag([cone_to[i] / cone_from[i] for i in range(3)]) * BRADFORD
    return list(rgb_to_xyz() ** -1 * adapt * mp.matrix(to_xyz(reflectance, name)))


@mp.workdps(DIGITS)
def lab(rgb: Sequence[Number]) -> Spectrum:
    """CIELAB of linear Rec.709 values, (1, 1, 1) the white."""
    xyz, white = rgb_to_xyz() * mp.matrix([mp.mpf(c) for c in rgb]), _xyz(*WHITE)
    edge = mp.mpf(6) / 29
    f = [mp.cbrt(t) if (t := xyz[i] / white[i]) > edge**3 else t / (3 * edge**2) + mp.mpf(4) / 29 for i in range(3)]
    return [116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])]


@mp.workdps(DIGITS)
def ciede2000(one: Sequence[float | Number], other: Sequence[float | Number]) -> Number:
    """The difference of two CIELAB colours (Sharma, Wu, Dalal 2005, Eq 2-22)."""
    L1, a1, b1, L2, a2, b2 = (mp.mpf(v) for v in (*one, *other))
    mean = (mp.hypot(a1, b1) + mp.hypot(a2, b2)) / 2
    G = (1 - mp.sqrt(mean**7 / (mean**7 + mp.mpf(25) ** 7))) / 2
    a1, a2 = (1 + G) * a1, (1 + G) * a2
    C1, C2 = mp.hypot(a1, b1), mp.hypot(a2, b2)
    h1, h2 = (mp.degrees(mp.atan2(b, a)) % 360 if a or b else mp.mpf(0) for a, b in ((a1, b1), (a2, b2)))
    dh = h2 - h1
    if C1 * C2 == 0:
        dh = mp.mpf(0)
    elif abs(dh) > 180:
        dh += 360 if dh < 0 else -360
    dL, dC, dH = L2 - L1, C2 - C1, 2 * mp.sqrt(C1 * C2) * mp.sin(mp.radians(dh / 2))
    L, C = (L1 + L2) / 2, (C1 + C2) / 2
    h = h1 + h2
    if C1 * C2 != 0:
        h = h / 2 if abs(h1 - h2) <= 180 else (h + 360) / 2 if h < 360 else (h - 360) / 2
    T = (
        1
        - mp.mpf("0.17") * mp.cos(mp.radians(h - 30))
        + mp.mpf("0.24") * mp.cos(mp.radians(2 * h))
        + mp.mpf("0.32") * mp.cos(mp.radians(3 * h + 6))
        - mp.mpf("0.20") * mp.cos(mp.radians(4 * h - 63))
    )
    S_L = 1 + mp.mpf("0.015") * (L - 50) ** 2 / mp.sqrt(20 + (L - 50) ** 2)
    S_C, S_H = 1 + mp.mpf("0.045") * C, 1 + mp.mpf("0.015") * C * T
    turn = 60 * mp.exp(-(((h - 275) / 25) ** 2))
    R = -mp.sin(mp.radians(turn)) * 2 * mp.sqrt(C**7 / (C**7 + mp.mpf(25) ** 7))
    return mp.sqrt((dL / S_L) ** 2 + (dC / S_C) ** 2 + (dH / S_H) ** 2 + R * (dC / S_C) * (dH / S_H))


def difference(one: Sequence[Number], other: Sequence[Number]) -> float:
    """CIEDE2000 of two linear Rec.709 colours."""
    return float(ciede2000(lab(one), lab(other)))
