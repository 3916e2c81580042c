"""Broken files of every kind for every reader, made from one good text each.

`corpus` gives, by family, the bytes of each kind. What holds for all of them stands in test_broken_files.py.
"""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np

from km_makeup.products import Library
from km_makeup.products.files import product_text
from km_makeup.products.pigment import pigment_text, shipped_pigments

NM = ["400", "500", "600", "700"]
VALUES = ["0.1", "0.2", "0.3", "0.4"]

BOMB = (
    '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "'
    + "b" * 1000
    + '">'
    + "".join(f'<!ENTITY {n} "{("&" + p + ";") * 10}">' for p, n in zip("acdefgh", "cdefghi", strict=True))
    + "]>"
)

Build = Callable[[list[str], list[str]], str]


def csv(nm: list[str], values: list[str]) -> str:
    return "nm,R\n" + "".join(f"{a},{b}\n" for a, b in zip(nm, values, strict=False))


def semicolons(nm: list[str], values: list[str]) -> str:
    return "nm;rouge;ebony\n" + "".join(f"{a};{b};0,2\n" for a, b in zip(nm, values, strict=False)).replace(".", ",")


def across(nm: list[str], values: list[str]) -> str:
    return "\t".join(["name", *nm]) + "\n" + "\t".join(["rouge", *values]) + "\n"


def cgats(nm: list[str], values: list[str]) -> str:
    fields = " ".join(f"SPECTRAL_NM_{one}" for one in nm)
    return (
        f"CGATS.17\nNUMBER_OF_FIELDS {len(nm) + 2}\nBEGIN_DATA_FORMAT\nSAMPLE_ID SAMPLE_NAME {fields}\nEND_DATA_FORMAT\n"
        f'NUMBER_OF_SETS 1\nBEGIN_DATA\n1 "warm beige" {" ".join(values)}\nEND_DATA\n'
    )


def xrite(nm: list[str], values: list[str]) -> str:
    fields = "\t".join(f"nm{one}" for one in nm)
    return (
        f'LGOROWLENGTH 1\nCREATED "11/24/2026"\nBEGIN_DATA_FORMAT\nSampleID\tSAMPLE_NAME\t{fields}\nEND_DATA_FORMAT\n'
        f"BEGIN_DATA\n1\tA1\t" + "\t".join(values) + "\nEND_DATA\n"
    )


def spdx(nm: list[str], values: list[str]) -> str:
    points = "".join(f'<SpectralData wavelength="{a}">{b}</SpectralData>' for a, b in zip(nm, values, strict=False))
    return (
        '<?xml version="1.0"?><IESTM2714 xmlns="http://www.ies.org/iestm2714" version="1.0"><Header><Description>Rouge</Description>'
        f"</Header><SpectralDistribution><SpectralQuantity>reflectance</SpectralQuantity>{points}</SpectralDistribution></IESTM2714>"
    )


def cxf(nm: list[str], values: list[str]) -> str:
    try:
        start, step = nm[0], f"{float(nm[1]) - float(nm[0]):g}"
    except ValueError:
        start, step = nm[0], nm[1]
    return (
        '<?xml version="1.0"?><cc:CxF xmlns:cc="http://colorexchangeformat.com/CxF3-core"><cc:Resources><cc:ObjectCollection>'
        f'<cc:Object Name="Rouge"><cc:ColorValues><cc:ReflectanceSpectrum StartWL="{start}" Increment="{step}">{" ".join(values)}'
        "</cc:ReflectanceSpectrum></cc:ColorValues></cc:Object></cc:ObjectCollection></cc:Resources></cc:CxF>"
    )


def refractive_index(nm: list[str], values: list[str]) -> str:
    rows = "".join(f"        {a} {b} 0\n" for a, b in zip([*nm], values, strict=False))
    return "REFERENCES: a test\nDATA:\n  - type: tabulated nk\n    data: |\n" + rows


TEXTS: dict[str, Build] = {
    "csv": csv, "semicolons": semicolons, "across": across, "cgats": cgats, "xrite": xrite, "spdx": spdx, "cxf": cxf,
    "refractive index": refractive_index,
}  # fmt: skip


