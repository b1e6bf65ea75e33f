"""What is listed and what problems declare: the same as what is there, with everybody named and built."""

from __future__ import annotations

import json
import subprocess
import sys
import textwrap
from collections.abc import Callable
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from cps_agents import catalogue
from cps_agents.arena.table import Table
from cps_agents.catalogue import PolicyEntry, describe_problem, pettingzoo_ids, policies
from cps_baselines.family import families
from cps_envs import PROBLEMS
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.problem import Later, Problem
from cps_envs.core.policies.lookup import GROUP, NEED_OPTIONS, resolve_policy
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.types import ROLES, Role
from cps_paper.benchmark.suite import find_benchmark
from tests.episodes import spec_of
from tools.challenge.constants import declared

TABLES = [(name, table) for name in PROBLEMS for table in find_benchmark(name).tables]


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=lambda problem: problem.name)
def test_what_a_problem_imports_later_is_there(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    config = problem.presets["learning"]
    game = problem.game(config, 1)
    for role in ROLES:
        assert problem.fields[role](config).size == game.fields[role].size
        try:
            game.team(role)
        except TypeError:
            assert role not in problem.swarm
    module = pytest.importorskip(f"cps_envs.{problem.name}_v{problem.version}")
    offered = {name.rpartition(".")[2] for form, name in pettingzoo_ids(problem).items() if form != "id"}
    assert offered == {name for name in ("parallel_env", "env", "swarm_env") if hasattr(module, name)}
    if problem.swarm:
        monkeypatch.delattr(module, "swarm_env")
        assert "swarm" not in pettingzoo_ids(problem)


@pytest.mark.parametrize(
    ("code", "heavy"),
    [
        ("import cps_agents.cli", {"torch", "numba", "numpy", "gymnasium", "matplotlib", "cps_envs"}),
        ("import cps_envs", {"numba", "scipy", "torch"}),
        ("from tests.agents.command_line import succeeded; succeeded('list')", {"numba", "scipy", "torch"}),
        (
            "from cps_agents.commands.train import _list; from cps_agents.recipes.finding import RECIPES; "
            "_list(list(RECIPES.values()), False)",
            {"numba", "scipy", "torch"},
        ),
        (
            "from tests.agents.command_line import succeeded; succeeded('play', 'disbanding', '--set', 'duration_s=2')",
            {"torch"},
        ),
    ],
    ids=["command line", "package", "list", "recipes", "play"],
)
def test_nothing_heavy_is_loaded_that_is_not_needed(code: str, heavy: set[str]) -> None:
    code += f"; import sys; print(sorted({heavy} & set(sys.modules)))"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.splitlines()[-1] == "[]"


def test_later_is_a_value_and_names_its_function() -> None:
    later = Later("cps_envs.core.types:other")
    assert later == Later("cps_envs.core.types:other")
    assert later("attacker") == "defender"


STRANGE = """
    '''What the module says.'''
    from cps_envs.core.policies.policy import Idle

    class Mine(Idle):
        privileged = frozenset({"opponent", "model"})

    def make(spec) -> Mine:
        '''Make one.

        More.
        '''
    """


@pytest.fixture
def listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str, str], PolicyEntry]:
    """Writes a module and lists a policy of it."""

    def of(source: str, attribute: str) -> PolicyEntry:
        (tmp_path / "strange.py").write_text(textwrap.dedent(source))
        monkeypatch.delitem(sys.modules, "strange", raising=False)
        entry = EntryPoint("hvac.attacker.mine", f"strange:{attribute}", GROUP)
        monkeypatch.setattr(catalogue, "policy_names", lambda problem, role: ["mine"])
        monkeypatch.setattr(catalogue, "policy_entry", lambda problem, role, name: entry)
        return policies(PROBLEMS["hvac"], "attacker")[0]

    monkeypatch.syspath_prepend(str(tmp_path))
    return of


@pytest.mark.parametrize(("attribute", "summary"), [("make", "Make one."), ("Mine", "What the module says.")])
def test_a_policy_is_listed_with_its_first_sentence_and_what_it_is_told(
    listed: Callable[[str, str], PolicyEntry], attribute: str, summary: str
) -> None:
    assert listed(STRANGE, attribute) == PolicyEntry("mine", summary, ("model", "opponent"))


