"""The ladder of the colour of films: from alpha blending to every wavelength.

Cases (stacks of one to four shipped products on measured skins, with the colour that a 1 nm computation in 40 digits gives them)
come from `reference.json`, which tests/accuracy/make_reference.py writes with code that imports nothing from here.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..makeup import Coat, coat, fit_transfers, interface_of
from ..makeup.coat import on_skin
from ..optics import Interface, film
from ..products import Library, Product
from ..spectra import WAVELENGTHS, Bands, bands, delta_e, reference_skins, upsample_skin
from ..spectra.few_bands import nonnegative_least_squares, training_spectra
from ..spectra.spaces import rgb_to_xyz
from .ladder import Ladder, Rung
from .pictures import Spread

REFERENCE_FILE = Path(__file__).parent / "reference.json"
TEXELS = 1 << 13
"""Texels of a timed run."""

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Stack:
    """Texels of one stack: products bottom to top with full thicknesses in µm, painted values (texels, layers) 0..1, skins
    (texels, 81), the light, and, for cases, the right colours (texels, 3)."""

    products: Sequence[Product]
    thickness_um: Sequence[float]
    values: Array
    skins: Array
    light: str
    colours: Array | None = None

    @property
    def interface(self) -> Interface | None:
        """The air interface that these products need."""
        return interface_of(self.products)

    def coats(self, at: NDArray | None = None, dtype: type = np.float64) -> list[Coat]:
        """The coats, at some wavelengths in nm."""
        return [coat(p, t, at, dtype) for p, t in zip(self.products, self.thickness_um)]


Compute = Callable[[Array, Array], Array]
"""Colours (texels, 3) of painted values (texels, layers) over skins (texels, 81)."""

Method = Callable[[Stack], Compute]
"""Prepares the computation of a stack."""


@functools.cache
def reference_cases() -> tuple[Stack, ...]:
    """The shipped cases with their colours, grouped by stack."""
    content = json.loads(REFERENCE_FILE.read_text(encoding="utf-8"))
    library, skins = Library.shipped(), np.stack(list(reference_skins().values()))
    return tuple(
        Stack(
            [library.find(layer["product"]) for layer in one["layers"]],
            [layer["thickness_um"] for layer in one["layers"]],
            np.array(one["values"]),
            np.array(one["skins"]) @ skins,
            one["light"],
            np.array(one["rgb"]),
        )
        for one in content["stacks"]
    )


def timed_stack() -> Stack:
    """What is timed: three films of many thicknesses over many skins."""
    case = next(one for one in reference_cases() if len(one.products) == 3)
    random = np.random.default_rng(0)
    values = random.random((TEXELS, 3))
    skins = random.dirichlet(np.ones(3), TEXELS) @ np.stack(list(reference_skins().values()))
    return Stack(case.products, case.thickness_um, values, skins, case.light)


def colour_ladder(stacks: Sequence[Stack] | None = None, timed: Stack | None = None) -> Ladder:
    """The ladder; other cases and another timed stack may be given."""
    cases, work = tuple(stacks or reference_cases()), timed or timed_stack()
    delta_e(np.ones(3), np.ones(3))  # colour-science is imported before anything is timed
    return Ladder(
        "colour",
        "Colour of films over skin",
        "CIEDE2000",
        f"{len(work.values)} texels of {len(work.products)} films",
        "films computed at every nm in 40 digits (mpmath), K and S on straight lines between their 81 values",
        [
            Rung(name, about, _preparer(method, work), _judge(method, cases), setting)
            for name, about, method, setting in METHODS
        ],
        falling=FALLING,
        notes=NOTES,
    )


def _preparer(method: Method, work: Stack) -> Callable[[], Callable[[], Array]]:
    def prepare() -> Callable[[], Array]:
        compute = method(work)
        return lambda: compute(work.values, work.skins)

    return prepare


def _judge(method: Method, cases: Sequence[Stack]) -> Callable[[], Spread]:
    def error() -> Spread:
        found = [delta_e(method(one)(one.values, one.skins), one.colours) for one in cases if one.colours is not None]
        return spread(np.concatenate(found))

    return error


def spread(errors: Array) -> Spread:
    """Mean, 99th percentile and largest."""
    return Spread(float(errors.mean()), float(np.quantile(errors, 0.99)), float(errors.max()))


def _weights(stack: Stack) -> NDArray[np.float64]:
    return bands(stack.light).weights


def alpha_blend(stack: Stack) -> Compute:
    """Each layer is its opaque product's colour, mixed with what is below by value times opacity (one minus luminous T)."""
    W = _weights(stack)
    layers = []
    for one in stack.coats():
        opaque = Coat(one.K, one.S, 10.0)
        seen = on_skin([opaque.at(np.ones(1))], stack.interface).over(np.zeros(81))[0] @ W
        T = film(one.K, one.S, one.thickness_mm).T @ W
        layers.append((seen, 1 - float(T[1])))

    def compute(values: Array, skins: Array) -> Array:
        colour = skins @ W
        for (own, opacity), value in zip(layers, values.T):
            a = (opacity * value)[:, None]
            colour = colour + a * (own - colour)
        return colour

    return compute


