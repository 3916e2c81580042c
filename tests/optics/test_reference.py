"""The model against independent physics and real measurements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from km_makeup.optics import Status, air_interface
from tests.optics import revigo, two_flux


def test_the_adding_doubling_table_holds_the_published_slab() -> None:
    """Van de Hulst 1980 by Wang, Jacques and Zheng 1995: albedo .9, b = 2, g = .75: R = .09739, T = .66096."""
    table = two_flux.rows()
    one = table[table.g == 0.75]
    assert (one.albedo[0], one.optical_thickness[0]) == (0.9, 2.0)
    assert one.UR1[0] == pytest.approx(0.09739, abs=1e-5)
    assert one.UT1[0] == pytest.approx(0.66096, abs=1e-5)
    assert table.quadrature_error.max() < 2e-5
    assert np.all(table.URU + table.UTU <= 1)


def test_kubelka_munk_is_as_far_from_radiative_transfer_as_is_written() -> None:
    """OPTICS.md: rms .011-.015 in R for diffuse light, several times that for light along the normal."""
    table = two_flux.rows()
    errors = two_flux.errors(table)
    assert 0.008 < two_flux.rms(errors["R diffuse"]) < 0.02
    assert 0.03 < two_flux.rms(errors["R normal"]) < 0.08
    assert two_flux.rms(errors["T diffuse"]) < 0.05
    assert two_flux.rms(errors["R diffuse"]) < two_flux.rms(errors["R normal"]) / 2


@pytest.fixture(scope="module")
def paints(shared_data: Path) -> list[revigo.Paint]:
    found = revigo.load(shared_data / "spectra" / "revigo_oilpaint_black_white")
    assert len(found) == 84
    return found


@pytest.mark.parametrize("interface", [None, air_interface(revigo.LINSEED)])
def test_all_real_paints_invert_to_finite_positive_numbers_and_a_status(paints: list, interface) -> None:
    ks = revigo.inverted(paints, interface)
    assert ks.K.shape == ks.status.shape == (84, 31)
    for values in (ks.K, ks.S, ks.K_error, ks.S_error, ks.K_condition, ks.S_condition):
        assert np.all(np.isfinite(values))
        assert np.all(values >= 0)
    by_name = {paint.name: index for index, paint in enumerate(paints)}
    assert np.mean(ks.status[by_name["17A"]] == Status.OK) == 1  # calcium carbonate: a clear glaze
    assert np.mean(ks.status[by_name["06A"]] == Status.OPAQUE) > 0.9  # vermilion hides
    darker = np.array([np.any(p.over_white < p.over_black - 0.01) for p in paints])
    crossed = np.array([np.any(p.over_white < p.over_black - 3 * np.sqrt(2) * revigo.NOISE) for p in paints])
    assert np.all(np.any(ks.status[crossed] >= Status.INCONSISTENT, axis=1))
    assert np.count_nonzero(darker) <= np.count_nonzero(crossed)


def test_mixtures_of_real_paints_are_predicted_better_by_k_and_s_than_by_reflectances(paints: list) -> None:
    errors = {name: e.mean() for name, e in revigo.mixing_errors(paints).items()}
    linear = errors.pop("linear mixing of reflectances")
    bare = min(e for name, e in errors.items() if "no interface" in name)
    saunderson = min(e for name, e in errors.items() if "Saunderson" in name)
    assert saunderson < 0.75 * bare
    assert bare < 0.75 * linear
    assert saunderson < 12
