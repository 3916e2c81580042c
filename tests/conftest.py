"""What all tests share: the data beside the checkout, and a clean scene for the tests that need Blender."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[1]

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
"""On a busy machine two threads of OpenBLAS wait for each other: test_mixtures took 60 s with one, over 280 with two."""

if "bpy" not in sys.modules:  # importing the bpy module would read the user's own settings and extensions
    _resources = tempfile.mkdtemp(prefix="km_makeup-tests-")
    os.environ["BLENDER_USER_RESOURCES"] = _resources
    atexit.register(shutil.rmtree, _resources, ignore_errors=True)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder `shared` beside the checkout: heads, spectra, reference data."""
    folder = CHECKOUT.parent / "shared"
    if not (folder / "spectra").is_dir():
        message = f"no test data in {folder}: put the folder `shared` (heads, spectra, reference) beside the checkout"
        if os.environ.get("CI"):
            pytest.fail(message)
        pytest.skip(f"NOT TESTED: {message}")
    return folder


@pytest.fixture
def clean_scene() -> None:
    """An empty file with factory settings, and KM Makeup registered; the preferences stay as they are."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if not hasattr(bpy.types.Object, "km_makeup"):
        from km_makeup import blender

        blender.register()


@pytest.fixture(autouse=True)
def _blender_tests_start_clean(request: pytest.FixtureRequest) -> None:
    if request.node.get_closest_marker("blender"):
        request.getfixturevalue("clean_scene")
        if "effects" not in request.path.parts:
            request.getfixturevalue("nothing_left_out")


@pytest.fixture
def nothing_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests of colours and nodes see every effect that the engine can have, and every film that carries product."""
    from dataclasses import replace

    from km_makeup.blender import makeup
    from km_makeup.effects import Switch

    planned = makeup.make_plan
    families = (
        "interreflection", "dither", "second_lobe", "lobe", "finish", "subsurface", "normals", "texture", "lamp", "gaussian",
        "diffusion", "depth", "bands",
    )  # fmt: skip

    def whole(facts, tolerance, overrides, *rest):
        seen = tuple(replace(layer, seen=True) for layer in facts.layers)
        facts = replace(facts, layers=seen, view=replace(facts.view, visible=True))
        return planned(facts, 0.0, {**dict.fromkeys(families, Switch.ON), **overrides}, *rest)

    monkeypatch.setattr(makeup, "make_plan", whole)
