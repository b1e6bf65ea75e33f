"""Policies inside a match: when they decide, what they are shown, and what becomes of their state."""

from __future__ import annotations

import copy
import pickle
import re
from typing import Any

import numpy as np
import pytest
from gymnasium.utils import seeding

from cps_envs.core.game.match import Match
from cps_envs.core.policies.mixture import Mixture
from cps_envs.core.policies.policy import AnalyticPolicy, Idle, RoleSpec, told_of
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, State
from tests.core.toy import ToyConfig, ToyGame

ALL = np.ones(3, np.bool_)


class Witness:
    """Plays one fixed action and writes down each call: how many environments, clocks, states, fresh starts."""

    def __init__(self, action: Any, dtype: Any = np.float32) -> None:
        self.action, self.dtype = action, dtype
        self.calls: list[tuple[list[float], list[int], list[bool]]] = []

    def predict(
        self, observation: Array, state: Any = None, episode_start: BoolArray | None = None, deterministic: bool = False
    ) -> tuple[Array, Any]:
        assert episode_start is not None
        count = np.zeros(len(observation), np.int64) if state is None else np.where(episode_start, 0, state[0])
        clock = np.round((observation[:, -1] + 1) * 6).tolist()
        self.calls.append((clock, count.tolist(), episode_start.tolist()))
        return np.array([self.action] * len(observation), self.dtype), (count + 1,)


class TellingGame(ToyGame):
    def truth(self, b: int) -> Any:
        return {"intruder": self.intruder[b]}


class Oracle(Witness):
    privileged = frozenset({"truth", "opponent"})

    def begin(self, generators: Any, knowledge: Any) -> Any:
        return (told_of(knowledge),)


def game(num_envs: int = 3, **kwargs: Any) -> ToyGame:
    return ToyGame(ToyConfig(reach_m=0.0, **kwargs), num_envs)


def generators(num_envs: int = 3) -> list[np.random.Generator]:
    return [seeding.np_random(b)[0] for b in range(num_envs)]


def test_each_role_decides_at_its_own_interval() -> None:
    attacker, defender = Witness(1, np.int64), Witness([0, 0])
    match = Match(game(), {"attacker": attacker, "defender": defender})
    match.reset(ALL, generators())
    match.step({}, ALL, 6)
    assert [call[0] for call in attacker.calls] == [[0] * 3, [3] * 3]
    assert [call[0] for call in defender.calls] == [[t] * 3 for t in range(6)]
    assert [call[1] for call in attacker.calls] == [[0] * 3, [1] * 3]
    assert [call[2] for call in attacker.calls] == [[True] * 3, [False] * 3]


def test_environments_out_of_phase_are_asked_when_they_are_due() -> None:
    attacker = Witness(1, np.int64)
    match = Match(game(), {"attacker": attacker})
    envs = generators()
    match.reset(ALL, envs)
    match.step({"defender": np.zeros((3, 2))}, ALL, 1)
    match.reset(np.array([False, True, False]), envs)
    for _ in range(3):
        match.step({"defender": np.zeros((3, 2))}, ALL, 1)
    assert [(clock, fresh) for clock, _, fresh in attacker.calls] == [
        ([0, 0, 0], [True] * 3),
        ([0], [True]),  # the environment that was reset
        ([3, 3], [False] * 2),  # the others at their own third step
    ]
    match.step({"defender": np.zeros((3, 2))}, ALL, 1)
    assert attacker.calls[-1] == ([3], [1], [False])


def test_a_part_of_the_environments_plays_as_all_of_them() -> None:
    """An action of single precision means the same whether it is asked of all environments or of some."""
    results = []
    for stagger in (False, True):
        defender = Witness([0.1, -0.3])
        played = game(guard_speed=0.7)
        match = Match(played, {"defender": defender})
        envs = generators()
        match.reset(ALL, envs)
        if stagger:
            match.step({}, np.array([True, False, False]), 3)
            match.step({}, np.array([False, True, True]), 3)
        else:
            match.step({}, ALL, 3)
        results.append(played.guard.copy())
    np.testing.assert_array_equal(*results)


def test_a_terminated_environment_is_not_asked_again() -> None:
    defender = Witness([0, 0])
    played = game()
    match = Match(played, {"defender": defender})
    match.reset(ALL, generators())
    played.terminated[1] = True
    payoff = match.step({}, ALL, 2)
    assert [len(call[0]) for call in defender.calls] == [2, 2]
    assert payoff[1] == 0


