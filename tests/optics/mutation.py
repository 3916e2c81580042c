"""Mutation testing of km_makeup/optics.

    python -m tests.optics.mutation                    all modules, an hour on two idle cores
    python -m tests.optics.mutation films fitting      only these
    python -m tests.optics.mutation --folder DIR films the same, in a folder that is kept: a run that was stopped goes on
    python -m tests.optics.mutation --folder DIR --collect films the page of what a stopped run has done, a random sample
    python -m tests.optics.mutation --again films      only the unexplained survivors of the page, with the tests of today
    python -m tests.optics.mutation --named            only the mistakes named below, a minute
    python -m tests.optics.mutation --total            the sums of the pages as they are

Writes a page per module, tests/results/optics_mutation_MODULE.md, so that a change of one module asks for that one only.
mutmut 3 (pip install mutmut) makes the mutants in a copy, `tests/optics/mutants.py` runs the tests against them: the fast
tests of the module first, all others against what is then left without an explanation. The tests in the copy are those
of tests/optics with fewer hypothesis examples, fewer products and a smaller sweep, and fits start fewer descents; without the real paints and the page
of hard cases: what they kill, the full tests kill. The mistakes named below are made by hand.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tests.stamps import RESULTS, ROOT, write_markdown

MODULES = (
    *("arrays", "diffusion", "films", "fitting", "interfaces", "inversion", "microfacets", "powder", "sensitivity"),
)
SETTINGS = """[mutmut]
source_paths=km_makeup/optics/
also_copy=
    km_makeup
    tests
