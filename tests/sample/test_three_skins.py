"""The same product on three skins."""

from __future__ import annotations

import pytest

from km_makeup.products import Library
from tests.sample import three_skins

BARE = 21.2  # CIEDE2000 between the lightest and the darkest of the three skins


@pytest.mark.parametrize("product", Library.shipped().products, ids=lambda product: product.id)
def test_a_product_is_nearer_to_itself_on_other_skins_than_the_skins_are(product):
    assert three_skins.under(product, product.thickness_um) < 0.95 * BARE


@pytest.mark.parametrize("product", [p for p in Library.shipped().products if p.kind == "lipstick"], ids=lambda p: p.id)
def test_a_lipstick_covers_a_skins_colour(product):
    assert three_skins.under(product, product.thickness_um) < 0.3 * BARE
    assert three_skins.under(product, product.thickness_um / 8) > three_skins.under(product, product.thickness_um)
