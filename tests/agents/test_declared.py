"""What problems declare for contests and benchmarks: everybody is named, can be built, and has what is asked of it."""

from __future__ import annotations

import pytest

from cps_agents.benchmark.suite import find_benchmark
from cps_agents.contest.contest import find_contests
from cps_agents.zoo.card import read_card
from cps_agents.zoo.files import find, shipped_names
from cps_baselines.arena import Contestant
from cps_baselines.contest import Contest, Side
from cps_baselines.schedule import Setting
from cps_envs import PROBLEMS
from cps_envs.core.lookup import NEED_OPTIONS, policy_names, resolve_policy
from cps_envs.core.types import ROLES, Role
from tests.episodes import spec_of

CONTESTS = pytest.mark.parametrize("contest", find_contests([]), ids=lambda contest: contest.problem)
SETTINGS = [(name, setting) for name in PROBLEMS for setting in find_benchmark(name).settings]


def side_of(contest: Contest, role: Role) -> Side:
    return contest.attackers if role == "attacker" else contest.defenders


def asked(side: Side) -> tuple[Contestant, ...]:
    return (*side.policies, *side.informed)


@CONTESTS
@pytest.mark.parametrize("role", ROLES)
def test_a_contest_plays_every_registered_policy_or_says_why_not(contest: Contest, role: Role) -> None:
    side = side_of(contest, role)
    playing = {each.reference.partition("?")[0] for each in asked(side)}
    cards = (read_card(find(name)) for name in shipped_names())
    shipped = {f"zoo:{card.name}" for card in cards if (card.problem, card.role) == (contest.problem, role)}
    everybody = {*policy_names(contest.problem, role)} | shipped
    assert playing | {*side.left_out} | {*NEED_OPTIONS} == everybody | {*NEED_OPTIONS}
    assert not playing & {*side.left_out}
    assert all(side.left_out.values())
    assert "none" in {each.name for each in side.policies}
    assert len({each.name for each in asked(side)}) == len(asked(side))


@CONTESTS
@pytest.mark.parametrize("role", ROLES)
def test_everybody_in_a_contest_can_be_built_in_every_variant(contest: Contest, role: Role) -> None:
    side = side_of(contest, role)
    for variant in contest.variants:
        spec = spec_of(PROBLEMS[contest.problem], role, variant.preset, **variant.overrides)
        for reference in (*(each.reference for each in asked(side)), *side.constants):
            resolve_policy(reference, spec)
        for search in side.searches:
            assert set(search.start) <= set(search.ranges)
            for end in (0, 1):
                resolve_policy(search.policy, spec, **{name: ends[end] for name, ends in search.ranges.items()})


@pytest.mark.parametrize(("problem", "setting"), SETTINGS, ids=lambda each: getattr(each, "name", each))
def test_everybody_in_a_benchmark_can_be_built(problem: str, setting: Setting) -> None:
    """Trained policies play in `test_benchmark.py`."""
    game = PROBLEMS[problem].game(setting.venue.config, 1)
    for role, contestants in (("attacker", setting.attackers), ("defender", setting.defenders)):
        for each in contestants:
            if not each.reference.startswith("zoo:"):
                resolve_policy(each.reference, game.spec(role))
            assert {setting.metric, each.metric or setting.metric} <= set(game.metrics())
    assert not setting.reference or setting.reference in game.metrics()


@pytest.mark.parametrize("problem", PROBLEMS)
def test_opponents_of_presets_can_be_built(problem: str) -> None:
    for preset, opponents in PROBLEMS[problem].opponents.items():
        for role, reference in opponents.items():
            resolve_policy(reference, spec_of(PROBLEMS[problem], role, preset))
