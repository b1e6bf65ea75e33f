"""Cards of networks that play through a wiring: they are read, or refused with a sentence that names the file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")

from cps_agents.learning.learner import learn
from cps_agents.zoo.card import SHIPPED, read_card
from cps_agents.zoo.files import load, save
from cps_agents.zoo.merging import merge
from cps_agents.zoo.wiring import check_wiring
from cps_envs.core.documents import DamagedFileError
from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.game.play import play_episodes
from tests.agents.arms import ARMS
from tests.agents.test_ppo import STEPS, job


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of our own PPO."""
    found = tmp_path_factory.mktemp("run")
    learn(job(found, total_timesteps=320))
    return found


def played(path: Path, preset: str = "learning", option: str = "", **overrides: Any) -> Any:
    reference = f"zoo:{path}?{option}".rstrip("?")
    return play_episodes(ARMS, ARMS.config(preset, overrides), {"attacker": reference}, range(2))["return"]


WRONG = {
    "frame_skip": [0, 1.5, True, 10**9],
    "recent_s": [[0.0], [float("1e300")], "often", [1.0] * 1000],
    "rough_s": [-1.0, "never"],
    "masked": [1],
    "joint": [1],
    "flat": ["no"],
    "plain": [None],
    "sampled": ["yes"],
    "adapter": [3],
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wiring_that_makes_no_sense_is_refused(name: str, folder: Path, tmp_path: Path) -> None:
    good = json.loads((folder / "policy.json").read_text())
    check_wiring(good["wiring"])
    for value in WRONG[name]:
        (tmp_path / "policy.json").write_text(json.dumps({**good, "wiring": {**good["wiring"], name: value}}))
        with pytest.raises(DamagedFileError, match=r"policy\.json is no card .*wiring"):
            read_card(tmp_path / "policy.json")


def test_entries_that_are_missing_or_unknown_are_named(folder: Path) -> None:
    good = read_card(folder / "policy.json").wiring
    with pytest.raises(ValueError, match="colour"):
        check_wiring({**good, "colour": 1})
    with pytest.raises(ValueError, match="rough_s"):
        check_wiring({name: value for name, value in good.items() if name != "rough_s"})


def test_a_wiring_of_another_adapter_or_size_is_refused(folder: Path, tmp_path: Path) -> None:
    card, network = load(folder / "policy.json")
    for change, error, words in (
        ({"adapter": "legs"}, UnknownNameError, "no adapter 'legs'"),
        ({"recent_s": [1.0]}, ConfigurationError, "play it in the configuration of its card"),
        ({"masked": False}, ConfigurationError, "play it in the configuration of its card"),
    ):
        fields = {name: getattr(card, name) for name in card.__dataclass_fields__}
        save(tmp_path / "policy.json", type(card)(**{**fields, "wiring": {**card.wiring, **change}}), {0: network})
        with pytest.raises(error, match=words):
            played(tmp_path)


def test_each_training_seed_keeps_its_scaling_and_its_untrained_network(tmp_path: Path) -> None:
    for seed in (0, 1):
        learn(replace(job(tmp_path / f"seed-{seed}", total_timesteps=STEPS), seed=seed))
    merge([tmp_path / f"seed-{seed}" / "policy.json" for seed in (0, 1)], tmp_path / "both.json")
    for option in ("", "&untrained=true"):
        alone = [played(tmp_path / f"seed-{seed}", option=f"seed={seed}{option}") for seed in (0, 1)]
        both = [played(tmp_path / "both.json", option=f"seed={seed}{option}") for seed in (0, 1)]
        np.testing.assert_array_equal(both, alone)
    networks = [load(tmp_path / "both.json", seed)[1] for seed in (0, 1)]
    starts = [load(tmp_path / "both.json", seed, untrained=True)[1] for seed in (0, 1)]
    np.testing.assert_array_equal(networks[0].mean, networks[1].mean)  # of the interface, and not of a seed
    for network, start in zip(networks, starts, strict=True):
        np.testing.assert_array_equal(network.mean, start.mean)
        assert (network.layers[0][0] != start.layers[0][0]).any()


def test_a_file_without_an_untrained_network_says_so(folder: Path, tmp_path: Path) -> None:
    card, network = load(folder / "policy.json")
    save(tmp_path / "policy.json", card, {0: network})
    with pytest.raises(ValueError, match="saved without the network that its training began with"):
        played(tmp_path, option="untrained=true")


def test_every_card_has_a_wiring(folder: Path, tmp_path: Path) -> None:
    assert all(read_card(path).wiring for path in SHIPPED.glob("*.json"))
    good = json.loads((folder / "policy.json").read_text())
    (tmp_path / "policy.json").write_text(json.dumps({**good, "wiring": {}}))
    with pytest.raises(DamagedFileError, match=r"policy\.json is no card .*entries of its wiring are not those"):
        read_card(tmp_path / "policy.json")


def test_a_network_plays_in_another_length_of_the_episode(folder: Path) -> None:
    assert played(folder, duration_s=20.0).mean() > played(folder).mean()
