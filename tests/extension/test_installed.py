"""The built extension installs, enables and leaves again in a fresh Blender, quickly."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.extension.conftest import FreshBlender

pytestmark = pytest.mark.blender

Installed = tuple[FreshBlender, dict[str, object]]
REGISTER_MILLISECONDS = 50.0


@pytest.fixture(scope="session")
def enablings(installed: Installed) -> list[dict[str, object]]:
    """Three fresh processes, since the first may read cold files from the disk."""
    return [installed[0].report("enable.py") for _ in range(3)]


def test_the_zip_installs_and_enables(installed: Installed) -> None:
    said = installed[1]
    assert said["result"] == ["FINISHED"]
    assert said["enabled"] is True
    assert said["property"] is True


def test_the_installed_code_runs_and_not_the_checkout(installed: Installed) -> None:
    blender, said = installed
    assert Path(str(said["package"])).resolve().is_relative_to(blender.user_folder.resolve())


def test_the_pinned_colour_science_is_found(installed: Installed) -> None:
    assert installed[1]["colour_version"] == "0.4.7"


def test_registering_takes_under_50_ms(enablings: list[dict[str, object]]) -> None:
    """Reading the code and register() together: what a start of Blender pays."""
    reading = [float(str(said["import_milliseconds"])) for said in enablings]
    registering = [float(str(said["register_milliseconds"])) for said in enablings]
    print(f"reading took {min(reading):.1f} ms and registering {min(registering):.1f} ms at best of {len(enablings)}")
    assert min(reading) + min(registering) < REGISTER_MILLISECONDS


def test_registering_imports_neither_colour_science_nor_openimageio(enablings: list[dict[str, object]]) -> None:
    assert [(said["colour"], said["OpenImageIO"]) for said in enablings] == [(False, False)] * 3


def test_it_can_be_disabled_and_enabled_again(enablings: list[dict[str, object]]) -> None:
    states = ("registered", "enabled", "left_after_disabling", "registered_again")
    assert [enablings[0][state] for state in states] == [True, True, False, True]
