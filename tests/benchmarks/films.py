"""Films beside the printed formulas, a million at a time.

    python tests/benchmarks/films.py      prints medians of alternating runs, writes tests/results/optics_speed.md

Printed: Eq 1, 2 (and 3 over a backing) of Huang et al. 2013 in their best straightforward vectorised form, on values for which
they do not fail. For a film over a backing the hyperbolic form of Kubelka 1948, Eq 20, stands beside them: it is the
shortest of all and loses digits where the film is thin, black or nearly opaque. Every dtype runs in a process of its own:
once as Python starts it, once with a C library told to keep all memory it ever had, in which case the printed formulas'
large intermediate arrays cost nothing to allocate.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from km_makeup.optics import film, film_over, lay
from tests.optics import printed
from tests.optics.report import write_result

COUNT, RUNS, ALLOWED = 1_000_000, 21, 1.3
KEPT = {"MALLOC_MMAP_THRESHOLD_": "1000000000", "MALLOC_TRIM_THRESHOLD_": "4000000000", "MALLOC_TOP_PAD_": "400000000"}
PAPER = ("R, T, A (Eq 1, 2 and 1 - R - T)", "film over a backing (Eq 1-3)")
BESIDE = ("R, T alone (Eq 1, 2); ours also A", "film over a backing (Kubelka, Eq 20)")
LAY = "one film laid on another, all six values"


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


def measure(dtype: type) -> dict[str, dict[str, float]]:
    """Times of the printed formulas and of ours, ms, in this process."""
    rng = np.random.default_rng(0)
    K, S = (10 ** rng.uniform(-1, 2, (2, COUNT))).astype(dtype)
    X, Rg = (10 ** rng.uniform(-3, -1, COUNT)).astype(dtype), rng.uniform(0, 1, COUNT).astype(dtype)
    pairs: tuple[tuple[Callable[[], object], Callable[[], object]], ...] = (
        (lambda: printed_with_absorptance(K, S, X), lambda: film(K, S, X)),
        (lambda: printed.film_over(K, S, X, Rg), lambda: film_over(K, S, X, Rg)),
        (lambda: printed.film(K, S, X), lambda: film(K, S, X)),
        (lambda: hyperbolic(K, S, X, Rg), lambda: film_over(K, S, X, Rg)),
    )
    result = {
        name: medians({"printed": theirs, "ours": ours})
        for name, (theirs, ours) in zip((*PAPER, *BESIDE), pairs, strict=True)
    }
    upper, lower = film(K, S, X), film(S, K, X)
    return result | {LAY: medians({"ours": lambda: lay(upper, lower)})}


def main() -> int:
    """Time, print and write."""
    parser = argparse.ArgumentParser(description="A million films beside the printed formulas.")
    parser.add_argument("--dtype", choices=("float64", "float32"), help="measure in this process and print JSON")
    dtype = parser.parse_args().dtype
    if dtype:
        print(json.dumps(measure(getattr(np, dtype))))
        return 0
    lines = ["| what | dtype | memory | printed, ms | ours, ms | ours over printed |", "|---|---|---|---:|---:|---:|"]
    worst = 0.0
    for memory, extra in (("as Python starts", {}), ("all kept", KEPT)):
        for name in ("float64", "float32"):
            command = [sys.executable, __file__, "--dtype", name]
            out = subprocess.run(command, env=os.environ | extra, capture_output=True, text=True, check=True).stdout
            for what, ms in json.loads(out).items():
                ratio = ms["ours"] / ms["printed"] if "printed" in ms else None
                if what in PAPER and not extra:
                    worst = max(worst, ratio)
                cells = (
                    (f"{ms['printed']:.1f}", f"{ms['ours']:.1f}", f"{ratio:.2f}")
                    if ratio
                    else ("", f"{ms['ours']:.1f}", "")
                )
                lines.append(f"| {what} | {name} | {memory} | " + " | ".join(cells) + " |")
    lines += [
        "",
        f"{COUNT} films, median of {RUNS} alternating runs, numpy {np.__version__}.",
        f"Largest ratio to the paper's formulas for the same results, as Python starts: {worst:.2f} (allowed {ALLOWED}).",
        "",
    ]
    text = "\n".join(lines)
    print(text)
    print(write_result("optics_speed.md", "Speed of films", "tests.benchmarks.films", text))
    return 0 if worst <= ALLOWED else 1


if __name__ == "__main__":
    sys.exit(main())
