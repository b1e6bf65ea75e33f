"""What `cps-envs benchmark` plays of the rogue-vehicle problem."""

from __future__ import annotations

from pathlib import Path

import pytest

from cps_agents.arena.store import Store
from cps_agents.benchmark.matrix import entries
from cps_agents.benchmark.suite import Choice, find_benchmark, run_benchmark, select
from cps_baselines.rogue.benchmark import BENCHMARK
from cps_baselines.rogue.contest import CONTEST
from cps_envs.core.lookup import NEED_OPTIONS, policy_names
from cps_envs.core.types import ROLES

BEYOND = {  # what the maps of the dissertation show
    "attacker": {"beam", "contested", "gains", "identify", "probe", "strike", "tuned"},
    "defender": {"assigned", "informed", "monitor", "pd_detection"},
}


def test_every_policy_of_the_paper_takes_part() -> None:
    assert find_benchmark("rogue").problem == "rogue"
    known = {role: set(policy_names("rogue", role)) - {*NEED_OPTIONS} - BEYOND[role] for role in ROLES}
    for setting in BENCHMARK.settings:
        attackers = {contestant.reference.partition("?")[0] for contestant in setting.attackers}
        defenders = {contestant.reference for contestant in setting.defenders}
        assert attackers == known["attacker"] | {"zoo:rogue-attack-ppo"}
        assert defenders == known["defender"] - {"none"} | {"zoo:rogue-defense-ppo"}


def test_every_registered_policy_plays_the_contest_or_a_reason_is_given() -> None:
    for role, side in (("attacker", CONTEST.attackers), ("defender", CONTEST.defenders)):
        playing = {contestant.reference.partition("?")[0] for contestant in (*side.policies, *side.informed)}
        assert playing | set(side.left_out) >= set(policy_names("rogue", role)) - {*NEED_OPTIONS}
        assert not playing & set(side.left_out)


@pytest.mark.parametrize("setting", [setting.name for setting in BENCHMARK.settings])
def test_a_meeting_shows_damage_and_tracking(setting: str, tmp_path: Path) -> None:
    wanted = Choice([setting], ["slow_square"], ["sliding_detection"], quick=True)
    outcome = run_benchmark(*select([BENCHMARK], wanted), Store(tmp_path), workers=1, quick=True)
    ((entry,),) = entries(outcome, outcome.benchmark.settings[0])
    assert entry.value == entry.means["damage"] > 0
    assert entry.crash
    damage, behind, cost = entry.text.split("\n")
    assert float(damage) == pytest.approx(entry.value, abs=0.05)
    assert behind == f"{entry.means['reference_error_m']:.0f} m"
    assert cost == f"c {entry.means['formation_cost_s']:.0f} s"
