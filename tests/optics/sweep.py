"""The accuracy of films, stacks and inversions against 80 digits, over the whole domain.

    python -m tests.optics.sweep                 the full sweep (40,000 points and more); writes tests/results/optics_sweep.md
    python -m tests.optics.sweep --points 2000   a smaller one, printed only

Points are log-uniform over the stated domain (K, S 1e-12..1e6 /mm, X 1e-9..1e3 mm, backing 0..1), to which come a
quarter as many of makeup as it is (K, S 1e-2..1e3 /mm, X 1e-3..1 mm) and the full cross product of the edge values.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
import warnings
from dataclasses import dataclass, field

import mpmath as mp
import numpy as np

from km_makeup.optics import (
    Status,
    air_interface,
    film,
    film_over,
    invert,
    invert_backings,
    opaque_reflectance,
    stack,
)
from tests.optics import oracle
from tests.stamps import write_markdown

COVERS = [f"km_makeup/optics/{name}.py" for name in ("arrays", "films", "interfaces", "inversion", "sensitivity")]
EDGES_KS = (0.0, 1e-12, 1e-6, 1.0, 1e3, 1e6)
EDGES_X = (0.0, 1e-9, 1e-3, 1.0, 1e3, np.inf)
EDGES_G = (0.0, 1e-6, 0.5, 1.0)


@dataclass
class Row:
    """The worst of one quantity: its error over what is allowed, and where."""

    name: str
    dtype: str
    limit: str
    points: int = 0
    worst: float = 0.0
    ratio: float = 0.0
    where: str = ""
    not_finite: int = 0
    notes: list[str] = field(default_factory=list)

    def see(self, value: float, exact: mp.mpf, allowed: mp.mpf, floor: float, where: str) -> None:
        """Count one value; ``floor`` is an error that the range of the format itself makes."""
        self.points += 1
        if not np.isfinite(value):
            self.not_finite += 1
            self.ratio, self.where = float("inf"), where
            return
        error = abs(mp.mpf(float(value)) - exact)
        ratio = float(error / (allowed + floor)) if error else 0.0
        if ratio > self.ratio:
            self.worst, self.ratio, self.where = float(error / exact) if exact else float(error), ratio, where


def points(count: int, rng: np.random.Generator, dtype: type, edges: bool) -> list[np.ndarray]:
    """K, S, X, Rg: the whole domain, makeup, and the edges."""
    few = count // 4
    K = np.concatenate([10 ** rng.uniform(-12, 6, count), 10 ** rng.uniform(-2, 3, few)])
    S = np.concatenate([10 ** rng.uniform(-12, 6, count), 10 ** rng.uniform(-2, 3, few)])
    X = np.concatenate([10 ** rng.uniform(-9, 3, count), 10 ** rng.uniform(-3, 0, few)])
    g = rng.uniform(0, 1, count + few)
    values = [K, S, X, g]
    if edges:
        corner = np.array(list(itertools.product(EDGES_KS, EDGES_KS, EDGES_X, EDGES_G)))
        values = [np.concatenate([v, corner[:, i]]) for i, v in enumerate(values)]
    return [v.astype(dtype) for v in values]


def optical_depth(K: float, S: float, X: float) -> float:
    """z of a film; 0 for the opaque film, whose T is exactly 0."""
    K, S, X = float(K), float(S), float(X)
    return 0.0 if np.isinf(X) else float(np.sqrt(K * X) * np.sqrt((K + 2 * S) * X))


def films(count: int, rng: np.random.Generator, dtype: type, edges: bool = True) -> list[Row]:
    """One film, and one film over a backing."""
    K, S, X, g = points(count, rng, dtype, edges)
    name, eps, tiny = np.dtype(dtype).name, np.finfo(dtype).eps, float(np.finfo(dtype).tiny)
    close = 1e-15 if dtype is np.float64 else 5e-7
    near = 5e-15 if dtype is np.float64 else 3e-6
    R, T, A = film(K, S, X)
    over, R_inf = film_over(K, S, X, g), opaque_reflectance(K, S)
    rows = {
        "R": Row("R", name, f"{close:g} relative"),
        "A": Row("A", name, f"{close:g} relative"),
        "B": Row("1 - R = A + T", name, f"{close:g} relative"),
        "I": Row("R_inf", name, f"{close:g} relative"),
        "T": Row("T", name, "5 eps (1 + z) relative"),
        "O": Row("film over backing", name, f"{near:g} absolute"),
        "P": Row("film over backing", name, f"{near:g} R + 10 eps (1 + z)(R - R0)"),
    }
    for i in range(K.size):
        where = f"K={K[i]:.6g} S={S[i]:.6g} X={X[i]:.6g} Rg={g[i]:.6g}"
        exact_R, exact_T = oracle.film(K[i], S[i], X[i])
        exact_A = mp.mpf(0) if K[i] == 0 or X[i] == 0 else 1 - exact_R - exact_T
        z = optical_depth(K[i], S[i], X[i])
        rows["R"].see(R[i], exact_R, close * exact_R, tiny, where)
        rows["A"].see(A[i], exact_A, close * exact_A, tiny, where)
        rows["B"].see(float(A[i]) + float(T[i]), 1 - exact_R, close * (1 - exact_R), tiny, where)
        rows["T"].see(T[i], exact_T, 5 * eps * (1 + z) * exact_T, tiny, where)
        exact_I = oracle.opaque(K[i], S[i])
        rows["I"].see(R_inf[i], exact_I, close * exact_I, tiny, where)
        exact_O = oracle.over(exact_R, exact_T**2, exact_R, g[i])
        rows["O"].see(over[i], exact_O, mp.mpf(near), 0, where)
        rows["P"].see(over[i], exact_O, near * exact_O + 10 * eps * (1 + z) * (exact_O - exact_R), tiny, where)
    return list(rows.values())


def stacks(count: int, rng: np.random.Generator, dtype: type) -> list[Row]:
    """Stacks of one to eight films, half of them under an air interface."""
    name, eps, tiny = np.dtype(dtype).name, np.finfo(dtype).eps, float(np.finfo(dtype).tiny)
    each = 2e-15 if dtype is np.float64 else 1.1e-6
    k1, k2 = (float(v) for v in air_interface(1.5))
    rows = {
        part: Row(f"stack of 1-8 films, {part}", name, f"{each:g} n R + 10 eps n (1 + z)(R - R of the first film)")
        for part in ("R_top", "R_bottom")
    }
    rows["A_top"] = Row("stack of 1-8 films, A_top", name, f"{each:g} n relative")
    rows["T"] = Row("stack of 1-8 films, T", name, "5 eps n (1 + z) relative")
    for index in range(count):
        n = 1 + index % 8
        K, S, X, _ = points(n, rng, dtype, False)
        pick = rng.permutation(K.size)[:n]
        layers = [(K[i], S[i], X[i]) for i in pick]
        top = [air_interface(1.5).as_stack] if index % 2 else []
        ours = stack([film(*(np.asarray([v]) for v in layer)) for layer in layers] + top)
        exact = oracle.stack(layers, *((k1, k2) if top else (None, None)))
        z = sum(optical_depth(*layer) for layer in layers)
        where = f"n={n}{' under air' if top else ''} " + " ".join(f"({k:.3g},{s:.3g},{x:.3g})" for k, s, x in layers)
        first = {"R_top": 0 if top else oracle.film(*layers[-1])[0], "R_bottom": oracle.film(*layers[0])[0]}
        values = dict(zip(("R_top", "R_bottom", "T"), exact, strict=False))
        for part in ("R_top", "R_bottom"):
            allowed = each * n * values[part] + 10 * eps * n * (1 + z) * (values[part] - first[part])
            rows[part].see(getattr(ours, part)[0], values[part], allowed, tiny, where)
        absorbed = 1 - values["R_top"] - values["T"]
        rows["A_top"].see(ours.A_top[0], absorbed, each * n * absorbed, tiny, where)
        rows["T"].see(ours.T[0], values["T"], 5 * eps * n * (1 + z) * values["T"], tiny, where)
    return list(rows.values())


def inversions(count: int, rng: np.random.Generator, dtype: type) -> list[Row]:
    """K and S back from exact readings, over one backing and the opaque film, and over two backings."""
    name, eps = np.dtype(dtype).name, np.finfo(dtype).eps
    each = 5e-14 if dtype is np.float64 else 2.7e-5
    K, S, X, g = points(count, rng, dtype, False)
    g_2 = rng.uniform(0, 1, g.size).astype(dtype)
    rows = []
    for method in ("invert", "invert_backings"):
        row_K, row_S = (Row(f"{method}, {c}", name, f"{each:g} x condition") for c in "KS")
        state = Row(f"{method}, status", name, "1 in 1000 other than ok where K and S are determined")
        conditions, readings = [], []
        for i in range(K.size):

            def read(k: mp.mpf, s: mp.mpf, i: int = i, method: str = method) -> tuple:
                one = oracle.film_over(k, s, X[i], g[i])
                return (oracle.opaque(k, s), one) if method == "invert" else (one, oracle.film_over(k, s, X[i], g_2[i]))

            moves = []
            R, T = oracle.film(K[i], S[i], X[i])
            for backing, slot in ((g[i], 1),) if method == "invert" else ((g[i], 0), (g_2[i], 1)):
                slope = oracle.exact(backing) * T * T / (1 - R * oracle.exact(backing)) ** 2
                moves.append((slope, mp.mpf(0)) if slot == 0 else (mp.mpf(0), slope))
            conditions.append(oracle.conditions(read, K[i], S[i], moves))
            readings.append(read(oracle.exact(K[i]), oracle.exact(S[i])))
        m = np.array([[float(v) for v in pair] for pair in readings]).astype(dtype).T
        ours = invert(*m, g, X) if method == "invert" else invert_backings(m[0], g, m[1], g_2, X)
        for i, (to_K, to_S) in enumerate(conditions):
            where = f"K={K[i]:.6g} S={S[i]:.6g} X={X[i]:.6g} Rg={g[i]:.4g}"
            where += "" if method == "invert" else f" and {g_2[i]:.4g}"
            if not all(np.isfinite(v[i]) for v in (ours.K, ours.S, ours.K_condition, ours.S_condition)):
                state.not_finite += 1
            if max(to_K, to_S) * eps > 1e-3:
                continue
            state.points += 1
            if ours.status[i] != Status.OK:
                state.worst += 1
                state.where = f"{Status(ours.status[i]).name} at {where}, condition {float(max(to_K, to_S)):.3g}"
                continue
            row_K.see(
                ours.K[i],
                oracle.exact(K[i]),
                each * to_K * oracle.exact(K[i]),
                0,
                f"{where}, condition {float(to_K):.3g}",
            )
            row_S.see(
                ours.S[i],
                oracle.exact(S[i]),
                each * to_S * oracle.exact(S[i]),
                0,
                f"{where}, condition {float(to_S):.3g}",
            )
        state.ratio = state.worst / max(1e-3 * state.points, 1)
        rows += [row_K, row_S, state]
    return rows


def run(count: int, seed: int, edges: bool = True) -> list[Row]:
    """All rows; the share of the kinds is that of their cost."""
    mp.mp.dps = oracle.DIGITS
    rows = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for dtype in (np.float64, np.float32):
            rng = np.random.default_rng(seed)
            rows += films(count, rng, dtype, edges)
            rows += stacks(max(count // 8, 40), rng, dtype)
            rows += inversions(max(count // 5, 60), rng, dtype)
    return rows


def table(rows: list[Row]) -> str:
    """The rows as a Markdown table."""
    lines = ["| quantity | dtype | points | allowed | worst over allowed | worst relative | not finite | where |"]
    lines.append("|---|---|---:|---|---:|---:|---:|---|")
    for r in rows:
        cells = (r.name, r.dtype, r.points, r.limit, f"{r.ratio:.3g}", f"{r.worst:.3g}", r.not_finite, r.where)
        lines.append("| " + " | ".join(str(c) for c in cells) + " |")
    return "\n".join(lines)


def main() -> int:
    """Run the sweep, print it, and write it where it is the full one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=40_000)
    parser.add_argument("--seed", type=int, default=20130501)
    arguments = parser.parse_args()
    start = time.perf_counter()
    rows = run(arguments.points, arguments.seed)
    text = table(rows)
    broken = [row for row in rows if row.ratio > 1 or row.not_finite]
    text += f"\n\n{len(rows)} quantities, {len(broken)} outside what is allowed; {time.perf_counter() - start:.0f} s.\n"
    print(text)
    if arguments.points >= 40_000:
        print(
            write_markdown("optics_sweep.md", "Optics against 80 digits", "python -m tests.optics.sweep", COVERS, text)
        )
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
