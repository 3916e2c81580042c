"""What it costs to draw the highlight of a large lamp as one of a small lamp with a rougher lobe.

    python -m tests.highlights.large_lamps        the table, and tests/results/highlights_large_lamps.md (some seconds)

Truth is `optics.kelemen` integrated over a round lamp of even radiance that faces the skin; the nodes add rho^2/16 (1 + 1/cos^2
theta_d) to the slope variance of the lobe (rho the lamp's radius over its distance, theta_d the angle between lamp and half
vector) and take the light from its middle. Differences are of the highlight over
views in the plane of incidence and 30 degrees beside it, as a share of the true peak.
"""

from __future__ import annotations

import sys

import numpy as np

from km_makeup.optics import kelemen
from tests.stamps import write_markdown

RADII_DEGREES = (1, 3, 6, 12, 20)
ROUGHNESS = (0.0625, 0.1225, 0.25, 0.4225)
"""Beckmann's m for Principled roughness 0.25, 0.35, 0.5 and 0.65: gloss, lipstick, satin, matte."""
INCIDENCES = (0, 30, 60)
F0 = 0.034
RINGS, SPOKES = 24, 48
COMMAND = "python -m tests.highlights.large_lamps"
COVERS = ("tests/highlights/large_lamps.py", "km_makeup/optics/microfacets.py")


def directions(incidence: float) -> np.ndarray:
    """Views (count, 3) around the mirror direction."""
    out = []
    for turn in (0.0, 30.0):
        theta = np.radians(np.arange(-85, 86, 1.0))
        phi = np.radians(turn)
        out.append(np.stack([-np.sin(theta) * np.cos(phi), -np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1))
    return np.concatenate(out)


def lamp(incidence: float, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Directions (count, 3) over a disc of angular radius (degrees) that faces the surface, and their weights (sum 1).

    A disc at distance 1 with radius tan(rho): the weight of a place is the light it sends to a surface that faces the disc.
    """
    reach = np.tan(np.radians(radius))
    r = reach * np.sqrt((np.arange(RINGS) + 0.5) / RINGS)
    a = 2 * np.pi * (np.arange(SPOKES) + 0.5) / SPOKES
    x, y = (r[:, None] * f(a)[None, :] for f in (np.cos, np.sin))
    t = np.radians(incidence)
    middle = np.array([np.sin(t), 0, np.cos(t)])
    across = np.array([np.cos(t), 0, -np.sin(t)])
    points = middle + x[..., None] * across + y[..., None] * np.array([0, 1, 0])
    length = np.linalg.norm(points, axis=-1, keepdims=True)
    weights = 1 / length[..., 0] ** 4
    return (points / length).reshape(-1, 3), (weights / weights.sum()).reshape(-1)


def errors(m: float, radius: float, incidence: float) -> tuple[float, float]:
    """Largest difference over the views as a share of the true peak, and the difference of the peaks."""
    views = directions(incidence)
    lights, weights = lamp(incidence, radius)
    middle = np.array([np.sin(np.radians(incidence)), 0, np.cos(np.radians(incidence))])
    normal = np.array([0.0, 0.0, 1.0])
    # Per irradiance of a surface that faces the lamp: cosine of each place over its cosine to the lamp's axis.
    share = weights * np.maximum(lights[:, 2], 0) / (lights @ middle)
    truth = (kelemen(normal, lights[None], views[:, None], m, F0) * share).sum(axis=1)
    length2 = np.maximum(((middle + views) ** 2).sum(axis=-1), 0.12)
    spread = np.tan(np.radians(radius)) ** 2 / 8 * (0.5 + 2 / length2)
    drawn = kelemen(normal, middle[None], views, np.sqrt(m * m + spread), F0) * middle[2]
    peak = truth.max()
    return float(np.abs(drawn - truth).max() / peak), float(drawn.max() / peak - 1)


def main() -> None:
    rows = [
        "Largest difference in % of the true peak / difference of the peaks in %, the worst of incidences "
        f"{', '.join(map(str, INCIDENCES))} degrees.\n",
        "| radius of the lamp seen from the skin | " + " | ".join(f"m = {m:g}" for m in ROUGHNESS) + " |",
        "| --- |" + " ---: |" * len(ROUGHNESS),
    ]
    for radius in RADII_DEGREES:
        cells = []
        for m in ROUGHNESS:
            found = [errors(m, radius, incidence) for incidence in INCIDENCES]
            peak = max((one[1] for one in found), key=abs)
            cells.append(f"{100 * max(one[0] for one in found):.1f} / {100 * peak:+.1f}")
        rows.append(f"| {radius}° | " + " | ".join(cells) + " |")
    text = "\n".join(rows) + "\n"
    print(text)
    print(write_markdown("highlights_large_lamps.md", "Highlights of large lamps", COMMAND, COVERS, text))


if __name__ == "__main__":
    sys.exit(main())
