"""`python -m tools.mutation`: puts small mistakes into modules, one at a time, and names those that no test notices.

A survivor is a test that is missing, or a change that nobody could observe: look at it. Kernels run as plain Python.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import os
import random
import resource
import shlex
from collections.abc import Iterator
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
TARGETS = {  # modules, and the tests that have to notice a mistake in them; other tests take minutes in plain Python
    "cps_envs/core/game/match.py": "tests/core/{game/test_match,interfaces/test_environments}.py "
    "tests/core/interfaces/test_frame_skip.py tests/core/policies/test_{mixture,policy_state}.py",
    "cps_envs/core/interfaces/vector_env.py": "tests/core/interfaces/test_{reset_masks,environments,frame_skip}.py "
    "tests/core/conformance/test_edges.py",
    "cps_envs/core/declare/{actions,fields}.py": "tests/core/declare/test_{actions,fields}.py",
    "cps_envs/core/compute/clock.py": "tests/core/{compute/test_clock,game/test_match,interfaces/test_environments}.py",
    "cps_envs/core/compute/{streams,generators}.py": "tests/core/compute/test_{generators,streams}.py",
    "cps_envs/core/learning/{wiring,wired_player,side,beside,scaling,outside,setting}.py": (
        "tests/core/learning/test_{by_value,setting}.py tests/core/learning/test_scaling.py -k 'not ships'"
    ),
    "cps_envs/core/interfaces/learning_env.py": "tests/core/learning/test_{by_value,learning_env}.py "
    "tests/core/interfaces/test_turns.py -k 'not short_names'",
    "cps_envs/core/interfaces/agents_batch.py": "tests/core/interfaces/test_agents_batch.py "
    "tests/core/learning/test_by_value.py -k 'not scale'",
    "cps_envs/core/interfaces/configured.py": "tests/core/interfaces/test_configure.py -k 'not problems and not liars'",
    "cps_envs/core/declare/{series,traces}.py": "tests/core/declare/test_{series,traces}.py",
    "cps_envs/core/{declare,game}/objective.py": "tests/core/game/test_paid.py",
    "cps_envs/core/game/configuration_file.py": "tests/core/game/test_configuration_file.py "
    "-k 'not door and not beside and not practise'",
    "cps_envs/core/policies/{reference,team}.py": "tests/core/policies/test_reference.py "
    "tests/core/learning/test_by_value.py -k 'not scale'",
    "cps_envs/core/policies/mixture.py": "tests/core/policies/test_{mixture,policy}.py",
    "cps_envs/disbanding/dynamics.py": "tests/disbanding/test_{contact,reference}.py",
    "cps_envs/disbanding/{payoff,observation,start}.py": "tests/disbanding/test_{game,radio,circumstances}.py -k "
    "'measured or charges or budget or number or sees or rows or silence or pause or start or begins or known'",
    "cps_envs/fdi/{dynamics,payoff}.py": "tests/fdi/test_{correcting,game,model,duel,instability}.py",
    "cps_envs/fdi/{observation,sensors,drawing}.py": "tests/fdi/test_{game,duel}.py",
    "cps_envs/hvac/dynamics.py": "tests/hvac/test_{reference,building}.py",
    "cps_envs/hvac/payoff.py": "tests/hvac/test_payoff.py",
    "cps_envs/hvac/{observation,sensors,start}.py": "tests/hvac/test_{config,game}.py -k 'sets or reach or attack or "
    "sees or choice or drawn or begins or draws or prefix or forged'",
    "cps_envs/rogue/dynamics.py": "tests/rogue/test_{dynamics,reference}.py",
    "cps_envs/rogue/lanes.py": "tests/rogue/test_{lanes,reference}.py -k 'comes_back or standing'",
    "cps_envs/rogue/{payoff,observation,start}.py": "tests/rogue/test_game.py -k 'measured or nobody or draw or price "
    "or sees or rows or noise or begins'",
    "agents/cps_agents/zoo/network.py": "tests/agents/test_zoo_{network,damage}.py",
    "agents/cps_agents/arena/statistics.py": "tests/agents/test_evaluation_statistics.py",
    "agents/cps_agents/league/equilibrium.py": "tests/agents/test_league_{equilibrium,value}.py",
    "agents/cps_agents/league/exploitability.py": "tests/agents/test_league_response.py -k 'gain or fresh or cannot'",
    "agents/cps_agents/zoo/references.py": "tests/agents/test_references.py -k 'not folder or plain or ends'",
    "agents/cps_agents/scoring/board.py": "tests/agents/test_ranks.py",
    "agents/cps_agents/scoring/score.py": "tests/agents/test_scoring.py -k 'weighs or worst or same or digits or part'",
    "paper/cps_paper/verdicts.py": "tests/baselines/test_exhibit.py -k 'left or near or rule or unit'",
}
HEAVY = ("hypothesis", "numba", "gymnasium", "pettingzoo", "scipy.stats", "safetensors.numpy")  # imported once
PYTEST = ("-xq", "-p", "no:cacheprovider", "-p", "no:xdist", "--hypothesis-seed=0")
FIRST_LIMIT_S, SPARE_S, FACTOR = 600, 20, 5  # CPU seconds of the tests without and with a mistake
PAIRS = ("Lt LtE", "Gt GtE", "Eq NotEq", "Is IsNot", "In NotIn", "Add Sub", "Mult Div", "BitAnd BitOr", "And Or")
BLOCKS = ("body", "orelse", "finalbody")  # fields of statements that hold others
SWAPPED = {a: b for pair in PAIRS for a, b in (pair.split(), pair.split()[::-1])}
SWAPPED |= dict.fromkeys(("FloorDiv", "Mod", "Pow"), "Mult") | dict.fromkeys(("USub", "Invert"), "UAdd")


def spread(text: str) -> list[str]:
    """A text with one `{a,b}` as several."""
    before, _, rest = text.partition("{")
    inside, _, after = rest.partition("}")
    return [before + each + after for each in inside.split(",")]


MODULES = {path: tests for paths, tests in TARGETS.items() for path in spread(paths)}


def mutants(source: str, path: str) -> list[tuple[str, CodeType]]:
    """A module with one mistake each: the line and the change in words, and the code."""
    tree, found = ast.parse(source), []
    for node, name, value in list(_changes(tree)):
        kept = getattr(node, name)
        told = next(old for old, new in zip(kept, value, strict=True) if old is not new) if name in BLOCKS else node
        before = ast.unparse(told).splitlines()[0]
        setattr(node, name, value)
        after = "pass" if name in BLOCKS else ast.unparse(node).splitlines()[0]
        code = compile(ast.fix_missing_locations(tree), path, "exec")
        found.append((f"{path}:{getattr(told, 'lineno', 0)}: {before[:100]}  ->  {after[:100]}", code))
        setattr(node, name, kept)
    return found


def _changes(tree: ast.Module) -> Iterator[tuple[ast.AST, str, Any]]:
    """A node, its field and what the field becomes; not in annotations, decorators, messages and shapes."""
    quiet = {id(each) for node in ast.walk(tree) for part in _quiet(node) for each in ast.walk(part)}
    for node in (each for each in ast.walk(tree) if id(each) not in quiet):
        blocks: list[tuple[str, Any]] = [(name, getattr(node, name, None)) for name in BLOCKS]
        for name, block in blocks:
            for place, each in enumerate(block if isinstance(block, list) else ()):
                if _acts(each):
                    yield node, name, [*block[:place], ast.Pass(), *block[place + 1 :]]
        name, old = next(((name, op) for name in ("op", "ops") if (op := getattr(node, name, None))), ("", None))
        kinds = [type(each).__name__ for each in (old if isinstance(old, list) else [old])]
        if len(kinds) == 1 and kinds[0] in SWAPPED:
            new = getattr(ast, SWAPPED[kinds[0]])()
            yield node, name, [new] if name == "ops" else new
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            yield node, "operand", ast.UnaryOp(ast.Not(), node.operand)
        elif isinstance(node, (ast.If, ast.IfExp)):
            yield from ((node, "test", ast.Constant(value)) for value in (True, False))
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
            yield node, "value", not node.value
        elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
            yield node, "value", node.value + (1 if isinstance(node.value, int) else 0.5 * node.value + 0.1)


def _acts(statement: ast.AST) -> bool:
    """Whether all that a statement does is to change something: it can be left out."""
    if isinstance(statement, ast.Assign):
        return all(isinstance(target, (ast.Attribute, ast.Subscript)) for target in statement.targets)
    calls = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call)
    return calls or isinstance(statement, ast.AugAssign)


def _quiet(node: ast.AST) -> list[ast.AST]:
    if isinstance(node, (ast.Raise, ast.JoinedStr, ast.Assert)):
        return [node]
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "reshape":
        return list(node.args)  # NumPy takes every negative number alike
    parts = [getattr(node, name, None) for name in ("annotation", "returns")] + getattr(node, "decorator_list", [])
    return [part for part in parts if part is not None]


def trial(path: str, limit_s: int, mutant: CodeType | None = None) -> tuple[int, float]:
    """Exit code of the tests of a module (negative: ended by that signal) in a fork, and their CPU seconds."""
    if (child := os.fork()) == 0:
        for stream in (1, 2):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
        resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s + 1))
        loaders: Any = SourceFileLoader
        usual, mine = loaders.get_code, str(ROOT / path) if mutant else ""
        loaders.get_code = lambda self, name: mutant if self.path == mine else usual(self, name)
        os._exit(int(pytest.main([*PYTEST, *(each for word in shlex.split(MODULES[path]) for each in spread(word))])))
    _, status, used = os.wait4(child, 0)
    return os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime


def main() -> None:
    """Put mistakes into the modules that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m tools.mutation", description=__doc__)
    parser.add_argument("modules", nargs="*", metavar="MODULE", help="paths as in TARGETS; all if left out")
    parser.add_argument("--number", type=int, default=10, help="of mistakes of each module")
    parser.add_argument("--seed", type=int, default=0, help="draws other ones")
    given = parser.parse_args()
    os.environ |= {"NUMBA_DISABLE_JIT": "1", "CPS_ENVS_TRUST": "1"}
    os.chdir(ROOT)
    for name in HEAVY:
        importlib.import_module(name)
    clean: dict[str, tuple[int, float]] = {}  # what trials without a mistake come to, by the tests
    for path in given.modules or MODULES:
        if path not in MODULES:
            parser.error(f"no tests are named for {path}")
        everything = mutants(Path(path).read_text(encoding="utf-8"), path)
        drawn = random.Random(given.seed).sample(everything, min(given.number, len(everything)))
        if MODULES[path] not in clean:
            clean[MODULES[path]] = trial(path, FIRST_LIMIT_S)
        code, used = clean[MODULES[path]]
        broken, _ = trial(path, FIRST_LIMIT_S, compile("raise RuntimeError", path, "exec"))
        if code or broken in (0, pytest.ExitCode.NO_TESTS_COLLECTED):
            parser.error(f"the tests of {path} fail without a mistake, or do not use it")
        limit_s = int(FACTOR * used) + SPARE_S
        alive = [what for what, mutant in drawn if trial(path, limit_s, mutant)[0] == 0]
        print(f"{path}: {len(drawn)} of {len(everything)} mistakes, {len(alive)} not noticed", *alive, sep="\n  ")


if __name__ == "__main__":
    main()