"""
LEAST = 0.9
SMALLER = {
    "[date.today().toordinal(), 7]": "[7]",
    "sweep.run(250,": "sweep.run(20,",
    "products(400)": "products(40)",
    "products(3000, 4)": "products(600, 4)",
}
QUICKER = {
    "_ROUNDS, _FIRST_ROUNDS = 200, 25": "_ROUNDS, _FIRST_ROUNDS = 70, 12",
    "_START_THICKNESSES = (0.02, 0.2, 1.0, 4.0)": "_START_THICKNESSES = (0.2, 2.0)",
    "_START_RATIOS = np.geomspace(1e-5, 1e3, 25)": "_START_RATIOS = np.geomspace(1e-4, 1e2, 10)",
}
"""Constants of fitting.py, which no mutant touches: fewer descents, with which all tests still pass, in a third of the time."""
LEFT_OUT = ("test_reference.py", "test_hard_cases.py", "mutation.py", "mutants.py", "test_mutation.py")


@dataclass(frozen=True)
class Mistake:
    """A mistake of the paper or one easily made: what it is, where, what is written instead."""

    name: str
    module: str
    right: str
    wrong: str


NAMED = (
    Mistake(
        "Eq 3 as misprinted, T1 R1 T1",
        "films.py",
        "_lit(U.R_top, U.A_top, down, L.R_top, L.A_top,",
        "_lit(U.R_top, U.A_top, down, U.R_top, L.A_top,",
    ),
    Mistake(
        "the upper film lit from above in the denominator",
        "films.py",
        "bounce = np.multiply(U.R_bottom, L.R_top, out=d)",
        "bounce = np.multiply(U.R_top, L.R_top, out=d)",
    ),
    Mistake("the same where two whites meet", "films.py", "U.R_bottom * (L.A_top + L.T)", "U.R_top * (L.A_top + L.T)"),
    Mistake(
        "Eq 7 with a - 1 as printed",
        "inversion.py",
        "0.5 * (1 - R_inf) ** 2 * w / X",
        "(0.5 * (1 / np.maximum(R_inf, 1e-300) + R_inf) - 1) * R_inf * w / X",
    ),
    Mistake("1 - Rg R_inf as printed", "inversion.py", "((1 - R_g) + R_g * (1 - R_inf))", "(1 - R_g * R_inf)"),
    Mistake("Beckmann without its 1/pi", "microfacets.py", "np.log(np.pi * m2)", "np.log(m2)"),
    Mistake(
        "1 - R R in white on white",
        "films.py",
        "much = bounce >= 0.5",
        "much = bounce >= 1.5",
    ),
)


def copy_to(folder: Path) -> None:
    """The optics floor and its tests in the folder, the tests made small."""
    for name in ("__init__.py", "errors.py"):
        (folder / "km_makeup").mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "km_makeup" / name, folder / "km_makeup" / name)
    shutil.copytree(ROOT / "km_makeup" / "optics", folder / "km_makeup" / "optics", dirs_exist_ok=True)
    (folder / "setup.cfg").write_text(SETTINGS)
    shared = ROOT.parent / "shared"
    fitting = folder / "km_makeup" / "optics" / "fitting.py"
    text = fitting.read_text()
    for whole, part in QUICKER.items():
        if whole not in text:
            raise SystemExit(f"fitting.py does not hold {whole!r}; mend QUICKER in this file.")
        text = text.replace(whole, part)
    fitting.write_text(text)
    for link in (folder / "shared", folder.parent / "shared"):  # beside mutmut's own copy, and beside this one
        if shared.exists() and not link.exists():
            link.symlink_to(shared)
    copy_tests_to(folder)


def copy_tests_to(folder: Path) -> None:
    """The tests of the optics in the folder, made small."""
    shutil.copytree(ROOT / "tests" / "optics", folder / "tests" / "optics", dirs_exist_ok=True)
    shutil.copy(ROOT / "tests" / "conftest.py", folder / "tests" / "conftest.py")
    shutil.copy(ROOT / "tests" / "stamps.py", folder / "tests" / "stamps.py")
    for name in LEFT_OUT:
        (folder / "tests" / "optics" / name).unlink(missing_ok=True)
    for path in (folder / "tests" / "optics").glob("test_*.py"):
        text = re.sub(r"max_examples=\d+", "max_examples=12", path.read_text())
        for whole, part in SMALLER.items():
            text = text.replace(whole, part)
        path.write_text(text)


def named_mistakes(module: str = "") -> list[tuple[Mistake, str]]:
    """Every named mistake (of a module) with the test that finds it; an empty name where none does."""
    found = []
    for mistake in NAMED:
        if module and mistake.module != f"{module}.py":
            continue
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary) / "copy"
            copy_to(folder)
            path = folder / "km_makeup" / "optics" / mistake.module
            text = path.read_text()
            if text.count(mistake.right) != 1:
                raise SystemExit(
                    f"{mistake.module} does not hold {mistake.right!r} just once; mend NAMED in this file."
                )
            path.write_text(text.replace(mistake.right, mistake.wrong))
            run = subprocess.run(
                [
                    sys.executable,
                    "-m",
                    "pytest",
                    "-x",
                    "-q",
                    "-p",
                    "no:cacheprovider",
                    "--import-mode=importlib",
                    f"tests/optics/test_{mistake.module}",
                ],
                cwd=folder,
                env=os.environ | {"PYTHONPATH": str(folder)},
                capture_output=True,
                text=True,
                check=False,
            )
            failed = re.search(r"FAILED \S*::(\w+)", run.stdout)
            found.append((mistake, failed.group(1) if run.returncode == 1 and failed else ""))
    return found


def make_mutants(folder: Path) -> None:
    """Every mutant of the optics in folder/mutants, unless they are there already."""
    if (folder / "mutants").exists():
        return
    copy_to(folder)
    code = (
        "from pathlib import Path; import mutmut.__main__ as m; from mutmut.mutation import trampoline as t; "
        "t.set_mutant_under_test('mutant_generation'); Path('mutants').mkdir(); m.copy_src_dir(); "
        "m.copy_also_copy_files(); m.setup_source_paths(); m.create_mutants(2)"
    )
    subprocess.run([sys.executable, "-c", code], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def run_mutants(folder: Path, *options: str) -> None:
    """Run the tests against the mutants in the folder that have no result yet."""
    runner = Path(__file__).with_name("mutants.py")
    command = [sys.executable, str(runner), str(folder / "mutants"), str(folder / "results.txt"), *options]
    single = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    subprocess.run(command, env=os.environ | single, check=True)


def results(folder: Path, module: str) -> dict[str, str]:
    """What became of every mutant of a module so far."""
    file = folder / "results.txt"
    lines = file.read_text().splitlines() if file.exists() else []
    found = dict(line.split("\t") for line in lines)
    return {name: what for name, what in found.items() if name.split(".")[2] == module}


def results_of_page(folder: Path, module: str) -> None:
    """Write what the page of a module says into the folder's results, where those have nothing of it."""
    text = (RESULTS / f"optics_mutation_{module}.md").read_text(encoding="utf-8")
    survivors = {
        f"km_makeup.optics.{module}.{name}" for name in re.findall(r"^\| (x\S+__mutmut_\d+) \|", text, re.MULTILINE)
    }
    names = mutants_of(folder, module)
    if f"{len(names)} mutants, {len(names) - len(survivors)} killed" not in text or not survivors <= set(names):
        raise SystemExit(f"The page of {module} is of other mutants; run the module whole.")
    for name in survivors:
        row = "`{}` | `{}`".format(*(cell.replace("|", "\\|") for cell in difference(folder, name)))
        if row not in text:
            raise SystemExit(f"{name} is another mutant than the page says; run the module whole.")
    with (folder / "results.txt").open("a") as out:
        out.writelines(f"{name}\t{'survived' if name in survivors else 'killed'}\n" for name in names)


