"""A product from a measurement, as the dialog of Blender saves it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from km_makeup.optics import air_interface, film_over, saunderson, unsaunderson

pytestmark = pytest.mark.blender
NM = np.arange(380, 781, 10)
FILMS = [
    {"name": "", "film": "mine_ob", "backing": "mine_b", "thickness_um": 60.0, "opaque": False},
    {"name": "", "film": "mine_ow", "backing": "mine_w", "thickness_um": 60.0, "opaque": False},
]
ASKED = {"product_name": "My Red", "kind": "lipstick", "source": "own measurement, simulated", "films": FILMS}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The user's folder of products, as the extension has it."""
    from km_makeup.blender import library

    own = tmp_path / "products"
    monkeypatch.setattr(library, "user_folder", lambda: own)
    library.look_again()
    yield own
    library.look_again()


@pytest.fixture
def measurement(tmp_path) -> Path:
    interface = air_interface(1.5)
    K, S = 20 / (1 + np.exp((NM - 600) / 15)) + 1, np.full(len(NM), 15.0)
    backings = {"b": np.full(len(NM), 0.05), "w": np.full(len(NM), 0.85)}
    spectra = {f"mine_{end}": values for end, values in backings.items()}
    for end, values in backings.items():
        spectra[f"mine_o{end}"] = saunderson(film_over(K, S, 0.06, unsaunderson(values, interface)), interface)
    rows = [",".join(["nm", *spectra])]
    rows += [",".join(f"{value:.6f}" for value in row) for row in zip(NM, *spectra.values(), strict=True)]
    file = tmp_path / "mine.csv"
    file.write_text("\n".join(rows))
    return file


def run(measurement: Path, **changes) -> set[str]:
    import bpy

    return bpy.ops.km_makeup.measure_product("EXEC_DEFAULT", filepath=str(measurement), **(ASKED | changes))


def test_a_measurement_becomes_a_product_of_the_library(folder, measurement):
    from km_makeup.blender.library import library

    assert run(measurement) == {"FINISHED"}
    product = library().find("lipstick-my-red")
    assert product.provenance.status == "measured"
    assert product.K[4] == pytest.approx(21, rel=0.02)
    assert np.allclose(product.S, 15, rtol=0.05)
    assert product.K_error is not None
    assert product.quality
    assert [file.name for file in folder.iterdir()] == ["lipstick-my-red.json"]


def test_it_goes_onto_the_active_layer_and_undo_takes_it_off(folder, measurement, test_products):
    import bpy

    from tests.blender import scenes

    obj = scenes.head()
    obj.data.materials.append(scenes.skin())
    bpy.context.view_layer.objects.active = obj
    bpy.ops.km_makeup.layer_add(product="test-base")
    name = obj.name
    bpy.ops.ed.undo_push(message="before")
    assert run(measurement) == {"FINISHED"}
    assert obj.km_makeup.layers[0].product == "lipstick-my-red"
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert bpy.data.objects[name].km_makeup.layers[0].product == "test-base"
    assert (folder / "lipstick-my-red.json").exists()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"product_name": " "}, "Give the product a name"),
        ({"product_name": "口紅"}, "no letter a-z or digit"),
        ({"source": ""}, "who measured what"),
        (
            {"films": [FILMS[0], {**FILMS[1], "film": "mine_oww"}]},
            "There is no spectrum 'mine_oww'; did you mean mine_ow",
        ),
        ({"films": [FILMS[0], {**FILMS[0]}]}, "no reflectances of a film"),
        ({"radiance": True, "light": "mine_b"}, "no reflectances of a film"),
    ],
)
def test_what_is_wrong_is_a_sentence_and_nothing_is_written(folder, measurement, changes, message):
    with pytest.raises(RuntimeError, match=message):
        run(measurement, **changes)
    assert not folder.exists() or list(folder.iterdir()) == []


def test_a_name_that_is_taken_is_said_and_overwritten_when_asked(folder, measurement):
    run(measurement)
    before = (folder / "lipstick-my-red.json").read_bytes()
    with pytest.raises(RuntimeError, match="exists; choose another"):
        run(measurement, noise=0.001)
    assert (folder / "lipstick-my-red.json").read_bytes() == before
    assert run(measurement, noise=0.001, overwrite=True) == {"FINISHED"}
    assert (folder / "lipstick-my-red.json").read_bytes() != before
    with pytest.raises(RuntimeError, match="belongs to another library"):
        run(measurement, product_name="berry", overwrite=True)


def test_without_a_library_of_ones_own_it_says_so(measurement, monkeypatch):
    from km_makeup.blender import library

    monkeypatch.setattr(library, "user_folder", lambda: None)
    library.look_again()
    with pytest.raises(RuntimeError, match="no folder to write to"):
        run(measurement)


def test_products_saved_by_another_blender_are_seen(folder, measurement, monkeypatch):
    from km_makeup.blender import library
    from km_makeup.products import Library

    monkeypatch.setattr(library, "LOOK_EVERY", 0.0)
    count = len(library.library().products)
    other = Library.user(folder)
    mine = other.find("lipstick-berry")
    from dataclasses import replace

    other.save(replace(mine, id="lipstick-theirs"))
    assert len(library.library().products) == count + 1
    (folder / "lipstick-theirs.json").write_text("{")
    assert len(library.library().products) == count
    assert any("lipstick-theirs.json" in problem for problem in library.library().problems)
