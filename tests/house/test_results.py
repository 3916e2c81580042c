"""No result file is older than the code it covers, and the fingerprint that says so sees what it must."""

from __future__ import annotations

import pytest

from tests import stamps

OLDER = {
    "live_colours.md",
    "optics_mutation_diffusion.md",
    "plan_scenes.md",
}
"""Results that are older than their code: mutants of diffusion, since fits hold the mean of r^2 too; scenes that call for less, since skin scatters as far as in Cycles (a head of 40 pixels keeps two Gaussians); live colours, since colour's tables come, the same to the last bit, from a file, and textured skins, of which there are none in them, have another mean colour."""


@pytest.mark.parametrize("file", sorted(stamps.RESULTS.iterdir()), ids=lambda file: file.name)
def test_a_result_is_not_older_than_its_code(file):
    assert file.name in OLDER or stamps.stale(file) == ""


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    monkeypatch.setattr(stamps, "ROOT", tmp_path)
    monkeypatch.setattr(stamps, "RESULTS", tmp_path / "tests" / "results")
    (tmp_path / "tests").mkdir()
    (tmp_path / "code.py").write_text(
        '"""Says."""\nLIMIT = 3\n"""What."""\n\n\ndef f():\n    "Text."\n    return LIMIT  # why\n'
    )
    return tmp_path


@pytest.mark.parametrize("kind", ["md", "json"])
def test_changed_code_makes_a_result_old_and_changed_words_do_not(checkout, kind):
    write = (
        (lambda: stamps.write_markdown("a.md", "Title", "python -m tests.a", ["code.py"], "| 1 |\n"))
        if kind == "md"
        else (lambda: stamps.write_json("a.json", "python -m tests.a", ["code.py"], {"x": 1}))
    )
    file = checkout / write()
    assert stamps.stale(file) == ""
    code = checkout / "code.py"
    code.write_text(
        code.read_text()
        .replace("Says", "Tells")
        .replace("What", "That")
        .replace("# why", "# because")
        .replace('"Text."', '"T."')
    )
    assert stamps.stale(file) == ""
    code.write_text(code.read_text().replace("LIMIT = 3", "LIMIT = 4"))
    assert "older than the code it covers (code.py); run: python -m tests.a" in stamps.stale(file)


def test_a_result_whose_code_is_gone_or_that_says_nothing_is_old(checkout):
    file = checkout / stamps.write_markdown("a.md", "Title", "python -m tests.a", ["code.py"], "")
    (checkout / "code.py").unlink()
    assert "code.py is not there" in stamps.stale(file)
    file.write_text("# Title\n")
    assert "does not say" in stamps.stale(file)
