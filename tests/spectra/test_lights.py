"""Light spectra: names, files and arrays."""

from __future__ import annotations

from pathlib import Path

import colour
import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.spectra import WAVELENGTHS, light_spectrum, resample, to_rgb


@pytest.mark.parametrize("name", ["D65", "D55", "A", "FL2"])
def test_a_named_light_has_the_tabulated_power(name: str) -> None:
    table = colour.SDS_ILLUMINANTS[name]
    known = dict(zip(table.wavelengths, table.values, strict=True))
    for nm, power in zip(WAVELENGTHS, light_spectrum(name), strict=True):
        if nm in known and np.median(np.diff(table.wavelengths)) >= 5:
            assert power == pytest.approx(known[nm], rel=1e-12)


def test_a_narrow_line_keeps_its_energy() -> None:
    fine = np.arange(380, 781, 0.5)
    for centre in (546.1, 541.3, 547.5):
        line = np.exp(-(((fine - centre) / 1.0) ** 2))
        assert resample(fine, line).sum() * 5 == pytest.approx(line.sum() * 0.5, rel=0.01)


@pytest.mark.parametrize(
    "text",
    [
        "wavelength,power\n" + "\n".join(f"{nm},{nm / 1000}" for nm in range(380, 781, 10)),
        "\n".join(f"{nm};{str(nm / 1000).replace('.', ',')}" for nm in range(780, 379, -10)),
        "# a lamp\n" + "\n".join(f"{nm}\t{nm / 1000}\tx" for nm in range(380, 781, 10)),
        "\ufeff" + "\n".join(f"{nm} {nm / 1000}" for nm in range(380, 781, 10)),
    ],
    ids=["comma", "semicolon, decimal comma, descending", "tab, comment, third column", "space, byte order mark"],
)
def test_a_light_is_read_from_a_csv_file(tmp_path: Path, text: str) -> None:
    file = tmp_path / "lamp.csv"
    file.write_text(text, encoding="utf-8")
    assert np.allclose(light_spectrum(file), WAVELENGTHS / 1000)


def test_a_file_and_its_arrays_give_the_same_colours(tmp_path: Path) -> None:
    power = light_spectrum("A")
    file = tmp_path / "a.csv"
    file.write_text("\n".join(f"{nm},{value!r}" for nm, value in zip(WAVELENGTHS, map(float, power), strict=True)))
    reflectance = np.linspace(0.1, 0.9, 81)
    for light in (file, (WAVELENGTHS, power), power, (WAVELENGTHS[::-1], 3 * power[::-1])):
        assert np.allclose(to_rgb(reflectance, light), to_rgb(reflectance, "A"), atol=1e-12)


BROKEN_FILES = {
    "empty": b"",
    "binary": bytes(range(256)),
    "one column": b"400\n500\n700\n",
    "words": b"red,blue\ngreen,white\n",
    "negative": b"380,1\n500,-2\n780,1\n",
    "all zero": b"380,0\n780,0\n",
    "nan": b"380,1\n500,nan\n780,1\n",
    "infinite": b"380,1\n500,inf\n780,1\n",
    "twice the same wavelength": b"380,1\n500,1\n500,2\n780,1\n",
    "too short a range": b"500,1\n600,1\n",
    "utf-16": "380,1\n780,1\n".encode("utf-16"),
    "huge": b"380,1\n" * 900_000,
}


@pytest.mark.parametrize("kind", BROKEN_FILES)
def test_a_broken_light_file_gives_one_sentence_with_its_name(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "lamp.csv"
    file.write_bytes(BROKEN_FILES[kind])
    with pytest.raises(MakeupError) as error:
        light_spectrum(file)
    assert "\n" not in str(error.value)
    assert "lamp.csv" in str(error.value) or "wavelength" in str(error.value) or "finite" in str(error.value)


def test_a_missing_light_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(MakeupError, match=r"Cannot read the light .*lamp\.csv"):
        light_spectrum(tmp_path / "lamp.csv")