def rgb_kubelka_munk(stack: Stack) -> Compute:
    """Kubelka-Munk with three numbers for K and three for S, their means under the weights of R, G and B."""
    W: Array = _weights(stack)
    mean = lambda spectrum: np.maximum(spectrum @ W, 0)  # noqa: E731
    coats = [Coat(mean(c.K), mean(c.S), c.thickness_mm, c.powder) for c in stack.coats()]

    def compute(values: Array, skins: Array) -> Array:
        optics = on_skin([one.at(v) for one, v in zip(coats, values.T)], stack.interface)
        return optics.over(np.clip(skins @ W, 0, 1))

    return compute


def single_pass(stack: Stack) -> Compute:
    """The paper read literally: every film once in RGB, light through it one time, nothing between films and skin."""
    return _layer_by_layer(stack, lambda film: film.T)


def round_trip(stack: Stack) -> Compute:
    """Every film in RGB, light through it twice (RGB of T^2), nothing between films and skin."""
    return _layer_by_layer(stack, lambda film: film.T * film.T)


def _layer_by_layer(stack: Stack, passed: Callable) -> Compute:
    W, coats = _weights(stack), stack.coats()

    def compute(values: Array, skins: Array) -> Array:
        colour = skins @ W
        for one, value in zip(coats, values.T):
            layer = one.at(value)
            colour = layer.R @ W + (passed(layer) @ W) * colour
        return colour

    return compute


def no_interface(stack: Stack) -> Compute:
    """Every wavelength, but internal K and S stacked on the skin as if there were no air above."""
    W, coats = _weights(stack), stack.coats()
    return lambda values, skins: on_skin([c.at(v) for c, v in zip(coats, values.T)], None).over(skins) @ W


def baked(stack: Stack) -> Compute:
    """The stack in every wavelength, then R, T2 and R_up in RGB, T2 exact for the mean skin: baked textures."""
    return lambda values, skins: shaded(*bake_colours(stack, values), skins @ _weights(stack))


def bake_colours(stack: Stack, values: Array) -> tuple[Array, Array, Array]:
    """R, T2 and R_up (texels, 3) of painted values, as a bake keeps them."""
    W, coats = _weights(stack), stack.coats()
    mean = stack.skins.mean(axis=0)
    c0 = mean @ W
    optics = on_skin([c.at(v) for c, v in zip(coats, values.T)], stack.interface)
    R, R_up = optics.R @ W, optics.R_up @ W
    return R, (optics.over(mean) @ W - R) * (1 - R_up * c0) / c0, R_up


def shaded(R: Array, T2: Array, R_up: Array, c: Array) -> Array:
    """What a shader makes of baked textures over the skin's colours (texels, 3)."""
    return R + T2 * c / (1 - R_up * c)


