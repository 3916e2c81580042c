"""Films beside the printed formulas, a million at a time.

    python tests/benchmarks/films.py      prints medians of alternating runs, writes tests/results/optics_speed.md

Printed: Eq 1, 2 (and 3 over a backing) of Huang et al. 2013 in their best straightforward vectorised form, on values for which
they do not fail; the same results are compared. Beside them, for what it is worth: R and T without A, where ours works
out A all the same; and the hyperbolic form of Kubelka 1948, Eq 20, which the paper does not print: the shortest of all,
without the exponential that keeps the digits of what comes back from a backing through a dark film. Every dtype runs in a
process of its own: once as Python starts it, once with a C library told to keep all memory it ever had, in which case the
printed formulas' large intermediate arrays cost nothing to allocate. Times are processor time, so that other work on the
machine counts little.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from km_makeup.optics import Film, film, film_over, lay
from tests.optics import printed
from tests.stamps import write_markdown

COUNT, RUNS, ALLOWED = 1_000_000, 21, 1.3
KEPT = {"MALLOC_MMAP_THRESHOLD_": "1000000000", "MALLOC_TRIM_THRESHOLD_": "4000000000", "MALLOC_TOP_PAD_": "400000000"}
PAPER = ("R, T, A (Eq 1, 2 and 1 - R - T)", "film over a backing (Eq 1-3)")
BESIDE = ("R, T alone (Eq 1, 2); ours also A", "film over a backing (Kubelka, Eq 20)")
LAY = "one film laid on another (Eq 3, 4: R down and up, T); ours also A and T up"


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


def printed_lay(upper: Film, lower: Film) -> tuple[np.ndarray, ...]:
    """Eq 3 and 4 with the upper film lit from below in the denominator: reflectance from above and below, transmittance."""
    d = 1 - upper.R * lower.R
    return upper.R + upper.T**2 * lower.R / d, lower.R + lower.T**2 * upper.R / d, upper.T * lower.T / d


def medians(calls: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Median time of each call in ms, the calls taking turns."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(RUNS):
        for name, call in calls.items():
            start = time.process_time()
            call()
            times[name].append(time.process_time() - start)
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
    return result | {LAY: medians({"printed": lambda: printed_lay(upper, lower), "ours": lambda: lay(upper, lower)})}


def processor() -> str:
    """The processor and the vector instructions that numpy's loops use on it."""
    from numpy.core._multiarray_umath import __cpu_features__ as features

    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    name = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "")
    return f"{name or platform.machine()} with {'AVX512' if features.get('AVX512_SKX') else 'AVX2' if features.get('AVX2') else 'base'} loops"


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
                ratio = ms["ours"] / ms["printed"]
                if what in PAPER:
                    worst = max(worst, ratio)
                cells = (f"{ms['printed']:.1f}", f"{ms['ours']:.1f}", f"{ratio:.2f}")
                lines.append(f"| {what} | {name} | {memory} | " + " | ".join(cells) + " |")
    lines += [
        "",
        f"{COUNT} films, median processor time of {RUNS} alternating runs on {processor()}, numpy {np.__version__}.",
        f"Largest ratio to the paper's formulas for the same results: {worst:.2f} (allowed {ALLOWED}).",
        "",
    ]
    text = "\n".join(lines)
    print(text)
    covers = ["km_makeup/optics/arrays.py", "km_makeup/optics/films.py"]
    print(write_markdown("optics_speed.md", "Speed of films", "python tests/benchmarks/films.py", covers, text))
    return 0 if worst <= ALLOWED else 1


if __name__ == "__main__":
    sys.exit(main())
