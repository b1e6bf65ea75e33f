"""Planning on copies of the world: the beam search, and the yardsticks that it and two other searches give."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.utils import seeding
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_baselines.rogue.beam import BEAMS, Beam, BeamPlan, BeamPlanner, plan_by_beam
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.match import Match
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.problem import ROGUE
from cps_envs.testbed.problem import TESTBED
from cps_paper.rogue.worlds import world_config

ALL = np.ones


def begun(config: RogueConfig, count: int, defender: str, seed: int = 0) -> Match:
    """A match of `count` equal episodes against a defender, at their start."""
    game = ROGUE.game(config, count)
    generators = [seeding.np_random(seed)[0] for _ in range(count)]
    match = Match(game, {"defender": resolve_policy(defender, game.spec("defender"))})
    match.reset(ALL(count, np.bool_), generators)
    return match


@settings(max_examples=15, deadline=None)
@given(
    parents=st.lists(st.integers(0, 3), min_size=4, max_size=4),
    defender=st.sampled_from(["sliding_detection", "disband_2", "monitor"]),
    seed=st.integers(0, 50),
)
def test_a_branch_goes_on_exactly_as_its_parent(parents: Any, defender: str, seed: int) -> None:
    overrides = {"attack_share": 1.0, "onset_s": 0.5, "duration_s": 6.0}
    match = begun(ROGUE.config("learning", overrides), 4, defender, seed)
    generator = np.random.default_rng(seed)
    everywhere = ALL(4, np.bool_)
    for _ in range(25):
        match.step({"attacker": generator.choice([-1.0, 1.0], size=(4, 1))}, everywhere, 1)
    rows = np.array(parents)
    state = [array.copy() for array in match.game.state]
    match.branch(rows)
    for before, after in zip(state, match.game.state, strict=True):
        assert np.array_equal(before[rows], after)
    actions = np.zeros((4, 1))
    for _ in range(20):
        match.step({"attacker": actions}, everywhere, 1)
    for array in match.game.state:
        for b, parent in enumerate(parents):
            assert np.array_equal(array[b], array[parents.index(parent)])


def test_a_game_without_copies_refuses_to_branch() -> None:
    game = TESTBED.game(TESTBED.config("paper", {}), 1)
    with pytest.raises(TypeError, match="no copies"):
        game.branch(np.zeros(1, np.int64))
    with pytest.raises(TypeError, match="no copies"):
        game.model(0, 2)


def planned(defender: str, config: RogueConfig, beam: Beam, seed: int = 0) -> BeamPlan:
    match = begun(config, 1, defender, seed)
    return plan_by_beam(lambda count: match.game.model(0, count), match.players["defender"], beam)


@pytest.mark.parametrize("defender", ["sliding", "disband_2"])
def test_the_plan_pays_what_the_search_says(defender: str) -> None:
    config = ROGUE.config("paper", {"contact": "solid", "duration_s": 20.0, "power_ratio": 1.3})
    plan = planned(defender, config, Beam(hold=3, foresight=0.3, width=16))
    assert plan.actions.shape == (200,)
    assert set(plan.actions) <= {-1.0, 1.0}
    match = begun(config, 1, defender)
    paid = sum(float(match.step({"attacker": np.array([[each]])}, ALL(1, np.bool_), 1)[0]) for each in plan.actions)
    assert paid == pytest.approx(plan.payoff, abs=1e-9)
    assert match.game.metrics()["damage"][0] == pytest.approx(plan.payoff, abs=1e-9)


def test_a_beam_that_keeps_everything_finds_the_best_of_all_plans() -> None:
    """Four decisions have sixteen plans: the search is then exhaustive, and every plan can be played by hand."""
    overrides = {"contact": "solid", "duration_s": 8.0, "power_ratio": 1.6}
    config = ROGUE.config("paper", overrides)
    beam = Beam(hold=20, foresight=1.0, width=16, cell_m=1e-6, cell_mps=1e-6)
    paid = []
    for number in range(16):
        signs = [1.0 if number >> place & 1 else -1.0 for place in range(4)]
        match = begun(config, 1, "pd")
        paid.append(sum(float(match.step({"attacker": np.array([[sign]])}, ALL(1, np.bool_), 20)[0]) for sign in signs))
    assert max(paid) > 0
    assert planned("pd", config, beam).payoff == pytest.approx(max(paid), abs=1e-9)


def test_the_planner_plays_its_plans_in_episodes_that_differ() -> None:
    config = ROGUE.config("learning", {"attack_share": 1.0, "onset_s": (1.0, 4.0), "duration_s": 12.0})
    expected = [
        max(planned("monitor", config, beam._replace(width=6), seed).payoff for beam in BEAMS) for seed in (3, 4)
    ]
    planner = BeamPlanner(ROGUE.game(config, 1).spec("attacker"), width=6)
    paid = play_episodes(ROGUE, config, {"attacker": planner, "defender": "monitor"}, [3, 4])["return"]
    assert paid == pytest.approx(expected, abs=1e-9)
    with pytest.raises(ConfigurationError, match="width = 0"):
        BeamPlanner(ROGUE.game(config, 1).spec("attacker"), width=0)


def test_more_width_is_worth_something_and_all_beat_a_square_wave() -> None:
    config = world_config(1.3, spread=0.0)
    wave = play_episodes(ROGUE, config, {"attacker": "square", "defender": "sliding"}, [0])["damage"][0]
    wide = max(planned("sliding", config, beam._replace(width=32)).payoff for beam in BEAMS)
    narrow = max(planned("sliding", config, beam._replace(width=1)).payoff for beam in BEAMS)
    assert wide > max(narrow, 1.5 * wave)
