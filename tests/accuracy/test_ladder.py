"""Measuring, reporting and the page, on a ladder whose figures are known."""

from __future__ import annotations

import csv
import io
import json
import re
import signal
import time
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from km_makeup import cli
from km_makeup.accuracy import answers, commands, ladder, page, repeat, report
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
    return Ladder(
        "small", "A small ladder", "CIEDE2000", "one sleep", "the truth", rungs, clock=time.perf_counter, least_s=0.0,
        falling=(("coarse", "middle", "fine"),),
    )  # fmt: skip


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
    assert done == sorted(done) and total == {len(names) * 5} and done[-1] == len(names) * 5 - 1


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
    assert [len(r["runs_s"]) for r in content["rungs"]] == [5, 5, 5, 5]
    assert {"date", "processor", "cores", "numpy"} <= content["made"].keys()
    text = report.table(result)
    assert "* middle" in text and "  slow" in text and "against the truth" in text


def test_the_page_says_the_answer_and_needs_nothing_from_elsewhere(result):
    text = page.page([result], report.machine(), current=["path LIVE"])
    assert "Use middle: 99 % of its errors are below 0.40 CIEDE2000" in text
    assert "The most accurate in the mean, fine" in text
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
    assert "No way here keeps" in answers.answer(ladder.Result(small(), [poor]))


