"""The hard cases, for the printed formulas and for ours, in float64 and float32.

python -m tests.optics.hard_cases      prints them and writes tests/hard_cases.md
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mpmath as mp
import numpy as np

from km_makeup.optics import Status, film, film_over, invert, invert_films, kelemen, opaque_reflectance, stack
from tests import stamps
from tests.optics import oracle, printed
from tests.optics.sweep import COVERS, optical_depth

COUNT = 120
WHOLE = [*COVERS, "km_makeup/optics/fitting.py", "km_makeup/optics/microfacets.py"]
DTYPES = (np.float64, np.float32)


@dataclass
class Worst:
    """The worst error of one formula in one case."""

    error: float = 0.0
    where: str = ""
    not_finite: int = 0
    finite: int = 0

    def see(self, value: float, exact: mp.mpf, scale: float, smallest: float, where: str) -> None:
        """Count a value; exact values below the smallest normal number have no relative error."""
        if not np.isfinite(value):
            self.not_finite += 1
            return
        self.finite += 1
        if abs(exact) >= smallest:
            error = float(abs(mp.mpf(float(value)) - exact) / abs(exact) / scale)
            if error > self.error:
                self.error, self.where = error, where

    def cells(self) -> str:
        """Three table cells."""
        error = f"{self.error:.1e}" if self.finite else "none finite"
        return f"{error} | {self.not_finite} | {self.where}"


def spread(rng: np.random.Generator, *ranges: tuple[float, float]) -> list[np.ndarray]:
    """Log-uniform values of each range; a range (v, v) is v everywhere."""
    return [np.full(COUNT, a) if a == b else 10 ** rng.uniform(np.log10(a), np.log10(b), COUNT) for a, b in ranges]


def film_cases() -> Iterator[tuple[str, list[np.ndarray]]]:
    """Name and K, S, X, Rg of each case of films."""
    rng = np.random.default_rng(12)
    skin = rng.uniform(0.1, 0.7, COUNT)
    nearly_white = 1 - 10 ** rng.uniform(-12, -3, COUNT)
    yield "K to 0", [*spread(rng, (1e-12, 1e-3), (1, 1e3), (1e-3, 1)), skin]
    yield "K = 0", [*spread(rng, (0, 0), (1, 1e3), (1e-3, 1)), skin]
    yield "S to 0", [*spread(rng, (1, 1e3), (1e-12, 1e-3), (1e-3, 1)), skin]
    yield "S = 0", [*spread(rng, (1, 1e3), (0, 0), (1e-3, 1)), skin]
    yield "both to 0", [*spread(rng, (1e-12, 1e-6), (1e-12, 1e-6), (1e-3, 1)), skin]
    yield "both 0", [*spread(rng, (0, 0), (0, 0), (1e-3, 1)), skin]
    yield "X to 0", [*spread(rng, (0.1, 1e3), (0.1, 1e3), (1e-9, 1e-6)), skin]
    yield "X to infinity", [*spread(rng, (0.1, 1e3), (0.1, 1e3), (1, 1e3)), skin]
    yield "X infinite", [*spread(rng, (0.1, 1e3), (0.1, 1e3)), np.full(COUNT, np.inf), skin]
    K, S, X = spread(rng, (1e3, 1e6), (1e-12, 1e-3), (1e-6, 1e-3))
    yield "R_inf to 0 (K >> S)", [K, S, X, skin]
    K, S, X = spread(rng, (1e-12, 1e-3), (1e3, 1e6), (1e-6, 1e-1))
    yield "R_inf to 1 (K << S)", [K, S, X, skin]
    yield "white on white skin", [*spread(rng, (1e-12, 1e-6), (10, 1e6), (1e-2, 1e3)), nearly_white]
    yield "white on perfect white", [*spread(rng, (1e-12, 1e-6), (10, 1e6), (1e-2, 1e3)), np.ones(COUNT)]
    yield "black on black", [*spread(rng, (10, 1e4), (1e-9, 1e-3), (1e-3, 1e-1)), 10 ** rng.uniform(-9, -3, COUNT)]
    yield "denormal in float32", [*spread(rng, (1e-44, 1e-38), (1e-44, 1e-38), (1e-3, 1e3)), skin]
    yield "denormal in float64", [*spread(rng, (1e-320, 1e-308), (1e-320, 1e-308), (1e-3, 1e3)), skin]


def rows_of_films() -> list[str]:
    """One row per case, quantity and dtype."""
    lines = []
    for name, values in film_cases():
        for dtype in DTYPES:
            K, S, X, Rg = (v.astype(dtype) for v in values)
            tiny = float(np.finfo(dtype).tiny)
            with np.errstate(all="ignore"):
                plain_R, plain_T = printed.film(K, S, X)
                plain_over = printed.film_over(K, S, X, Rg)
                a = 1 + K / S
                plain_inf = a - np.sqrt(a * a - 1)
            R, T, A = film(K, S, X)
            ours_over, ours_inf = film_over(K, S, X, Rg), opaque_reflectance(K, S)
            seen = {
                q: (Worst(), Worst())
                for q in ("R", "T over (1 + z)", "1 - R", "R_inf", "R over the backing, over (1 + z)")
            }
            for i in range(COUNT):
                where = f"K={K[i]:.3g} S={S[i]:.3g} X={X[i]:.3g} Rg={Rg[i]:.12g}"
                exact_R, exact_T = oracle.film(K[i], S[i], X[i])
                z = 1 + optical_depth(K[i], S[i], X[i])
                over = oracle.over(exact_R, exact_T**2, exact_R, Rg[i])
                ours_rest = float(A[i]) + float(T[i])
                for quantity, plain, ours, exact, scale in (
                    ("R", plain_R[i], R[i], exact_R, 1),
                    ("T over (1 + z)", plain_T[i], T[i], exact_T, z),
                    ("1 - R", 1 - plain_R[i], ours_rest, 1 - exact_R, 1),
                    ("R_inf", plain_inf[i], ours_inf[i], oracle.opaque(K[i], S[i]), 1),
                    ("R over the backing, over (1 + z)", plain_over[i], ours_over[i], over, z),
                ):
                    for which, value in zip(seen[quantity], (plain, ours), strict=True):
                        which.see(value, exact, scale, tiny, where)
            for quantity, (plain, ours) in seen.items():
                lines.append(f"| {name} | {quantity} | {np.dtype(dtype).name} | {plain.cells()} | {ours.cells()} |")
    return lines


def rows_of_stacks() -> list[str]:
    """Stacks of eight films, thin to thick and white to black."""
    lines = []
    cases = (
        ("8 films of makeup", (1e-1, 1e2), (1, 1e2), (5e-3, 5e-2)),
        ("8 thick films", (1e-1, 1e2), (1, 1e2), (1, 1e3)),
        ("8 white films", (1e-12, 1e-6), (1e2, 1e5), (1e-2, 1e2)),
        ("8 clear films", (1e-9, 1e-3), (1e-9, 1e-3), (1e-3, 1)),
    )
    for name, *ranges in cases:
        rng = np.random.default_rng(13)
        films = [spread(rng, *ranges) for _ in range(8)]
        for dtype in DTYPES:
            layers = [tuple(v.astype(dtype) for v in one) for one in films]
            with np.errstate(all="ignore"):
                plain = printed.stack(layers)
            ours = stack([film(*one) for one in layers]).R_top
            seen = Worst(), Worst()
            for i in range(COUNT):
                numbers = [tuple(v[i] for v in one) for one in layers]
                exact = oracle.stack(numbers)[0]
                where = f"K={numbers[-1][0]:.3g} S={numbers[-1][1]:.3g} X={numbers[-1][2]:.3g} on top"
                for which, value in zip(seen, (plain[i], ours[i]), strict=True):
                    which.see(value, exact, 1, float(np.finfo(dtype).tiny), where)
            lines.append(f"| {name} | R from above | {np.dtype(dtype).name} | {seen[0].cells()} | {seen[1].cells()} |")
    return lines


def inversion_cases() -> Iterator[tuple[str, list[np.ndarray]]]:
    """Name and K, S, X, Rg of films to be found again."""
    rng = np.random.default_rng(14)
    K, S = spread(rng, (1, 30), (1, 30))
    z = 10 ** rng.uniform(np.log10(4), np.log10(14), COUNT)
    yield "R near R_inf", [K, S, z / np.sqrt(K * (K + 2 * S)), rng.uniform(0.02, 0.9, COUNT)]
    yield "R near Rg", [*spread(rng, (1, 30), (1, 30), (1e-9, 1e-5)), rng.uniform(0.02, 0.9, COUNT)]
    yield "both above R_inf", [*spread(rng, (10, 100), (1, 10), (1e-3, 3e-2)), rng.uniform(0.7, 0.95, COUNT)]
    yield "white on white", [*spread(rng, (1e-9, 1e-4), (10, 100), (1e-2, 1)), 1 - 10 ** rng.uniform(-9, -2, COUNT)]
    yield "makeup", [*spread(rng, (0.1, 100), (1, 100), (5e-3, 5e-2)), rng.uniform(0.02, 0.9, COUNT)]


def rows_of_inversions() -> list[str]:
    """Errors over the condition number of the case; cases that a rounding decides (condition x eps > 1e-3) left out."""
    lines = []
    for name, values in inversion_cases():
        for dtype in DTYPES:
            K, S, X, Rg = (v.astype(dtype) for v in values)
            conditions, readings = [], []
            for i in range(COUNT):

                def read(k: mp.mpf, s: mp.mpf, i: int = i, X: np.ndarray = X, Rg: np.ndarray = Rg) -> tuple:
                    return oracle.opaque(k, s), oracle.film_over(k, s, X[i], Rg[i])

                R, T = oracle.film(K[i], S[i], X[i])
                slope = oracle.exact(Rg[i]) * T * T / (1 - R * oracle.exact(Rg[i])) ** 2
                conditions.append(oracle.conditions(read, K[i], S[i], [(mp.mpf(0), slope)]))
                readings.append([float(v) for v in read(oracle.exact(K[i]), oracle.exact(S[i]))])
            m = np.array(readings).astype(dtype).T
            with np.errstate(all="ignore"):
                plain = printed.invert(*m, Rg, X)
            ours = invert(*m, Rg, X)
            seen, determined, ok = (Worst(), Worst()), 0, 0
            for i, pair in enumerate(conditions):
                if max(pair) * np.finfo(dtype).eps > 1e-3:
                    continue
                determined += 1
                ok += ours.status[i] == Status.OK
                for truth, condition, p, o, letter in (
                    (K[i], pair[0], plain[0][i], ours.K[i], "K"),
                    (S[i], pair[1], plain[1][i], ours.S[i], "S"),
                ):
                    where = f"{letter} of K={K[i]:.3g} S={S[i]:.3g} X={X[i]:.3g} Rg={Rg[i]:.10g}, condition {float(condition):.2g}"
                    for which, value in zip(seen, (p, o), strict=True):
                        which.see(value, oracle.exact(truth), float(condition), 0.0, where)
            lines.append(
                f"| {name} ({ok} of {determined} ok) | K and S, over condition | {np.dtype(dtype).name} | "
                f"{seen[0].cells()} | {seen[1].cells()} |"
            )
    return lines


def rows_of_fits() -> list[str]:
    """Exact readings of sets of films, from hardly there to opaque: least squares has no closed form to lean on."""
    lines = []
    rng = np.random.default_rng(17)
    sets = {
        "one thickness, black and white": ((1.0, 1.0), (0.0, 0.9)),
        "two thicknesses, black": ((0.5, 1.0), (0.05, 0.05)),
        "one and an opaque one, black": ((1.0, np.inf), (0.05, 0.05)),
        "three, black and white": ((0.5, 1.0, 1.0), (0.05, 0.05, 0.9)),
    }
    for name, (X, Rg) in sets.items():
        for low, high in ((1e-3, 0.1), (0.1, 4), (4, 12), (12, 25), (25, 500)):
            ratio = 10 ** rng.uniform(-2, 2, COUNT)
            S = 10 ** rng.uniform(np.log10(low), np.log10(high), COUNT) / np.sqrt(ratio * (ratio + 2))
            K = ratio * S
            R, inf = (
                np.array([[float(oracle.film_over(k, s, x, g)) for k, s in zip(K, S, strict=True)] for x, g in films])
                for films in (list(zip(X, Rg, strict=True)), [(np.inf, g) for g in Rg])
            )
            fit = invert_films(R, np.array(Rg)[:, None], X)
            told, ok = np.max(np.abs(R - inf), axis=0) > 1e-14, fit.status == Status.OK
            hidden = np.max(np.abs(R - inf), axis=0) < 1e-15
            worst = [
                np.max((np.abs(found / truth - 1) / condition)[ok], initial=0)
                for found, truth, condition in ((fit.K, K, fit.K_condition), (fit.S, S, fit.S_condition))
            ]
            conditions = np.maximum(fit.K_condition, fit.S_condition)[ok]
            lines.append(
                f"| {name} | {low:g}-{high:g} | {np.count_nonzero(ok & told)} of {np.count_nonzero(told)} | "
                f"{np.count_nonzero((fit.status == Status.OPAQUE) & hidden)} of {np.count_nonzero(hidden)} | "
                f"{'none' if not ok.any() else f'{max(worst):.1e}'} | "
                f"{'none' if not ok.any() else f'{np.median(conditions):.0e}'} | "
                f"{np.count_nonzero(~np.isfinite([fit.K, fit.S]))} |"
            )
    return lines


def rows_of_noise() -> list[str]:
    """Share of wavelengths that are unusable under noise: no number, negative, or K or S off by more than half."""
    rng = np.random.default_rng(15)
    n = 4000
    products = {
        "pale (foundation)": (0.3, 30.0),
        "middle (blush)": (8.0, 20.0),
        "dark (lipstick, red band)": (60.0, 8.0),
    }
    X = np.array([0.015, 0.05, 0.15, 0.015, 0.05, 0.15, np.inf])
    Rg = np.array([0.05, 0.05, 0.05, 0.85, 0.85, 0.85, 0.5])[:, None]
    lines = []
    for name, (K, S) in products.items():
        for sigma in (0.001, 0.003, 0.01):
            exact = film_over(np.full(n, K), np.full(n, S), X[:, None], Rg)
            R = exact + rng.normal(0, sigma, (7, n))

            def off(k: np.ndarray, s: np.ndarray, K: float = K, S: float = S) -> np.ndarray:
                with np.errstate(invalid="ignore"):
                    return ~(np.abs(k / K - 1) < 0.5) | ~(np.abs(s / S - 1) < 0.5)

            with np.errstate(all="ignore"):
                plain = printed.invert(R[6], R[2], Rg[2], X[2])
            ours = invert(R[6], R[2], Rg[2], X[2], noise=sigma)
            fit = invert_films(R, Rg, X, noise=sigma)
            not_ok = ours.status != Status.OK
            lines.append(
                f"| {name} | {sigma} | {100 * np.mean(off(*plain)):.1f} % | {np.count_nonzero(~np.isfinite(plain[1]))} | "
                f"{100 * np.mean(not_ok):.1f} % | {100 * np.mean(off(ours.K, ours.S) & ~not_ok):.1f} % | "
                f"{100 * np.mean(off(fit.K, fit.S)):.1f} % | {100 * np.median(np.abs(fit.K / K - 1)):.1f} % | "
                f"{100 * np.median(np.abs(fit.S / S - 1)):.1f} % |"
            )
    return lines


def rows_of_highlights() -> list[str]:
    """Highlights around the mirror direction, and against the light."""
    lines = []
    rng = np.random.default_rng(16)
    normal = np.array([0.0, 0.0, 1.0])

    def unit(v: np.ndarray) -> np.ndarray:
        return v / np.linalg.norm(v, axis=-1, keepdims=True)

    def at(theta: float) -> np.ndarray:
        phi = rng.uniform(0, 2 * np.pi, COUNT)
        t = np.radians(theta)
        return np.stack([np.sin(t) * np.cos(phi), np.sin(t) * np.sin(phi), np.full(COUNT, np.cos(t))], -1)

    for name, theta in (("0 degrees", 0.0), ("45 degrees", 45.0), ("89.9 degrees", 89.9), ("opposed, grazing", None)):
        m = 10 ** rng.uniform(-3, 0, COUNT)
        view = at(89.9 if theta is None else theta)
        mirror = view * [-1, -1, 1]
        light = unit(mirror + rng.normal(0, 1, (COUNT, 3)) * (m * np.maximum(view[:, 2], 0.001))[:, None])
        if theta is None:
            light = unit(mirror + 1e-4 * rng.normal(0, 1, (COUNT, 3)))
        light[:, 2] = np.abs(light[:, 2])
        light = unit(light)
        for dtype in DTYPES:
            n, li, vi, mi = (v.astype(dtype) for v in (normal, light, view, m))
            with np.errstate(all="ignore"):
                plain = printed.kelemen(n, li, vi, mi, dtype(0.04))
            ours = kelemen(n, li, vi, mi, 0.04)
            seen = Worst(), Worst()
            for i in range(COUNT):
                exact = oracle.kelemen(n, li[i], vi[i], mi[i], 0.04)
                where = f"m={mi[i]:.3g} light {np.degrees(np.arccos(min(li[i][2], 1))):.2f} degrees"
                for which, value in zip(seen, (plain[i], ours[i]), strict=True):
                    which.see(value, exact, 1, 1e-30 if dtype is np.float32 else 1e-250, where)
            lines.append(f"| {name} | BRDF | {np.dtype(dtype).name} | {seen[0].cells()} | {seen[1].cells()} |")
    return lines


def page() -> str:
    """The whole page."""
    mp.mp.dps = oracle.DIGITS
    head = "| case | quantity | dtype | printed: worst relative error | not finite | where | ours: worst relative error | not finite | where |"
    rule = "|---|---|---|---:|---:|---|---:|---:|---|"
    noise = (
        "| product | sigma | printed, one film on black: unusable | not finite | ours, same readings: status other than ok | "
        "unusable though ok | 7 films: unusable | K off, median | S off, median |\n" + "|---|---:|" + "---:|" * 7
    )

    def section(title: str, text: str, top: str, rows: Callable[[], list[str]]) -> str:
        return "\n".join([f"## {title}", "", text, "", top, *rows(), ""])

    return "\n".join(
        [
            stamps.head("Hard cases", "python -m tests.optics.hard_cases", WHOLE).rstrip(),
            "",
            f"Exact values: mpmath, 80 digits, {COUNT} points a case. *Printed*: the formulas of Huang et al. 2013 as they stand (tests/optics/printed.py),",
            "Eq 3 with its misprint mended. T and what comes back from a backing are divided by 1 + z, the conditioning",
            "of exp(-z): the number shown is what the formula itself loses. Exact values below the smallest normal number",
            "count only as finite or not.",
            "",
            section("One film", "K and S in 1/mm, X in mm.", f"{head}\n{rule}", rows_of_films),
            section("Stacks", "Bottom to top, reflectance from above.", f"{head}\n{rule}", rows_of_stacks),
            section(
                "Inversion (opaque film and one backing)",
                "Errors of K and S divided by the condition number of each; points where condition x eps > 1e-3 are left out.",
                f"{head}\n{rule}",
                rows_of_inversions,
            ),
            section(
                "Inversion by least squares",
                "Exact readings of several films (float64), K/S from 0.01 to 100, by the optical thickness of the thickest. Told: an "
                "opaque film would read otherwise by more than 1e-14; hidden: by less than 1e-15.",
                "| films | optical thickness | told and ok | hidden and opaque | worst error over condition | condition, median | "
                "not finite |\n|---|---|---:|---:|---:|---:|---:|",
                rows_of_fits,
            ),
            section(
                "Noise",
                "0.15 mm on black and an opaque film, 4000 trials; beside it least squares over films of 15, 50 and 150 um on "
                "black and white and one opaque. Unusable: no number, or K or S off by more than half.",
                noise,
                rows_of_noise,
            ),
            section(
                "Highlights",
                "F0 = 0.04, roughness 1e-3 to 1, light around the mirror direction. Inputs are taken as the numbers they are.",
                f"{head}\n{rule}",
                rows_of_highlights,
            ),
        ]
    )


def main() -> int:
    """Print and write."""
    text = page()
    print(text)
    (stamps.ROOT / "tests" / "hard_cases.md").write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
