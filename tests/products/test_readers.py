"""Readers of measured spectra: real files, every common shape of a table, and files that are broken."""

from __future__ import annotations

import time
from pathlib import Path

import colour
import numpy as np
import pytest

from km_makeup.errors import MakeupError
from km_makeup.products.readers import Scale, read_spectra

NM = np.arange(400.0, 701.0, 10.0)
VALUES = {"black": 0.05 + 0 * NM, "red paint": np.where(NM > 600, 0.8, 0.04) + NM / 1e5}
RESOURCES = Path(colour.__file__).parent / "io" / "tests" / "resources"


def table(
    separator: str = ",",
    percent: bool = False,
    comma: bool = False,
    um: bool = False,
    reverse: bool = False,
    across: bool = False,
) -> str:
    """The spectra above as text in one of the shapes that instruments write."""

    def show(value: float) -> str:
        return f"{value:.9g}".replace(".", ",") if comma else f"{value:.9g}"

    order = slice(None, None, -1) if reverse else slice(None)
    nm = [show(value / 1000 if um else value) for value in NM[order]]
    columns = [[show(value * (100 if percent else 1)) for value in values[order]] for values in VALUES.values()]
    rows = [["wavelength", *VALUES], *map(list, zip(nm, *columns, strict=True))]
    if across:
        rows = [list(row) for row in zip(*rows, strict=True)]
    return "\n".join(separator.join(row) for row in rows) + "\n"


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("um", [False, True])
@pytest.mark.parametrize("percent", [False, True])
@pytest.mark.parametrize(("separator", "comma"), [(",", False), (";", False), (";", True), ("\t", False), ("\t", True)])
def test_a_table_is_read_in_every_common_shape(
    tmp_path: Path, separator: str, comma: bool, percent: bool, um: bool, reverse: bool, across: bool
) -> None:
    file = tmp_path / "paints.csv"
    file.write_text(table(separator, percent, comma, um, reverse, across), encoding="utf-8")
    found = read_spectra(file)
    assert found.scale == (Scale.PERCENT if percent else Scale.FRACTION)
    assert np.allclose(found.wavelengths, NM)
    for name, values in VALUES.items():
        assert np.allclose(found.find(name), values, atol=1e-9)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_headings_and_encodings_do_not_matter(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / "paints.txt"
    text = "# Messger\u00e4t 4711\nOperator: M\u00fcller\nReflectance factor (%)\n" + table("\t", percent=True).replace(
        "\n", "\r\n"
    )
    file.write_bytes(text.encode(encoding))
    assert np.allclose(read_spectra(file).find("red paint"), VALUES["red paint"], atol=1e-9)


def test_dark_spectra_in_percent_are_told_by_the_heading(tmp_path: Path) -> None:
    file = tmp_path / "black.csv"
    file.write_text("nm,R [%]\n" + "\n".join(f"{nm:g},1.5" for nm in NM))
    assert np.allclose(read_spectra(file).values, 0.015)
    assert np.allclose(read_spectra(file, Scale.FRACTION).values, 1.5)


def test_radiance_is_kept_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "radiance.csv"
    file.write_text("nm,L\n" + "\n".join(f"{nm:g},{nm}" for nm in NM))
    assert read_spectra(file).scale == Scale.AS_IS
    assert np.allclose(read_spectra(file).values[0], NM)


def test_many_spectra_without_a_heading_are_columns(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    values = np.sort(rng.uniform(0.2, 0.9, (31, 5)), axis=1)  # rising along each row, as micrometres would
    file = tmp_path / "rows.csv"
    file.write_text("\n".join(",".join(f"{v:.9g}" for v in [nm, *row]) for nm, row in zip(NM, values, strict=True)))
    found = read_spectra(file)
    assert found.values.shape == (5, 31)
    assert np.allclose(found.values.T, values)


def test_revigo_paints_are_read_from_the_file_as_it_is(shared_data: Path) -> None:
    found = read_spectra(
        shared_data / "spectra" / "revigo_oilpaint_black_white" / "revigo-aggregated-palette-spectral-data.txt"
    )
    assert len(found.names) == 336
    assert found.scale == Scale.PERCENT
    assert found.find("04A_ow")[0] == pytest.approx(0.0413)


def test_nist_skins_are_read_from_the_file_as_it_is(shared_data: Path) -> None:
    found = read_spectra(shared_data / "spectra" / "nist_skin" / "nist_skin_avg_360_830nm.csv")
    assert found.values.shape == (100, 157)
    assert found.on_grid("subject007").shape == (81,)


def test_a_real_spdx_file_agrees_with_colour_sciences_reader() -> None:
    theirs = colour.SpectralDistribution_IESTM2714(str(RESOURCES / "Fluorescent.spdx")).read()
    ours = read_spectra(RESOURCES / "Fluorescent.spdx")
    assert ours.scale == Scale.AS_IS
    assert np.allclose(ours.wavelengths, theirs.wavelengths)
    assert np.allclose(ours.values[0], theirs.values)


def test_a_real_x_rite_file_agrees_with_colour_sciences_reader() -> None:
    file = RESOURCES / "X-Rite_Digital_Colour_Checker.txt"
    theirs = colour.read_sds_from_xrite_file(str(file))
    ours = read_spectra(file)
    assert set(ours.names) == set(theirs)
    for name, sd in theirs.items():
        assert np.allclose(ours.wavelengths, sd.wavelengths)
        assert np.allclose(ours.find(name), sd.values)


CGATS = """CGATS.17
SPECTRAL_NORM 100
NUMBER_OF_FIELDS 5
BEGIN_DATA_FORMAT
SAMPLE_ID SAMPLE_NAME SPECTRAL_NM_400 SPECTRAL_NM_550 SPECTRAL_NM_700
END_DATA_FORMAT
NUMBER_OF_SETS 2
BEGIN_DATA
1 "warm beige" 30.0 45.5 60.25
2 "ebony" 3.0 5.5 9.0
END_DATA
"""
TI3 = """CTI3
DESCRIPTOR "Argyll"
SPECTRAL_BANDS "4"
SPECTRAL_START_NM "400.0"
SPECTRAL_END_NM "700.0"
BEGIN_DATA_FORMAT
SAMPLE_ID SPEC_400 SPEC_500 SPEC_600 SPEC_700
END_DATA_FORMAT
BEGIN_DATA
A1 10 20 30 40
END_DATA
"""
CXF = """<?xml version="1.0" encoding="UTF-8"?>
<cc:CxF xmlns:cc="http://colorexchangeformat.com/CxF3-core"><cc:Resources>
<cc:ObjectCollection><cc:Object ObjectType="Standard" Name="Rouge" Id="1"><cc:ColorValues>
<cc:ReflectanceSpectrum ColorSpecification="s1" StartWL="400">0.1 0.2 0.3 0.4</cc:ReflectanceSpectrum>
</cc:ColorValues></cc:Object></cc:ObjectCollection>
<cc:ColorSpecificationCollection><cc:ColorSpecification Id="s1"><cc:MeasurementSpec>
<cc:WavelengthRange StartWL="400" Increment="100"/></cc:MeasurementSpec></cc:ColorSpecification></cc:ColorSpecificationCollection>
</cc:Resources></cc:CxF>
"""


def test_cgats_percent_and_quoted_names(tmp_path: Path) -> None:
    file = tmp_path / "shades.txt"
    file.write_text(CGATS)
    found = read_spectra(file)
    assert found.names == ("warm beige", "ebony")
    assert np.allclose(found.find("warm beige"), [0.30, 0.455, 0.6025])


def test_ti3_of_argyll(tmp_path: Path) -> None:
    file = tmp_path / "shades.ti3"
    file.write_text(TI3)
    assert np.allclose(read_spectra(file).wavelengths, [400, 500, 600, 700])
    file.write_text(TI3.replace("SPEC_400 SPEC_500 SPEC_600 SPEC_700", "SPEC_1 SPEC_2 SPEC_3 SPEC_4"))
    assert np.allclose(read_spectra(file).wavelengths, [400, 500, 600, 700])
    assert np.allclose(read_spectra(file).values, [[0.1, 0.2, 0.3, 0.4]])


def test_cxf3(tmp_path: Path) -> None:
    file = tmp_path / "rouge.cxf"
    file.write_text(CXF)
    found = read_spectra(file)
    assert np.allclose(found.find("Rouge"), [0.1, 0.2, 0.3, 0.4])
    assert np.allclose(found.wavelengths, [400, 500, 600, 700])


BOMB = (
    '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "'
    + "b" * 1000
    + '">'
    + "".join(f'<!ENTITY {n} "{("&" + p + ";") * 10}">' for p, n in zip("acdefgh", "cdefghi", strict=True))
    + "]>"
)

BROKEN = {
    "csv": {
        "empty": b"",
        "blank": b"  \n\n \n",
        "binary": bytes(range(256)),
        "image": b"\x89PNG\r\n\x1a\n" + bytes(range(200)),
        "words only": b"once upon a time\nthere was a paint\n",
        "truncated in a row": table().encode()[:-4].rsplit(b",", 1)[0] + b"\n",
        "one column": b"400\n500\n600\n700\n",
        "column count changes": b"nm,R\n400,.1\n500,.2\n600,.3,.4\n700,.4\n",
        "text in numbers": b"nm,R\n400,.1\n500,high\n600,.3\n700,.4\n",
        "nan": b"nm,R\n400,.1\n500,nan\n600,.3\n700,.4\n",
        "infinity": b"nm,R\n400,.1\n500,inf\n600,.3\n700,.4\n",
        "overflow": b"nm,R\n400,.1\n500,1e999\n600,.3\n700,.4\n",
        "hole": b"nm,R,S\n400,.1,.1\n500,,.1\n600,.3,.1\n700,.4,.1\n",
        "duplicate wavelengths": b"nm,R\n400,.1\n500,.2\n500,.3\n700,.4\n",
        "two rows": b"nm,R\n400,.1\n500,.2\n",
        "wavelengths of radio": b"nm,R\n4000000,.1\n5000000,.2\n6000000,.3\n",
        "wavelengths of nothing": b"nm,R\n0,.1\n5,.2\n6,.3\n",
        "header without spectra": b"name,400,500,600,700\n",
        "row too short across": b"name,400,500,600,700\nred,.1,.2,.3\n",
        "word across": b"name,400,500,600,700\nred,.1,.2,x,.4\n",
        "open quotation": b'nm,R\n"400,.1\n500,.2\n600,.3\n700,.4\n',
        "hexadecimal": b"nm,R\n0x190,.1\n500,.2\n600,.3\n",
    },
    "xml": {
        "bomb": (BOMB + "<IESTM2714>&i;</IESTM2714>").encode(),
        "outside entity": b'<!DOCTYPE x [<!ENTITY f SYSTEM "file:///etc/passwd">]><CxF>&f;</CxF>',
        "doctype alone": b"<!DOCTYPE html><html></html>",
        "not closed": CXF.encode()[:300],
        "another format": b"<svg></svg>",
        "no objects": b"<CxF></CxF>",
        "no spectrum": b'<IESTM2714><Header/></IESTM2714>',
        "word for number": CXF.replace("0.3", "three").encode(),
        "no grid": CXF.replace('StartWL="400"', "").encode(),
        "no increment": CXF.replace('Increment="100"', "").encode(),
        "negative increment": CXF.replace('Increment="100"', 'Increment="-5"').encode(),
        "too few": CXF.replace("0.1 0.2 0.3 0.4", "0.1").encode(),
        "nested deep": b"<a>" * 100_000,
        "undefined entity": b"<CxF>&nbsp;</CxF>",
    },
    "cgats": {
        "no data": CGATS.split("BEGIN_DATA\n")[0].encode(),
        "cut off": CGATS.split("END_DATA\n")[0].encode(),
        "row too short": CGATS.replace("60.25", "").encode(),
        "row too long": CGATS.replace("60.25", "60.25 7").encode(),
        "word for number": CGATS.replace("60.25", "sixty").encode(),
        "open quotation": CGATS.replace('beige"', "beige").encode(),
        "no spectral fields": CGATS.replace("SPECTRAL_NM_", "RGB_X").encode(),
        "no rows": CGATS.replace('1 "warm beige" 30.0 45.5 60.25\n2 "ebony" 3.0 5.5 9.0\n', "").encode(),
        "same wavelength twice": CGATS.replace("NM_550", "NM_400").encode(),
    },
}  # fmt: skip


@pytest.mark.parametrize(("family", "kind"), [(family, kind) for family, kinds in BROKEN.items() for kind in kinds])
def test_a_broken_file_gives_one_sentence_with_its_name_and_no_wait(tmp_path: Path, family: str, kind: str) -> None:
    file = tmp_path / f"measurement.{family}"
    file.write_bytes(BROKEN[family][kind])
    start = time.perf_counter()
    with pytest.raises(MakeupError) as error:
        read_spectra(file)
    assert time.perf_counter() - start < 2
    assert "measurement." in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400 + len(str(file))
    assert file.read_bytes() == BROKEN[family][kind]


@pytest.mark.parametrize("kind", ["bomb", "outside entity", "doctype alone"])
def test_a_document_type_is_refused_before_anything_is_expanded(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "measurement.xml"
    file.write_bytes(BROKEN["xml"][kind])
    with pytest.raises(MakeupError, match="declares a document type or entities"):
        read_spectra(file)


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    file = tmp_path / "huge.csv"
    with file.open("wb") as handle:
        handle.truncate(4_000_000_000)
    start = time.perf_counter()
    with pytest.raises(MakeupError, match="larger than"):
        read_spectra(file)
    assert time.perf_counter() - start < 0.5


def test_names_that_are_taken_get_a_number_and_unknown_ones_a_hint(tmp_path: Path) -> None:
    file = tmp_path / "twice.csv"
    file.write_text("nm,red,red,\n" + "\n".join(f"{nm:g},.1,.2,.3" for nm in NM))
    found = read_spectra(file)
    assert found.names[:2] == ("red", "red (2)")
    with pytest.raises(MakeupError, match="did you mean red"):
        found.find("rde")
