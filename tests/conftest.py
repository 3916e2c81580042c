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
        pytest.skip(message)
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
            request.getfixturevalue("everything_on")


@pytest.fixture
def everything_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Heads are set up with their switch Everything on: tests of colours and nodes see every effect that the engine can have."""
    from km_makeup.blender import looks, makeup
    from km_makeup.blender.update import paused

    set_up = makeup.set_up

    def with_everything(obj, *rest, **more):
        set_up(obj, *rest, **more)
        with paused():
            obj.km_makeup.everything = True

    for module in (makeup, looks):
        monkeypatch.setattr(module, "set_up", with_everything)
