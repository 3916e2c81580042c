"""The live fits of an object's films, each made once: what did not change is not fitted again.

A film's transfer depends on the skin, on the films below it and on itself, on the light, the working space and the air
interface; so a change refits the film it concerns and those above.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..makeup import Coat, Transfer, fit_transfer
from ..makeup.transfer import Below, bare, under_next
from ..optics import Interface
from ..spectra import bands, upsample_skin
from .skin import Skin

KEPT = 512


@dataclass(frozen=True)
class SkinColours:
    """The skin's colours (count, 3) as something that can be a key."""

    data: bytes

    @classmethod
    def of(cls, skin: Skin) -> SkinColours:
        return cls(np.ascontiguousarray(skin.colours, np.float64).tobytes())

    @property
    def colours(self) -> NDArray:
        """Colours (count, 3), linear RGB of the working space."""
        return np.frombuffer(self.data, np.float64).reshape(-1, 3)


_fitted: dict[tuple, Transfer] = {}
_grounds: dict[tuple, Below] = {}
_skins: dict[tuple, Below] = {}


def transfers(
    coats: Sequence[Coat],
    skin: SkinColours,
    interface: Interface | None,
    light: str,
    space: str,
    below: Sequence[Sequence[int]] | None = None,
) -> list[Transfer]:
    """The transfers of a stack's films, bottom to top, as `makeup.fit_transfers` gives them.

    ``below`` lists for each film those (by index, rising) that it lies on anywhere; all lower ones where it is None.
    """
    base: tuple = (skin, interface, _light_mark(light), space)
    found = []
    for number, one in enumerate(coats):
        under = [coats[i] for i in (range(number) if below is None else below[number])]
        key = (*base, *map(_mark, under), _mark(one))
        if key not in _fitted:
            met = _met(base, under, skin, light, space)
            _keep(_fitted, key, fit_transfer(one, met, interface, bands(light, space)))
        found.append(_fitted[key])
    return found


def _met(base: tuple, under: Sequence[Coat], skin: SkinColours, light: str, space: str) -> Below:
    """What a film meets over some others."""
    if not under:
        return _skin(skin, light, space)
    key = (*base, *map(_mark, under))
    if key not in _grounds:
        _keep(_grounds, key, under_next(under[-1], _met(base, under[:-1], skin, light, space), base[1]))
    return _grounds[key]


def _skin(skin: SkinColours, light: str, space: str) -> Below:
    key = (skin, _light_mark(light), space)
    if key not in _skins:
        _keep(_skins, key, bare(upsample_skin(skin.colours, light=light, space=space)))
    return _skins[key]


def _light_mark(light: str) -> tuple[str, int]:
    """A light by its name; a file of a spectrum by its time of change as well."""
    path = Path(light)
    return light, path.stat().st_mtime_ns if path.suffix and path.is_file() else 0


def _mark(one: Coat) -> tuple:
    return (one.K.tobytes(), one.S.tobytes(), one.thickness_mm, one.powder)


def _keep(store: dict, key: tuple, value: object) -> None:
    """Keep a result; the oldest goes where there are too many."""
    store[key] = value
    if len(store) > KEPT:
        del store[next(iter(store))]
