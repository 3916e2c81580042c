"""How much of the skin shows through a product: the colours of every shipped product on light, medium and deep skin.

    python -m tests.sample.three_skins

A film is the same film on every skin: R, T2 and R_up of `makeup.coat.on_skin` do not know the skin. What differs is what
shines through. Printed: CIEDE2000 between the most different two of the three skins, bare and under the product, at its usual
thickness and as an opaque film.
"""

from __future__ import annotations

import itertools

import numpy as np

from km_makeup.products import Library
from km_makeup.products.formulation import seen_over
from km_makeup.products.swatches import reference_skins
from km_makeup.spectra import delta_e, to_rgb


def spread(colours: list[np.ndarray]) -> float:
    """The largest CIEDE2000 among linear Rec.709 colours (3,)."""
    return max(float(delta_e(a, b)) for a, b in itertools.combinations(colours, 2))


def under(product, thickness_um: float) -> float:
    """The largest CIEDE2000 among the three skins under so much of a product."""
    return spread(
        [to_rgb(seen_over(product.K, product.S, thickness_um, skin)) for skin in dict(reference_skins()).values()]
    )


def main() -> None:
    bare = spread([to_rgb(skin) for skin in dict(reference_skins()).values()])
    print(f"bare skins: {bare:.1f}\n\nproduct                     um   usual   opaque")
    for product in Library.shipped().products:
        thick = product.thickness_um
        print(f"{product.id:24} {thick:5.1f} {under(product, thick):7.2f} {under(product, np.inf):8.2f}")


if __name__ == "__main__":
    main()
