"""The page of hard cases says what it must, and some of its rows are made again."""

from __future__ import annotations

import mpmath as mp
import pytest

from tests import stamps
from tests.optics import hard_cases, oracle

PAGE = stamps.ROOT / "tests" / "hard_cases.md"
CASES = (
    *("K to 0", "K = 0", "S to 0", "S = 0", "both to 0", "both 0", "X to 0", "X to infinity", "X infinite"),
    *("R_inf to 0 (K >> S)", "R_inf to 1 (K << S)", "white on white skin", "white on perfect white", "black on black"),
    *(
        "denormal in float32",
        "denormal in float64",
        "8 films of makeup",
        "8 thick films",
        "8 white films",
        "8 clear films",
    ),
    *(
        "R near R_inf",
        "R near Rg",
        "both above R_inf",
        "white on white (",
        "pale (foundation)",
        "dark (lipstick, red band)",
    ),
    *("0 degrees", "45 degrees", "89.9 degrees", "opposed, grazing"),
)


def rows() -> list[list[str]]:
    """The cells of every row with a dtype."""
    lines = [line.strip("| \n").split(" | ") for line in PAGE.read_text(encoding="utf-8").splitlines()]
    return [
        [cell.strip() for cell in cells]
        for cells in lines
        if len(cells) >= 8 and cells[2].strip() in ("float64", "float32")
    ]


def test_the_page_is_not_older_than_the_code() -> None:
    assert stamps.stale(PAGE) == ""


@pytest.mark.parametrize("case", CASES)
def test_the_page_has_every_case_that_is_asked_for(case: str) -> None:
    assert f"| {case}" in PAGE.read_text(encoding="utf-8")


def test_ours_has_no_value_that_is_not_finite_and_loses_no_digits() -> None:
    found = rows()
    assert len(found) > 150
    for case, quantity, dtype, *cells in found:
        error, not_finite = cells[3], cells[4]
        assert not_finite == "0", (case, quantity)
        if case.startswith("denormal") and quantity == "R_inf":
            continue  # K and S themselves have few digits there
        if error == "none finite":
            continue
        allowed = {"float64": 1e-15, "float32": 5e-7}[dtype]
        if quantity == "BRDF":
            allowed = {"float64": 2e-13, "float32": 4e-7}[dtype]
        if case.startswith("8 "):
            allowed *= 8
        assert float(error) <= allowed, (case, quantity, dtype)


def test_least_squares_loses_no_digits_and_knows_what_is_hidden() -> None:
    text = PAGE.read_text(encoding="utf-8").split("## Inversion by least squares")[1].split("## ")[0]
    found = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in text.splitlines() if "-" in line]
    found = [cells for cells in found if len(cells) == 7 and cells[1][0].isdigit()]
    assert len(found) == 20
    for films, thickness, *counts, error, _, not_finite in found:
        for count in counts:
            right, of = count.split(" of ")
            assert right == of, (films, thickness)
        assert error == "none" or float(error) <= 5e-14, (films, thickness)
        assert not_finite == "0"


def test_the_printed_formulas_do_fail_there() -> None:
    """The page would be worthless if its yardstick were ours."""
    failed = {case for case, _, _, _, not_finite, *_ in rows() if int(not_finite) > 0}
    assert {"K = 0", "S = 0", "both 0", "X to infinity", "white on white skin", "8 thick films"} <= failed
    lost = {
        case
        for case, _, dtype, error, *_ in rows()
        if dtype == "float64" and error[0].isdigit() and float(error) > 1e-10
    }
    assert {"K to 0", "R_inf to 1 (K << S)", "white on white skin", "8 white films"} <= lost


def test_rows_made_now_agree_with_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hard_cases, "COUNT", 16)
    with mp.workdps(oracle.DIGITS):
        for row in (*hard_cases.rows_of_stacks(), *hard_cases.rows_of_highlights()):
            cells = [cell.strip() for cell in row.strip("| ").split(" | ")]
            assert cells[7] == "0"
            assert float(cells[6]) < (5e-6 if cells[2] == "float32" else 1e-12)
