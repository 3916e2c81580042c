"""Runs the tests of the optics against every mutant in a copy, in forks of one process.

    python tests/optics/mutants.py COPY/mutants RESULTS [--modules films fitting] [--children 2]

`tests.optics.mutation` starts it. Python, numpy and pytest start and collect once; a fork is a mutant, which runs the
fast tests of its module that reach its function, first those that killed most mutants for their time, until one fails; with
--every-test the slow tests and those of the other modules too. Processor time and memory of a fork are bounded, so that an
endless loop is a kill and the machine stays usable. RESULTS gains a line per mutant (name, killed, survived or timeout);
what is in it already is not run again, so a run may be stopped and resumed; the last line of a mutant counts. The order is
shuffled by a fixed seed, so that what a stopped run has done is a random sample.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import random
import resource
import sys
import time
from collections import Counter
from pathlib import Path

import hypothesis
import pytest
from _pytest.runner import runtestprotocol

OWN_TESTS = {
    "fitting": ("fitting", "fitting_prior"),
    "arrays": ("odd_input", "films"),
    "sensitivity": ("inversion", "fitting", "fitting_prior"),
}
"""The tests of modules that have none of their name, or others beside it."""
MEMORY = 4 << 30
FAST = 0.6
MANY = 250
"""The exit status of a fork whose test is the 250th or a later one, or none."""
SEED = 20130501


class Forks:
    """A pytest plugin in place of the loop over the tests."""

    def __init__(self, mutants: list[str], results: Path, children: int, everything: bool) -> None:
        self.mutants, self.results, self.children, self.everything = mutants, results, children, everything
        self.reached: dict[str, list[pytest.Item]] = {}
        self.seconds: dict[pytest.Item, float] = {}
        self.kills: Counter[pytest.Item] = Counter()

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Measure every test once without a mutant, then run all mutants."""
        self.measure(session.items)
        gc.freeze()  # a fork that collects would copy all of the memory
        gc.disable()
        running: dict[int, tuple[str, list[pytest.Item]]] = {}
        with self.results.open("a") as out:
            for done, name in enumerate(self.mutants):
                while len(running) >= self.children:
                    self.reap(running, out)
                tests = self.tests_of(name)
                pid = os.fork()
                if pid == 0:
                    self.child(name, tests)
                running[pid] = name, tests
                if done % 50 == 0:
                    print(f"{time.strftime('%H:%M:%S')} {done} of {len(self.mutants)}", flush=True)
            while running:
                self.reap(running, out)
        return True

    def measure(self, items: list[pytest.Item]) -> None:
        """Which functions every test reaches, and how long it takes."""
        from mutmut.mutation import trampoline

        hits: set[str] = set()
        trampoline.record_trampoline_hit = lambda name, caller=None: hits.add(name)
        os.environ["MUTANT_UNDER_TEST"] = "stats"
        for item in items:
            hits.clear()
            start = time.process_time()
            if not passes(item):
                raise SystemExit(f"{item.nodeid} fails without any mutant; mend the tests first.")
            self.seconds[item] = time.process_time() - start
            for name in hits:
                self.reached.setdefault(name, []).append(item)
        os.environ["MUTANT_UNDER_TEST"] = ""
        print(f"{len(items)} tests, {sum(self.seconds.values()):.0f} s", flush=True)
        for item in sorted(items, key=lambda item: -self.seconds[item])[:40]:
            print(f"{self.seconds[item]:6.2f} s  {item.nodeid}", flush=True)

    def tests_of(self, name: str) -> list[pytest.Item]:
        """The tests that reach a mutant's function, the fast ones of its own module first."""
        module = name.split(".")[2]
        own = own_tests(module)
        reached = self.reached.get(name.rpartition("__mutmut_")[0], [])
        near = {item: item.path.name in own and self.seconds[item] < FAST for item in reached}
        chosen = [item for item in reached if near[item] or self.everything]
        return sorted(
            chosen, key=lambda item: (not near[item], (self.seconds[item] + 0.005) / (self.kills[item] + 0.3))
        )

    def child(self, name: str, tests: list[pytest.Item]) -> None:
        """Run the tests of a mutant and leave with the number of the first that fails, 0 where none does."""
        limit = int(5 + 8 * sum(self.seconds[item] for item in tests))
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        os.environ["MUTANT_UNDER_TEST"] = name
        try:
            code = next((min(number, MANY) for number, item in enumerate(tests, 1) if not passes(item)), 0)
        except BaseException:  # noqa: BLE001 what a mutant makes of pytest itself is a kill
            code = MANY
        os._exit(code)

    def reap(self, running: dict[int, tuple[str, list[pytest.Item]]], out) -> None:
        """Wait for one fork and write what became of it."""
        pid, status = os.waitpid(-1, 0)
        code = os.waitstatus_to_exitcode(status)
        name, tests = running.pop(pid)
        if 0 < code < MANY:
            self.kills[tests[code - 1]] += 1
        out.write(f"{name}\t{'survived' if code == 0 else 'killed' if code > 0 else 'timeout'}\n")
        out.flush()


def own_tests(module: str) -> tuple[str, ...]:
    """The files of a module's own tests."""
    return tuple(f"test_{part}.py" for part in (*OWN_TESTS.get(module, (module,)), "refusals"))


def passes(item: pytest.Item) -> bool:
    """Whether a test passes."""
    return not any(report.failed for report in runtestprotocol(item, log=False, nextitem=None))


def main() -> int:
    """Collect once and run what has no result yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("results", type=Path)
    parser.add_argument("--modules", nargs="*")
    parser.add_argument("--children", type=int, default=2)
    parser.add_argument("--again", type=Path, help="a file of mutants to run, with a result or not")
    parser.add_argument("--every-test", action="store_true", help="run the slow tests and those of other modules too")
    arguments = parser.parse_args()
    results = arguments.results.resolve()
    again = arguments.again.read_text().split() if arguments.again else []
    os.chdir(arguments.folder)
    sys.path[0] = str(Path.cwd())
    hypothesis.settings.register_profile(
        "mutants", derandomize=True, database=None, phases=[hypothesis.Phase.explicit, hypothesis.Phase.generate]
    )
    hypothesis.settings.load_profile("mutants")
    seen = {line.split("\t")[0] for line in results.read_text().splitlines()} if results.exists() else set()
    names = []
    for meta in sorted(Path("km_makeup/optics").glob("*.meta")):
        if not arguments.modules or meta.name.removesuffix(".py.meta") in arguments.modules:
            keys = json.loads(meta.read_text())["exit_code_by_key"]
            names += [name for name in keys if name not in seen]
    random.Random(SEED).shuffle(names)
    if arguments.again:
        names = again
    modules = {name.split(".")[2] for name in names}
    files = {f"tests/optics/{file}" for module in modules for file in own_tests(module)}
    # A traceback in another style parses the file of mutants, megabytes long.
    plain = ["-q", "-s", "--tb=native", "-p", "no:cacheprovider", "-p", "no:timeout", "--import-mode=importlib"]
    return int(
        pytest.main(
            [*plain, *(["tests/optics"] if arguments.every_test else sorted(files))],
            plugins=[Forks(names, results, arguments.children, arguments.every_test)],
        )
    )


if __name__ == "__main__":
    sys.exit(main())
