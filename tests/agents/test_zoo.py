"""Trained policies as files and as players."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_agents.errors import CommandError
from cps_agents.recipes.finding import RECIPES
from cps_agents.zoo.card import read_card
from cps_agents.zoo.files import find, load, save, shipped_names
from cps_agents.zoo.merging import merge, without_places
from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.game.play import play_episodes
from cps_envs.registration import PROBLEMS, find_problem
from tests.agents.command_line import succeeded
from tests.agents.trained import save_tiny
from tests.episodes import play
from tests.settings import tests_of as settings_of

SHORT = {name: dict(settings_of(name).short) for name in PROBLEMS}


@pytest.mark.parametrize("role", ["attacker", "defender"])
@pytest.mark.parametrize("name", sorted(PROBLEMS))
def test_plays_every_role(name: str, role: Any, tmp_path: Path) -> None:
    save_tiny(tmp_path / "tiny.json", name, role, overrides=SHORT[name])
    config = find_problem(name).config("paper", SHORT[name])
    outcome = play_episodes(find_problem(name), config, {role: f"zoo:{tmp_path / 'tiny.json'}"}, range(3))
    assert np.isfinite(outcome["return"]).all()


@pytest.mark.parametrize("name", ["disbanding", "rogue"])
def test_plays_a_team(name: str, tmp_path: Path) -> None:
    save_tiny(tmp_path / "tiny.json", name, "defender", overrides=SHORT[name], swarm=True, frame_skip=2)
    config = find_problem(name).config("paper", SHORT[name])
    players: Any = {"defender": f"zoo:{tmp_path / 'tiny.json'}"}
    mixed: Any = {"defender": f'mixture?policies=["zoo:{tmp_path / "tiny.json"}"]'}
    alone = play_episodes(find_problem(name), config, players, range(2))
    np.testing.assert_array_equal(alone["return"], play_episodes(find_problem(name), config, mixed, range(2))["return"])


@pytest.mark.parametrize("deterministic", [True, False])
def test_environments_equal_single_environments(deterministic: bool, tmp_path: Path) -> None:
    save_tiny(tmp_path / "tiny.json", "rogue", "defender", preset="easy", frame_skip=3)
    reference = f"zoo:{tmp_path / 'tiny.json'}?deterministic={str(deterministic).lower()}"

    def returns(seeds: Sequence[int]) -> list[float]:
        return play(find_problem("rogue"), "square", reference, seeds, "easy", duration_s=4.0)["return"].tolist()

    assert [returns([seed])[0] for seed in range(4)] == returns(range(4))


def test_sampling_differs_from_the_mode_and_between_seeds(tmp_path: Path) -> None:
    save_tiny(tmp_path / "tiny.json", "rogue", "attacker")
    reference, charged = f"zoo:{tmp_path / 'tiny.json'}", {"duration_s": 4.0, "formation_weight_mps2": 0.5}
    mode, drawn, other = (
        play(find_problem("rogue"), reference + query, "pd", [0, 1], **charged)["formation_charge"].tolist()
        for query in ("", "?deterministic=false", "?seed=1")
    )
    assert mode[0] == mode[1]
    assert drawn[0] != drawn[1]
    assert mode != drawn
    assert mode != other


def test_is_an_opponent_by_name(tmp_path: Path) -> None:
    save_tiny(tmp_path / "tiny.json", "hvac", "defender", overrides=SHORT["hvac"])
    env = gymnasium.make(
        "cps_envs:cps_envs/HvacAttack-v0", preset="paper", opponent=f"zoo:{tmp_path / 'tiny.json'}", **SHORT["hvac"]
    )
    env.reset(seed=0)
    assert np.isfinite(env.step(env.action_space.sample())[1])


def test_masks_are_obeyed(tmp_path: Path) -> None:
    save_tiny(tmp_path / "tiny.json", "disbanding", "attacker", overrides=SHORT["disbanding"])
    problem = find_problem("disbanding")
    game = problem.game(problem.config("paper", SHORT["disbanding"]), 5)
    policy = problem.policy(f"zoo:{tmp_path / 'tiny.json'}?deterministic=false", game, "attacker")
    mask = np.zeros((5, 11), np.bool_)
    mask[:, 4] = True
    observation = np.zeros((5, game.fields["attacker"].size), np.float32)
    actions, _ = policy.predict(observation, action_masks=mask)  # type: ignore[call-arg]
    np.testing.assert_array_equal(actions, 4)


def test_says_what_does_not_fit(tmp_path: Path) -> None:
    card = tmp_path / "tiny.json"
    save_tiny(card, "fdi", "attacker", preset="easy")
    problem = find_problem("fdi")
    game = problem.game(problem.config("paper", {}), 1)
    with pytest.raises(ConfigurationError, match="play it in the configuration of its card, preset 'easy'"):
        problem.policy(f"zoo:{card}", game, "attacker")
    with pytest.raises(ConfigurationError, match="not as defender of fdi"):
        problem.policy(f"zoo:{card}", game, "defender")
    save_tiny(card, "fdi", "attacker", version=99)
    with pytest.raises(ConfigurationError, match="version 99"):
        problem.policy(f"zoo:{card}", game, "attacker")
    save_tiny(card, "fdi", "attacker", observation_size=9999)
    with pytest.raises(ConfigurationError, match="and 9999 inputs"):
        problem.policy(f"zoo:{card}", game, "attacker")


def test_unknown_names_and_seeds(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="no trained policy"):
        find("hvac-atack")
    save_tiny(tmp_path / "tiny.json", "fdi", "attacker")
    with pytest.raises(ValueError, match="no training seed 7"):
        load(tmp_path / "tiny.json", 7)


def test_merging_keeps_each_seed(tmp_path: Path) -> None:
    for seed in (0, 1):
        save_tiny(
            tmp_path / f"seed-{seed}" / "policy.json",
            "fdi",
            "attacker",
            seeds=2,
            best=seed,
        )
    cards = [tmp_path / f"seed-{seed}" / "policy.json" for seed in (0, 1)]
    merged = merge(cards, tmp_path / "both.json")
    assert merged.name == "both"
    assert merged.best == 0
    assert list(merged.seeds) == ["0", "1"]
    for seed in (0, 1):
        expected = load(cards[seed], seed)[1].tensors()
        for name, array in load(tmp_path / "both.json", seed)[1].tensors().items():
            np.testing.assert_array_equal(array, expected[name])
    with pytest.raises(CommandError, match="is already in the policy"):
        merge([cards[0], cards[0]], tmp_path / "both.json")
    save_tiny(cards[1], "fdi", "attacker", recipe={"other": 1})
    with pytest.raises(CommandError, match="another recipe"):
        merge(cards, tmp_path / "both.json")


def test_a_merged_card_says_so_where_a_network_has_not_learned(tmp_path: Path) -> None:
    for seed, (algorithm, steps) in enumerate((("shared-ppo", 64), ("untrained", 0))):
        facts = {str(seed): {"validation": float(-seed), "steps": steps}}
        save_tiny(tmp_path / f"{seed}.json", "fdi", "attacker", seeds=2, best=seed, algorithm=algorithm)
        card, network = load(tmp_path / f"{seed}.json", seed)
        save(tmp_path / f"{seed}.json", replace(card, seeds=facts), {seed: network})
    merged = merge([tmp_path / f"{seed}.json" for seed in (0, 1)], tmp_path / "both.json")
    assert (merged.best, merged.algorithm) == (0, "untrained")


def test_a_kept_command_names_no_places() -> None:
    command = "cps-envs train x --seeds 5 --out /a/b --jobs=2 --to 'c d' --resume --opponent 'mixture?policies=[1]'"
    assert without_places(command) == "cps-envs train x --seeds 5 --opponent 'mixture?policies=[1]'"


def test_commands(tmp_path: Path) -> None:
    save_tiny(tmp_path / "run" / "policy.json", "fdi", "attacker", seeds=1)

    def run(*arguments: str) -> str:
        result = succeeded("zoo", *arguments)
        return str(result.stdout)

    folder = str(tmp_path / "own")
    assert "attacker of fdi" in run("add", str(tmp_path / "run"), "--to", folder, "--name", "mine")
    assert [card["name"] for card in json.loads(run("list", "--folder", folder, "--json"))] == ["mine"]
    assert json.loads(run("show", f"{folder}/mine.json", "--json"))["problem"] == "fdi"
    assert "mine" in run("list", "--folder", folder)


@pytest.mark.parametrize("name", shipped_names())
def test_shipped_policies_load(name: str) -> None:
    card, _ = load(name)
    assert card.name == name
    assert card.problem in PROBLEMS
    assert find(name).with_suffix(".safetensors").stat().st_size <= 1_000_000
    for seed in card.seeds:
        load(name, int(seed))
    problem = find_problem(card.problem)
    game = problem.game(problem.config(card.preset, card.overrides), 1)
    role: Any = card.role
    problem.policy(f"zoo:{name}", game, role)


@pytest.mark.parametrize("name", shipped_names())
def test_cards_are_readable(name: str, tmp_path: Path) -> None:
    path = tmp_path / "card.md"
    succeeded("zoo", "card", name, "--out", str(path))
    text = path.read_text(encoding="utf-8")
    assert text.startswith("---\nlibrary_name: cps-envs\n")
    assert f"zoo:{name}" in text
    assert read_card(find(name)).weights in text
    tables = [line for line in text.splitlines() if line.startswith("|")]
    assert {line.replace("\\|", "").count("|") for line in tables} <= {5, 7}


@pytest.mark.parametrize("name", [name for name in shipped_names() if "-self-play" not in name])
def test_every_trained_policy_has_a_recipe_and_learned_by_reward_where_its_card_says_ppo(name: str) -> None:
    card = read_card(find(name))
    assert card.algorithm == RECIPES[name].algorithm
    assert list(card.seeds) == ["0", "1", "2", "3", "4"]
    assert "ppo" not in card.algorithm or all(facts["steps"] > 0 for facts in card.seeds.values())
