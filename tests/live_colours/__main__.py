"""Random stacks in the live path, read from rendered pixels, against 81 bands.

    python -m tests.live_colours --count 2000 --result     (writes tests/results/live_colours.md)
    python -m tests.live_colours --count 40 --engine eevee

Exit status: 0 within the bounds, 1 beyond one, 2 bad arguments.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests import stamps
from tests.flat_field.compare import delta_e
from tests.live_colours import stacks as made

MEAN, P99, PART = 0.15, 0.8, 0.01
"""Bounds: CIEDE2000 over all texels, mean and 99th percentile; films' and skin's part, 99th percentile of each."""

BATCH = 200
"""Stacks in one file of Blender."""

COVERS = [
    "km_makeup/optics/films.py", "km_makeup/spectra/skin.py",
    "km_makeup/spectra/skin_basis.json", "km_makeup/makeup/transfer.py", "km_makeup/makeup/coat.py",
    "km_makeup/blender/fitting.py", "km_makeup/blender/skin.py", "km_makeup/blender/nodes/groups.py",
    "km_makeup/products/shipped", "tests/live_colours/stacks.py", "tests/live_colours/tiles.py", "tests/live_colours/__main__.py",
]  # fmt: skip


@dataclass(frozen=True)
class Difference:
    """What was rendered less what 81 bands give: CIEDE2000 (stacks, texels), largest channel of each part (stacks, texels)."""

    colour: NDArray
    film: NDArray
    skin: NDArray

    def row(self, chosen: NDArray) -> str:
        colour, film, skin = self.colour[chosen], self.film[chosen], self.skin[chosen]
        return (
            f"{colour.mean():.3f} | {np.quantile(colour, 0.99):.3f} | {colour.max():.2f} | {np.quantile(film, 0.99):.4f} | "
            f"{film.max():.4f} | {np.quantile(skin, 0.99):.4f} | {skin.max():.4f}"
        )

    def faults(self) -> list[str]:
        """The bounds that are passed, in words."""
        found = []
        if self.colour.mean() > MEAN:
            found.append(f"mean {self.colour.mean():.3f} > {MEAN}")
        if np.quantile(self.colour, 0.99) > P99:
            found.append(f"99th percentile {np.quantile(self.colour, 0.99):.3f} > {P99}")
        for name, part in (("films'", self.film), ("skin's", self.skin)):
            if part.max() > PART:
                found.append(f"{name} part {part.max():.4f} > {PART} on {np.mean(part > PART):.3%} of the texels")
        return found


def difference(rendered: NDArray, chosen: list[made.Stack]) -> Difference:
    """``rendered`` (stacks, 2, texels, 3) against 81 bands on the spectra as measured."""
    wanted = np.array([made.expected(stack) for stack in chosen])
    apart = np.abs(rendered - wanted).max(axis=-1)
    return Difference(delta_e(rendered.sum(axis=1), wanted.sum(axis=1)), apart[:, 0], apart[:, 1])


def measure(count: int, seed: int, engines: list[str]) -> tuple[list[made.Stack], dict[str, Difference]]:
    """As many random stacks, and by engine what their rendered colours differ by."""
    from tests.live_colours import tiles

    chosen = made.random_stacks(count, seed)
    pictures: dict[str, list[NDArray]] = {engine: [] for engine in engines}
    with tempfile.TemporaryDirectory(prefix="km_makeup-live-colours-") as folder:
        for start in range(0, count, BATCH):
            since = time.monotonic()
            batch = chosen[start : start + BATCH]
            for engine, found in tiles.measured(batch, engines, Path(folder)).items():
                pictures[engine].append(found)
            print(
                f"{start + len(batch)} of {count} stacks, {time.monotonic() - since:.0f} s", file=sys.stderr, flush=True
            )
    return chosen, {engine: difference(np.concatenate(found), chosen) for engine, found in pictures.items()}


def report(chosen: list[made.Stack], found: dict[str, Difference]) -> str:
    films = np.array([len(stack.films) for stack in chosen])
    texels = made.TEXELS**2
    text = (
        f"{len(chosen)} random stacks of 1 to {made.MOST_FILMS} films of the {len(made.products())} shipped products, at "
        f"{made.FACTORS[0]:g} to {made.FACTORS[1]:g} times their usual thickness, {texels} texels each with a random byte of every map on a "
        f"measured skin (NIST, ISSA; {made.faces().shape[0]} groups of {texels} skins of about one lightness). The group's film and skin part, "
        "emitted by a plane and read from 32-bit EXR, against the printed equations at 81 bands on the spectra as measured: "
        "CIEDE2000 of their sum, and the largest channel's difference of each part.\n\n"
        "| engine | films | mean | 99 % | max | film part 99 % | max | skin part 99 % | max |\n"
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n"
    )
    for engine, one in found.items():
        for number in sorted(set(films)):
            text += f"| {engine} | {number} | {one.row(films == number)} |\n"
        text += f"| {engine} | all | {one.row(films > 0)} |\n"
    for engine, one in found.items():
        worst = np.unravel_index(int(np.argmax(one.colour)), one.colour.shape)
        text += f"\nWorst in {engine}: {chosen[worst[0]].name}, CIEDE2000 {one.colour[worst]:.2f}.\n"
        text += f"Beyond the bounds in {engine}: {'; '.join(one.faults()) or 'nothing'}.\n"
    return text


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.live_colours",
        description="Random stacks in the live path, read from rendered pixels, against 81 bands.",
        epilog="Example: python -m tests.live_colours --count 40 --engine eevee",
    )
    parser.add_argument("--count", type=int, default=2000, help="stacks (2000)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--engine", action="append", choices=["cycles", "eevee"], help="default: both")
    parser.add_argument("--result", action="store_true", help="write tests/results/live_colours.md")
    arguments = parser.parse_args()
    if arguments.count < 1:
        parser.error("--count must be at least 1")
    chosen, found = measure(arguments.count, arguments.seed, arguments.engine or ["cycles", "eevee"])
    text = report(chosen, found)
    print(text)
    if arguments.result:
        command = f"python -m tests.live_colours --count {arguments.count} --result"
        stamps.write_markdown("live_colours.md", "Live colours as rendered, against 81 bands", command, COVERS, text)
    return int(any(one.faults() for one in found.values()))


if __name__ == "__main__":
    sys.exit(main())
