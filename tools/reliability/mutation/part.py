"""Mutation tests: a small mistake is put into a module, and the tests have to notice it."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from types import CodeType
from typing import Any

from tools.reliability.chunk import ROOT, Chunk, Part, Result
from tools.reliability.journal import Journal
from tools.reliability.mutation.mutants import Mutant, count, draw
from tools.reliability.mutation.targets import TARGETS, Target
from tools.reliability.mutation.trial import Replacing, run_tests, warm_up

EQUIVALENT = Path(__file__).with_name("equivalent.json")
PER_CHUNK = 10
FIRST_LIMIT_S, SPARE_S, FACTOR = 600, 20, 5  # CPU seconds of the tests without and with a mutant
NO_TESTS = 5  # pytest's exit code
BROKEN = compile("raise RuntimeError", "broken.py", "exec")
OURS = tuple(f"tools/reliability/mutation/{name}" for name in ("mutants.py", "trial.py"))


def chunks() -> list[Chunk]:
    """Some mutants of one module each; the first ones of every module come first."""
    found = []
    for target in TARGETS:
        tests = dict.fromkeys(test.partition("::")[0] for test in target.tests)
        sources, known = (target.path, *tests, *OURS), [each for each in equivalents() if each["path"] == target.path]
        mutants = min(target.mutants, count((ROOT / target.path).read_text(encoding="utf-8")))
        for number in range(-(-mutants // PER_CHUNK)):
            environment = {"NUMBA_DISABLE_JIT": "1", "CPS_ENVS_TRUST": "1"}
            chunk = Chunk("mutation", target.path, number, sources, json.dumps(known), environment, 7200, 1800)
            found.append(chunk)
    return sorted(found, key=lambda chunk: chunk.number)


def run(chunk: Chunk, journal: Journal) -> Result:
    """Try the mutants of a chunk.

    Raises:
        RuntimeError: the tests fail without a mutant, or pass with a module that cannot be imported.
    """
    target = next(each for each in TARGETS if each.path == chunk.row)
    mutants = _mutants(target, chunk.number)
    warm_up()
    counts = dict.fromkeys(("mutants", "killed", "late", "equivalent", "survived"), 0)
    survivors = []
    with tempfile.TemporaryDirectory() as folder:
        os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = folder
        code, used = run_tests(ROOT, target.tests, FIRST_LIMIT_S)
        if code:
            raise RuntimeError(f"the tests of {target.path} end with {code} before anything is changed")
        if run_tests(ROOT, target.tests, FIRST_LIMIT_S, _replacing(target, BROKEN))[0] in (0, NO_TESTS):
            raise RuntimeError(f"the tests of {target.path} do not use it")
        for place, mutant in enumerate(mutants):
            if journal.begin(place, f"line {mutant.line}: {mutant.change}"):
                outcome = _try(target, mutant, int(FACTOR * used) + SPARE_S)
                counts["mutants"] += 1
                counts[outcome] += 1
                if outcome == "survived":
                    survivors.append(f"{target.path}:{mutant.line}: {mutant.change}")
    return {"counts": counts, "examples": {f"survivor {i}": text for i, text in enumerate(survivors)}}


def _mutants(target: Target, number: int) -> list[Mutant]:
    source = (ROOT / target.path).read_text(encoding="utf-8")
    drawn = draw(source, str(ROOT / target.path), target.mutants)
    return drawn[PER_CHUNK * number : PER_CHUNK * (number + 1)]


def _try(target: Target, mutant: Mutant, limit_s: int) -> str:
    code, _ = run_tests(ROOT, target.tests, limit_s, _replacing(target, mutant.code))
    if code == 0:
        return "equivalent" if _is_equivalent(target.path, mutant) else "survived"
    return "late" if code < 0 else "killed"


def _replacing(target: Target, code: CodeType) -> Replacing:
    return Replacing(target.module, ROOT / target.path, code)


def _is_equivalent(path: str, mutant: Mutant) -> bool:
    line = (ROOT / path).read_text(encoding="utf-8").splitlines()[mutant.line - 1].strip()
    known = [(each["path"], each["line"], each["change"]) for each in equivalents()]
    return (path, line, mutant.change) in known


@lru_cache
def equivalents() -> Sequence[dict[str, Any]]:
    """Mutants that no test can notice: path, line, change and the reason."""
    found: list[dict[str, Any]] = json.loads(EQUIVALENT.read_text(encoding="utf-8"))
    return found


PART = Part(
    name="mutation",
    title="Mutation tests",
    about=(
        "A mutant is a module with one small mistake: an operator, a comparison, a condition or a number is changed. "
        "The tests nearest to the module have to fail. Mutants are drawn by a fixed seed, so many of a module as its "
        "row says; of the payoffs all that there are. What has no row here is not mutated: filters and estimates, "
        "detectors, controllers and other policies, viewers, learning, the adapters, commands and pages, and of the "
        "chapters all but the rules of verdicts. Kernels run as plain Python. "
        "An equivalent mutant changes nothing that anybody could observe; "
        "`tools/reliability/mutation/equivalent.json` gives the reason for each."
    ),
    columns={
        "mutants": "mutants",
        "killed": "a test failed",
        "late": "stopped (endless, or out of memory)",
        "equivalent": "equivalent",
        "survived": "survived",
    },
    forbidden=frozenset({"survived"}),
    chunks=chunks,
    run=run,
)
