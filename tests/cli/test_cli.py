"""The command line: what it writes, what it refuses with exit code 2 and one line, and that it leaves nothing half-done."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.blender import scenes

pytestmark = pytest.mark.blender
CHECKOUT = Path(__file__).resolve().parents[2]
QUICK = ["--engine", "cycles", "--samples", "1", "--size", "24x30"]


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Path:
    """A head as .obj and as .blend, an albedo, maps good and bad, a look."""
    import bpy

    from km_makeup import blender

    folder = tmp_path_factory.mktemp("cli")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if not hasattr(bpy.types.Object, "km_makeup"):
        blender.register()
    obj = scenes.head("Head", radius=0.12)
    obj.data.materials.append(scenes.skin())
    scenes.studio()
    bpy.ops.wm.obj_export(filepath=str(folder / "head.obj"), export_materials=False)
    bpy.ops.wm.obj_export(filepath=str(folder / "no_uv.obj"), export_uv=False, export_materials=False)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "head.blend"))
    (folder / "empty.obj").write_text("# nothing\n")
    (folder / "broken.blend").write_bytes(b"no blender file")
    (folder / "head.fbx").write_bytes(b"x")
    scenes.write_map(folder, "lips", scenes.spots())
    (folder / "cut.png").write_bytes((folder / "lips.png").read_bytes()[:-40])
    scenes.write_map(folder, "small", np.zeros((8, 8), np.uint8))
    scenes.write_map(folder, "nan", np.full((32, 32), np.nan, np.float32))
    scenes.write_map(folder, "above", np.full((32, 32), 2.0, np.float32))
    albedo = np.full((32, 32, 3), 150, np.uint8)
    scenes.write_map(folder, "albedo", albedo)
    look = {"name": "L", "layers": [{"product": "lipstick-berry", "thickness_um": 15, "map": "lips.png"}]}
    (folder / "look.json").write_text(json.dumps(look))
    (folder / "broken.json").write_text("{")
    return folder


@pytest.fixture
def run(files, capsys, monkeypatch, tmp_path):
    """Runs a command in this process, in an empty folder; exit code, standard output, lines of standard error."""
    from km_makeup.cli import main

    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("KM_MAKEUP_PRODUCTS", raising=False)

    def command(*arguments: str) -> tuple[int, str, list[str]]:
        capsys.readouterr()
        code = main([word.replace("FILES", str(files)) for word in arguments])
        said = capsys.readouterr()
        return code, said.out, said.err.splitlines()

    return command


RENDER = ["render", "FILES/head.obj", "--skin", "FILES/albedo.png", *QUICK, "--log", "error"]
LAYER = ["--layer", "lipstick-classic-red=FILES/lips.png@15um"]


def test_a_head_is_rendered_with_makeup_and_the_same_bytes_every_time(run, tmp_path):
    """EEVEE's pictures and the textures to the bit. Cycles' differ by 5e-7 from process to process, bare scenes too."""
    for folder in ("a", "b"):
        code, out, err = run(*RENDER, *LAYER, "--engine", "eevee", "--out", f"{folder}/face.png", "--json")
        assert (code, err) == (0, [])
        assert json.loads(out.splitlines()[-1])["pictures"][0]["file"] == f"{folder}/face.png"
    first, second = ({f.relative_to(tmp_path / d): f.read_bytes() for f in (tmp_path / d).rglob("*.*")} for d in "ab")
    assert first == second and len(first) == 5 and first[Path("face.png")].startswith(b"\x89PNG")


def test_a_picture_of_cycles_does_not_say_how_long_it_took(run, tmp_path):
    from km_makeup.bake import read_image

    assert run(*RENDER, *LAYER, "--out", "a.png")[0] == 0
    picture = (tmp_path / "a.png").read_bytes()
    assert b"IDAT" in picture and b"tEXt" not in picture
    assert read_image(tmp_path / "a.png")[0].shape[:2] == (30, 24)


def test_makeup_is_in_the_picture_and_bare_leaves_it_out(run, tmp_path):
    from km_makeup.bake import read_image

    for name, makeup in (("makeup", LAYER), ("bare", ["--bare", *LAYER]), ("none", [])):
        assert run(*RENDER, *makeup, "--out", f"{name}.png")[0] == 0
    made_up, bare, none = (read_image(tmp_path / f"{n}.png")[0].astype(int) for n in ("makeup", "bare", "none"))
    assert np.abs(bare - none).max() <= 1
    redder = (made_up[..., 1] < 0.7 * bare[..., 1]) & (made_up[..., 0] > 1.3 * made_up[..., 1])
    assert redder.sum() > 20


def test_the_compositor_diffuses_each_of_several_views_as_if_it_were_alone(run, tmp_path):
    from km_makeup.bake import read_image

    head = ["render", "FILES/head.blend", "--size", "64x80", "--samples", "4", "--everything", *LAYER]
    views = ["front", "close-up"]
    assert run(*head, "--diffuse", "--view", ",".join(views), "--out", "all", "--save", "all.blend")[0] == 0
    for name, diffuse in (("bare", ["--diffuse", "3"]), ("bare without", [])):
        assert run(*head, *diffuse, "--view", "close-up", "--bare", "--out", f"{name}.png")[0] == 0
    bare, without = (read_image(tmp_path / f"{n}.png")[0].astype(int) for n in ("bare", "bare without"))
    assert np.abs(bare - without).mean() > 0.1
    for view in views:
        assert run(*head, "--diffuse", "--view", view, "--out", f"{view}.png")[0] == 0
        assert run(*head, "--view", view, "--out", f"{view} without.png")[0] == 0
        names = (f"all/{view}", view, f"{view} without")
        together, alone, without = (read_image(tmp_path / f"{n}.png")[0].astype(int) for n in names)
        assert np.abs(alone - without).mean() > 0.1 and np.abs(together - alone).max() <= 1
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "all.blend"))
    assert any(node.label == "KM Diffusion" for node in bpy.context.scene.compositing_node_group.nodes)


def test_what_was_found_out_is_said_in_lines(run):
    code, _, err = run(*RENDER[:-2], *LAYER, "--out", "a.png")
    text = "\n".join(err)
    assert code == 0
    for word in ("scale: 0.24 units read as metres", "layer: lipstick-classic-red, 15 µm", "bake:", "wrote a.png in"):
        assert word in text


@pytest.mark.parametrize("colour", ["live", "baked", "finished"])
def test_every_colour_path_renders(run, tmp_path, colour):
    code, _, err = run(*RENDER, *LAYER, "--colour", colour, "--out", f"{colour}.exr")
    assert (code, err) == (0, []) and (tmp_path / f"{colour}.exr").stat().st_size > 500


def test_a_look_and_layers_on_top_of_it_come_in_order(run, files):
    import bpy

    code, _, err = run(
        *RENDER, "--look", "FILES/look.json", "--layer", "eyeshadow-blue=FILES/lips.png", "--out", "a.png"
    )
    assert (code, err) == (0, [])
    (obj,) = [o for o in bpy.context.scene.objects if o.km_makeup.layers]
    assert [layer.product for layer in obj.km_makeup.layers] == ["lipstick-berry", "eyeshadow-blue"]


def test_baking_writes_textures_and_says_which(run, tmp_path):
    code, out, err = run(
        "bake", "FILES/head.obj", "--skin", "FILES/albedo.png", *LAYER, "--finished", "--resolution", "64",
        "--out", "textures", "--json", "--log", "error",
    )  # fmt: skip
    assert (code, err) == (0, [])
    written = {Path(file) for file in json.loads(out.splitlines()[-1])["files"].values()}
    assert written == set((tmp_path / "textures").iterdir())
    assert {file.stem.rpartition("Head_")[2] for file in written} >= {"R", "T2", "R_up", "albedo", "finish"}


def test_the_plan_is_listed_with_reasons_and_as_json(run, files):
    scenes.write_map(files, "nothing", np.zeros((32, 32), np.uint8))
    layers = ("--layer", "lipstick-berry=FILES/lips.png@15um", "--layer", "foundation-light=FILES/nothing.png@10um")
    code, out, _ = run("plan", "FILES/head.blend", *layers)
    assert code == 0 and "its map is empty" in out and "Foundation" in out and "left out" in out
    code, out, _ = run(
        "plan", "FILES/head.blend", *layers, "--engine", "cycles", "--size", "300x400", "--json", "--tolerance", "2"
    )
    plan = json.loads(out)
    effects = {effect["key"]: effect for effect in plan["effects"]}
    assert code == 0 and plan["left_out"] <= plan["tolerance"] and plan["summary"]
    assert effects["film:0"]["on"] and not effects["film:1"]["on"] and not effects["compositor"]["on"]
    code, out, _ = run("plan", "FILES/head.blend", *layers, "--everything", "--json")
    assert {e["key"]: e["on"] for e in json.loads(out)["effects"]}["film:1"]
    code, out, _ = run(
        "plan", "FILES/head.blend", *layers, "--everything", "--json", "--diffuse", "2", "--view", "front"
    )
    diffused = {e["key"]: e["on"] for e in json.loads(out)["effects"]}
    assert diffused["compositor"] and diffused["gaussian:2"] and "gaussian:3" not in diffused
    code, _, errors = run("plan", "FILES/head.blend", "--tolerance", "-1")
    assert code == 2 and len(errors) == 1 and "0 or more" in errors[0]


def test_a_blend_is_opened_and_left_as_it_was(run, files, tmp_path):
    before = (files / "head.blend").read_bytes()
    code, _, err = run(
        "render", "FILES/head.blend", *LAYER, *QUICK, "--log", "error", "--view", "Camera", "--out", "a.png"
    )
    assert (code, err) == (0, []) and (tmp_path / "a.png").exists()
    assert (files / "head.blend").read_bytes() == before


def test_the_saved_scene_opens_with_its_makeup_and_nothing_lies_beside_it(run, tmp_path):
    import bpy

    code, _, err = run(*RENDER, *LAYER, "--colour", "live", "--out", "a.png", "--save", "saved/face.blend")
    assert (code, err) == (0, [])
    assert [file.name for file in (tmp_path / "saved").iterdir()] == ["face.blend"]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved" / "face.blend"))
    (obj,) = [o for o in bpy.context.scene.objects if o.km_makeup.layers]
    assert obj.material_slots[0].material["km_makeup_made"] and obj.km_makeup.layers[0].map.packed_file


def test_paths_with_two_slashes_start_at_the_blend(run, files):
    code, _, err = run(
        "render", "FILES/head.blend", "--layer", "lipstick-berry=//lips.png@15um", *QUICK, "--view", "Camera",
        "--log", "error", "--out", "//pictures/a.png",
    )  # fmt: skip
    assert (code, err) == (0, []) and (files / "pictures" / "a.png").exists()


def test_of_several_views_the_good_ones_are_rendered_and_the_exit_code_says_so(run, tmp_path):
    code, out, err = run(*RENDER, *LAYER, "--view", "front,sideways", "--out", "views", "--json")
    assert code == 3 and len(err) == 1 and "sideways" in err[0]
    said = json.loads(out.splitlines()[-1])
    assert [p["view"] for p in said["pictures"]] == ["front"] and list(said["failed"]) == ["sideways"]
    assert (tmp_path / "views" / "front.png").exists()


BAD = {
    "no head": (["render", "nothing.obj"], "nothing.obj does not exist"),
    "a reference of Cycles": (
        ["render", "FILES/head.obj", "--engine", "cycles", "--reference", "8"],
        "use it with --engine eevee",
    ),
    "diffusion in Cycles": (["render", "FILES/head.obj", "--engine", "cycles", "--diffuse"], "leave one of them out"),
    "too many Gaussians": (["render", "FILES/head.obj", "--engine", "eevee", "--diffuse", "7"], "between 1 and 6"),
    "another format": (["render", "FILES/head.fbx"], "export the head as one of these"),
    "a broken blend": (["render", "FILES/broken.blend"], "is it a Blender file"),
    "no mesh": (["render", "FILES/empty.obj"], "holds no mesh"),
    "no such object": ([*RENDER, *LAYER, "--object", "Nose"], "no mesh object 'Nose'"),
    "no UVs": (["render", "FILES/no_uv.obj", *LAYER], "no UV map"),
    "no such product": ([*RENDER, "--layer", "lipstick-clasic-red=FILES/lips.png"], "lipstick-classic-red"),
    "no such map": ([*RENDER, "--layer", "lipstick-berry=FILES/none.png"], "none.png does not exist"),
    "another size": ([*RENDER, *LAYER, "--layer", "lipstick-berry=FILES/small.png"], "same size"),
    "not a number": ([*RENDER, "--layer", "lipstick-berry=FILES/nan.exr"], "not numbers"),
    "beyond one": ([*RENDER, "--layer", "lipstick-berry=FILES/above.exr"], "between 0 and 1"),
    "no thickness": ([*RENDER, "--layer", "lipstick-berry=FILES/lips.png@thin"], "no thickness"),
    "no such channel": ([*RENDER, "--layer", "lipstick-berry=FILES/lips.png#B"], "no channel B"),
    "no such look": ([*RENDER, "--look", "FILES/none.json"], "none.json does not exist"),
    "a broken look": ([*RENDER, "--look", "FILES/broken.json"], "not readable JSON"),
    "no such skin": (["render", "FILES/head.obj", "--skin", "none.png", *LAYER], "none.png does not exist"),
    "no such light": ([*RENDER, *LAYER, "--light", "moon"], "moon"),
    "no light file": ([*RENDER, *LAYER, "--light", "moon.csv"], "moon.csv"),
    "no such products": ([*RENDER, *LAYER, "--products", "nowhere"], "product folder nowhere"),
    "no such view": ([*RENDER, *LAYER, "--view", "behind"], "no view or camera 'behind'"),
    "no size": ([*RENDER, *LAYER, "--size", "large"], "write it like 720x900"),
    "no samples": ([*RENDER, *LAYER, "--samples", "0"], "between 1 and"),
    "samples beyond Blender": ([*RENDER, *LAYER, "--samples", "99999999999"], "between 1 and"),
    "a seed beyond Blender": ([*RENDER, *LAYER, "--seed", "99999999999"], "between 0 and"),
    "a resolution below 0": (["bake", *RENDER[1:4], *LAYER, "--resolution", "-4"], "between 0 and 16384"),
    "a resolution beyond Blender": (["bake", *RENDER[1:4], *LAYER, "--resolution", "100000"], "between 0 and 16384"),
    "a thickness beyond Blender": ([*RENDER, "--layer", "lipstick-berry@500000um"], "between 0 and 100000"),
    "a map forgotten": ([*RENDER, "--layer", "lipstick-berry=@15um"], "names no map after '='"),
    "a damaged map": ([*RENDER, "--layer", "lipstick-berry=FILES/cut.png"], "is damaged"),
    "a folder as head": (["render", "FILES"], "is a folder"),
    "several views in one picture": ([*RENDER, *LAYER, "--view", "front,close-up", "--out", "a.png"], "give a folder"),
    "a save that is no blend": ([*RENDER, *LAYER, "--out", "a.png", "--save", "a.png"], "saved as .blend"),
    "a picture over the skin": ([*RENDER, *LAYER, "--out", "FILES/albedo.png"], "would replace a picture"),
    "a save in a locked folder": ([*RENDER, *LAYER, "--out", "a.png", "--save", "/proc/a.blend"], "Cannot write"),
    "another picture": ([*RENDER, *LAYER, "--out", "a.webp"], ".png or .exr"),
    "a locked folder": ([*RENDER, *LAYER, "--out", "/proc/km_makeup/a.png"], "choose another output folder"),
    "a locked bake": (["bake", *RENDER[1:4], *LAYER, "--out", "/proc/km_makeup"], "choose another output folder"),
    "a locked save": ([*RENDER, *LAYER, "--out", "a.png", "--save", "/proc/km_makeup/a.blend"], "/proc/km_makeup"),
    "nothing to bake": (["bake", "FILES/head.obj"], "no makeup to bake"),
    "no such engine": ([*RENDER, "--engine", "povray"], "povray"),
    "no command": ([], "COMMAND"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_ends_with_code_2_and_one_line_and_writes_nothing(run, tmp_path, case):
    arguments, message = BAD[case]
    if "/proc" in " ".join(arguments) and not Path("/proc").is_dir():
        pytest.skip("NOT TESTED: no /proc here")
    if arguments and "--log" not in arguments:
        arguments = [*arguments, "--log", "error"]
    code, _, err = run(*arguments)
    assert code == 2, err
    assert len(err) == 1 and err[0].startswith("km_makeup") and message in err[0], err
    assert not [file for file in tmp_path.rglob("*") if file.is_file()]


@pytest.fixture
def tiny_disk(tmp_path):
    """A full file system; root on Linux only."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        pytest.skip("NOT TESTED: a full disk needs root, to mount a tiny file system")
    folder = tmp_path / "tiny"
    folder.mkdir()
    done = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16k", "tmpfs", folder], capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"NOT TESTED: a full disk; cannot mount here ({done.stderr.strip()})")
    (folder / "filler").write_bytes(bytes(14_000))
    yield folder
    subprocess.run(["umount", folder], check=True)