def test_idle_players_are_not_asked_and_cost_no_steps() -> None:
    class Busy(Idle):
        def act(self, seen: Seen, state: State) -> Any:
            raise AssertionError("an idle policy is asked")

    played = game()
    match = Match(played, {"defender": Busy(played.spec("defender"))})
    match.reset(ALL, generators())
    match.step({}, ALL, 3)
    assert played.elapsed.tolist() == [3, 3, 3]


@pytest.mark.parametrize(
    ("role", "action", "dtype"),
    [("defender", [np.nan, 0], float), ("defender", [0], float), ("attacker", 9, int), ("attacker", 0.5, float)],
)
def test_impossible_actions_of_a_policy_name_it(role: Any, action: Any, dtype: Any) -> None:
    match = Match(game(), {role: Witness(action, dtype)})
    match.reset(ALL, generators())
    with pytest.raises(ValueError, match=f"the {role}'s policy Witness gave impossible actions"):
        match.step({}, ALL, 1)


class Author(AnalyticPolicy):
    """Its `act` is what a test hands over."""

    def __init__(self, spec: RoleSpec, act: Any) -> None:
        super().__init__(spec)
        self.play = act

    def act(self, seen: Seen, state: State) -> Any:
        return self.play(seen, state)


@pytest.mark.parametrize(
    ("act", "fault"),
    [
        (lambda seen, state: np.zeros((len(seen), 2)), ": act returns (actions, state), not one ndarray"),
        (lambda seen, state: (seen["own"].mean(axis=7), state), " failed in act: AxisError: axis 7 is out of bounds"),
        (lambda seen, state: (seen["owm"], state), " failed in act: UnknownNameError: there is no field 'owm'. Did"),
    ],
)
@pytest.mark.parametrize("num_envs", [1, 2, 3])
def test_an_error_in_act_names_the_policy(act: Any, fault: str, num_envs: int) -> None:
    played = game(num_envs)
    match = Match(played, {"defender": Author(played.spec("defender"), act)})
    match.reset(ALL[:num_envs], generators(num_envs))
    with pytest.raises(ValueError, match=re.escape(f"the defender's policy Author{fault}")):
        match.step({}, ALL[:num_envs], 1)


def test_only_a_policy_with_the_episodes_generators_draws_unless_the_match_is_deterministic() -> None:
    asked = []

    class Asked(Witness):
        def predict(self, *args: Any) -> Any:
            asked.append(args[3])
            return super().predict(*args)

    class AskedOwn(AnalyticPolicy):
        def act(self, seen: Seen, state: Any) -> Any:
            asked.append(seen.deterministic)
            return np.zeros((len(seen), 2)), state

    own = AskedOwn(game().spec("defender"))
    mixed = Mixture(game().spec("defender"), [Asked([0, 0])])
    for player in (Asked([0, 0]), mixed, own):
        for options in ({}, {"deterministic": True}):
            match = Match(game(), {"defender": player}, **options)
            match.reset(ALL, generators())
            match.step({}, ALL, 1)
    assert asked == [True, True, True, True, False, True]


def test_payoffs_of_the_decisions_within_a_step_add_up() -> None:
    played = game()
    match = Match(played, {"attacker": Witness(1, np.int64), "defender": Witness([0, 0])})
    match.reset(ALL, generators())
    payoff = match.step({}, ALL, 6)
    assert (payoff > 1).all()
    np.testing.assert_allclose(payoff, played.closeness + played.fee, rtol=1e-12)


def test_held_actions_are_paid_until_the_limit() -> None:
    played = game()
    match = Match(played, {"defender": Witness([0, 0])})
    match.reset(ALL, generators())
    payoff = match.hold({}, ALL, 1, 5, 2)
    assert played.elapsed.tolist() == [2, 2, 2]
    np.testing.assert_allclose(payoff, played.closeness + played.fee, rtol=1e-12)


def test_beliefs_are_told_by_players_who_have_some_and_have_decided() -> None:
    class Believer(Witness):
        def beliefs(self, state: Any) -> Any:
            return {"decisions": state[0]}

    match = Match(game(), {"attacker": Witness(1, np.int64), "defender": Believer([0, 0])})
    match.reset(ALL, generators())
    assert match.beliefs("defender") == {}
    match.step({}, ALL, 1)
    assert match.beliefs("attacker") == {}
    assert match.beliefs("defender")["decisions"].tolist() == [1, 1, 1]
    assert Match(game(), {}).beliefs("attacker") == {}


