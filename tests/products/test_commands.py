"""The commands of the product library and the pictures of swatches."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from km_makeup.optics import film_over
from km_makeup.products import Library, read_product
from km_makeup.products.commands import hex_colour, main
from km_makeup.products.swatches import srgb8, swatch, swatch_image, swatch_sheet, write_png
from km_makeup.spectra import delta_e


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    code = main(list(arguments))
    out, err = capsys.readouterr()
    return code, out, err


def test_list_names_every_product_and_filters_by_kind(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "list", "--json")
    assert code == 0
    assert {one["id"] for one in json.loads(out)} == {one.id for one in Library.shipped().products}
    assert len(run(capsys, "list", "--kind", "lipstick")[1].splitlines()) == 7


def test_a_kind_that_does_not_exist_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, "list", "--kind", "nonsense")
    assert code == 2 and not out
    assert "'nonsense'; use" in err and "lipstick" in err


def test_show_tells_source_recipe_and_colours(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, "show", "lipstick-coral")
    assert all(words in out for words in ("derived from measured paint", "orange-lake", "on deep", "20 um"))


def test_mixed_products_are_written_and_can_be_read(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "lipstick-mine.json"
    parts = ["--part", "carmine=1.2%", "--part", "titanium-dioxide=0.003"]
    code, _, _ = run(
        capsys, "mix", "--id", "lipstick-mine", "--name", "Mine", "--kind", "lipstick", *parts, "--out", str(file)
    )
    assert code == 0
    assert dict(read_product(file).provenance.recipe) == {"carmine": pytest.approx(0.012), "titanium-dioxide": 0.003}


def test_a_match_says_how_near_it_comes_and_by_light(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(
        capsys, "match", "#8c4a3e", "--pigments", "iron-oxide-red,iron-oxide-yellow,magenta-lake,carbon-black", "--json"
    )
    found = json.loads(out)
    assert found["reached"]
    assert set(found["delta_e"]) == {"D65", "A", "LED-B3"}
    _, out, _ = run(capsys, "match", "#10e010", "--pigments", "iron-oxide-red")
    assert "cannot be reached" in out


def test_a_shade_is_found_for_a_hex_colour(capsys: pytest.CaptureFixture[str]) -> None:
    _, out, _ = run(capsys, "shade", "#8d5f43", "--json")
    found = json.loads(out)
    assert len(found["shades"]) == 3
    assert found["shades"][0]["product"] == "foundation-tan"


def test_a_measurement_is_imported_from_its_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, shared_data: Path
) -> None:
    paints = shared_data / "spectra" / "revigo_oilpaint_black_white" / "revigo-aggregated-palette-spectral-data.txt"
    out_file = tmp_path / "white.json"
    films = ["--film", "16A_ob:16A_b:60um", "--film", "16A_ow:16A_w:60um"]
    identity = [
        "--id",
        "white",
        "--name",
        "White",
        "--kind",
        "foundation",
        "--source",
        "REVIGO paint 16A",
        "--out",
        str(out_file),
    ]
    code, _, err = run(capsys, "import", str(paints), *films, *identity)
    assert code == 0
    assert "K is known to" in err
    product = read_product(out_file)
    assert product.provenance.status == "measured"
    assert product.K_error is not None
    assert product.S.max() == pytest.approx(0.405 / 0.06, rel=0.05)


def test_radiance_and_reflectance_of_one_measurement_give_one_product(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    nm = np.arange(380, 781, 5)
    product = Library.shipped().find("foundation-medium")
    backings = {"black": np.full(81, 0.05), "white": np.full(81, 0.8)}
    seen = {f"on {name}": film_over(product.K, product.S, 0.06, one) for name, one in backings.items()} | backings
    lamp, dark = np.linspace(40, 90, 81), 2.5
    radiance = {name: R * lamp + dark for name, R in seen.items()} | {
        "lamp": 0.99 * lamp + dark,
        "dark": 0 * lamp + dark,
    }
    made = []
    for kind, columns, extra in (
        ("reflectance", seen, []),
        ("radiance", radiance, ["--light", "lamp", "--dark", "dark"]),
    ):
        file = tmp_path / f"{kind}.csv"
        rows = zip(nm, *columns.values(), strict=True)
        file.write_text("\n".join(",".join(map(str, row)) for row in [("nm", *columns), *rows]))
        out = tmp_path / f"{kind}.json"
        films = ["--film", "on black:black:60um", "--film", "on white:white:60um", "--apparent", "--noise", "1e-6"]
        names = [
            "--id",
            "x",
            "--name",
            "x",
            "--kind",
            "foundation",
            "--source",
            "simulated for a test",
            "--out",
            str(out),
        ]
        assert run(capsys, "import", str(file), *films, *names, *extra)[0] == 0
        made.append(read_product(out))
    assert np.allclose(made[0].K, product.K, rtol=1e-3, atol=1e-3)
    assert np.allclose(made[1].K, made[0].K, rtol=1e-4, atol=1e-4)
    assert np.allclose(made[1].S, product.S, rtol=1e-3)
    assert made[1].interface == "apparent"


def test_check_finds_nothing_in_the_shipped_library_and_something_in_a_broken_one(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert run(capsys, "check")[0] == 0
    (tmp_path / "x.json").write_text("{")
    code, out, _ = run(capsys, "check", "--folder", str(tmp_path))
    assert code == 3
    assert "x.json" in out


@pytest.mark.parametrize(
    "arguments",
    [
        ["show", "lipstik-coral"],
        ["match", "red"],
        ["match", "#12345"],
        ["match", "#a1343c", "--pigments", "carmin"],
        ["match", "#a1343c", "--thickness", "thin"],
        ["mix", "--id", "x", "--name", "x", "--kind", "x", "--part", "carmine", "--out", "x.json"],
        ["mix", "--id", "X", "--name", "x", "--kind", "x", "--part", "carmine=1%", "--out", "x.json"],
        ["mix", "--id", "x", "--name", "x", "--kind", "x", "--part", "carmine=1%", "--out", "x.txt"],
        ["mix", "--id", "x", "--name", "x", "--kind", "x", "--part", "carmine=1%", "--out", "/nowhere/x.json"],
        ["shade", "#c69076", "--kind", "nail"],
        [
            "import",
            "/nowhere.csv",
            "--film",
            "a:b:1um",
            "--id",
            "x",
            "--name",
            "x",
            "--kind",
            "x",
            "--source",
            "x",
            "--out",
            "x.json",
        ],
        ["swatch", "nothing", "--out", "x.png"],
        ["swatch", "--out", "/nowhere/x.png"],
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, *arguments)
    assert code == 2
    assert out == ""
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_hex_colours_are_decoded_as_srgb() -> None:
    assert np.allclose(hex_colour("#ffffff"), 1)
    assert np.allclose(hex_colour("808080"), 0.21586, atol=1e-5)
    assert np.array_equal(srgb8(hex_colour("#12aBef")), [0x12, 0xAB, 0xEF])
    assert np.array_equal(hex_colour("#fa0"), hex_colour("#ffaa00"))


def test_a_swatch_goes_from_the_backing_to_the_opaque_film() -> None:
    for product in Library.shipped().products:
        one = swatch(product)
        for name, colours in one.drawdowns.items():
            distances = delta_e(colours, np.broadcast_to(one.backings[name], colours.shape))
            if distances[-1] > 3 and product.kind not in ("eyeliner", "eyeshadow", "lipstick"):
                assert distances[0] < distances[1] < distances[2], (product.id, name)


def test_a_png_holds_the_picture(tmp_path: Path) -> None:
    colour_io = pytest.importorskip("PIL.Image")
    image = swatch_sheet(Library.shipped().products[:5], size=40, across=3)
    write_png(tmp_path / "a.png", image)
    assert np.array_equal(np.asarray(colour_io.open(tmp_path / "a.png")), image)
    assert swatch_image(Library.shipped().products[0], 32).shape == (32, 32, 3)


def test_a_pale_nude_over_skin_is_matched_with_as_much_white_as_it_takes(capsys: pytest.CaptureFixture) -> None:
    assert main(["match", "#e8b7a0", "--thickness", "15um", "--skin", "medium", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["reached"]
    assert found["fractions"]["titanium-dioxide"] > 0.01
    assert set(found["delta_e"]) == {"D65", "A", "LED-B3"}
