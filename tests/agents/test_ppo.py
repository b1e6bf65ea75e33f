"""Our own PPO: that it learns, what it looks at, how it starts, and that it goes on exactly."""

from __future__ import annotations

import json
import signal
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")

import torch

from cps_agents.errors import CommandError
from cps_agents.learning.copies import Copies
from cps_agents.learning.episode_noise import EpisodeNoise
from cps_agents.learning.learner import learn
from cps_agents.learning.ppo import Learner, Returns
from cps_agents.learning.recipe import Recipe, changed, knobs_of
from cps_agents.learning.run import TrainingJob
from cps_agents.learning.shared import make_envs, make_learner
from cps_agents.recipes.finding import RECIPES, find_recipe
from cps_agents.recipes.learning import OWN, learning_recipe
from cps_agents.zoo.files import load
from cps_agents.zoo.wired import Head, WiredPolicy
from cps_envs.core.declare.seeds import training_seed
from cps_envs.core.game.play import play_episodes
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.types import ROLES, SIGN, Array, Role
from cps_envs.registration import PROBLEMS
from tests.agents.arms import ARMS
from tests.core.toy import TOY

STEPS = 12_800
BEST = 20.0  # 15 hits, and what idle dials are charged


def recipe_of(role: Role, **changes: Any) -> Recipe:
    small = {"hidden": (16, 16), "total_timesteps": STEPS, "evaluation_episodes": 4, "evaluations": 1}
    return changed(learning_recipe(ARMS, role), {"problem": "tests.agents.arms:ARMS", **small, **changes})


def job(folder: Path, **changes: Any) -> TrainingJob:
    given = {name: changes.pop(name) for name in ("resume",) if name in changes}
    return TrainingJob(recipe_of("attacker", **changes), 0, folder, "cps-envs train", tracker="none", **given)


def toy_envs(role: Role, **options: Any) -> LearningVectorEnv:
    return LearningVectorEnv(TOY, role, 8, **options)


def test_arms_follow_their_cues() -> None:
    learner = make_learner(recipe_of("attacker"), 0)
    learner.learn()
    assert learner.progress().training_return > 0.8 * BEST


def test_dials_are_moved_by_noise_that_is_held() -> None:
    recipe = recipe_of("defender", episode_noise=True, learning_rate=1e-3, total_timesteps=12_800)
    learner = make_learner(recipe, 0)
    assert isinstance(learner, EpisodeNoise)
    learner.learn()
    rows = torch.from_numpy(learner.rows)
    np.testing.assert_allclose(learner.network.outputs(rows).detach(), 0.5, atol=0.1)


@pytest.mark.parametrize("copies", [2, 4])
def test_of_like_episodes_the_better_ones_are_followed(copies: int) -> None:
    learner = make_learner(recipe_of("attacker", copies=copies), 0)
    assert isinstance(learner, Copies)
    learner.start()
    shown = learner.collect()
    assert shown.ended[-1].all()
    advantages, _ = learner.credit(shown)
    returns = shown.rewards.sum(axis=0).reshape(copies, -1)
    np.testing.assert_allclose(advantages[0], (returns - returns.mean(axis=0)).reshape(-1), atol=1e-5)
    assert (advantages == advantages[0]).all()
    learner.learn()
    assert learner.progress().training_return > 0.5 * BEST


def test_the_return_that_is_shown_is_of_one_whole_episode_of_each_environment() -> None:
    shown = Returns(3)
    shown.start(at_once=False)

    def add(*returns: float) -> float:
        """What is shown once the episodes with these returns have ended; those that go on have none."""
        found = np.array(returns)
        shown.add(np.nan_to_num(found), ~np.isnan(found))
        return shown.mean

    goes_on = np.nan
    assert np.isnan(add(9.0, 9.0, goes_on))  # whose beginnings nobody has seen
    assert np.isnan(add(1.0, goes_on, 9.0))
    assert np.isnan(add(8.0, 2.0, goes_on))  # the first environment ends its second short episode
    assert add(8.0, goes_on, 6.0) == 3.0
    assert add(goes_on, 5.0, goes_on) == 3.0  # began before 3.0 was known
    assert add(0.0, goes_on, 0.0) == 3.0  # these began then
    assert add(goes_on, 3.0, goes_on) == 1.0
    shown.start(at_once=True)
    assert add(4.0, 4.0, goes_on) == 1.0
    assert add(0.0, 0.0, 4.0) == 4.0


def test_short_episodes_do_not_come_first() -> None:
    learner = make_learner(recipe_of("attacker", n_steps=5, total_timesteps=640), 0)
    means = []
    learner.learn(lambda progress: means.append(progress.training_return))
    assert np.isnan(means[0])
    assert np.isfinite(means[-1])


