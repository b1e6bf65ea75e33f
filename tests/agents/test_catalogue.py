"""What is listed and what problems declare: the same as what is there, with everybody named and built."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from cps_agents.arena.table import Table
from cps_agents.catalogue import describe_problem, imported_entry, pettingzoo_ids, policies
from cps_agents.declarations import UnreadableError, declaration, missing_package
from cps_baselines.searches import searches_of
from cps_envs import PROBLEMS
from cps_envs.core.lookup import policy_entry, resolve_policy
from cps_envs.core.problem import Later, Problem
from cps_envs.core.types import ROLES, Role
from cps_paper.benchmark.suite import find_benchmark
from tests.episodes import spec_of
from tools.rivals import declared

TABLES = [(name, table) for name in PROBLEMS for table in find_benchmark(name).tables]


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=lambda problem: problem.name)
def test_sources_say_what_importing_says(problem: Problem) -> None:
    pytest.importorskip("scipy")
    for role in ROLES:
        for entry in policies(problem, role):
            assert entry == imported_entry(entry.name, policy_entry(problem.name, role, entry.name))


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=lambda problem: problem.name)
def test_what_a_problem_imports_later_is_there(problem: Problem) -> None:
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


@pytest.mark.parametrize(
    "code",
    [
        "import cps_envs",
        "from cps_agents.catalogue import describe_everything; describe_everything()",
        "from cps_agents.commands.train import _list; from cps_agents.recipes.finding import RECIPES; "
        "_list(list(RECIPES.values()), False)",
    ],
)
def test_listings_do_not_load_the_compiler(code: str) -> None:
    code += "; import sys; print(sorted({'numba', 'scipy', 'torch'} & set(sys.modules)))"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.splitlines()[-1] == "[]"


def test_later_is_a_value_and_names_its_function() -> None:
    later = Later("cps_envs.core.types:other")
    assert later == Later("cps_envs.core.types:other")
    assert later("attacker") == "defender"


STRANGE = """
    '''What the module says.'''
    import nowhere_to_be_found
    from {package}.bases import Base

    class Mine(Base):
        pass

    def make(spec) -> Mine:
        '''Make one.

        More.
        '''

    table = 3
    """
BASES = """
    class Base:
        privileged: frozenset[str] = frozenset({"opponent", "model"})
    """


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    folder = tmp_path / "strange_policies"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "mine.py").write_text(textwrap.dedent(STRANGE.format(package=folder.name)))
    (folder / "bases.py").write_text(textwrap.dedent(BASES))
    monkeypatch.syspath_prepend(str(tmp_path))
    return folder.name


def test_a_source_shows_summary_privileges_and_what_is_missing(package: str) -> None:
    made, own = declaration(f"{package}.mine", "make"), declaration(f"{package}.mine", "Mine")
    assert (made.summary, own.summary) == ("Make one.", "What the module says.")
    assert made.privileged == own.privileged == ("model", "opponent")
    assert missing_package(f"{package}.mine") == "nowhere_to_be_found"
    assert missing_package(f"{package}.bases") == ""
    with pytest.raises(UnreadableError):
        declaration(f"{package}.mine", "table")


def test_a_policy_that_cannot_be_loaded_says_what_it_lacks(package: str) -> None:
    entry = imported_entry("mine", EntryPoint("disbanding.attacker.mine", f"{package}.mine:make", "cps_envs.policies"))
    assert (entry.summary, entry.missing) == ("", "nowhere_to_be_found")


def test_presets_and_roles_are_listed() -> None:
    found = describe_problem(PROBLEMS["hvac"])
    assert found["presets"] == list(PROBLEMS["hvac"].presets)
    assert {entry["name"] for entry in found["policies"]["defender"]} >= {"none", "mtd2", "mixture"}


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("role", ROLES)
def test_rivals_and_what_is_searched_can_be_built(problem: str, role: Role) -> None:
    rivals, spec = declared(problem, role), spec_of(PROBLEMS[problem], role, "learning")
    names = [each.name for each in rivals.policies]
    assert "none" in names
    assert len(set(names)) == len(names)
    for reference in (*(each.reference for each in (*rivals.policies, *rivals.informed)), *rivals.constants):
        resolve_policy(reference, spec)
    for search in searches_of(problem, role):
        assert set(search.start) <= set(search.ranges)
        for end in (0, 1):
            resolve_policy(search.policy, spec, **{name: ends[end] for name, ends in search.ranges.items()})


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