def corpus() -> dict[str, dict[str, bytes]]:
    """Bytes of each broken kind, by family."""
    found = {family: any_text(build(NM, VALUES)) | numbers(build, family) for family, build in TEXTS.items()}
    for family in ("spdx", "cxf"):
        found[family] |= markup(TEXTS[family](NM, VALUES))
    found["cgats"] |= tables(cgats(NM, VALUES))
    found["xrite"] |= tables(xrite(NM, VALUES))
    product, pigment = Library.shipped().products[0], shipped_pigments()["carmine"]
    found["product"] = any_text(product_text(product)) | fields(json.loads(product_text(product)))
    found["pigment"] = any_text(pigment_text(pigment)) | fields(json.loads(pigment_text(pigment)))
    return found


def any_text(good: str) -> dict[str, bytes]:
    """What can happen to any text file."""
    data = good.encode()
    return {
        "empty": b"",
        "blank": b" \n\t\n \n",
        "binary": bytes(range(256)) * 4,
        "picture": b"\x89PNG\r\n\x1a\n" + bytes(range(200)),
        "archive": b"PK\x03\x04\x14\x00\x00\x00" + bytes(range(256)),
        "web page": b"<!DOCTYPE html><html><body>404 Not Found</body></html>",
        "pointer of git": b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n",
        "truncated early": data[: len(data) // 3],
        "zeros inside": data[:40] + b"\x00" * 20 + data[40:],
        "control letters": data[:40] + b"\x01\x02\x1b[31m" + data[40:],
        "UTF-16 without its mark": good.encode("utf-16-le"),
        "UTF-32": good.encode("utf-32"),
        "EBCDIC": good.encode("cp500", "replace"),
        "endless line": b"1" * 500_000 + b"\n",
        "lines without end": b"1,2\n" * 100_001,
        "words": b"once upon a time\nthere was a paint\n",
        "huge": b" " * 6_100_000,
    }


def numbers(build: Build, family: str) -> dict[str, bytes]:
    """What can happen to numbers."""

    def value(text: str) -> bytes:
        return build(NM, [*VALUES[:2], text, VALUES[3]]).encode()

    def wavelength(*nm: str) -> bytes:
        return build(list(nm), VALUES).encode()

    comma = "0;3" if family == "semicolons" else "0,3"
    kinds = {
        "nan": value("nan"),
        "infinity": value("inf"),
        "overflow": value("1e999"),
        "word": value("high"),
        "hexadecimal": value("0x10"),
        "underscore": value("1_0"),
        "other digits": value("\u0663"),
        "negative": value("-0.5"),
        "hole": value(""),
        "one more": value("0.3 0.35" if family not in ("csv", "semicolons", "across") else "0.3;0.35,1\t2"),
        "decimal comma": value(comma),
        "percent sign": value("30%"),
        "wavelength of a word": wavelength("400", "green", "600", "700"),
        "wavelengths of radio": wavelength("4e9", "5e9", "6e9", "7e9"),
        "wavelengths of nothing": wavelength("0", "0", "0", "0"),
        "negative wavelengths": wavelength("-400", "-500", "-600", "-700"),
        "one wavelength twice": wavelength("400", "400", "600", "700"),
        "one wavelength": build(NM[:2], VALUES[:1]).encode(),
    }
    if family == "across":  # between tabs a decimal comma is understood
        del kinds["decimal comma"]
    if family in ("cgats", "xrite"):  # a field of another name is no spectral field
        del kinds["wavelength of a word"]
    if family == "cxf":  # the format counts from its first wavelength: any number of values is a spectrum
        del kinds["hole"], kinds["one more"]
    if family == "refractive index":  # published tables repeat wavelengths; the first rows are in um
        del kinds["one wavelength twice"]
    return kinds


def markup(good: str) -> dict[str, bytes]:
    """What can happen to XML."""
    root = good.partition("?>")[2]
    return {
        "bomb": (BOMB + root.replace("0.3", "&i;")).encode(),
        "quadratic bomb": ('<!DOCTYPE x [<!ENTITY a "' + "1" * 50_000 + '">]><x>' + "&a;" * 10_000 + "</x>").encode(),
        "outside entity": (
            '<!DOCTYPE x [<!ENTITY f SYSTEM "file:///etc/passwd">]>' + root.replace("0.3", "&f;")
        ).encode(),
        "entity of a parameter": ('<!DOCTYPE x [<!ENTITY % p SYSTEM "http://example.org/x.dtd"> %p;]>' + root).encode(),
        "outside type": ('<!DOCTYPE x SYSTEM "http://example.org/x.dtd">' + root).encode(),
        "undefined entity": root.replace("0.3", "&nbsp;").encode(),
        "not closed": good[:-10].encode(),
        "wrong end": good.replace("</", "</x", 1).encode(),
        "two roots": (root + root).encode(),
        "another format": b"<svg xmlns='http://www.w3.org/2000/svg'/>",
        "nested deep": b"<a>" * 200_000,
        "nested deep and closed": b"<a>" * 20_000 + b"</a>" * 20_000,
        "words among the numbers": root.replace("0.3", "three").encode(),
        "no numbers": root.replace("0.1", "").replace("0.2", "").replace("0.3", "").replace("0.4", "").encode(),
    }


def tables(good: str) -> dict[str, bytes]:
    """What can happen to a CGATS table."""
    row = next(line for line in good.splitlines() if line.startswith("1"))
    return {
        "no data": good.split("BEGIN_DATA\n")[0].encode(),
        "cut off": good.split("END_DATA\n")[0].encode(),
        "no end of its format": good.replace("END_DATA_FORMAT\n", "").encode(),
        "row too short": good.replace(row, row.rsplit(None, 1)[0]).encode(),
        "row too long": good.replace(row, row + " 0.7").encode(),
        "open quotation": good.replace(row, row.replace("1", '1 "', 1)).encode(),
        "no rows": good.replace(row + "\n", "").encode(),
        "no spectral fields": good.replace("NM_", "RGB_").replace("nm", "lab").encode(),
    }


def fields(good: dict) -> dict[str, bytes]:
    """What can happen to the fields of a JSON file."""

    def changed(**values: object) -> bytes:
        return json.dumps({**good, **values}).encode()

    K = list(np.asarray(good["K"], dtype=float))
    return {
        "no K": json.dumps({key: value for key, value in good.items() if key != "K"}).encode(),
        "no id": json.dumps({key: value for key, value in good.items() if key != "id"}).encode(),
        "no provenance": json.dumps({key: value for key, value in good.items() if key != "provenance"}).encode(),
        "newer schema": changed(schema=99),
        "schema of words": changed(schema="one"),
        "nan": json.dumps({**good, "K": [float("nan"), *K[1:]]}).encode(),
        "infinity": json.dumps({**good, "K": [float("inf"), *K[1:]]}).encode(),
        "overflow": changed(K=[1e308, *K[1:]]).replace(b"1e+308", b"1e999"),
        "negative": changed(K=[-1.0, *K[1:]]),
        "text among numbers": changed(K=["1.0", *K[1:]]),
        "true among numbers": changed(K=[True, *K[1:]]),
        "one less": changed(K=K[1:]),
        "one more": changed(K=[*K, 1.0]),
        "another unit": changed(spectrum={"unit": "1/cm", "start_nm": 380, "step_nm": 5}),
        "grid backwards": changed(spectrum={"unit": good["spectrum"]["unit"], "start_nm": 780, "step_nm": -5}),
        "path in its id": changed(id="../../etc/passwd"),
        "path of Windows in its id": changed(id="..\\..\\boot"),
        "zero in its id": changed(id="a\u0000b"),
        "device as id": changed(id="con"),
        "number as id": changed(id=7),
        "source of nothing": changed(provenance={"status": "computed", "source": " "}),
        "provenance of words": changed(provenance="mine"),
        "list": b"[1, 2]",
        "comma at the end": json.dumps(good).encode()[:-1] + b",}",
        "nested deep": b'{"schema": ' + b"[" * 100_000,
        "digits without end": b'{"schema": 1, "K": [' + b"9" * 100_000 + b"]}",
        "cut in a number": json.dumps(good).encode()[:-30],
    }