def test_the_command_writes_three_files_and_prints_json(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(commands, "ladders", lambda: {"small": small})
    assert cli.main(["accuracy", "--quick", "--json", "--out", str(tmp_path / "new")]) == 0
    assert {f.name for f in (tmp_path / "new").iterdir()} == {
        "accuracy.html",
        "accuracy.csv",
        "accuracy.json",
        "small.svg",
    }
    assert len(json.loads(capsys.readouterr().out)["rungs"]) == 4


def test_only_rungs_that_are_asked_for_are_measured(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(commands, "ladders", lambda: {"small": small})
    ask = ["accuracy", "--quick", "--json", "--out", str(tmp_path), "--rung"]
    assert cli.main([*ask, "ddl", "--rung", "fine"]) == 0
    assert [r["rung"] for r in json.loads(capsys.readouterr().out)["rungs"]] == ["middle", "fine"]
    (tmp_path / "accuracy.json").unlink()
    assert cli.main([*ask, "rope"]) == 2
    assert "No rung's name holds 'rope'" in capsys.readouterr().err and not (tmp_path / "accuracy.json").exists()


def test_a_ladder_that_does_not_exist_is_bad_input(capsys):
    assert cli.main(["accuracy", "--ladder", "rope"]) == 2
    assert "no ladder 'rope'; use colour, skin, maps, mip" in capsys.readouterr().err


def stopping(after: int) -> Ladder:
    """A ladder whose second rung is interrupted at a run."""
    made = 0

    def interrupt() -> None:
        nonlocal made
        made += 1
        if made > after:
            raise KeyboardInterrupt

    rungs = [rung("first", 0.001, 1.0), Rung("second", "", lambda: interrupt, lambda: Spread(0, 0, 0))]
    return Ladder("b", "B", "u", "r", "t", rungs, clock=time.perf_counter, least_s=0.0)


@pytest.mark.parametrize(("after", "kept"), [(0, ["first"]), (3, ["first", "second"])])
def test_a_stop_leaves_what_was_measured(tmp_path, monkeypatch, capsys, after, kept):
    monkeypatch.setattr(commands, "ladders", lambda: {"small": small, "b": lambda: stopping(after)})
    assert cli.main(["accuracy", "--quick", "--out", str(tmp_path)]) == 130
    content = json.loads((tmp_path / "accuracy.json").read_text())
    assert [r["rung"] for r in content["rungs"] if r["ladder"] == "b"] == kept
    assert content["ladders"]["small"]["whole"] and not content["ladders"]["b"]["whole"]
    assert "stopped" in capsys.readouterr().err
    assert "Measuring was stopped" in (tmp_path / "accuracy.html").read_text()


def test_ctrl_c_is_heard_between_steps_and_keeps_the_rungs(tmp_path, monkeypatch, capsys):
    """As while Blender renders: what raises inside a step is lost, the signal is not."""

    def pressing() -> Ladder:
        def press() -> None:
            signal.raise_signal(signal.SIGINT)

        rungs = [
            rung("first", 0.001, 1.0),
            Rung("second", "", lambda: press, lambda: Spread(0, 0, 0), memory=lambda _: 0.0),
        ]
        return Ladder(
            "b", "B", "u", "r", "t", [*rungs, rung("third", 0.001, 0.5)], clock=time.perf_counter, least_s=0.0
        )

    monkeypatch.setattr(commands, "ladders", lambda: {"b": pressing})
    before = signal.getsignal(signal.SIGINT)
    assert cli.main(["accuracy", "--quick", "--out", str(tmp_path)]) == 130
    assert signal.getsignal(signal.SIGINT) is before
    content = json.loads((tmp_path / "accuracy.json").read_text())
    assert [r["rung"] for r in content["rungs"]] == ["first"]
    assert "stopping after this step" in capsys.readouterr().err


def at(name: str, error: float, seconds: float) -> Measured:
    return Measured(name, "", "", Spread(error, error, error), Times(0, seconds, seconds, 0, 0))


def test_a_rung_that_does_not_fall_is_said_beyond_the_noise():
    found = ladder.Result(small(), [at("coarse", 1.0, 1), at("middle", 0.4, 1), at("fine", 0.5, 1)])
    assert ladder.not_falling(found) == ["fine has a mean error of 0.5, middle 0.4"]
    found.noise = Spread(0.2, 0.2, 0.2)
    assert ladder.not_falling(found) == []


def test_two_measurements_agree_when_one_machine_is_slower_by_a_factor():
    one = ladder.Result(small(), [at("a", 1, 0.010), at("b", 1, 0.020), at("c", 1, 0.031)])
    slower = ladder.Result(small(), [at("a", 1, 0.050), at("b", 1, 0.102), at("c", 1, 0.160)])
    turned = ladder.Result(small(), [at("a", 1, 0.010), at("b", 1, 0.020), at("c", 1, 0.015)])
    assert repeat.agreement(one, slower).holds
    found = repeat.agreement(one, turned)
    assert not found.holds and found.out_of_order == ("b and c",)


def test_busy_moments_that_slow_a_whole_round_do_not_change_ratios():
    def measured(slow: tuple[float, ...]) -> ladder.Result:
        quiet = {"a": 0.010, "b": 0.020, "c": 0.031}
        rungs = []
        for name, seconds in quiet.items():
            runs = tuple(seconds * by for by in slow)
            # the median of one rung falls into a busy round, that of the others does not
            later = runs[0] if name == "b" else seconds
            rungs.append(replace(at(name, 1, later), times=Times(0, later, later, 0, 0, runs)))
        return ladder.Result(small(), rungs)

    found = repeat.agreement(measured((3.0, 1.0, 1.5)), measured((1.0, 1.0, 1.0)))
    assert found.holds and found.worst == pytest.approx(1)


def test_short_runs_are_made_until_they_can_be_timed():
    now = 0.0
    calls = []

    def run() -> None:
        nonlocal now
        now += 0.001
        calls.append(now)

    quick = Rung("q", "", lambda: run, lambda: Spread(0, 0, 0), memory=lambda _: 0.0)
    found, _ = finished(measure(Ladder("m", "M", "u", "r", "t", [quick], clock=lambda: now, least_s=0.02), runs=2))
    assert len(calls) == 1 + 2 * ladder.TURNS * 20
    assert found.rungs[0].times.later == pytest.approx(0.001)


def test_long_runs_are_made_as_often_as_asked_for():
    now, calls = 0.0, {"short": 0, "long": 0}

    def taking(name: str, seconds: float):
        def run() -> None:
            nonlocal now
            now += seconds
            calls[name] += 1

        return Rung(name, "", lambda: run, lambda: Spread(0, 0, 0), memory=lambda _: 0.0)

    rungs = [taking("short", 0.02), taking("long", 0.6)]
    found, seen = finished(measure(Ladder("m", "M", "u", "r", "t", rungs, clock=lambda: now, least_s=0.02), runs=3))
    assert calls == {"short": 1 + 3 * ladder.TURNS, "long": 1 + 3}
    assert seen[-1][0] < seen[-1][1], "progress never passes its end"
    assert [len(one.times.runs) for one in found.rungs] == [3 * ladder.TURNS, 3]


def test_the_fastest_runs_are_what_a_rung_takes_undisturbed():
    assert ladder.of_the_fastest([3.0, 1.0, 2.0]) == 1.5
    assert ladder.of_the_fastest([9.0] * 28 + [1.0] * 7) == 1.0


def test_pictures_of_a_rung_are_in_the_page():
    shown = replace(at("a", 0.3, 0.01), shots=(ladder.Shot("picture", b"PNG bytes"),), flip=Spread(0.02, 0.1, 0.2))
    text = page.page([ladder.Result(small(), [shown, at("b", 0.2, 0.02)])], report.machine())
    assert "data:image/png;base64,UE5HIGJ5dGVz" in text and "<th>FLIP</th>" in text and "<td>0.020</td>" in text


def test_questions_are_answered_from_the_rungs():
    bands = [
        at("8 fitted bands", 0.9, 0.01),
        at("12 fitted bands", 0.3, 0.015),
        at("81 bands", 0.02, 0.06),
        at("live", 0.5, 0.02),
        at("baked", 0.25, 0.005),
    ]
    blurs = [
        at("0 Gaussians", 1.0, 1.0),
        at("1 Gaussian", 0.5, 1.1),
        at("3 Gaussians", 0.31, 1.2),
        at("6 Gaussians", 0.3, 1.5),
    ]
    results = [
        ladder.Result(replace(small(), name="colour"), bands),
        ladder.Result(replace(small(), name="diffusion"), blurs),
    ]
    found = dict(answers.in_short(results))
    assert found["How many bands do I need?"].startswith("12 are enough, with fitted weights")
    assert "In single precision" not in found["How many bands do I need?"]
    assert found["How many Gaussians?"].startswith("3: mean error 0.31 against 1.00 with none and 0.30 with 6")
    assert "from 0.500 to 0.250" in found["Is baking worth it?"]
    assert "km_makeup accuracy HEAD.blend" in found["What does Cycles buy me?"]
    quick = at("16 fitted bands, float32", 0.1, 0.015)
    alike = [at(f"{count} Gaussian{'s' if count else ''}", 1.7 + count / 1000, 1.0) for count in (0, 3, 6)]
    pictures = [at("EEVEE, live", 2.2, 5.5), at("Cycles, 16 samples", 4.6, 1.7), at("Cycles, denoised", 1.6, 1.9)]
    found = dict(
        answers.in_short(
            [
                ladder.Result(replace(small(), name="colour"), [*bands, quick]),
                ladder.Result(replace(small(), name="diffusion"), alike, noise=Spread(1.0, 2.0, 3.0)),
                ladder.Result(replace(small(), name="picture"), pictures),
            ]
        )
    )
    assert "In single precision 16 take no longer" in found["How many bands do I need?"]
    assert found["How many Gaussians?"].startswith("It does not show in these pictures: 0 to 6 differ by 0.01")
    assert "Cycles, denoised is 1.60" in found["What does Cycles buy me?"]
    assert "Cycles, 16 samples (4.60) is farther off" in found["What does Cycles buy me?"]


def test_pictures_need_a_head(capsys):
    assert cli.main(["accuracy", "--ladder", "diffusion"]) == 2
    assert "name the head's file" in capsys.readouterr().err
    assert cli.main(["accuracy", "x.blend", "--size", "big"]) == 2
    assert "pixels, such as 200x250" in capsys.readouterr().err
