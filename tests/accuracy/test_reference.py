"""The reference of the colour ladders against published values, against physics by another way, and free of km_makeup."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

from tests.accuracy import reference
from tests.stamps import ROOT

SHARMA = """
50 2.6772 -79.7751 50 0 -82.7485 2.0425
50 3.1571 -77.2803 50 0 -82.7485 2.8615
50 2.8361 -74.0200 50 0 -82.7485 3.4412
50 -1.3802 -84.2814 50 0 -82.7485 1.0000
50 -1.1848 -84.8006 50 0 -82.7485 1.0000
50 -0.9009 -85.5211 50 0 -82.7485 1.0000
50 0 0 50 -1 2 2.3669
50 -1 2 50 0 0 2.3669
50 2.4900 -0.0010 50 -2.4900 0.0009 7.1792
50 2.4900 -0.0010 50 -2.4900 0.0010 7.1792
50 2.4900 -0.0010 50 -2.4900 0.0011 7.2195
50 2.4900 -0.0010 50 -2.4900 0.0012 7.2195
50 -0.0010 2.4900 50 0.0009 -2.4900 4.8045
50 -0.0010 2.4900 50 0.0010 -2.4900 4.8045
50 -0.0010 2.4900 50 0.0011 -2.4900 4.7461
50 2.5 0 50 0 -2.5 4.3065
50 2.5 0 73 25 -18 27.1492
50 2.5 0 61 -5 29 22.8977
50 2.5 0 56 -27 -3 31.9030
50 2.5 0 58 24 15 19.4535
50 2.5 0 50 3.1736 0.5854 1.0000
50 2.5 0 50 3.2972 0 1.0000
50 2.5 0 50 1.8634 0.5757 1.0000
50 2.5 0 50 3.2592 0.3350 1.0000
60.2574 -34.0099 36.2677 60.4626 -34.1751 39.4387 1.2644
63.0109 -31.0961 -5.8663 62.8187 -29.7946 -4.0864 1.2630
61.2901 3.7196 -5.3901 61.4292 2.2480 -4.9620 1.8731
35.0831 -44.1164 3.7933 35.0232 -40.0716 1.5901 1.8645
22.7233 20.0904 -46.6940 23.0331 14.9730 -42.5619 2.0373
36.4612 47.8580 18.3852 36.2715 50.5065 21.2231 1.4146
90.8027 -2.0831 1.4410 91.1528 -1.6435 0.0447 1.4441
90.9257 -0.5406 -0.9208 88.6381 -0.8985 -0.7239 1.5381
6.7747 -0.2908 -2.4247 5.8714 -0.0985 -2.2286 0.6377
2.0776 0.0795 -1.1350 0.9033 -0.0636 -0.5514 0.9082
"""
"""Sharma, Wu, Dalal 2005, Table 1: L a b, L a b, difference."""


@pytest.mark.parametrize("row", SHARMA.split("\n")[1:-1])
def test_published_pairs_have_their_published_difference(row: str) -> None:
    *values, published = row.split()
    one, other = [mp.mpf(v) for v in values[:3]], [mp.mpf(v) for v in values[3:]]
    assert float(reference.ciede2000(one, other)) == pytest.approx(float(published), abs=5.1e-5)
    assert reference.ciede2000(other, one) == pytest.approx(reference.ciede2000(one, other), rel=1e-30)


def test_it_imports_nothing_of_the_extension() -> None:
    code = (
        "import sys, tests.accuracy.reference as r; r.light('D65'); print([m for m in sys.modules if 'km_makeup' in m])"
    )
    ran = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def test_published_films_over_backings_come_out(shared_data: Path) -> None:
    cases = json.loads((shared_data / "reference" / "painty_km_layer.json").read_text())
    for case in cases["cases"]:
        K, S, X, skin = (mp.mpf(str(v)) for v in (case["K"], case["S"], case.get("d", cases["d"]), case["R0"]))
        layer = reference.Layer([K] * 401, [S] * 401, X)
        seen = reference.made_up([skin] + [mp.mpf(0)] * 400, [layer], n=None)
        assert float(seen[0]) == pytest.approx(case["R"], abs=cases["tolerance"])


def test_published_constants_of_surfaces_come_out(shared_data: Path) -> None:
    for row in json.loads((shared_data / "reference" / "fresnel_diffuse.json").read_text())["rows"]:
        k1, k2 = reference.surface(str(row["n"]))
        assert float(k1) == pytest.approx(row["external_normal"], rel=1e-12)
        assert float(k2) == pytest.approx(row["internal_diffuse"], rel=1e-9)


def two_fluxes_through(films: list[tuple], skin: mp.mpf, k1: mp.mpf, k2: mp.mpf) -> mp.mpf:
    """What leaves through the surface, films given top to bottom: dI/dx = -(K + S) I + S J, dJ/dx = (K + S) J - S I.

    The matrix exponential carries (I, J) down to the skin; there J = skin I, at the top I = (1 - k1) + k2 J.
    """
    through = mp.eye(2)
    for K, S, X in films:
        through = mp.expm(mp.matrix([[-(K + S), S], [-S, K + S]]) * X) * through
    # J_bottom = skin I_bottom: (c - skin a) I + (d - skin b) J = 0 at the top
    a, b, c, d = through[0, 0], through[0, 1], through[1, 0], through[1, 1]
    reflected = -(c - skin * a) / (d - skin * b)
    return (1 - k2) * (1 - k1) * reflected / (1 - k2 * reflected)


@mp.workdps(reference.DIGITS)
def test_stacks_under_air_solve_the_two_flux_equations() -> None:
    """Foundation over lipstick over skin, in both orders: neither adding nor the hyperbolic form is used by the other way."""
    lipstick, foundation = (mp.mpf(60), mp.mpf(3), mp.mpf("0.01")), (mp.mpf("0.5"), mp.mpf(30), mp.mpf("0.02"))
    k1, k2 = reference.surface("1.45")
    skin = mp.mpf("0.4")
    for bottom, top in ((lipstick, foundation), (foundation, lipstick)):
        layers = [reference.Layer([K] * 401, [S] * 401, X) for K, S, X in (bottom, top)]
        seen = reference.made_up([reference_apparent(skin, k1, k2)] + [mp.mpf("0.1")] * 400, layers)[0]
        assert abs(seen - two_fluxes_through([top, bottom], skin, k1, k2)) < mp.mpf(10) ** -30


def reference_apparent(inside: mp.mpf, k1: mp.mpf, k2: mp.mpf) -> mp.mpf:
    """Saunderson 1942, without the leading k1."""
    return (1 - k1) * (1 - k2) * inside / (1 - k2 * inside)


@mp.workdps(reference.DIGITS)
def test_kubelka_1954_holds_for_films_that_differ() -> None:
    """T is the same from both sides, R is not (Eq 11-12); a film split 20/80 is the whole; over black and white, Eq 9."""
    dark, pale = (reference.film(*map(mp.mpf, v)) for v in ((60, 3, "0.02"), ("0.5", 30, "0.02")))
    over, under, down, up = reference.lay((pale[0], pale[0], pale[1], pale[1]), (dark[0], dark[0], dark[1], dark[1]))
    assert abs(down - up) < mp.mpf(10) ** -30
    assert over > 5 * under
    whole = reference.film(mp.mpf(5), mp.mpf(20), mp.mpf("0.1"))
    parts = [reference.film(mp.mpf(5), mp.mpf(20), mp.mpf(X)) for X in ("0.02", "0.08")]
    joined = reference.lay(*((R, R, T, T) for R, T in parts))
    assert max(abs(joined[0] - whole[0]), abs(joined[1] - whole[0]), abs(joined[2] - whole[1])) < mp.mpf(10) ** -30


def test_no_film_leaves_the_skin_as_it_is_and_a_share_of_powder_lies_between() -> None:
    skin = [mp.mpf(nm) / 2000 for nm in reference.WAVELENGTHS]
    nothing = reference.Layer([mp.mpf(9)] * 401, [mp.mpf(7)] * 401, mp.mpf(0))
    for n in ("1.45", None):
        for layers in ([], [nothing], [nothing, nothing]):
            assert (
                max(abs(a - b) for a, b in zip(reference.made_up(skin, layers, n), skin, strict=True))
                < mp.mpf(10) ** -30
            )
    bare, half, full = (
        reference.made_up(skin, [reference.Layer([mp.mpf(90)] * 401, [mp.mpf(7)] * 401, mp.mpf("0.05"), mp.mpf(share))])
        for share in ("0", "0.5", "1")
    )
    assert all(a > b > c for a, b, c in zip(bare, half, full, strict=True))


@pytest.mark.parametrize(
    ("name", "X", "Z"), [("D65", 0.95047, 1.08883), ("A", 1.09850, 0.35585), ("E", 1.0, 1.0), ("D50", 0.96422, 0.82521)]
)
def test_lights_have_their_published_white_and_a_perfect_white_is_one(name: str, X: float, Z: float) -> None:
    """ASTM E308 / CIE 15 tristimulus values; they sum 360-830 nm at 1 or 5 nm."""
    white = [mp.mpf(1)] * 401
    assert [float(v) for v in reference.to_xyz(white, name)] == pytest.approx([X, 1, Z], abs=3e-4)
    assert max(abs(c - 1) for c in reference.to_rgb(white, name)) < mp.mpf(10) ** -30
    assert max(abs(v) for v in reference.lab([mp.mpf(1)] * 3)[1:]) < mp.mpf(10) ** -30
    assert reference.lab([mp.mpf(1)] * 3)[0] == pytest.approx(100, abs=1e-12)


def test_grey_is_grey_and_spectra_must_reach_both_ends() -> None:
    grey = reference.to_rgb(reference.at_every_nanometre([0.25] * 81), "A")
    assert max(abs(c - mp.mpf("0.25")) for c in grey) < mp.mpf(10) ** -30
    ramp = reference.at_every_nanometre([float(v) for v in range(81)])
    assert [float(v) for v in ramp[:6]] == pytest.approx([0, 0.2, 0.4, 0.6, 0.8, 1.0])
    with pytest.raises(ValueError, match="end before"):
        reference.at_every_nanometre([0.1] * 80)


@pytest.mark.parametrize(("light", "cost"), [("D65", 0.039), ("A", 0.053), ("FL11", 0.155)])
def test_the_extension_has_the_same_spectrum_and_5_nm_cost_what_is_written(light: str, cost: float) -> None:
    """Two implementations that share nothing but tables: every fifth nanometre is equal; the sum over 5 nm is the rest."""
    from km_makeup.optics import air_interface, apparent, film, internal, over, stack
    from km_makeup.spectra import to_rgb

    shipped = ROOT / "km_makeup" / "products" / "shipped"
    films = [json.loads((shipped / f"{name}.json").read_text()) for name in ("foundation-light", "lipstick-coral")]
    skin = [0.1 + 0.5 / (1 + np.exp(-(nm - 560) / 40)) for nm in range(380, 781, 5)]
    layers = [
        reference.Layer(reference.at_every_nanometre(f["K"]), reference.at_every_nanometre(f["S"]), mp.mpf(x) / 1000)
        for f, x in zip(films, (10, 5), strict=True)
    ]
    exact = reference.made_up(reference.at_every_nanometre([float(v) for v in skin]), layers)
    air = air_interface(1.45)
    whole = stack([film(np.array(f["K"]), np.array(f["S"]), x / 1000) for f, x in zip(films, (10, 5), strict=True)])
    seen = apparent(over(whole.R_top, whole.T * whole.T_up, whole.R_bottom, internal(np.array(skin), air)), air)
    np.testing.assert_allclose(seen, [float(v) for v in exact[::5]], rtol=2e-14)
    ours = [mp.mpf(float(c)) for c in to_rgb(seen, light)]
    assert reference.difference(ours, reference.to_rgb(exact, light)) == pytest.approx(cost, abs=0.005)
