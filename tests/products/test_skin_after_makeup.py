"""Upsampled skin under makeup: what remains of the upsampling's error once films lie on it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from km_makeup.products import Library
from km_makeup.products.formulation import seen_over
from km_makeup.spectra import delta_e, light_spectrum, to_rgb, upsample_skin
from km_makeup.spectra.derive_skin_basis import issa_faces
from km_makeup.spectra.skin import _mallett


def test_made_up_skin_is_met_three_times_better_than_with_mallett(shared_data: Path) -> None:
    truth = issa_faces(shared_data / "spectra")[::25]
    rgb = to_rgb(truth)
    mallett = rgb @ _mallett(light_spectrum("D65").tobytes(), "Linear Rec.709").T
    guesses = {"skin basis": upsample_skin(rgb), "Mallett": mallett}
    means = {}
    for name, guess in guesses.items():
        for light in ("D65", "A", "LED-B3"):
            errors = np.array([_difference(product, truth, guess, light) for product in Library.shipped().products])
            means[name, light] = errors.mean()
            print(
                f"ISSA faces under {len(errors)} products, {name}, {light}: dE2000 {errors.mean():.3f}/{errors.max():.2f}"
            )
    assert means["skin basis", "D65"] < 0.1
    assert means["Mallett", "D65"] > 3 * means["skin basis", "D65"]
    assert means["Mallett", "A"] > 3 * means["skin basis", "A"]


def _difference(product, truth: np.ndarray, guess: np.ndarray, light: str) -> np.ndarray:
    seen = [to_rgb(seen_over(product.K, product.S, product.thickness_um, one), light) for one in (truth, guess)]
    return delta_e(*seen)