def test_copies_are_at_least_two() -> None:
    with pytest.raises(CommandError, match="copies"):
        Copies(make_envs(recipe_of("attacker"), 0), changed(Recipe(), {"total_timesteps": 1}))


def test_noise_for_an_episode_needs_pairs_and_a_box() -> None:
    with pytest.raises(CommandError, match="copies"):
        EpisodeNoise(make_envs(recipe_of("defender"), 0), changed(Recipe(), {"total_timesteps": 1}))
    with pytest.raises(CommandError, match="continuous"):
        make_learner(recipe_of("attacker", episode_noise=True), 0)


def test_only_active_rows_are_learned_from(monkeypatch: pytest.MonkeyPatch) -> None:
    learner = make_learner(recipe_of("attacker"), 0)
    seen: list[Array] = []
    monkeypatch.setattr(learner, "update", lambda played, chosen, falling: seen.append(chosen.numpy()))
    learner.start()
    shown = learner.collect()
    monkeypatch.setattr(learner, "collect", lambda: shown)
    learner.improve(1.0)
    np.testing.assert_array_equal(seen[0], np.flatnonzero(shown.active[:-1]))
    assert 0.6 < len(seen[0]) / shown.ended.size < 0.9  # three quarters are active
    idle = ~shown.active[:-1]
    assert (shown.actions[idle] == 0).all()
    assert (shown.log_probability[idle] == 0).all()


def test_advantages_are_those_of_each_row_by_itself() -> None:
    learner = make_learner(recipe_of("attacker", gamma=0.9, gae_lambda=0.8), 0)
    learner.start()
    shown = learner.collect()
    generator = np.random.default_rng(1)
    shown = shown._replace(rewards=generator.normal(size=shown.rewards.shape))
    learner.scale = 4.0
    advantages, targets = learner.credit(shown)
    with torch.no_grad():
        values = torch.stack(
            [
                learner.network.values(torch.from_numpy(rows), torch.from_numpy(truth))
                for rows, truth in zip(shown.rows, shown.truth, strict=True)
            ]
        ).numpy()
    for row in range(0, shown.rewards.shape[1], 7):
        for t in range(len(shown.rewards)):
            total, factor = 0.0, 1.0
            for later in range(t, len(shown.rewards)):
                over = shown.ended[later, row] or not shown.active[later + 1, row]
                following = 0.0 if over else 0.9 * values[later + 1, row]
                total += factor * (shown.rewards[later, row] / 2 + following - values[later, row])
                factor *= 0.9 * 0.8
                if over:
                    break
            np.testing.assert_allclose(advantages[t, row], total, rtol=1e-4, atol=1e-5)
            np.testing.assert_allclose(targets[t, row], total + values[t, row], rtol=1e-4, atol=1e-5)


def test_what_is_paid_in_a_pause_counts_for_the_decision_before(monkeypatch: pytest.MonkeyPatch) -> None:
    learner = make_learner(recipe_of("defender"), 0)
    learner.start()
    monkeypatch.setattr(learner.envs.adapter, "pauses", True)
    shown = learner.collect()
    generator = np.random.default_rng(2)
    active, ended = generator.random(shown.active.shape) < 0.4, generator.random(shown.ended.shape) < 0.1
    shown = shown._replace(rewards=generator.normal(size=shown.rewards.shape), active=active, ended=ended)
    learner.scale = 1.0
    advantages, _ = learner.credit(shown)
    with torch.no_grad():
        seen = zip(map(torch.from_numpy, shown.rows), map(torch.from_numpy, shown.truth), strict=True)
        values = torch.stack([learner.network.values(rows, truth) for rows, truth in seen]).numpy()
    discount, gae_lambda = learner.recipe.ppo.gamma, learner.recipe.ppo.gae_lambda

    def advantage(first: int, row: int) -> float:
        """From a decision to the next one as a single step, and so on."""
        paid, factor = -values[first, row], 1.0
        for t in range(first, len(shown.rewards)):
            paid += factor * shown.rewards[t, row]
            factor *= discount
            if ended[t, row]:
                return float(paid)
            if active[t + 1, row] and t + 1 < len(shown.rewards):
                return float(paid + factor * (values[t + 1, row] + gae_lambda * advantage(t + 1, row)))
        return float(paid + factor * values[-1, row])

    for t, row in zip(*np.nonzero(active[:-1]), strict=True):
        np.testing.assert_allclose(advantages[t, row], advantage(t, row), rtol=1e-3, atol=1e-4)


def test_the_value_of_an_active_row_is_told_the_truth() -> None:
    learner = make_learner(recipe_of("attacker"), 0)
    columns = learner.envs.wired.columns.size
    assert learner.network.value[0].in_features == columns + 1
    assert learner.network.policy[0].in_features == columns


