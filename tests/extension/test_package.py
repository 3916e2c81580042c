"""What is in the extension's zip, and that its manifest is one that Blender's own tool accepts."""

from __future__ import annotations

import hashlib
import re
import subprocess
import tomllib
import zipfile
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[2]
MANIFEST = tomllib.loads((CHECKOUT / "blender_manifest.toml").read_text("utf-8"))
AT_THE_ROOT = {"blender_manifest.toml", "__init__.py", "README.md", "LICENSE", "km_makeup", "node_groups"}


def names(archive: Path) -> list[str]:
    with zipfile.ZipFile(archive) as opened:
        return opened.namelist()


def test_only_what_users_need_is_packed(extension_zip: Path) -> None:
    assert {name.split("/")[0] for name in names(extension_zip)} <= AT_THE_ROOT


def test_every_tracked_source_file_is_packed(extension_zip: Path) -> None:
    listed = subprocess.run(["git", "ls-files", "km_makeup"], cwd=CHECKOUT, capture_output=True, text=True, check=True)
    tracked = {name for name in listed.stdout.splitlines() if (CHECKOUT / name).is_file()}
    assert tracked
    assert tracked - set(names(extension_zip)) == set()


def test_no_caches_backups_or_hidden_files_are_packed(extension_zip: Path) -> None:
    assert [
        name for name in names(extension_zip) if re.search(r"__pycache__|\.pyc$|/\.|^\.|\.blend\d$|\.zip$", name)
    ] == []


def test_wheels_in_the_zip_are_those_of_the_manifest_with_the_pinned_hashes(extension_zip: Path) -> None:
    wheels = [wheel.removeprefix("./") for wheel in MANIFEST["wheels"]]
    pinned = set(re.findall(r"sha256:([0-9a-f]{64})", (CHECKOUT / ".ci/pins/wheels.txt").read_text("utf-8")))
    with zipfile.ZipFile(extension_zip) as opened:
        assert sorted(name for name in opened.namelist() if name.endswith(".whl")) == sorted(wheels)
        assert {hashlib.sha256(opened.read(wheel)).hexdigest() for wheel in wheels} == pinned


def test_bundled_wheels_run_on_any_python() -> None:
    assert [wheel for wheel in MANIFEST["wheels"] if not wheel.endswith("-py3-none-any.whl")] == []


def test_the_manifest_has_the_version_of_the_package() -> None:
    package = (CHECKOUT / "km_makeup/__init__.py").read_text("utf-8")
    assert re.search(r'^__version__ = "(.+)"$', package, re.MULTILINE)[1] == MANIFEST["version"]


def test_the_asset_library_is_packed_without_its_maker(extension_zip: Path) -> None:
    packed = {name for name in names(extension_zip) if name.startswith("node_groups/")}
    assert {
        f"node_groups/{n}" for n in ("makeup_groups.blend", "makeup_brushes.blend", "blender_assets.cats.txt")
    } <= packed
    assert [name for name in packed if name.endswith(".py")] == []
