"""A part of the flat field, another one every day; `python tests/flat_field/compare.py` runs all of it.

It runs in processes of its own: the prediction imports nothing from km_makeup, the render nothing from the prediction.
"""

from __future__ import annotations

import ast
import datetime
import json
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
PARTS = 24


def test_the_prediction_imports_nothing_from_the_extension():
    for name in ("predict.py", "cases.py", "upsample.py"):
        for node in ast.walk(ast.parse((HERE / name).read_text(encoding="utf-8"))):
            modules = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            modules += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(module.split(".")[0] == "km_makeup" for module in modules), name


@pytest.mark.slow
def test_planes_render_as_the_printed_equations_say_within_half_a_delta_e(shared_data, tmp_path):
    pytest.importorskip("mpmath", reason="NOT TESTED: the flat field needs mpmath")
    pytest.importorskip("bpy")
    part = datetime.datetime.now(datetime.UTC).timetuple().tm_yday % PARTS
    rows_file = tmp_path / "rows.json"
    ran = subprocess.run(
        [sys.executable, "-W", "ignore", str(HERE / "compare.py"), "--every", str(PARTS), "--first", str(part),
         "--list", "5", "--rows", str(rows_file)],
        cwd=HERE.parents[1], capture_output=True, text=True, check=False,
    )  # fmt: skip
    print(f"part {part} of {PARTS}\n{ran.stdout}")
    assert rows_file.exists(), ran.stderr[-2000:]
    rows = json.loads(rows_file.read_text(encoding="utf-8"))
    assert {(row["path"], row["engine"]) for row in rows} == {
        (path, engine) for path in ("live", "baked", "finished") for engine in ("cycles", "eevee")
    }
    for row in rows:
        assert row["cases"] >= 40
        assert row["max"] <= 0.5, (row["path"], row["engine"], row["worst"], row["max"])
        assert row["mean"] <= 0.25, (row["path"], row["engine"], row["mean"])
    assert ran.returncode == 0
