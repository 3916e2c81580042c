"""What no live path can know: stacks at all 81 bands on the spectra that skin's colours tell, against the spectra as measured.

    python -m tests.live_colours.known [--count 2000]

The stacks are those of `tests.live_colours`. A material has the skin's colour and not its spectrum, so what these two differ by is
left to every way of computing from colours, at any cost. Prints the same table for it.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from numpy.typing import NDArray

from km_makeup.spectra import upsample_skin
from tests.flat_field.compare import delta_e
from tests.live_colours import stacks as made
from tests.live_colours.__main__ import PART, Difference


def on_known_skins(stack: made.Stack) -> NDArray:
    """Parts (2, texels, 3) of a stack at 81 bands on the spectra that its skins' colours tell."""
    layers = [made.layer(film.product, film.thickness_um, film.map.reshape(-1) / 255) for film in stack.films]
    return np.array(made.colours(layers, upsample_skin(stack.skins @ made.rgb_weights().T)))


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.live_colours.known", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=2000, help="stacks (2000)")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if options.count < 1:
        parser.error("--count must be at least 1")
    chosen = made.random_stacks(options.count, options.seed)
    parts = np.array([on_known_skins(stack) for stack in chosen])
    wanted = np.array([made.expected(stack) for stack in chosen])
    apart = np.abs(parts - wanted).max(axis=-1)
    found = Difference(delta_e(parts.sum(axis=1), wanted.sum(axis=1)), apart[:, 0], apart[:, 1])
    print(
        "| mean | 99 % | max | film part 99 % | max | skin part 99 % | max |\n| ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    )
    print(f"| {found.row(np.full(len(chosen), True))} |")
    for name, part in (("films'", found.film), ("skin's", found.skin)):
        print(f"The {name} part is off by more than {PART} on {np.mean(part > PART):.3%} of the texels.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