@pytest.mark.parametrize("command", ["render", "bake", "save"])
def test_a_full_disk_ends_with_code_2_and_leaves_nothing_half_written(run, tiny_disk, tmp_path, command):
    head = ["FILES/head.obj", "--skin", "FILES/albedo.png", *LAYER, "--log", "error"]
    arguments = {
        "render": ["render", *head, *QUICK, "--size", "128x128", "--out", str(tiny_disk / "a.png"), "--colour", "live"],
        "bake": ["bake", *head, "--resolution", "128", "--out", str(tiny_disk)],
        "save": ["render", *head, *QUICK, "--out", str(tmp_path / "a.png"), "--save", str(tiny_disk / "a.blend")],
    }[command]
    code, _, err = run(*arguments)
    assert code == 2, err
    assert "disk" in err[-1] or "space" in err[-1]
    assert [file.name for file in tiny_disk.iterdir()] == ["filler"]


def shell(*arguments: str, **environment: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "km_makeup", *arguments],
        cwd=CHECKOUT, env={**os.environ, **environment}, capture_output=True, text=True, timeout=120,
    )  # fmt: skip


@pytest.fixture
def python_with_bpy():
    """`python -m km_makeup` is for the bpy module; the program Blender has its own command."""
    import bpy

    if bpy.app.binary_path:
        pytest.skip("NOT TESTED here: python -m km_makeup, which needs the bpy module")


