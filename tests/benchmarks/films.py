"""Films beside the printed formulas, a million at a time.

    python tests/benchmarks/films.py      prints medians of alternating runs, writes tests/results/optics_speed.md

Printed: Eq 1, 2 (and 3 over a backing) of Huang et al. 2013 in their best straightforward vectorised form, on values for which
they do not fail. For a film over a backing the arc-hyperbolic form of Kubelka 1948, Eq 20, stands beside them: it is the
shortest of all and loses digits where the film is thin, black or nearly opaque.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from km_makeup.optics import film, film_over, lay
from tests.optics import printed
from tests.optics.report import write_result

COUNT, RUNS = 1_000_000, 15


def hyperbolic(K: np.ndarray, S: np.ndarray, X: np.ndarray, Rg: np.ndarray) -> np.ndarray:
    """Kubelka 1948, Eq 20: (1 - Rg (a - b coth bSX))/(a - Rg + b coth bSX)."""
    a = 1 + K / S
    b = np.sqrt(a * a - 1)
    b_coth = b / np.tanh(b * S * X)
    return (1 - Rg * (a - b_coth)) / (a - Rg + b_coth)


def printed_with_absorptance(K: np.ndarray, S: np.ndarray, X: np.ndarray) -> tuple[np.ndarray, ...]:
    """Eq 1, 2 and A = 1 - R - T."""
    R, T = printed.film(K, S, X)
    return R, T, 1 - R - T


def medians(calls: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Median time of each call in ms, the calls taking turns."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(RUNS):
        for name, call in calls.items():
            start = time.perf_counter()
            call()
            times[name].append(time.perf_counter() - start)
    return {name: 1e3 * float(np.median(t)) for name, t in times.items()}


def main() -> int:
    """Time, print and write."""
    lines = ["| what | dtype | printed, ms | ours, ms | ours over printed |", "|---|---|---:|---:|---:|"]
    rng = np.random.default_rng(0)
    worst = 0.0
    for dtype in (np.float64, np.float32):
        K, S = (10 ** rng.uniform(-1, 2, (2, COUNT))).astype(dtype)
        X, Rg = (10 ** rng.uniform(-3, -1, COUNT)).astype(dtype), rng.uniform(0, 1, COUNT).astype(dtype)
        upper, lower = film(K, S, X), film(S, K, X)
        pairs: dict[str, tuple[Callable[[], object], Callable[[], object]]] = {
            "R, T (Eq 1, 2); ours also A": (lambda: printed.film(K, S, X), lambda: film(K, S, X)),
            "R, T, A": (lambda: printed_with_absorptance(K, S, X), lambda: film(K, S, X)),
            "film over a backing (Eq 1-3)": (lambda: printed.film_over(K, S, X, Rg), lambda: film_over(K, S, X, Rg)),
            "film over a backing (Kubelka, Eq 20)": (lambda: hyperbolic(K, S, X, Rg), lambda: film_over(K, S, X, Rg)),
        }
        for name, (theirs, ours) in pairs.items():
            ms = medians({"printed": theirs, "ours": ours})
            ratio = ms["ours"] / ms["printed"]
            if "Eq 20" not in name:
                worst = max(worst, ratio)
            lines.append(f"| {name} | {np.dtype(dtype).name} | {ms['printed']:.1f} | {ms['ours']:.1f} | {ratio:.2f} |")
        ms = medians({"lay": lambda: lay(upper, lower)})
        lines.append(f"| one film laid on another, all six values | {np.dtype(dtype).name} | | {ms['lay']:.1f} | |")
    lines += [
        "",
        f"{COUNT} films, median of {RUNS} alternating runs, numpy {np.__version__}. Largest ratio to the paper's: {worst:.2f}.",
        "",
    ]
    text = "\n".join(lines)
    print(text)
    write_result(
        "optics_speed.md", "Speed of films", "tests/benchmarks/films.py".removesuffix(".py").replace("/", "."), text
    )
    return 0 if worst <= 1.3 else 1


if __name__ == "__main__":
    sys.exit(main())