FAULT = "the entry point hvac.attacker.mine names strange:make, but the module"


@pytest.mark.parametrize(
    ("source", "summary", "missing"),
    [
        ("raise ModuleNotFoundError(name='scipy')", "", "scipy"),
        ("import nowhere", f"{FAULT} cannot be imported: ModuleNotFoundError: No module named 'nowhere'", ""),
        ("table = 1 / 0", f"{FAULT} cannot be imported: ZeroDivisionError: division by zero", ""),
    ],
)
def test_a_policy_that_cannot_be_imported_says_why(
    listed: Callable[[str, str], PolicyEntry], source: str, summary: str, missing: str
) -> None:
    assert listed(source, "make") == PolicyEntry("mine", summary, (), missing=missing)


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("role", ROLES)
def test_a_policy_that_cannot_play_learning_says_where_it_plays(name: str, role: Role) -> None:
    """Each one is really built in `learning`, and those that refuse in the setting that they say."""
    problem = PROBLEMS[name]
    learning = problem.game(problem.presets["learning"], 1).spec(role)
    for entry in policies(problem, role):
        if entry.name in NEED_OPTIONS or entry.missing or not (refused := refusal_of(entry.name, learning)):
            assert not entry.plays_in, entry.name
            continue
        preset, *fields = entry.plays_in.split(" with ")
        overrides = {field: json.loads(value) for field, value in (each.split("=") for each in fields)}
        resolve_policy(entry.name, spec_of(problem, role, preset, **overrides))
        assert all(word in refused for word in fields or [preset]), entry.name


def refusal_of(name: str, spec: RoleSpec) -> str:
    """Why a policy cannot be built; empty if it can, or if it only lacks options, as a plan its events."""
    try:
        resolve_policy(name, spec)
    except ConfigurationError as error:
        return str(error)
    except TypeError as error:
        return "" if "required" in str(error) else str(error)
    return ""


def test_presets_and_roles_are_listed() -> None:
    found = describe_problem(PROBLEMS["hvac"])
    assert found["presets"] == list(PROBLEMS["hvac"].presets)
    assert {entry["name"] for entry in found["policies"]["defender"]} >= {"none", "mtd2", "mixture"}


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("role", ROLES)
def test_rivals_and_what_is_searched_can_be_built(problem: str, role: Role) -> None:
    panels = import_module(f"cps_envs.{problem}.panels")
    rivals, spec = panels.RIVALS[role], spec_of(PROBLEMS[problem], role, "learning")
    names = [each.name for each in rivals]
    assert "none" in names
    assert len(set(names)) == len(names)
    places = [getattr(panels, name, {}) for name in ("CHALLENGE", "RECIPES", "TRAINING")]
    everybody = [each for place in places for each in place.get(role, ())]
    for reference in (*(each.reference for each in (*rivals, *everybody)), *declared(problem, role)):
        resolve_policy(reference, spec)
    for family in families(problem).values():
        if family.role == role and family.is_bounded:
            numbers = np.array([(number.low, number.start, number.high) for number in family.numbers])
            assert (np.diff(numbers) >= 0).all()
            for values in numbers.T:
                resolve_policy(family.reference(values), spec)


@pytest.mark.parametrize(("problem", "table"), TABLES, ids=lambda each: getattr(each, "name", each))
def test_everybody_in_a_benchmark_can_be_built(problem: str, table: Table) -> None:
    """Trained policies play in `test_benchmark.py`."""
    game = PROBLEMS[problem].game(table.venue.config, 1)
    for role, contestants in (("attacker", table.attackers), ("defender", table.defenders)):
        for each in contestants:
            if not each.reference.startswith("zoo:"):
                resolve_policy(each.reference, game.spec(role))
            assert {table.metric, each.metric or table.metric} <= set(game.metrics())
    assert not table.per or table.per in game.metrics()


@pytest.mark.parametrize("problem", PROBLEMS)
def test_opponents_of_presets_can_be_built(problem: str) -> None:
    for preset, opponents in PROBLEMS[problem].opponents.items():
        for role, reference in opponents.items():
            resolve_policy(reference, spec_of(PROBLEMS[problem], role, preset))
