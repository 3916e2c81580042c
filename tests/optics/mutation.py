"""Mutation testing of km_makeup/optics.

    python -m tests.optics.mutation                  all mutants (an hour on two cores), writes tests/results/optics_mutation.md
    python -m tests.optics.mutation --named          only the mistakes named below, a minute
    python -m tests.optics.mutation --collect DIR    writes the page from a run in DIR that was stopped and resumed

mutmut 3 (pip install mutmut) makes the mutants and runs the tests that reach each of them, in a copy. The tests in the copy are those of
tests/optics with fewer hypothesis examples and a smaller sweep, without the real paints and the page of hard cases: what
they kill, the full tests kill. The mistakes named below are made by hand.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tests.optics.report import ROOT, write_result

SETTINGS = """[mutmut]
source_paths=km_makeup/optics/
also_copy=
    km_makeup
    tests
pytest_add_cli_args=
    -x
    -q
    -p
    no:cacheprovider
pytest_add_cli_args_test_selection=tests/optics
"""
LEFT_OUT = ("test_reference.py", "test_hard_cases.py", "mutation.py")


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
        "R_top=U.R_top + down * L.R_top * U.T_up",
        "R_top=U.R_top + down * U.R_top * U.T_up",
    ),
    Mistake(
        "the upper film lit from above in the denominator",
        "films.py",
        "bounce = U.R_bottom * L.R_top",
        "bounce = U.R_top * L.R_top",
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
        "np.where(bounce < 0.5, 1 - bounce,",
        "np.where(bounce < 1.5, 1 - bounce,",
    ),
)


def copy_to(folder: Path) -> None:
    """The optics floor and its tests in the folder, the tests made small."""
    for name in ("__init__.py", "errors.py"):
        (folder / "km_makeup").mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "km_makeup" / name, folder / "km_makeup" / name)
    shutil.copytree(ROOT / "km_makeup" / "optics", folder / "km_makeup" / "optics", dirs_exist_ok=True)
    shutil.copytree(ROOT / "tests" / "optics", folder / "tests" / "optics", dirs_exist_ok=True)
    shutil.copy(ROOT / "tests" / "conftest.py", folder / "tests" / "conftest.py")
    (folder / "setup.cfg").write_text(SETTINGS)
    shared = ROOT.parent / "shared"
    for link in (folder / "shared", folder.parent / "shared"):  # beside mutmut's own copy, and beside this one
        if shared.exists() and not link.exists():
            link.symlink_to(shared)
    for name in LEFT_OUT:
        (folder / "tests" / "optics" / name).unlink(missing_ok=True)
    for path in (folder / "tests" / "optics").glob("test_*.py"):
        text = re.sub(r"max_examples=\d+", "max_examples=25", path.read_text())
        text = text.replace("[date.today().toordinal(), 7]", "[7]").replace("sweep.run(250,", "sweep.run(60,")
        path.write_text(text)


def named_mistakes() -> list[tuple[Mistake, str]]:
    """Every named mistake with the test that finds it; an empty name where none does."""
    found = []
    for mistake in NAMED:
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


def collect(folder: Path) -> tuple[dict[str, Counter], list[str]]:
    """Killed and survived per module, and the names of the survivors, of a mutmut run in the folder."""
    counts: dict[str, Counter] = {}
    survivors = []
    for path in sorted((folder / "mutants" / "km_makeup" / "optics").glob("*.meta")):
        results = json.loads(path.read_text())["exit_code_by_key"]
        if results:
            counts[path.name.removesuffix(".meta")] = Counter(
                "not run" if code is None else "survived" if code == 0 else "killed" for code in results.values()
            )
            survivors += [name for name, code in results.items() if code == 0]
    return counts, survivors


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

    if re.sub("([<>])=", r"\1", old) == re.sub("([<>])=", r"\1", new):
        return "Differs only where the two numbers compared are equal to the last digit; either answer is right there."
    for where, pattern, why in EXPLANATIONS:
        if re.search(where, name) and re.search(pattern, f"{old} => {new}"):
            return why
    return ""


def page(folder: Path) -> str:
    """The named mistakes, the counts and the survivors."""
    lines = ["## Mistakes of the paper and others by hand", "", "| mistake | found by |", "|---|---|"]
    lines += [f"| {mistake.name} | {test or '**not found**'} |" for mistake, test in named_mistakes()]
    counts, survivors = collect(folder)
    lines += [
        "",
        "## Mutants",
        "",
        "| module | killed | survived | not run | killed of those run |",
        "|---|---:|---:|---:|---:|",
    ]
    total: Counter = Counter()
    for module, count in [*counts.items(), ("all", total)]:
        if module != "all":
            total.update(count)
        ran = count["killed"] + count["survived"]
        share = f"{100 * count['killed'] / ran:.1f} %" if ran else "-"
        lines.append(f"| {module} | {count['killed']} | {count['survived']} | {count['not run']} | {share} |")
    lines += ["", "## Survivors", "", "| mutant | is | becomes | why it survives |", "|---|---|---|---|"]
    unexplained = 0
    for name in survivors:
        old, new = difference(folder, name)
        why = explanation(name, old, new)
        unexplained += not why
        cells = (name.removeprefix("km_makeup.optics."), f"`{old}`", f"`{new}`", why or "**not explained**")
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    lines += ["", f"{len(survivors)} survivors, {unexplained} not explained.", ""]
    return "\n".join(lines)


def main() -> int:
    """Run or collect, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--named", action="store_true", help="only the mistakes named in this file")
    parser.add_argument("--collect", type=Path, metavar="DIR", help="a folder in which mutmut ran")
    parser.add_argument("--note", default="", help="a sentence for the page, on how the run went")
    parser.add_argument("--children", type=int, default=2, help="processes at a time")
    arguments = parser.parse_args()
    if arguments.named:
        found = named_mistakes()
        for mistake, test in found:
            print(f"{mistake.name}: {test or 'NOT FOUND'}")
        return 0 if all(test for _, test in found) else 1
    if arguments.collect:
        text = page(arguments.collect)
    else:
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary) / "copy"
            copy_to(folder)
            command = [str(Path(sys.executable).parent / "mutmut"), "run", "--max-children", str(arguments.children)]
            subprocess.run(command, cwd=folder, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"}, check=False)
            text = page(folder)
    text = f"{arguments.note}\n\n{text}" if arguments.note else text
    print(text)
    print(write_result("optics_mutation.md", "Mutation testing of the optics", "tests.optics.mutation", text))
    return 0


if __name__ == "__main__":
    sys.exit(main())