def test_a_process_ends_with_code_2_and_one_line(python_with_bpy, files, tmp_path):
    ran = shell(
        "render", str(files / "head.obj"), "--layer", f"lipstick-berry={files / 'nan.exr'}",
        "--out", str(tmp_path / "a.png"), "--log", "error",
    )  # fmt: skip
    assert ran.returncode == 2
    (line,) = ran.stderr.splitlines()
    assert line.startswith("km_makeup: ") and "not numbers" in line and not (tmp_path / "a.png").exists()


def test_a_process_renders_a_picture(python_with_bpy, files, tmp_path):
    ran = shell(
        "render", str(files / "head.obj"), "--skin", str(files / "albedo.png"), "--layer",
        f"lipstick-berry={files / 'lips.png'}@15um", *QUICK, "--out", str(tmp_path / "a.png"),
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("command", ["render", "bake"])
def test_standard_output_of_a_process_is_the_json_alone(python_with_bpy, files, tmp_path, command):
    options = {"render": [*QUICK, "--out", str(tmp_path / "a.png")], "bake": ["--out", str(tmp_path / "textures")]}
    ran = shell(
        command, str(files / "head.obj"), "--layer", f"lipstick-berry={files / 'lips.png'}", *options[command], "--json"
    )
    assert ran.returncode == 0, ran.stderr
    assert json.loads(ran.stdout)["seconds" if command == "bake" else "pictures"]


def test_standard_output_of_a_process_is_the_files_alone(python_with_bpy, files, tmp_path):
    ran = shell(
        "bake", str(files / "head.obj"), "--layer", f"lipstick-berry={files / 'lips.png'}", "--out", str(tmp_path / "t")
    )
    assert ran.returncode == 0, ran.stderr
    written = [Path(line) for line in ran.stdout.splitlines()]
    assert sorted(written) == sorted((tmp_path / "t").iterdir())
    assert {f"Head_{name}.exr" for name in ("R", "T2", "R_up", "finish")} <= {path.name for path in written}


@pytest.mark.parametrize(
    ("layer", "message"), [("no-such-product", "no-such-product"), ("lipstick-berry=none.png", "none.png")]
)
def test_what_a_look_names_is_looked_for_before_the_head_is_opened(run, monkeypatch, layer, message):
    from km_makeup.blender import studio

    monkeypatch.setattr(studio, "open_head", lambda *_: pytest.fail("the head was opened"))
    code, _, err = run("render", "FILES/head.obj", "--layer", layer, "--log", "error")
    assert code == 2 and message in err[-1]


def test_a_bake_of_nothing_leaves_no_folder(run, tmp_path):
    code, _, err = run("bake", "FILES/head.obj", "--out", str(tmp_path / "new"), "--log", "error")
    assert code == 2 and "no makeup to bake" in err[-1] and not (tmp_path / "new").exists()


def test_a_process_that_is_asked_to_end_tidies_up(monkeypatch, capsys, tmp_path):
    import os
    import signal

    from km_makeup import cli
    from km_makeup.files import replacing

    def ends_itself(*_):
        with replacing(tmp_path / "a.png"):
            os.kill(os.getpid(), signal.SIGTERM)
            pytest.fail("it went on")

    monkeypatch.setattr(cli, "_doctor", ends_itself)
    before = signal.getsignal(signal.SIGTERM)
    assert cli.main(["doctor"]) == 143
    assert "stopped" in capsys.readouterr().err and not list(tmp_path.iterdir())
    assert signal.getsignal(signal.SIGTERM) is before


def test_the_doctor_finds_all_well(run):
    code, out, _ = run("doctor", "--json")
    findings = json.loads(out)
    assert code == 0 and {f["what"] for f in findings} >= {"Blender", "products", "computation"}
    assert all(f["good"] for f in findings)


def test_the_doctor_warns_of_a_clear_surface_that_casts_shadows_and_of_no_other(run, files):
    """A cornea over the head of the file: warned of; not where it casts no shadow, nor where shadows are solid."""
    import bpy

    code, out, _ = run("doctor", "FILES/head.blend", "--json")
    assert code == 0 and json.loads(out)[-1] == {
        "what": "shadows",
        "good": True,
        "detail": "no clear surface casts one",
    }
    bpy.ops.wm.open_mainfile(filepath=str(files / "head.blend"))
    cornea, lashes = scenes.head("Cornea", radius=0.01), scenes.head("Lashes", radius=0.02)
    clear = scenes.mixed("Clear", lambda tree: tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0])
    cornea.data.materials.append(clear)
    cut = scenes.skin("Cut out")
    scenes.principled_of(cut).inputs["Alpha"].default_value = 0.5
    lashes.data.materials.append(cut)

    def warned_of() -> str:
        bpy.ops.wm.save_as_mainfile(filepath=str(files / "clear.blend"))
        code, out, _ = run("doctor", "FILES/clear.blend", "--json")
        finding = json.loads(out)[-1]
        assert finding["what"] == "shadows" and finding["good"] == (code == 0)
        return finding["detail"].partition(":")[0]

    assert warned_of() == "Cornea (material Clear), Lashes (material Cut out)"
    bpy.data.objects["Cornea"].visible_shadow = False
    assert warned_of() == "Lashes (material Cut out)"
    bpy.data.materials["Cut out"].use_transparent_shadow = False
    assert warned_of() == "no clear surface casts one"


@pytest.mark.parametrize("command", ["render", "bake", "doctor"])
def test_every_command_shows_an_example_in_its_help(run, command):
    code, out, _ = run(command, "--help")
    assert code == 0 and f"example:\n  km_makeup {command}" in out
