"""The ladder of mixed light: what it costs to compute films for one spectrum where two lamps of different spectra shine.

A lamp in a scene has a colour, not a spectrum: the renderer multiplies the film's colour, computed for one light, by the lamps'.
Cases come from `reference_more.json` (1 nm, 40 digits): daylight (D65) and a light bulb (A), in three shares of their luminance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..makeup import coat, interface_of
from ..makeup.coat import on_skin
from ..products import Library
from ..spectra import bands, delta_e, reference_skins
from ..spectra.colorimetry import observer
from ..spectra.lights import light_spectrum
from ..spectra.spaces import adaptation, rgb_to_xyz, white
from .colour import Array, spread
from .highlights import more_reference
from .ladder import Ladder, Rung
from .pictures import Spread

SHARES = (0.8, 0.5, 0.2)
"""Shares of the key light's luminance."""

TEXELS = 1 << 13


@dataclass(frozen=True)
class Lit:
    """Reflectances (n, 81) under two lamps; colours of the lamps in the scene; what is seen by the reference."""

    reflectance: Array
    key: str
    fill: str
    white_key: Array
    white_fill: Array
    seen_key: Array
    seen_fill: Array


def cases() -> Lit:
    """The shipped stacks, computed at 81 bands, with the right colours under either lamp."""
    content = more_reference()["mixed_light"]
    library, skins = Library.shipped(), np.stack(list(reference_skins().values()))
    found = []
    for one in content["stacks"]:
        products = [library.find(layer["product"]) for layer in one["layers"]]
        coats = [coat(p, layer["thickness_um"]) for p, layer in zip(products, one["layers"])]
        optics = on_skin([c.at(np.array([v])) for c, v in zip(coats, one["values"])], interface_of(products))
        found.append(optics.over(np.array(one["skin"]) @ skins)[0])
    arrays = [np.array([one[name] for one in content["stacks"]]) for name in ("key", "fill")]
    return Lit(
        np.array(found), content["key"], content["fill"], np.array(content["white_key"]), np.array(content["white_fill"]), *arrays
    )  # fmt: skip


Shown = Callable[[Lit, float], Array]
"""What is seen (n, 3) of the cases with a share of the key's light."""


def mixed_light_ladder() -> Ladder:
    """The ladder."""
    lit = cases()
    times = -(-TEXELS // len(lit.reflectance))
    work = Lit(np.tile(lit.reflectance, (times, 1)), *(getattr(lit, n) for n in list(Lit.__dataclass_fields__)[1:]))
    delta_e(np.ones(3), np.ones(3))
    return Ladder(
        "light",
        "One light where two spectra mix",
        "CIEDE2000",
        f"{len(work.reflectance)} reflectances to colours",
        f"both lamps' spectra ({lit.key} and {lit.fill}), 1 nm, 40 digits (mpmath)",
        [Rung(name, about, _preparer(shown, work), _judge(shown, lit), setting) for name, about, shown, setting in WAYS],
        falling=(tuple(name for name, *_ in WAYS[1:]),),
        notes=(
            "Films computed for the bulb and then lit by a lamp of its tint are further off than films computed for daylight: a renderer "
            "multiplies three numbers by three numbers, while the films' colours are adapted to white in another way (Bradford). Leave the "
            "light on D65 where the lamps in the scene are tinted; choose A where they are white and the white balance is done.",
        ),
    )  # fmt: skip


def _preparer(shown: Shown, work: Lit) -> Callable[[], Callable[[], Array]]:
    return lambda: lambda: shown(work, 0.5)


def _judge(shown: Shown, lit: Lit) -> Callable[[], Spread]:
    def error() -> Spread:
        found = []
        for share in SHARES:
            balance = balanced(share * lit.white_key + (1 - share) * lit.white_fill)
            truth = share * lit.seen_key + (1 - share) * lit.seen_fill
            found.append(delta_e(shown(lit, share) @ balance, truth @ balance))
        return spread(np.concatenate(found))

    return error


def balanced(rgb: Array) -> Array:
    """Linear Rec.709 to linear Rec.709 as a camera's white balance on a white of this colour does (Bradford)."""
    to_xyz = rgb_to_xyz("Linear Rec.709").T
    return to_xyz @ adaptation(rgb @ to_xyz, white("Linear Rec.709")).T @ np.linalg.inv(to_xyz)


def one_light(choose: Callable[[Lit, float], Array | str]) -> Shown:
    """Films for one light; the lamps' colours are added up and multiplied."""

    def shown(lit: Lit, share: float) -> Array:
        lamps = share * lit.white_key + (1 - share) * lit.white_fill
        return lit.reflectance @ bands(choose(lit, share)).weights * lamps

    return shown


def scaled(lit: Lit, powers: Array, lamp: Array) -> Array:
    """Colours (n, 3) that, multiplied by the lamp's colour, are what the light's spectrum gives: von Kries in RGB, not Bradford."""
    to_xyz = powers[:, None] * observer()
    raw: Array = lit.reflectance @ (to_xyz / to_xyz[:, 1].sum()) @ np.linalg.inv(rgb_to_xyz("Linear Rec.709")).T
    return np.divide(raw, lamp)


def _powers(lit: Lit) -> tuple[Array, Array]:
    """Spectra of key and fill, of equal luminance."""
    return tuple(one / (one @ observer()[:, 1]) for one in map(light_spectrum, (lit.key, lit.fill)))  # type: ignore[return-value]


def half_and_half(lit: Lit, share: float) -> Array:
    """Films once, for both lamps together at equal luminance, wherever the shares are others."""
    key, fill = _powers(lit)
    lamps = share * lit.white_key + (1 - share) * lit.white_fill
    return scaled(lit, (key + fill) / 2, (lit.white_key + lit.white_fill) / 2) * lamps


def own_lights(lit: Lit, share: float) -> Array:
    """Films twice, for either lamp."""
    key, fill = _powers(lit)
    first: Array = scaled(lit, key, lit.white_key) * lit.white_key
    second: Array = scaled(lit, fill, lit.white_fill) * lit.white_fill
    return share * first + (1 - share) * second


WAYS: Sequence[tuple[str, str, Shown, str]] = (
    ("the fill light's spectrum for both", "films computed for the bulb, the lamps' colours multiplied", one_light(lambda lit, _: lit.fill), ""),
    ("the key light's spectrum for both", "films computed for daylight, the lamps' colours multiplied", one_light(lambda lit, _: lit.key), "light"),
    ("both lamps' mean spectrum", "films computed once for equal shares, so that the lamps' colours multiply rightly", half_and_half, ""),
    ("each lamp its own spectrum", "films computed twice: two renders, or a light group each", own_lights, ""),
)  # fmt: skip

__all__ = ["WAYS", "cases", "mixed_light_ladder"]
