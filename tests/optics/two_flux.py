"""What the two-flux model itself is worth: Kubelka-Munk against adding-doubling.

    python -m tests.optics.two_flux      prints the errors and writes tests/results/optics_two_flux.md

The slabs of km_makeup/accuracy/adding_doubling.csv (made by tests/accuracy/make_adding_doubling.py) with K = 2 mu_a and S = 3/4 mu_s (1 - g),
no surface reflection: R and T of the model less those of adding-doubling, for diffuse light and light along the normal.
"""

from __future__ import annotations

import sys

import numpy as np

from km_makeup.accuracy.two_flux import table as rows
from km_makeup.accuracy.two_flux import two_fluxes
from tests.stamps import write_markdown

PUBLISHED_G = 0.75


def errors(table: np.ndarray) -> dict[str, np.ndarray]:
    """Model less truth, per illumination and quantity."""
    R, T = two_fluxes(table)
    return {
        "R diffuse": R - table.URU,
        "T diffuse": T - table.UTU,
        "R normal": R - table.UR1,
        "T normal": T - table.UT1,
    }


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def text() -> str:
    """The errors by g, albedo and thickness."""
    table = rows()
    table = table[table.g != PUBLISHED_G]
    difference = errors(table)
    lines = ["| slabs | " + " | ".join(f"rms {name}" for name in difference) + " | worst |", "|---|" + "---:|" * 5]

    def add(name: str, chosen: np.ndarray) -> None:
        worst = max(np.abs(d[chosen]).max() for d in difference.values())
        lines.append(
            f"| {name} | " + " | ".join(f"{rms(d[chosen]):.4f}" for d in difference.values()) + f" | {worst:.4f} |"
        )

    add("all", np.ones(table.size, bool))
    for column in ("g", "albedo", "optical_thickness"):
        for value in np.unique(table[column]):
            add(f"{column} = {value:g}", table[column] == value)
    reduced = table.albedo * table.optical_thickness * (1 - table.g)
    add("thick and scattering: mu_s' d > 1, albedo >= 0.95", (reduced > 1) & (table.albedo >= 0.95))
    lines += ["", f"Largest quadrature error of the table itself: {table.quadrature_error.max():.1e}.", ""]
    return "\n".join(lines)


def main() -> int:
    """Print and write."""
    result = text()
    print(result)
    title, command = "Kubelka-Munk against adding-doubling", "python -m tests.optics.two_flux"
    covers = [
        f"km_makeup/{name}"
        for name in ("optics/arrays.py", "optics/films.py", "accuracy/two_flux.py", "accuracy/adding_doubling.csv")
    ]
    print(write_markdown("optics_two_flux.md", title, command, covers, result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
