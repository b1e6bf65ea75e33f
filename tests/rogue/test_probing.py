"""The searched attackers `switching` and `probe`: their files, and what they are told."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import numpy as np
import pytest

from cps_baselines.rogue.probing import LOOKS_S, Answers, Probe, shipped_answers
from cps_baselines.rogue.switching import Switching
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.types import Array
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.problem import ROGUE
from cps_paper.rogue.headroom import SHIPPED
from cps_paper.rogue.worlds import ALL, RATIOS, switching_damages, world_config
from tests import episodes
from tests.rogue.games import DEFENDERS

SEEDS = range(8_100, 8_104)


def shipped() -> list[dict[str, Any]]:
    return json.loads(files("cps_baselines.rogue").joinpath("switching.json").read_text(encoding="utf-8"))["found"]


def test_against_all_means_the_mean_over_the_six_defenders() -> None:
    weights = np.array([[1.34, 0.16, -0.69, 4.35, -0.14, -0.47, -0.71]])
    together = switching_damages(weights, DEFENDERS, 1.3, [0], spread=0.0)[0, :, 0]
    for defender, damage in zip(DEFENDERS, together, strict=True):
        alone = switching_damages(weights, (defender,), 1.3, [0], spread=0.0)
        assert alone.ravel() == pytest.approx(damage, abs=1e-9)
    assert together[0] == pytest.approx(120.6, abs=0.06)  # the check value of the specification


def test_the_shipped_file_is_complete_and_says_how_it_was_found() -> None:
    rows = shipped()
    assert [(row["against"], row["power_ratio"]) for row in rows] == [
        (name, ratio) for name in (ALL, *DEFENDERS) for ratio in RATIOS
    ]
    for row in rows:
        general = next(each for each in rows if (each["against"], each["power_ratio"]) == (ALL, row["power_ratio"]))
        assert row["search"]["start"] == ([] if row["against"] == ALL else general["weights"])


@pytest.mark.parametrize("row", shipped(), ids=lambda row: f"{row['against']}-{row['power_ratio']}")
def test_the_shipped_weights_do_what_the_file_says(row: dict[str, Any]) -> None:
    against = DEFENDERS if row["against"] == ALL else (row["against"],)
    found = switching_damages(np.array([row["weights"]]), against, row["power_ratio"], [0], spread=0.0).mean()
    assert found == pytest.approx(row["damage"], rel=0.05)


def test_they_reach_what_another_search_found() -> None:
    """The bar: the best of three cross-entropy searches of an independent implementation, verified as ours is."""
    bars = {(row["defender"], float(row["power_ratio"])): float(row["verified"]) for row in SHIPPED}
    for row in shipped():
        if row["against"] != ALL:
            assert row["verified"] >= 0.95 * bars[row["against"], row["power_ratio"]], row["against"]


def spec_of(config: RogueConfig) -> RoleSpec:
    return ROGUE.game(config, 1).spec("attacker")


def answers(**changes: Any) -> Answers:
    generator = np.random.default_rng(0)
    found = Answers(
        against=("pd", "sliding"),
        ratios=np.array([1.0, 1.2]),
        probes=generator.normal(size=(2, 7)),
        weights=generator.normal(size=(2, 2, 7)),
        at=np.array([[0, 1], [0, 1]]),
        traces=np.zeros((2, 2, len(LOOKS_S), 5)),
    )
    return found._replace(**changes)


def signs(attacker: Probe | Switching, config: RogueConfig, defender: str = "pd") -> Array:
    """What it plays (steps, B)."""
    played = []
    players = {"attacker": attacker, "defender": defender}
    play_episodes(ROGUE, config, players, SEEDS, on_step=lambda game: played.append(game.state.effort[:, 1].copy()))
    return np.array(played)


def test_the_shipped_answers_are_complete_and_rise() -> None:
    known = shipped_answers()
    assert known.against == DEFENDERS
    assert (np.diff(known.ratios) > 0).all()
    assert {1.0, 1.1, 1.2, 1.3} <= set(known.ratios)
    assert known.weights.shape == (len(known.ratios), len(DEFENDERS), 7)
    assert known.traces.shape == (len(known.ratios), len(DEFENDERS), len(LOOKS_S), 5)
    assert (known.at[:, 0] == 0).all()


@pytest.mark.parametrize(("ratio", "defender"), [(1.0, "sliding_detection"), (1.1, "pd"), (1.3, "sliding_detection")])
def test_an_answer_does_what_the_file_says(ratio: float, defender: str) -> None:
    document = json.loads(files("cps_baselines.rogue").joinpath("probing.json").read_text(encoding="utf-8"))
    (row,) = (row for row in document["found"] if row["power_ratio"] == ratio)
    above = row.get("search", document["search"])["above"] if ratio == 1.1 else 0.0
    config = world_config((ratio, ratio + above) if above else ratio, refined=True)
    players = {"attacker": Probe(spec_of(config), defender), "defender": defender}
    damage = play_episodes(ROGUE, config, players, SEEDS)["damage"].mean()
    assert damage == pytest.approx(row["answers"][defender]["damage"], rel=0.1)


def test_it_probes_until_the_look_and_then_answers() -> None:
    config = ROGUE.config("paper", {"contact": "solid", "duration_s": 8.0})
    known = answers()
    always = answers(probes=known.weights[:, 0], weights=known.weights)
    first = signs(Probe(spec_of(config), "pd", always), config)
    np.testing.assert_array_equal(first, signs(Switching(spec_of(config), known.weights[0, 0]), config))
    late = signs(Probe(spec_of(config), "sliding", known), config)
    probe = signs(Switching(spec_of(config), known.probes[0]), config)
    decisions = round(LOOKS_S[1] / config.control_period_s)
    np.testing.assert_array_equal(late[: decisions + 1], probe[: decisions + 1])
    assert (late[decisions:] != probe[decisions:]).any()


def test_an_answer_holds_up_to_the_next_ratio() -> None:
    for ratio, row in ((1.0, 0), (1.19, 0), (1.2, 1), (1.3, 1)):
        config = ROGUE.config("paper", {"contact": "solid", "duration_s": 3.0, "power_ratio": ratio})
        known = answers(weights=answers().probes[:, np.newaxis].repeat(2, axis=1))
        played = signs(Probe(spec_of(config), "pd", known), config)
        np.testing.assert_array_equal(played, signs(Switching(spec_of(config), known.probes[row]), config))


def test_what_it_sees_decides_unless_it_is_told() -> None:
    config = world_config(1.3)
    for defender in ("pd", "sliding_detection"):
        told = signs(Probe(spec_of(config), defender), config, defender)
        np.testing.assert_array_equal(signs(Probe(spec_of(config)), config, defender), told)


def test_unknown_controllers_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="Did you mean 'sliding'"):
        Probe(spec_of(world_config(1.0)), "slidng")


@pytest.mark.parametrize("option", ["answers=[0.1]", "answers=99", "answers=-1", "answers=[[0]]", "knowledge=words"])
def test_identify_takes_rows_of_its_table_only(option: str) -> None:
    with pytest.raises(ConfigurationError, match="must be"):
        resolve_policy(f"identify?{option}", episodes.spec_of(ROGUE, "attacker", preset="learning"))


@pytest.mark.parametrize("option", ["row=0.5", "row=-2", "answers=1"])
def test_probe_takes_rows_of_its_table_only(option: str) -> None:
    with pytest.raises(ConfigurationError, match="must be"):
        resolve_policy(f"probe?{option}", episodes.spec_of(ROGUE, "attacker"))
