"""Measuring, reporting and the page, on a ladder whose figures are known."""

from __future__ import annotations

import csv
import io
import json
import re
import time
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from km_makeup import cli
from km_makeup.accuracy import commands, ladder, page, report
from km_makeup.accuracy.ladder import Ladder, Measured, Rung, Times, marked, measure
from km_makeup.accuracy.pictures import Spread

SVG = "{http://www.w3.org/2000/svg}"


def rung(name: str, seconds: float, error: float, log: list | None = None, setting: str = "") -> Rung:
    def run() -> None:
        if log is not None:
            log.append(name)
        time.sleep(seconds)

    return Rung(name, f"{name} <it>", lambda: run, lambda: Spread(error, 2 * error, 3 * error), setting)


def small(log: list | None = None) -> Ladder:
    rungs = [
        rung("coarse", 0.002, 1.0, log), rung("slow", 0.03, 0.6, log),
        rung("middle", 0.012, 0.2, log, "path LIVE"), rung("fine", 0.025, 0.0, log),
    ]  # fmt: skip
    return Ladder("small", "A small ladder", "CIEDE2000", "one sleep", "the truth", rungs)


def finished(steps):
    seen = []
    while True:
        try:
            seen.append(next(steps))
        except StopIteration as end:
            return end.value, seen


@pytest.fixture(scope="module")
def result():
    return finished(measure(small(), runs=5))[0]


def test_runs_take_turns_and_progress_reaches_the_total():
    log: list[str] = []
    _, seen = finished(measure(small(log), runs=3))
    names = ["coarse", "slow", "middle", "fine"]
    assert log == [n for name in names for n in (name, name)] + names * 3  # first and memory, then rounds
    done, total = [s[0] for s in seen], {s[1] for s in seen}
    assert done == sorted(done) and total == {len(names) * 6} and done[-1] == len(names) * 6 - 1


def test_times_are_those_of_the_runs_and_the_front_is_marked(result):
    later = {r.name: r.times.later for r in result.rungs}
    assert 0.002 <= later["coarse"] < later["middle"] < later["fine"] < later["slow"]
    assert {r.name: r.on_front for r in result.rungs} == {"coarse": True, "slow": False, "middle": True, "fine": True}


def test_equal_rungs_are_both_on_the_front():
    one = Measured("a", "", "", Spread(1, 1, 1), Times(0, 1, 1, 0, 0))
    assert all(r.on_front for r in marked([one, one]))


def test_memory_is_what_a_run_allocates():
    hungry = Rung("hungry", "", lambda: lambda: np.ones(2_000_000), lambda: Spread(0, 0, 0))
    found, _ = finished(measure(Ladder("m", "M", "u", "r", "t", [hungry]), runs=1))
    assert found.rungs[0].times.memory_mb == pytest.approx(16, abs=0.5)


def test_csv_json_and_table_hold_every_rung(result):
    rows = list(csv.DictReader(io.StringIO(report.as_csv([result]))))
    assert [r["rung"] for r in rows] == ["coarse", "slow", "middle", "fine"]
    assert float(rows[2]["error_p99"]) == 0.4 and float(rows[0]["ratio"]) == 1
    content = json.loads(report.as_json([result], report.machine()))
    assert content["rungs"][1]["error_mean"] == 0.6 and content["ladders"]["small"]["unit"] == "CIEDE2000"
    assert {"date", "processor", "cores", "numpy"} <= content["made"].keys()
    text = report.table(result)
    assert "* middle" in text and "  slow" in text and "against the truth" in text


def test_the_page_says_the_answer_and_needs_nothing_from_elsewhere(result):
    text = page.page([result], report.machine(), current=["path LIVE"])
    assert "99 % of the errors below 0.5 CIEDE2000 is middle" in text
    assert "the most accurate, fine" in text
    assert re.search(r'<tr class="front current"><td>middle', text)
    outside = [u for u in re.findall(r"(?:https?:)?//[\w.]+", text) if "www.w3.org" not in u]
    assert not outside and "<script" not in text and "<link" not in text and "<it>" not in text


def test_hovering_names_every_rung_at_its_point(result):
    svg = ET.fromstring(page.plot(result, set()))
    titles = [c.find(f"{SVG}title").text for c in svg.iter(f"{SVG}circle") if c.get("class") == "point"]
    assert [t.split(":")[0] for t in titles] == ["coarse", "slow", "middle", "fine"]
    places = [(float(c.get("cx")), float(c.get("cy"))) for c in svg.iter(f"{SVG}circle") if c.get("class") == "point"]
    assert places[0][0] < places[2][0] < places[1][0] and places[0][1] < places[1][1] < places[2][1] < places[3][1]


def test_no_rung_good_enough_is_said():
    poor = Measured("poor", "", "", Spread(2, 3, 4), Times(0, 1, 1, 0, 0), True)
    assert "No way here keeps" in page.answer(ladder.Result(small(), [poor]))


def test_the_command_writes_three_files_and_prints_json(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(commands, "ladders", lambda: {"small": small})
    assert cli.main(["accuracy", "--quick", "--json", "--out", str(tmp_path / "new")]) == 0
    assert {f.name for f in (tmp_path / "new").iterdir()} == {"accuracy.html", "accuracy.csv", "accuracy.json"}
    assert len(json.loads(capsys.readouterr().out)["rungs"]) == 4


def test_a_ladder_that_does_not_exist_is_bad_input(capsys):
    assert cli.main(["accuracy", "--ladder", "rope"]) == 2
    assert "no ladder 'rope'; use colour, skin, maps" in capsys.readouterr().err


def test_a_stop_leaves_the_ladders_that_were_finished(tmp_path, monkeypatch, capsys):
    def stopping() -> Ladder:
        def interrupt() -> None:
            raise KeyboardInterrupt

        return Ladder("b", "B", "u", "r", "t", [Rung("x", "", lambda: interrupt, lambda: Spread(0, 0, 0))])

    monkeypatch.setattr(commands, "ladders", lambda: {"small": small, "b": stopping})
    assert cli.main(["accuracy", "--quick", "--out", str(tmp_path)]) == 130
    assert json.loads((tmp_path / "accuracy.json").read_text())["ladders"].keys() == {"small"}
    assert "stopped" in capsys.readouterr().err
