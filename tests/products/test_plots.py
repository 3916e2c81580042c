"""Plots of products: what is drawn, the same every time, nothing from elsewhere."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.optics import film
from km_makeup.products import Library
from km_makeup.products.commands import main
from km_makeup.products.plots import coefficients, plot_product, product_svg, reflectances, thin_film

PLAIN = Library.shipped().find("foundation-medium")
MEASURED = replace(PLAIN, K_error=0.1 * PLAIN.K, S_error=0.05 * PLAIN.S)


def test_the_same_product_gives_the_same_picture_and_it_is_self_contained() -> None:
    first = product_svg(MEASURED)
    assert product_svg(MEASURED) == first
    assert ET.fromstring(first).tag.endswith("svg")
    assert not re.search(r"href|url\(\s*['\"]?(?!#)|<script|<image|@import", first)
    for word in ("R on black", "R on white", "R∞", "Rg black", "K", "S", "R₀", "T", "wavelength (nm)", "1/mm"):
        assert word in first, word


def test_a_measured_product_has_three_bands_and_a_computed_one_none() -> None:
    def bands(product) -> int:
        return product_svg(product).count('fill-opacity="0.2"')

    assert (bands(PLAIN), bands(MEASURED)) == (0, 3)


def test_the_band_of_the_thin_film_is_what_its_errors_do_to_it() -> None:
    rng = np.random.default_rng(1)
    K, S = (
        v + rng.normal(0, 1, (4000, 81)) * e
        for v, e in ((MEASURED.K, MEASURED.K_error), (MEASURED.S, MEASURED.S_error))
    )
    spread = film(np.maximum(K, 0), np.maximum(S, 0), MEASURED.thickness_um / 1000).R.std(axis=0)
    stated = next(line.error for line in thin_film(MEASURED) if line.name == "R₀")
    assert stated is not None
    assert np.allclose(stated, spread, rtol=0.1)


def test_the_opaque_film_lies_between_what_is_seen_on_black_and_on_white_of_a_pale_product() -> None:
    lines = {line.name: line.values for line in reflectances(PLAIN)}
    assert (lines["R on black"] < lines["R∞"]).all()
    assert (lines["R on white"] > lines["R on black"]).all()
    assert np.array_equal(coefficients(PLAIN)[0].values, PLAIN.K)


def test_an_apparent_product_is_drawn_without_the_air_interface() -> None:
    apparent = {line.name: line.values for line in reflectances(replace(PLAIN, interface="apparent"))}  # type: ignore[arg-type]
    internal = {line.name: line.values for line in reflectances(PLAIN)}
    assert (apparent["R∞"] > internal["R∞"]).all()


def test_the_command_writes_the_file_and_refuses_another_suffix(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["plot", "lipstick-berry", "--out", str(tmp_path / "berry.svg")]) == 0
    assert "no bands, since it is derived from measured paint" in capsys.readouterr().out
    assert (tmp_path / "berry.svg").read_text(encoding="utf-8").startswith("<svg")
    assert main(["plot", "lipstick-berry", "--out", str(tmp_path / "berry.png")]) == 2
    assert "let it end in .svg" in capsys.readouterr().err
    assert main(["plot", "lipstick-bery", "--out", str(tmp_path / "b.svg")]) == 2
    assert "did you mean lipstick-berry" in capsys.readouterr().err
    with pytest.raises(MakeupError, match="Cannot write"):
        plot_product(PLAIN, tmp_path / "no" / "a.svg")
