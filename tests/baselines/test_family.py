"""Families of policies: what points of a search mean, and one set of numbers per episode."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from cps_baselines.disbanding.families import BROADCAST, LOCAL, RADIO
from cps_baselines.disbanding.string_controller import Gains, StringController, shipped_gains
from cps_baselines.family import Family, Members, Number, between, families, find_family, play_family
from cps_baselines.rogue.families import SWITCHING
from cps_baselines.rogue.tuned import tuned
from cps_envs import PROBLEMS
from cps_envs.core.errors import UnknownNameError, UntrustedCodeError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.policy import AnalyticPolicy
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.registration import find_problem
from cps_envs.rogue.problem import ROGUE
from tests import episodes

SHORT = {"num_platoons": 3, "vehicles_per_platoon": 3, "duration_s": 30.0, "attack_budget": 2}
ENDING = {"on_collision": "end", "tau_s": 0.5}  # episodes end at different times


def test_points_are_steps_from_the_start() -> None:
    numbers = (Number("gain", 2.0, 0.5), Number("threshold", 3.0, 0.1, by_factors=True))
    family = Family("rogue", "attacker", "tuned", numbers)
    points = np.array([[0.0, 0.0], [2.0, -10.0]])
    np.testing.assert_allclose(family.values(points), [[2, 3], [3, 3 / np.e]])
    np.testing.assert_allclose(family.points(family.values(points)), points, atol=1e-12)
    assert family.names == ("gain", "threshold")
    assert not family.is_bounded


def test_numbers_stay_within_their_bounds() -> None:
    family = Family(
        "rogue", "attacker", "strike?strike_s=2", between({"effort": (-1.0, 0.0), "period_s": (10.0, 40.0)})
    )
    assert family.is_bounded
    np.testing.assert_array_equal(family.row({}), [[-0.5, 25.0]])
    np.testing.assert_array_equal(family.values(np.array([[-9.0, 9.0]])), [[-1.0, 40.0]])
    assert family.reference(np.array([-0.5, 25.0])) == "strike?strike_s=2&effort=-0.5&period_s=25.0"


def test_a_policy_of_its_own_plays_each_row_of_a_family_without_a_builder() -> None:
    config = ROGUE.config("paper", {"duration_s": 5.0})
    alone = Family("rogue", "attacker", "tuned", SWITCHING.numbers)
    values = np.repeat(SWITCHING.values(np.random.default_rng(0).normal(size=(2, len(alone.numbers)))), 2, axis=0)
    found, expected = (play_family(each, ROGUE, config, "pd", values, [0, 1, 0, 1]) for each in (alone, SWITCHING))
    for name, one in found.items():
        np.testing.assert_array_equal(one, expected[name], name)


def test_every_family_has_a_name_and_other_names_are_explained() -> None:
    for problem in PROBLEMS:
        found = families(problem)
        assert found
        for name, family in found.items():
            assert find_family(name) is family
            assert family.problem == problem
            assert len(set(family.names)) == len(family.numbers)
    with pytest.raises(UnknownNameError, match="Did you mean 'disbanding-local'"):
        find_family("disbanding-locl")


def test_code_in_a_name_needs_consent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CPS_ENVS_TRUST", raising=False)
    with pytest.raises(UntrustedCodeError, match="--trust"):
        find_family("cps_baselines.rogue.families:SWITCHING")
    monkeypatch.setenv("CPS_ENVS_TRUST", "1")
    assert find_family("cps_baselines.rogue.families:SWITCHING") is SWITCHING
    with pytest.raises(UnknownNameError, match="is not a family"):
        find_family("cps_baselines.rogue.tuned:tuned")


@pytest.mark.parametrize(
    ("family", "form"), [pytest.param(LOCAL, "local", id="local"), pytest.param(BROADCAST, "informed", id="broadcast")]
)
def test_the_numbers_of_a_string_go_to_its_gains(family: Family, form: str) -> None:
    spec = DISBANDING.game(DISBANDING.config("paper", {}), 1).spec("defender")
    gains = shipped_gains(form)[0] + np.arange(34.0).reshape(2, 17)
    named = {
        f"{vehicle}.{name}": gains[i, j]
        for i, vehicle in enumerate(("leader", "other"))
        for j, name in enumerate(Gains._fields)
    }
    values = np.array([[named[name] for name in family.names]])
    built = family.build(spec, values)
    assert isinstance(built, StringController)
    used = [name in family.names for name in named]
    np.testing.assert_array_equal(built.gains.ravel()[used], gains.ravel()[used])
    assert not built.gains.ravel()[~np.array(used)].any()


def test_the_search_for_a_late_warning_starts_at_string() -> None:
    config = DISBANDING.config("learning", {**SHORT, "quiet_share": 0.0, "earliest_attack_s": 1})
    start = RADIO.build(DISBANDING.game(config, 1).spec("defender"), RADIO.values(np.zeros((1, len(RADIO.numbers)))))
    both = [
        play_episodes(DISBANDING, config, {"attacker": "lead", "defender": each}, [1, 2])["return"]
        for each in (start, "string")
    ]
    np.testing.assert_array_equal(*both)


def play(policy: AnalyticPolicy | str, seeds: list[int], **overrides: object) -> dict[str, np.ndarray]:
    config = DISBANDING.config("easy", {**SHORT, **overrides})
    return play_episodes(DISBANDING, config, {"attacker": "lead", "defender": policy}, seeds)


@pytest.mark.parametrize("family", [BROADCAST, LOCAL, RADIO])
@pytest.mark.parametrize("overrides", [{}, ENDING])
def test_each_episode_is_played_by_its_own_row(family: Family, overrides: dict[str, object]) -> None:
    generator = np.random.default_rng(0)
    values = family.values(2.0 * generator.standard_normal((4, len(family.numbers))))
    spec = DISBANDING.game(DISBANDING.config("easy", {**SHORT, **overrides}), 1).spec("defender")
    config = DISBANDING.config("easy", {**SHORT, **overrides})
    together = play_family(family, DISBANDING, config, "lead", values, [1, 2, 3, 4])
    for row in range(4):
        alone = play(family.build(spec, values[row : row + 1]), [row + 1], **overrides)
        for name, found in alone.items():
            assert together[name][row] == found[0], name


@pytest.mark.parametrize(
    ("name", "rival", "overrides", "tolerance"),
    [
        ("fdi-hypotheses", "tracker", {}, 0.0),
        ("fdi-task-tracker", "cusum", {}, 0.0),
        ("hvac-bayes", "tracker", {"num_steps": 330, "onset_step": 220}, 1e-12),
        ("hvac-bayes-together", "tracker", {"num_steps": 330, "onset_step": 220}, 1e-12),
    ],
)
def test_members_of_the_other_families_play_by_their_own_numbers(
    name: str, rival: str, overrides: dict[str, object], tolerance: float
) -> None:
    family, seeds = find_family(name), range(1, 5)
    problem, other = find_problem(family.problem), {"attacker": "defender", "defender": "attacker"}[family.role]
    values = family.values(np.random.default_rng(1).standard_normal((len(seeds), len(family.numbers))))
    setting: dict[str, Any] = {"preset": "learning", **overrides}
    spec = episodes.spec_of(problem, family.role, **setting)

    def paid(policy: AnalyticPolicy, seeds: Sequence[int]) -> np.ndarray:
        return episodes.play(problem, **{family.role: policy, other: rival}, seeds=seeds, **setting)["return"]

    alone = [paid(family.build(spec, values[row : row + 1]), [seed])[0] for row, seed in enumerate(seeds)]
    np.testing.assert_allclose(paid(Members(spec, family, values), seeds), alone, rtol=tolerance)


def test_the_numbers_of_the_rogue_family_are_those_of_tuned() -> None:
    config = ROGUE.config("paper", {"duration_s": 5.0})
    spec = ROGUE.game(config, 1).spec("attacker")
    values = np.array([[1.0, -0.5, 0.3, 0.2, -0.1, 0.05, 0.02], [-1.0, 0.5, 0.3, -0.2, 0.1, 0.0, 0.3]])
    both = play_episodes(ROGUE, config, {"attacker": Members(spec, SWITCHING, values), "defender": "pd"}, [0, 0])
    for row, numbers in enumerate(values):
        players = {"attacker": tuned(spec, **dict(zip(SWITCHING.names, numbers, strict=True))), "defender": "pd"}
        assert play_episodes(ROGUE, config, players, [0])["return"][0] == both["return"][row]
