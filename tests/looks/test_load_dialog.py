"""What the dialog of a look that is loaded or dropped says."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from tests.blender import scenes

pytestmark = pytest.mark.blender


class Layout:
    """Stands for the layout that the dialog is drawn into, and keeps its texts."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def column(self, align: bool = False) -> Layout:
        return self

    def label(self, text: str = "", icon: str = "NONE") -> None:
        self.texts.append(text)

    def prop(self, data: object, name: str) -> None:
        self.texts.append(name)


@pytest.mark.parametrize(("area", "widest", "lines"), [("VIEW_3D", 56, 1), ("FILE_BROWSER", 36, 2)])
def test_layers_are_called_by_their_products_names_and_lines_fit(area, widest, lines, tmp_path):
    from km_makeup.blender.ui.looks.operators import KM_OT_load_look
    from km_makeup.makeup import Layer, Look

    head = scenes.head()
    head.data.materials.append(scenes.skin())
    file = tmp_path / "day.json"
    Look("Day", (Layer("lipstick-coral", 8.0), Layer("blush-rose", 10.0, name="Cheeks"))).save(file)
    shown = SimpleNamespace(layout=Layout(), filepath=str(file), maps="AUTO")
    KM_OT_load_look.draw(shown, SimpleNamespace(object=head, area=SimpleNamespace(type=area)))
    texts = shown.layout.texts
    assert texts[:3] == ["Day", "Cheeks, 10 µm", "Lipstick, coral, 8 µm"]
    assert len(texts) == 4 + lines and max(map(len, texts)) <= widest
