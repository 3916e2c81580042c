"""84 real oil paints over black and white: what two-backing inversion makes of them.

    python -m tests.optics.revigo      inverts them, predicts the mixtures from the pure paints, writes
                                       tests/results/optics_paints.md

Data: Geldof et al. 2018, Heritage Science 6:17 (CC0), in ../shared/spectra; specular included, 400-700 nm, 10 nm. The
films' thickness is not published, so K and S are per film (X = 1 of the drawdown), taken to be the same for all.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from km_makeup.optics import (
    Interface,
    Inversion,
    Status,
    air_interface,
    film_over,
    invert_backings,
    saunderson,
    unsaunderson,
)
from km_makeup.spectra import delta_e, to_rgb
from tests.optics.sweep import COVERS
from tests.stamps import ROOT, write_markdown

FOLDER = ROOT.parent / "shared" / "spectra" / "revigo_oilpaint_black_white"
NOISE = 0.0005  # repeatability of a good spectrophotometer; the paper gives none
LINSEED = 1.48
WAVELENGTHS = np.arange(400, 701, 10)


@dataclass(frozen=True)
class Paint:
    """One paint: mass fractions of its pigments, reflectances (31,) over black and white, bare and painted."""

    name: str
    fractions: dict[str, float]
    bare_black: np.ndarray
    bare_white: np.ndarray
    over_black: np.ndarray
    over_white: np.ndarray


def load(folder: Path = FOLDER) -> list[Paint]:
    """All paints of the data set."""
    rows = {}
    for line in (folder / "revigo-aggregated-palette-spectral-data.txt").read_text().splitlines()[1:]:
        name, *values = line.split()
        rows[name] = np.array([float(v) for v in values]) / 100
    paints = []
    for line in (folder / "revigo-mixture-specifications.txt").read_text().splitlines():
        if "|" not in line:
            continue
        name, recipe = line.split()
        if f"{name}_ow" not in rows:  # 12E is specified and not measured
            continue
        pigments, shares = (part.split("-") for part in recipe.split("|"))
        mass = dict(zip(pigments, (float(s) for s in shares), strict=True))
        total = sum(mass.values())
        fractions = {pigment: share / total for pigment, share in mass.items() if share > 0}
        paints.append(Paint(name, fractions, *(rows[f"{name}_{kind}"] for kind in ("b", "w", "ob", "ow"))))
    return paints


def inverted(paints: list[Paint], interface: Interface | None) -> Inversion:
    """K and S per film, shape (paints, wavelengths)."""
    columns = [[getattr(p, kind) for p in paints] for kind in ("over_black", "bare_black", "over_white", "bare_white")]
    return invert_backings(*(np.array(c) for c in columns), 1.0, noise=NOISE, interface=interface)


def colour_difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """CIEDE2000 under D65 of reflectances (..., 31), held constant outside 400-700 nm."""
    full = np.arange(380, 781, 5)

    def rgb(R: np.ndarray) -> np.ndarray:
        return to_rgb(np.apply_along_axis(lambda r: np.interp(full, WAVELENGTHS, r), -1, R))

    return delta_e(rgb(a), rgb(b))


def held_out(paints: list[Paint]) -> list[tuple[Paint, dict[int, float]]]:
    """Mixtures all of whose pigments are there as pure paints, with the index of each pure paint and its share."""
    pure: dict[str, int] = {}
    for index, paint in enumerate(paints):
        if len(paint.fractions) == 1:
            pure.setdefault(next(iter(paint.fractions)), index)
    return [
        (paint, {pure[pigment]: share for pigment, share in paint.fractions.items()})
        for paint in paints
        if len(paint.fractions) > 1 and all(pigment in pure for pigment in paint.fractions)
    ]


def predict(
    paint: Paint, recipe: dict[int, float], K: np.ndarray, S: np.ndarray, interface: Interface | None
) -> tuple[np.ndarray, np.ndarray]:
    """Reflectance of a mixture over its own black and white, K and S added by mass."""
    mixed_K, mixed_S = (sum(share * v[i] for i, share in recipe.items()) for v in (K, S))

    def seen(bare: np.ndarray) -> np.ndarray:
        if interface is None:
            return film_over(mixed_K, mixed_S, 1.0, bare)
        inner = np.clip(unsaunderson(bare, interface), 0, 1)
        return saunderson(film_over(mixed_K, mixed_S, 1.0, inner), interface)

    return seen(paint.bare_black), seen(paint.bare_white)


def with_borrowed_scale(ks: Inversion) -> tuple[np.ndarray, np.ndarray]:
    """K and S with those of opaque wavelengths, of which only K/S is known, scaled to ln S between determined ones."""
    K, S = ks.K.copy(), ks.S.copy()
    for k, s, status, error in zip(K, S, ks.status, ks.S_error, strict=True):
        sure = (status == Status.OK) & (error < 0.5 * s)
        opaque = status == Status.OPAQUE
        if sure.any():
            ratio = k[opaque] / s[opaque]
            s[opaque] = np.exp(np.interp(WAVELENGTHS[opaque], WAVELENGTHS[sure], np.log(s[sure])))
            k[opaque] = ratio * s[opaque]
    return K, S


def usable(paints: list[Paint]) -> list[tuple[Paint, dict[int, float]]]:
    """The held-out mixtures whose pure paints read as reflectances under a linseed surface at every wavelength."""
    dark = np.any(inverted(paints, air_interface(LINSEED)).status == Status.OUT_OF_RANGE, axis=1)
    return [(paint, recipe) for paint, recipe in held_out(paints) if not any(dark[i] for i in recipe)]


def mixing_errors(paints: list[Paint]) -> dict[str, np.ndarray]:
    """CIEDE2000 of predicted against measured mixtures, each (mixtures, black and white), by method."""
    mixtures = usable(paints)
    measured = np.array([[p.over_black, p.over_white] for p, _ in mixtures])
    errors = {}
    for name, interface in (("no interface", None), (f"Saunderson n = {LINSEED}", air_interface(LINSEED))):
        ks = inverted(paints, interface)
        for how, (K, S) in (
            ("", (ks.K, ks.S)),
            (", opaque ones at the scale of their neighbours", with_borrowed_scale(ks)),
        ):
            predicted = np.array([predict(p, recipe, K, S, interface) for p, recipe in mixtures])
            errors[f"K and S, {name}{how}"] = colour_difference(predicted, measured)
    linear = np.array(
        [
            [
                sum(share * getattr(paints[i], side) for i, share in recipe.items())
                for side in ("over_black", "over_white")
            ]
            for _, recipe in mixtures
        ]
    )
    errors["linear mixing of reflectances"] = colour_difference(linear, measured)
    return errors


def text(paints: list[Paint]) -> str:
    """Both tables."""
    lines = [f"{len(paints)} paints at {WAVELENGTHS.size} wavelengths, noise {NOISE} assumed.", ""]
    lines += [
        "| inversion | " + " | ".join(s.name for s in Status) + " | not finite | negative |",
        "|---|" + "---:|" * 7,
    ]
    for name, interface in (("no interface", None), (f"Saunderson n = {LINSEED}", air_interface(LINSEED))):
        ks = inverted(paints, interface)
        counts = np.bincount(ks.status.ravel(), minlength=5)
        wrong = sum(np.count_nonzero(~np.isfinite(v)) for v in (ks.K, ks.S, ks.K_error, ks.S_error))
        negative = np.count_nonzero(ks.K < 0) + np.count_nonzero(ks.S < 0)
        lines.append(f"| {name} | " + " | ".join(str(c) for c in counts) + f" | {wrong} | {negative} |")
    errors = mixing_errors(paints)
    mixtures = usable(paints)
    dropped = [p.name for p, _ in held_out(paints) if p.name not in {q.name for q, _ in mixtures}]
    lines += [
        "",
        f"{len(mixtures)} mixtures whose pigments are all there as pure paints, predicted from those (CIEDE2000, D65).",
    ]
    lines += [
        f"Left out of all rows, for a pure paint that reads darker than a linseed surface: {', '.join(dropped)}.",
        "",
    ]
    lines += [
        "| method | over black mean | over white mean | all mean | median | max |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for name, e in errors.items():
        lines.append(
            f"| {name} | {e[:, 0].mean():.2f} | {e[:, 1].mean():.2f} | {e.mean():.2f} | {np.median(e):.2f} | {e.max():.2f} |"
        )
    lines += ["", "Which: " + ", ".join(p.name for p, _ in mixtures) + ".", ""]
    return "\n".join(lines)


def main() -> int:
    """Print both tables and write them."""
    result = text(load())
    print(result)
    title = "Two-backing inversion of 84 oil paints"
    print(write_markdown("optics_paints.md", title, "python -m tests.optics.revigo", COVERS, result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