def mutants_of(folder: Path, module: str) -> list[str]:
    """The names of all mutants of a module."""
    meta = folder / "mutants" / "km_makeup" / "optics" / f"{module}.py.meta"
    return list(json.loads(meta.read_text())["exit_code_by_key"])


def interval(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927)."""
    z, share = 1.96, hits / of
    middle = (share + z * z / (2 * of)) / (1 + z * z / of)
    half = z / (1 + z * z / of) * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of))
    return middle - half, middle + half


def unexplained(folder: Path, module: str) -> list[str]:
    """The survivors without a reason."""
    left = [name for name, what in results(folder, module).items() if what == "survived"]
    return [name for name in left if not explanation(name, *difference(folder, name))]


@cache
def functions(path: Path) -> dict[str, list[str]]:
    """The lines of every function and method in a file of mutants, by name."""
    text = path.read_text()
    lines = text.splitlines()
    found = {}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            found[node.name] = [line.strip() for line in lines[node.lineno - 1 : node.end_lineno]]
    return found


def difference(folder: Path, name: str) -> tuple[str, str]:
    """What a mutant changes, before and after."""
    module, function = name.removeprefix("km_makeup.optics.").split(".", 1)
    of_module = functions(folder / "mutants" / "km_makeup" / "optics" / f"{module}.py")
    original = re.sub(r"__mutmut_\d+$", "__mutmut_orig", function)
    before, after = ([line.replace(n, "") for line in of_module[n]] for n in (original, function))
    changes = list(difflib.ndiff(before, after))
    return tuple(" ".join(line[2:] for line in changes if line.startswith(sign)) for sign in "-+")


def explanation(name: str, old: str, new: str) -> str:
    """Why a survivor survives, by the first rule of EXPLANATIONS that fits."""
    from tests.optics.survivors import EXPLANATIONS

    counted = re.search(r"len\(|_MOST|ndim|size|shape|(films|count|R_g) [<>]", old)
    if not counted and re.sub("([<>])=", r"\1", old) == re.sub("([<>])=", r"\1", new):
        return "Differs only where the two numbers compared are equal to the last digit; either answer is right there."
    for where, pattern, why in EXPLANATIONS:
        if re.search(where, name) and re.search(pattern, f"{old} => {new}"):
            return why
    return ""


def page(folder: Path, module: str) -> str:
    """The counts, the named mistakes of the module and its survivors."""
    found = results(folder, module)
    count = Counter(found.values())
    survivors = sorted(name for name, what in found.items() if what == "survived")
    killed = len(found) - len(survivors)
    lines = [f"{len(found)} mutants, {killed} killed ({count['timeout']} of them by running on)."]
    there = len(mutants_of(folder, module))
    if len(found) < there:
        low, high = (100 * share for share in interval(killed, len(found)))
        lines[0] += (
            f" These are a random sample of the {there} there are: with 95 % {low:.1f} to {high:.1f} % are killed."
        )
    named = named_mistakes(module)
    if named:
        lines += ["", "## Mistakes by hand", "", "| mistake | found by |", "|---|---|"]
        lines += [f"| {mistake.name} | {test or '**not found**'} |" for mistake, test in named]
    groups: dict[str, list[str]] = {}
    for name in survivors:
        old, new = difference(folder, name)
        cells = (name.removeprefix(f"km_makeup.optics.{module}."), f"`{old}`", f"`{new}`")
        row = "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
        groups.setdefault(explanation(name, old, new) or "**Not explained.**", []).append(row)
    lines += ["", "## Survivors"]
    for why, rows in groups.items():
        lines += ["", f"{why} ({len(rows)})", "", "| mutant | is | becomes |", "|---|---|---|", *rows]
    return "\n".join([*lines, ""])


def total() -> tuple[float, list[str]]:
    """The share of all mutants that is killed, by the pages (a sample stands for its module), and what is wrong with them."""
    made = killed = 0.0
    wrong = []
    for module in MODULES:
        file = RESULTS / f"optics_mutation_{module}.md"
        text = file.read_text(encoding="utf-8") if file.exists() else ""
        counts = re.search(r"^(\d+) mutants, (\d+) killed", text, re.MULTILINE)
        if counts is None:
            wrong.append(f"{module}: not run")
            continue
        share = int(counts[2]) / int(counts[1])
        sample = re.search(r"sample of the (\d+)", text)
        there = int(sample[1] if sample else counts[1])
        made, killed = made + there, killed + share * there
        wrong += [f"{module}: {what}" for what in ("not found", "Not explained") if f"**{what}" in text]
        of = f" of a sample of the {there} there are" if sample else ""
        print(f"{module}: {counts[2]} of {counts[1]}{of} killed, {100 * share:.1f} %")
    print(f"all {made:.0f}: {100 * killed / max(made, 1):.1f} %")
    return killed / max(made, 1), wrong


def main() -> int:
    """Run, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="*", choices=[[], *MODULES], metavar="MODULE", help=", ".join(MODULES))
    parser.add_argument("--named", action="store_true", help="only the mistakes named in this file")
    parser.add_argument("--total", action="store_true", help="only the sums of the pages")
    parser.add_argument("--collect", action="store_true", help="run nothing, write the pages from --folder")
    parser.add_argument(
        "--again", action="store_true", help="only the survivors without a reason, with the tests of today"
    )
    parser.add_argument("--folder", type=Path, help="where the copy is made and kept")
    parser.add_argument("--children", type=int, default=2, help="processes at a time")
    arguments = parser.parse_args()
    if arguments.named:
        found = named_mistakes()
        for mistake, test in found:
            print(f"{mistake.name}: {test or 'NOT FOUND'}")
        return 0 if all(test for _, test in found) else 1
    if arguments.collect:
        for module in arguments.modules or MODULES:
            write_page(arguments.folder, module)
    elif not arguments.total:
        with tempfile.TemporaryDirectory() as temporary:
            run = run_again if arguments.again else run_modules
            run(arguments.folder or Path(temporary) / "copy", arguments.modules or MODULES, arguments.children)
    share, wrong = total()
    for sentence in wrong:
        print(sentence)
    return 1 if wrong or share < LEAST else 0


