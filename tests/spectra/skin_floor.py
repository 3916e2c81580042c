"""How near a linear basis can come under an LED at all: bases fitted to the very skins that they are judged on.

    python -m tests.spectra.skin_floor     prints how many times smaller than Mallett and Yuksel's the difference under makeup is

The regression is least squares at every wavelength, so no other basis that is linear in RGB leaves less; what remains of the
difference is in the spectra and not in their colours.
"""

from __future__ import annotations

import sys

import numpy as np

from km_makeup.spectra import to_rgb, upsample_skin
from tests.spectra.skins import basis_of, made_up, mallett, some, splits

COMPARED = 60


def main() -> int:
    """Print the ratios under LED-B3."""
    for split in splits()[2:5]:
        skins = some(split.test, COMPARED)
        other = made_up(mallett(skins), skins, "LED-B3").mean()
        for name, train in (("as split", split.train), ("fitted to the skins compared", skins)):
            for shrinkage in (0.1, 0.0):
                with basis_of(train):
                    guess = np.asarray(upsample_skin(to_rgb(skins), shrinkage=shrinkage))
                ratio = other / made_up(guess, skins, "LED-B3").mean()
                print(f"{split.name}, {name}, shrinkage {shrinkage:g}: {ratio:.2f} times", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
