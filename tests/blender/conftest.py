"""Products of fixed numbers for the tests in Blender, so that they do not move with the shipped library."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.fixture
def test_products(tmp_path, monkeypatch):
    """Ids of a liquid, a powder and a red cream, found through KM_MAKEUP_PRODUCTS."""
    from km_makeup.products import Finish, Product, Provenance
    from km_makeup.products.files import write_product
    from km_makeup.spectra import WAVELENGTHS

    folder = tmp_path / "products"
    folder.mkdir()
    step = 1 / (1 + np.exp((WAVELENGTHS - 590) / 10))
    for id_, form, K, S, roughness in (
        ("test-base", "liquid", 4 * step + 1, np.full(81, 15.0), 0.6),
        ("test-powder", "powder", np.full(81, 30.0), np.full(81, 40.0), 0.8),
        ("test-red", "cream", 120 * step + 0.5, np.full(81, 12.0), 0.25),
    ):
        made = Product(id_, id_, "test", form, K, S, Provenance("computed", "a test"), finish=Finish(roughness, 0.045))
        write_product(made, folder / f"{id_}.json")
    monkeypatch.setenv("KM_MAKEUP_PRODUCTS", str(folder))
    return ["test-base", "test-powder", "test-red"]


@pytest.fixture
def painted_look(test_products, tmp_path):
    """A look of three layers, each painted on a part of its map."""
    from km_makeup.makeup import Layer, Look
    from tests.blender import scenes

    path = scenes.write_map(tmp_path, "spots", scenes.spots())
    return Look("Painted", tuple(Layer(id_, 15.0, path) for id_ in test_products))
