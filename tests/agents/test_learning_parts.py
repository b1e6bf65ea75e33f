"""The parts of training: recipes, environments, input scaling, demonstrations, imitation, export."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

from cps_agents.errors import CommandError
from cps_agents.learning.demonstrations import demonstrate, join
from cps_agents.learning.export import learned_by, network_of_model
from cps_agents.learning.imitation import imitate
from cps_agents.learning.model import CLASSES, check_fit, make_model, seen_columns, spread, wander
from cps_agents.learning.recipe import ALGORITHMS, SEARCH, SHARED, Recipe, changed
from cps_agents.learning.training_envs import TrainingEnvs, make_envs
from cps_envs.core.play import play_episodes
from cps_envs.core.seeds import EVALUATION, TRAINING_START, VALIDATION, training_seed
from cps_envs.registration import find_problem

ROGUE = Recipe(
    name="tiny",
    problem="rogue",
    role="attacker",
    opponent="pd",
    preset="easy",
    overrides={"duration_s": 3.0},
    num_envs=4,
    total_steps=64,
    steps_per_update=16,
    batch_size=32,
    hidden=(8,),
)
SWARM = replace(
    ROGUE,
    problem="disbanding",
    role="defender",
    opponent="lead",
    swarm=True,
    hold=10,
    overrides={"duration_s": 6.0, "num_platoons": 3, "vehicles_per_platoon": 3, "attack_budget": 1},
)


def test_recipes_refuse_nonsense() -> None:
    with pytest.raises(CommandError, match="Did you mean 'ppo'"):
        Recipe(algorithm="pppo")
    with pytest.raises(CommandError, match="hold = 0"):
        Recipe(hold=0)
    with pytest.raises(CommandError, match="swarm form"):
        Recipe(swarm=True)
    with pytest.raises(CommandError, match=r"no knob 'learning_rat'.*learning_rate"):
        changed(ROGUE, {"learning_rat": 1})
    with pytest.raises(CommandError, match="should be like"):
        changed(ROGUE, {"total_steps": "many"})


def test_recipes_change_by_values_of_the_command_line() -> None:
    recipe = changed(ROGUE, {"hidden": [32, 32], "discount": 1, "overrides": {"dt_s": 0.001}})
    assert recipe.hidden == (32, 32)
    assert isinstance(recipe.discount, float)
    assert recipe.overrides == {"duration_s": 3.0, "dt_s": 0.001}


def test_seeds_do_not_overlap() -> None:
    assert EVALUATION.stop <= VALIDATION.start
    assert VALIDATION.stop <= TRAINING_START <= training_seed(0)
    assert training_seed(1) - training_seed(0) > 19 * 1024


def run_out(envs: TrainingEnvs, action: Any) -> tuple[np.ndarray, list[dict[str, Any]]]:
    """Scaled returns of every row over one episode under a constant action, and the last infos."""
    envs.reset()
    total = np.zeros(envs.num_envs)
    while True:
        envs.step_async(np.stack([action] * envs.num_envs))
        _, reward, done, infos = envs.step_wait()
        total += reward
        if done.all():
            return total, infos


@pytest.mark.parametrize("hold", [1, 3])
def test_environments_pay_the_return(hold: int) -> None:
    recipe = replace(ROGUE, hold=hold, reward_scale=0.5)
    envs = make_envs(recipe, 7)
    total, infos = run_out(envs, np.array([0.7], np.float32))
    unscaled = np.array([info["episode"]["r"] for info in infos])
    np.testing.assert_allclose(total, 0.5 * unscaled, rtol=1e-5)
    config = find_problem("rogue").config("easy", recipe.overrides)
    players: Any = {"attacker": "tests.agents.players:Constant?value=0.7", "defender": "pd"}
    np.testing.assert_allclose(unscaled, play_episodes(find_problem("rogue"), config, players, range(7, 11))["return"])
    assert infos[0]["episode"]["l"] == -(-30 // hold)
    assert not infos[0]["TimeLimit.truncated"]


def test_swarm_environments_share_or_split_the_payoff() -> None:
    team, _infos = run_out(make_envs(SWARM, 0), np.zeros(1, np.float32))
    assert team.shape == (4 * 9,)
    np.testing.assert_allclose(team.reshape(4, 9), team.reshape(4, 9)[:, :1].repeat(9, axis=1))
    local = replace(SWARM, overrides={**SWARM.overrides, "swarm_reward": "local", "collision_penalty": 0.0})
    own, _ = run_out(make_envs(local, 0), np.zeros(1, np.float32))
    np.testing.assert_allclose(own.reshape(4, 9).sum(axis=1), team.reshape(4, 9)[:, 0], rtol=0.02)


def test_bootstrapping_is_told_to_the_learner() -> None:
    _, infos = run_out(make_envs(replace(ROGUE, bootstrap=True), 0), np.zeros(1, np.float32))
    assert all(info["TimeLimit.truncated"] for info in infos)
    assert infos[0]["terminal_observation"].shape == make_envs(ROGUE, 0).observation_space.shape


def test_unseen_fields_are_not_seen() -> None:
    envs = make_envs(ROGUE, 0)
    names = list(envs.env.game.fields["attacker"].slices)
    columns = seen_columns(envs, replace(ROGUE, unseen=(names[0],)))
    assert not set(columns) & set(range(*envs.env.game.fields["attacker"].slices[names[0]].indices(1000)))
    with pytest.raises(ValueError, match="no field 'nonsense'"):
        seen_columns(envs, replace(ROGUE, unseen=("nonsense",)))


def build(recipe: Recipe) -> tuple[Any, TrainingEnvs]:
    envs = make_envs(recipe, 0)
    columns = seen_columns(envs, recipe)
    mean, deviation = spread(wander(envs, 0), columns)
    scaling = {"columns": columns, "mean": mean, "deviation": deviation}
    return make_model(recipe, envs, scaling, 0, "cpu"), envs


CASES = {
    "ppo": ROGUE,
    "sac": replace(ROGUE, algorithm="sac", buffer_size=100),
    "recurrent-ppo": replace(ROGUE, algorithm="recurrent-ppo", memory_units=8),
    "maskable-ppo": replace(ROGUE, problem="fdi", preset="easy", algorithm="maskable-ppo", opponent="", overrides={}),
    "dqn": replace(
        ROGUE,
        problem="disbanding",
        algorithm="dqn",
        opponent="none",
        buffer_size=100,
        overrides={"num_platoons": 3, "vehicles_per_platoon": 3, "duration_s": 60.0},
    ),
    "swarm": SWARM,
}


@pytest.mark.parametrize("case", CASES)
def test_exported_networks_act_like_the_model(case: str) -> None:
    recipe = CASES[case]
    model, envs = build(recipe)
    network = network_of_model(model, recipe.activation)
    observation = wander(envs, 1)[-50:]
    state = np.zeros((len(observation), network.units), np.float32)
    outputs, *_ = network.forward(observation, state, state)
    actions, _ = model.predict(observation, deterministic=True)
    if recipe.algorithm == "sac":
        outputs = np.tanh(outputs)
    if actions.dtype.kind == "f":
        np.testing.assert_allclose(np.clip(outputs, -1, 1), actions, atol=1e-5)
    else:
        counts = np.ravel(getattr(envs.action_space, "nvec", getattr(envs.action_space, "n", 0)))
        parts = np.split(outputs, np.cumsum(counts)[:-1], axis=1)
        np.testing.assert_array_equal(
            np.stack([part.argmax(axis=1) for part in parts], axis=1).squeeze(), actions.squeeze()
        )


@pytest.mark.parametrize(
    ("recipe", "message"),
    [
        (replace(CASES["maskable-ppo"], algorithm="sac"), "sac plays continuous"),
        (replace(ROGUE, algorithm="dqn"), "dqn plays Discrete"),
        (replace(ROGUE, algorithm="maskable-ppo"), "plays discrete actions"),
        (replace(CASES["maskable-ppo"], overrides={"attack_action": "share"}), "all actions .* are legal"),
        (replace(CASES["sac"], teacher="square"), "cannot start from a teacher"),
    ],
)
def test_algorithms_that_do_not_fit_are_refused(recipe: Recipe, message: str) -> None:
    with pytest.raises(CommandError, match=message):
        check_fit(recipe, make_envs(recipe, 0))


def test_every_algorithm_has_a_class() -> None:
    assert {*CLASSES, SEARCH, SHARED} == set(ALGORITHMS)


def test_imitation_learns_what_the_teacher_does() -> None:
    recipe = replace(SWARM, teacher="feedback", teacher_epochs=200, batch_size=64, hidden=(32,))
    shown = demonstrate(recipe, range(4))
    assert shown.observations.shape == (4 * 6 * 9, 22)
    model, _ = build(recipe)
    generator = np.random.default_rng(0)
    assert imitate(model.policy, shown, recipe, generator) < 0.1 * shown.actions.var()


def test_a_student_is_commented_on_where_it_goes() -> None:
    recipe = replace(ROGUE, teacher="square", overrides={"duration_s": 3.0, "onset_s": 0.0})
    alone = demonstrate(recipe, range(2))
    problem = find_problem("rogue")
    game = problem.game(problem.config("easy", recipe.overrides), 1)
    student = problem.policy("tests.agents.players:Constant?value=-1", game, "attacker")
    corrected = demonstrate(recipe, range(2), student)
    assert not np.array_equal(alone.observations, corrected.observations)
    assert len(join(alone, corrected).actions) == 2 * len(alone.actions)


def test_disturbed_teachers_show_more_and_say_the_same() -> None:
    recipe = replace(SWARM, teacher="feedback")
    plain, noisy = (demonstrate(replace(recipe, teacher_noise=noise), range(2)) for noise in (0.0, 0.1))
    assert not np.array_equal(noisy.observations, plain.observations)
    again = demonstrate(replace(recipe, teacher_noise=0.1), range(2))
    np.testing.assert_array_equal(noisy.observations, again.observations)
    first = plain.observations[:9]  # before anything is disturbed
    np.testing.assert_array_equal(first, noisy.observations[:9])
    np.testing.assert_array_equal(plain.actions[:9], noisy.actions[:9])
    with pytest.raises(CommandError, match="teacher_noise is for continuous actions"):
        demonstrate(replace(CASES["maskable-ppo"], teacher="oracle", teacher_noise=0.1), range(1))


def test_a_checkpoint_that_has_not_learned_says_what_made_it() -> None:
    taught = Recipe(name="x", problem="fdi", teacher="tracker")
    assert learned_by(taught, 0) == "imitation"
    assert learned_by(taught, 64) == "ppo"
    assert learned_by(replace(taught, teacher="", search_steps=5), 0) == "plan-search"
    assert learned_by(replace(taught, teacher=""), 0) == "untrained"
