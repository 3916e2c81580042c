"""`look show|apply|save` on the command line."""

from __future__ import annotations

import json

import pytest

from km_makeup.cli import main
from km_makeup.makeup import Layer, Look
from tests.makeup import heads


def test_show_says_what_a_look_holds_and_bad_input_ends_with_2(tmp_path, capsys):
    Look("Day", (Layer("lipstick-berry", 12.0, "lips.png", enabled=False),)).save(tmp_path / "day.json")
    assert main(["look", "show", str(tmp_path / "day.json")]) == 0
    assert "lipstick-berry  12 um  x1  lips.png, hidden" in capsys.readouterr().out
    assert main(["look", "show", str(tmp_path / "day.json"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["layers"][0]["product"] == "lipstick-berry"
    assert main(["look", "show", str(tmp_path / "none.json")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert main(["look", "apply", str(tmp_path / "day.json"), "head.obj", "--out", "x.png"]) == 2


@pytest.mark.blender
def test_a_look_goes_onto_a_head_into_a_file_and_out_again(tmp_path, shared_data, capsys):
    Look("Day", (Layer("lipstick-berry", 12.0), Layer("blush-rose", 5.0, name="Mine"))).save(tmp_path / "day.json")
    head, blend, again = str(heads.SHARED / heads.FILES["MediaPipe"]), tmp_path / "a.blend", tmp_path / "again.json"
    assert main(["look", "apply", str(tmp_path / "day.json"), head, "--out", str(blend), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["maps"] == "as-is"
    assert main(["look", "save", str(blend), "--out", str(again)]) == 0
    look = Look.load(again)
    assert [(x.product, x.thickness_um, x.name) for x in look.layers] == [
        ("lipstick-berry", 12.0, ""), ("blush-rose", 5.0, "Mine"),
    ]  # fmt: skip
    assert look.head is not None and (tmp_path / look.head.surface).is_file()