@pytest.mark.parametrize("bias", [0.0, 2.0])
def test_an_untrained_network_plays_near_the_neutral_action(bias: float) -> None:
    envs, recipe = toy_envs("attacker"), changed(Recipe(), {"total_timesteps": 1, "neutral_bias": bias})
    network, count = Learner(envs, recipe).network, 4000
    rows = torch.zeros(count, envs.wired.columns.size)
    rows[:, -network.masked :] = 1
    drawn, log_probability = network.draw(rows, torch.Generator().manual_seed(0))
    neutral = (drawn[:, 0] == 0).float().mean().item()
    odds = np.exp([bias, 0, 0, 0, 0])
    assert neutral == pytest.approx(odds[0] / odds.sum(), abs=0.03)
    judged, entropy = network.judge(rows, drawn)
    np.testing.assert_allclose(judged.detach(), log_probability.detach(), atol=1e-5)
    assert entropy[0].item() == pytest.approx(-(odds / odds.sum() * np.log(odds / odds.sum())).sum(), abs=1e-4)


def test_no_illegal_action_is_drawn() -> None:
    learner = Learner(toy_envs("attacker"), changed(Recipe(), {"total_timesteps": 1, "n_steps": 30}))
    learner.start()
    shown = learner.collect()
    legal = shown.rows[:-1, :, -learner.network.masked :] > 0
    chosen = np.take_along_axis(legal, shown.actions.astype(int), axis=2)
    assert not legal.all()
    assert chosen.all()


def test_gaussian_actions_have_their_density() -> None:
    recipe = changed(Recipe(), {"total_timesteps": 1, "initial_deviation": 0.4})
    network = Learner(toy_envs("defender"), recipe).network
    rows = torch.zeros(5, network.inputs)
    drawn, log_probability = network.draw(rows, torch.Generator().manual_seed(3))
    normal = torch.distributions.Normal(network.outputs(rows), 0.4)
    expected = normal.log_prob(drawn).sum(1).detach()
    np.testing.assert_allclose(log_probability.detach(), expected, atol=1e-5)
    np.testing.assert_allclose(network.judge(rows, drawn)[0].detach(), expected, atol=1e-5)
    np.testing.assert_allclose(network.judge(rows, drawn)[1].detach(), normal.entropy().sum(1).detach(), atol=1e-5)


PLAYED = [
    (TOY, "attacker", {"frame_skip": 2, "recent_s": (3.0, 9.0), "rough_s": 4.0}),
    (TOY, "attacker", {}),
    (TOY, "defender", {"frame_skip": 3}),
    (TOY, "defender", {"recent_s": (2.0,)}),
    (ARMS, "attacker", {"frame_skip": 2}),
    (ARMS, "defender", {"rough_s": 3.0}),
]