def test_masks_are_handed_to_those_who_take_them() -> None:
    seen = []

    class Masked(Witness):
        def predict(self, *args: Any, action_masks: Any = None) -> Any:  # type: ignore[override]
            seen.append(action_masks)
            return super().predict(*args)

    played = game()
    match = Match(played, {"attacker": Masked(0, np.int64), "defender": Masked([0, 0])})
    match.reset(ALL, generators())
    played.intruder[:] = [[4, 0], [-4, 0], [0, 4]]
    whole = played.action_mask("attacker")
    assert whole is not None
    assert len({tuple(row) for row in whole.tolist()}) == 3
    match.step({}, np.array([True, False, True]), 1)
    np.testing.assert_array_equal(seen[0], whole[[0, 2]])
    assert seen[1] is None
    match.reset(ALL, generators())
    played.intruder[:] = [[4, 0], [-4, 0], [0, 4]]
    match.step({}, ALL, 1)
    np.testing.assert_array_equal(seen[2], whole)


def test_a_decentralised_policy_sees_what_its_team_sees() -> None:
    seen = []

    class Swarm(Witness):
        decentralised = True

        def predict(self, *args: Any, team_observation: Any = None) -> Any:  # type: ignore[override]
            seen.append(team_observation)
            return super().predict(*args)

    played = game()
    match = Match(played, {"attacker": Witness(1, np.int64), "defender": Swarm([0, 0])})
    match.reset(ALL, generators())
    team = played.team("defender").observe()
    match.step({}, np.array([True, False, True]), 1)
    np.testing.assert_array_equal(seen[0], team[[0, 2]])
    team = played.team("defender").observe()
    match.step({}, ALL, 1)
    np.testing.assert_array_equal(seen[1], team)


def test_begin_hands_out_generators_and_privileged_knowledge() -> None:
    begun: list[Any] = []

    class Oracle(Witness):
        privileged = frozenset({"model", "opponent"})

        def begin(self, generators: Any, knowledge: Any) -> Any:
            begun.append((generators, knowledge))
            return (np.full(len(generators), 7),)

    oracle, rival = Oracle(0, np.int64), Witness([0, 0])
    match = Match(game(), {"attacker": oracle, "defender": rival})
    own = generators()
    match.reset(np.array([False, True, True]), own)
    ((given, knowledge),) = begun
    assert len(given) == 2
    assert given[0] not in own
    assert knowledge[0]["opponent"] is rival
    with pytest.raises(TypeError, match="'toy' hands no copies"):
        knowledge[0]["model"](4)


def test_truth_is_what_the_game_says_of_an_episode() -> None:
    begun: list[Any] = []

    class Told(Witness):
        privileged = frozenset({"truth"})

        def begin(self, generators: Any, knowledge: Any) -> Any:
            begun.extend(knowledge)
            return (np.full(len(generators), 7),)

    played = game()
    played.truth = lambda b: {"liar": b}  # type: ignore[method-assign]
    Match(played, {"attacker": Told(0, np.int64)}).reset(np.array([False, True, True]), generators())
    assert [known["truth"] for known in begun] == [{"liar": 1}, {"liar": 2}]
    with pytest.raises(KeyError, match="Told is not told 'model': it has to name it in `privileged`"):
        begun[0]["model"]
    with pytest.raises(TypeError, match="'toy' tells no policy"):
        Match(game(), {"attacker": Told(0, np.int64)}).reset(np.ones(3, np.bool_), generators())


def test_what_a_policy_was_told_asks_the_match_that_it_is_in() -> None:
    played = TellingGame(ToyConfig(), 3)
    match = Match(played, {"attacker": Oracle(0, np.int64), "defender": Witness([0, 0])})
    match.reset(ALL, generators())
    told = match._states["attacker"][0]  # type: ignore[index]
    before = told[1]["truth"]["intruder"]
    for copied in (copy.deepcopy(match), pickle.loads(pickle.dumps(match))):
        copied.game.intruder[1] += 1.0
        theirs = copied._states["attacker"][0]
        np.testing.assert_array_equal(theirs[1]["truth"]["intruder"], before + 1.0)
        assert theirs[1]["opponent"] is copied.players["defender"]
        np.testing.assert_array_equal(told[1]["truth"]["intruder"], before)
    told[1]["truth"]["intruder"][...] = 7.0
    np.testing.assert_array_equal(played.intruder[1], before)


def test_draws_of_a_policy_shift_no_draw_of_the_physics() -> None:
    class Drawing(Witness):
        def begin(self, generators: Any, knowledge: Any) -> Any:
            for generator in generators:
                generator.random(100)

    courses = []
    for player in (Drawing([0, 0]), Idle(game().spec("defender"))):
        played = game()
        match = Match(played, {"defender": player})
        envs = generators()
        for _ in range(2):
            match.reset(ALL, envs)
            match.step({}, ALL, 3)
        courses.append(played.intruder.copy())
    np.testing.assert_array_equal(*courses)
