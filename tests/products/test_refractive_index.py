"""Refractive indices from files of the refractiveindex.info database."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.products.refractive_index import read_refractive_index


@pytest.mark.parametrize(
    ("name", "nm", "n"),
    [
        ("main__TiO2__Devore-o", 587.6, 2.6142),
        ("main__TiO2__Devore-e", 587.6, 2.9103),
        ("main__SiO2__Malitson", 587.6, 1.4585),
        ("main__Al2O3__Malitson-o", 587.6, 1.7682),
        ("main__CaCO3__Ghosh-o", 587.6, 1.6585),
        ("main__ZnO__Bond-o", 587.6, 2.0034),
    ],
)
def test_formulas_give_the_published_index(shared_data: Path, name: str, nm: float, n: float) -> None:
    index = read_refractive_index(shared_data / "spectra" / "refractiveindex" / f"{name}.yml")
    assert float(index.n(nm)) == pytest.approx(n, abs=2e-4)
    assert float(index.k(nm)) == 0


def test_a_table_is_read_and_interpolated(shared_data: Path) -> None:
    index = read_refractive_index(shared_data / "spectra" / "refractiveindex" / "main__Fe2O3__Querry-o.yml")
    assert index.n([550, 555]) == pytest.approx([3.318, 3.333])
    assert index.k([550, 555]) == pytest.approx([0.498, 0.4675])
    assert "Querry" in index.reference
    assert "<" not in index.reference


def test_every_file_of_the_collection_can_be_read(shared_data: Path) -> None:
    files = sorted((shared_data / "spectra" / "refractiveindex").glob("*.yml"))
    assert len(files) > 20
    for file in files:
        n = read_refractive_index(file).n(np.arange(450, 700, 50))
        assert np.isfinite(n).all()
        assert (n > 0.5).all()


BROKEN = {
    "empty": "",
    "no data": "REFERENCES: x\n",
    "unknown type": "DATA:\n  - type: tabulated nkz\n    data: |\n        0.4 1 0\n        0.5 1 0\n",
    "unknown formula": "DATA:\n  - type: formula 77\n    coefficients: 1 2 3\n",
    "formula of words": "DATA:\n  - type: formula x\n    coefficients: 1 2 3\n",
    "odd coefficients": "DATA:\n  - type: formula 1\n    coefficients: 0 1\n",
    "wrong columns": "DATA:\n  - type: tabulated nk\n    data: |\n        0.4 1\n        0.5 1\n",
    "text in numbers": "DATA:\n  - type: tabulated nk\n    data: |\n        0.4 one 0\n        0.5 1 0\n",
    "one row": "DATA:\n  - type: tabulated nk\n    data: |\n        0.4 1 0\n",
    "not a number": "DATA:\n  - type: tabulated nk\n    data: |\n        0.4 nan 0\n        0.5 1 0\n",
    "negative wavelength": "DATA:\n  - type: tabulated nk\n    data: |\n        -0.4 1 0\n        0.5 1 0\n",
    "yaml bomb": "a: &a [x, x]\nb: &b [*a, *a]\nDATA: *b\n",
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_file_gives_one_sentence(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "x.yml"
    file.write_text(BROKEN[kind])
    with pytest.raises(MakeupError) as error:
        read_refractive_index(file)
    assert "\n" not in str(error.value)
    assert "x.yml" in str(error.value) or "formula" in str(error.value)


def test_a_missing_and_a_binary_file_are_named(tmp_path: Path) -> None:
    (tmp_path / "b.yml").write_bytes(b"\xff\xfe\x00\x81")
    for name in ("a.yml", "b.yml"):
        with pytest.raises(MakeupError, match=name.replace(".", r"\.")):
            read_refractive_index(tmp_path / name)