@pytest.mark.parametrize(("problem", "role", "options"), PLAYED)
def test_a_played_policy_sees_and_does_what_it_did_in_training(problem: Any, role: Role, options: Any) -> None:
    envs = LearningVectorEnv(problem, role, 8, copies=2, **options)
    learner = Learner(envs, changed(Recipe(), {"total_timesteps": 1}), seed=3)
    with torch.no_grad():
        learner.network.policy[-1].weight.normal_(generator=learner.generator)
    network = learner.network.exported()
    head = Head()
    outputs, asked = network.forward, []

    def listening(rows: Array) -> Array:
        asked.append(rows)
        return outputs(rows)

    policy = WiredPolicy(envs.game.spec(role), envs.wired.wiring, listening, head)
    seeds = range(training_seed(0), training_seed(0) + 4)
    other: Role = "defender" if role == "attacker" else "attacker"
    played = play_episodes(problem, envs.config, {role: policy, other: envs.opponent}, seeds)
    rows, _ = envs.reset()
    returns, going, place = np.zeros(8), np.ones(8, np.bool_), 0
    while going.any():
        if going.all():
            np.testing.assert_allclose(asked[place], rows[: len(rows) // 2], atol=1e-6)
        place += 1
        actions = greedy(learner, outputs, rows).reshape(envs.action_space.shape)
        rows, _, ended, _, info = envs.step(actions)
        ended = ended[:: envs.agents] & going
        if ended.any():
            returns[ended] = info["final_info"]["episode"]["r"][:: envs.agents][ended]
        going &= ~ended
    assert place > 1
    np.testing.assert_allclose(SIGN[role] * returns[:4], played["return"], atol=1e-9)
    np.testing.assert_array_equal(returns[:4], returns[4:])


def greedy(learner: Learner, outputs: Any, rows: Array) -> Array:
    """The best actions by the exported network, whose outputs are those of torch but for rounding."""
    network, found = learner.network, outputs(rows)
    if network.choices:
        found = np.where(rows[:, -network.masked :] > 0, found, -1e9) if network.masked else found
    with torch.no_grad():
        np.testing.assert_allclose(found, network.outputs(torch.from_numpy(rows)), rtol=1e-5, atol=1e-5)
    if not network.choices:
        return found
    ends = np.cumsum(network.choices)
    parts = [found[:, end - count : end] for end, count in zip(ends, network.choices, strict=True)]
    return np.stack([part.argmax(axis=1) for part in parts], axis=1)


def test_draws_of_a_played_policy_are_the_episodes_own(tmp_path: Path) -> None:
    learn(job(tmp_path, total_timesteps=640, sampled=True))
    reference = f"zoo:{tmp_path}"

    def hits(seeds: Any, name: str = reference) -> Array:
        return play_episodes(ARMS, ARMS.config("learning", {}), {"attacker": name}, seeds)["hits"]

    together = hits(range(6))
    np.testing.assert_array_equal(together, np.concatenate([hits([seed]) for seed in range(6)]))
    assert (together != hits(range(6), f"{reference}?deterministic=true")).any()
    np.testing.assert_array_equal(together, hits(range(6), f"{reference}?deterministic=false"))


def test_a_run_leaves_a_policy_that_plays(tmp_path: Path) -> None:
    notes: list[tuple[int, str]] = []
    found = learn(job(tmp_path), lambda steps, note: notes.append((steps, note)))
    assert (found["status"], found["best_score"]) == ("finished", pytest.approx(BEST, abs=1))
    assert found["steps"] >= STEPS
    assert "none 5" in notes[0][1]
    assert "steps/CPU s" in notes[1][1]
    assert "CPU s left" in notes[1][1]
    rows = [json.loads(line) for line in (tmp_path / "evaluations.jsonl").read_text().splitlines()]
    assert [row["steps"] for row in rows] == [0, found["steps"]]
    card, _ = load(tmp_path / "policy.json")
    assert (card.algorithm, card.wiring["adapter"], card.actions) == ("shared-ppo", "arms", (3,))
    played = play_episodes(ARMS, ARMS.config("learning", {}), {"attacker": f"zoo:{tmp_path}"}, range(8))
    assert played["return"].mean() > BEST - 1
    with pytest.raises(ValueError, match=r"scaled inputs|attacker of"):
        play_episodes(ARMS, ARMS.config("learning", {}), {"defender": f"zoo:{tmp_path}"}, [0])


def test_ctrl_c_leaves_a_policy_and_the_run_goes_on(tmp_path: Path) -> None:
    whole = learn(job(tmp_path / "whole"))

    def interrupt(steps: int, note: str) -> None:
        if steps > STEPS // 2:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        learn(job(tmp_path / "cut"), interrupt)
    stopped = json.loads((tmp_path / "cut" / "run.json").read_text())
    assert stopped["status"] == "interrupted"
    assert load(tmp_path / "cut" / "policy.json")[0].algorithm == "shared-ppo"
    with pytest.raises(CommandError, match="--resume"):
        learn(job(tmp_path / "cut"))
    found = learn(job(tmp_path / "cut", resume=True))
    assert (found["status"], found["steps"]) == ("finished", whole["steps"])
    rows = [
        json.loads((tmp_path / name / "evaluations.jsonl").read_text().splitlines()[-1]) for name in ("whole", "cut")
    ]
    assert {**rows[0], "cpu_s": 0} == {**rows[1], "cpu_s": 0}


def test_recipes_take_their_numbers_from_the_problems() -> None:
    for problem in PROBLEMS.values():
        for role in ROLES:
            recipe, training = learning_recipe(problem, role), problem.training.get(role)
            assert RECIPES[recipe.name] == recipe
            assert find_recipe(problem.env_id(role)) == recipe
            if training is None:
                continue
            own = OWN.get((problem.name, role), {})
            told = {**asdict(training), "total_timesteps": recipe.training.total_timesteps}
            knobs = knobs_of(recipe)
            named = json.loads(json.dumps({**told, **training.ppo, **own}))
            assert {name: knobs[name] for name in named if name in knobs} == {
                name: value for name, value in named.items() if name in knobs
            }
            assert named.keys() - knobs.keys() <= {"ppo", "policy_kwargs"}


def test_nothing_is_played_twice_in_a_run() -> None:
    envs = LearningVectorEnv(ARMS, "attacker", 8)
    drawn = []
    for start in range(3):
        envs.reset(options={"start": start})
        drawn += [generator.bit_generator.seed_seq.entropy for generator in envs._generators]
    assert len(set(drawn)) == len(drawn)
    assert all(training_seed(0) <= seed < training_seed(1) for seed in drawn)