def run_modules(folder: Path, modules: Sequence[str], children: int) -> None:
    """Make the mutants, run the modules', and write their pages."""
    make_mutants(folder)
    for module in modules:
        run_mutants(folder, "--children", str(children), "--modules", module)
        run_left(folder, module, children)
        write_page(folder, module)


def run_left(folder: Path, module: str, children: int) -> None:
    """Run every test against the survivors without a reason."""
    left = unexplained(folder, module)
    if left:
        (folder / "left.txt").write_text("\n".join(left))
        again = ("--again", str(folder / "left.txt"), "--every-test")
        run_mutants(folder, "--children", str(children), "--modules", module, *again)


def run_again(folder: Path, modules: Sequence[str], children: int) -> None:
    """Run the tests as they are now against the survivors without a reason, and write the pages anew."""
    make_mutants(folder)
    copy_tests_to(folder / "mutants")
    for module in modules:
        if not results(folder, module):
            results_of_page(folder, module)
        run_left(folder, module, children)
        write_page(folder, module)


def write_page(folder: Path, module: str) -> None:
    """Write the page of a module from what was run in the folder."""
    command, covers = f"python -m tests.optics.mutation {module}", [f"km_makeup/optics/{module}.py"]
    print(write_markdown(f"optics_mutation_{module}.md", f"Mutants of {module}", command, covers, page(folder, module)))


if __name__ == "__main__":
    sys.exit(main())