def live(stops: int) -> Method:
    """The live path: a transfer per film in so many steps of thickness, fitted to this stack and these skins."""

    def prepare(stack: Stack) -> Compute:
        light = bands(stack.light)
        some = stack.skins[:: max(1, len(stack.skins) // 64)]
        transfers = fit_transfers(stack.coats(), some, stack.interface, light, stops)

        def compute(values: Array, skins: Array) -> Array:
            colour = skins @ light.weights
            for transfer, value in zip(transfers, values.T):
                colour = transfer.apply(value, colour)
            return colour

        return compute

    return prepare


def some_bands(at: Callable[[str], Bands], dtype: type = np.float64, upsampled: bool = False) -> Method:
    """The stack at the wavelengths of a set of bands; with ``upsampled`` the skin is known by its RGB only."""

    def prepare(stack: Stack) -> Compute:
        chosen = at(stack.light)
        W: Array = chosen.weights.astype(dtype)
        coats = stack.coats(chosen.wavelengths, dtype)
        places = np.searchsorted(WAVELENGTHS, chosen.wavelengths)

        def compute(values: Array, skins: Array) -> Array:
            if upsampled:
                skins = upsample_skin(skins @ bands(stack.light).weights, light=stack.light)
            optics = on_skin([c.at(v.astype(dtype)) for c, v in zip(coats, values.T)], stack.interface)
            return optics.over(skins[:, places].astype(dtype)) @ W

        return compute

    return prepare


def even_steps(count: int) -> Callable[[str], Bands]:
    """Bands in even steps from 400 to 700 nm (41: 380 to 780) with the weights of spectra that are straight from band to band."""
    first, last = (400, 700) if count < 41 else (380, 780)
    index = np.searchsorted(WAVELENGTHS, np.rint(np.linspace(first, last, count) / 5) * 5)

    def at(light: str) -> Bands:
        whole = bands(light)
        shares = np.stack([np.interp(WAVELENGTHS, WAVELENGTHS[index], unit) for unit in np.eye(count)])
        return Bands(WAVELENGTHS[index], shares @ whole.weights, whole.light, whole.space)

    return at


def refitted(wavelengths: Sequence[float]) -> Callable[[str], Bands]:
    """Bands at wavelengths of one's own, with weights fitted as the product's own sets are, for numbers it does not ship."""

    def at(light: str) -> Bands:
        whole = bands(light)
        to_xyz = whole.weights @ rgb_to_xyz(whole.space).T
        index = np.searchsorted(WAVELENGTHS, wavelengths)
        spectra = training_spectra()
        weights = np.empty((len(index), 3))
        for column in range(3):
            wanted = spectra @ to_xyz[:, column]
            scale = 1 / np.maximum(wanted, 0.02)
            weights[:, column] = nonnegative_least_squares(spectra[:, index] * scale[:, None], wanted * scale)
        rgb = weights @ np.linalg.inv(rgb_to_xyz(whole.space)).T
        return Bands(WAVELENGTHS[index], rgb / rgb.sum(axis=0), whole.light, whole.space)

    return at


def fitted_bands(count: int) -> Callable[[str], Bands]:
    """The product's own sets of a few wavelengths with fitted weights, or all 81."""
    return lambda light: bands(light, count=count)


METHODS: Sequence[tuple[str, str, Method, str]] = (
    ("alpha blend", "what other tools do: colours mixed by opacity", alpha_blend, ""),
    ("RGB Kubelka-Munk", "three numbers for K and for S", rgb_kubelka_munk, ""),
    ("paper, single pass", "each film once in RGB, light through it one time", single_pass, ""),
    ("RGB(T²) per film", "each film in RGB, light through it twice", round_trip, ""),
    ("no air interface", "81 bands, internal K and S as if there were no air", no_interface, ""),
    ("3 even bands", "400, 550, 700 nm; spectra taken as straight in between", some_bands(even_steps(3)), ""),
    ("6 even bands", "every 60 nm", some_bands(even_steps(6)), ""),
    ("12 even bands", "every 27 nm", some_bands(even_steps(12)), ""),
    ("41 even bands", "every 10 nm", some_bands(even_steps(41)), ""),
    ("3 fitted bands", "450, 540, 610 nm; weights fitted to films over skins", some_bands(refitted((450, 540, 610))), ""),
    ("4 fitted bands", "440, 520, 570, 620 nm", some_bands(refitted((440, 520, 570, 620))), ""),
    ("6 fitted bands", "440, 490, 535, 575, 605, 645 nm", some_bands(refitted((440, 490, 535, 575, 605, 645))), ""),
    ("8 fitted bands", "weights fitted to films over skins", some_bands(fitted_bands(8)), "bands 8"),
    ("12 fitted bands", "weights fitted to films over skins", some_bands(fitted_bands(12)), "bands 12"),
    ("16 fitted bands", "weights fitted to films over skins", some_bands(fitted_bands(16)), "bands 16"),
    ("16 fitted bands, float32", "weights fitted to films over skins, single precision", some_bands(fitted_bands(16), np.float32), ""),
    ("live, 4 steps", "a table of 4 thicknesses per film", live(4), ""),
    ("live, 8 steps", "a table of 8 thicknesses per film", live(8), ""),
    ("live, 16 steps", "a table of 16 thicknesses per film", live(16), ""),
    ("live", "a table of 32 thicknesses per film, as the nodes have", live(32), "path LIVE"),
    ("live, 64 steps", "a table of 64 thicknesses per film", live(64), ""),
    ("baked", "81 bands once per texel when baking, then three RGB textures: not paid again for every frame", baked, "path BAKED"),
    ("81 bands, skin from RGB", "the finished albedo: skin upsampled from its colour", some_bands(fitted_bands(81), upsampled=True), "finished"),
    ("81 bands, float32", "every 5 nm in single precision", some_bands(fitted_bands(81), np.float32), ""),
    ("81 bands", "every 5 nm in double precision", some_bands(fitted_bands(81)), ""),
)  # fmt: skip
"""Name, what it is, how, and the setting that chooses it; from coarse to fine."""

FALLING = (
    ("alpha blend", "RGB Kubelka-Munk", "live", "81 bands"),
    ("3 even bands", "6 even bands", "12 even bands", "41 even bands"),
    (
        "3 fitted bands",
        "4 fitted bands",
        "6 fitted bands",
        "8 fitted bands",
        "12 fitted bands",
        "16 fitted bands",
        "81 bands",
    ),
    ("3 even bands", "3 fitted bands"),
    ("12 even bands", "12 fitted bands"),
    ("live, 4 steps", "live, 8 steps", "live, 16 steps", "live, 64 steps"),
    ("paper, single pass", "RGB(T²) per film", "baked", "81 bands"),
    ("no air interface", "81 bands"),
)
"""Rungs that theory says are each nearer than the one before."""

NOTES = (
    '"Paper, single pass" is Huang et al. 2013 as Eq 3 and 4 are printed, in RGB: light crosses a film once and leaves without meeting it '
    "again, and the air interface is left out, which makes skin far too bright. Their own renderer may have done otherwise.",
    "Cases: 360 colours of one to four shipped products on mixtures of three measured skins, under three lights. Baked: its time is the bake, "
    "paid once; the ladder of a frame has what a frame costs.",
    "Without the air interface the error is large: light that would be thrown back at the surface leaves, so everything is too bright; that "
    "has nothing to do with the number of bands.",
    "41 even bands can be further off than 16 fitted ones: fitted weights know what films over skin look like, even ones take the "
    "spectrum as straight from band to band.",
    "A table of 64 thicknesses is not much nearer than one of 32: what is left is the fit of three colours by nine numbers.",
)

__all__ = ["FALLING", "METHODS", "Stack", "colour_ladder", "reference_cases", "spread", "timed_stack"]
