"""Policies against opponents, and `cps-envs evaluate`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_agents.arena.statistics import Estimate
from cps_agents.arena.table import Table, scores
from cps_agents.arena.venue import Venue
from cps_agents.commands.evaluate import ranges
from cps_agents.evaluation import Standing, is_better, worst_of
from cps_agents.zoo.references import form_of, is_trained, origin_of
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.errors import UnknownNameError
from cps_envs.registration import find_problem
from tests.agents.command_line import invoke, succeeded
from tests.agents.trained import save_tiny
from tests.episodes import play

SHORT = {"duration_s": 4.0}
ALONE = ("--jobs", "1")
ROGUE = ("evaluate", "rogue", "attacker", "--preset", "paper", "--set", "duration_s=4", "--defender", "pd", *ALONE)


def seeds_of(reference: str) -> Any:
    return origin_of("rogue", reference).seeds


def weights_of(reference: str) -> Any:
    return origin_of("rogue", reference).sources


@pytest.fixture
def tiny(tmp_path: Path) -> str:
    save_tiny(tmp_path / "tiny.json", "rogue", "attacker", overrides=SHORT, seeds=3)
    return f"zoo:{tmp_path / 'tiny.json'}"


def test_a_trained_policy_stands_for_its_training_seeds(tiny: str) -> None:
    assert seeds_of(tiny) == {seed: f"{tiny}?seed={seed}" for seed in range(3)}
    drawn = f"{tiny}?deterministic=false"
    assert seeds_of(drawn)[1] == f"{drawn}&seed=1"
    assert seeds_of(f"{tiny}?seed=2") == {None: f"{tiny}?seed=2"}
    assert seeds_of("square?duty=0.5") == {None: "square?duty=0.5"}


def test_a_policy_that_is_not_there_is_an_error(tiny: str) -> None:
    found = origin_of("rogue", f'mixture?policies=["{tiny}","pd"]')
    assert (found.card, list(found.sources)) == (None, [tiny.removeprefix("zoo:")])
    for missing in ("zoo:nobody", f'mixture?policies=["{tiny}","zoo:nobody?seed=1","pd"]'):
        with pytest.raises(UnknownNameError, match="no trained policy 'nobody'"):
            origin_of("rogue", missing)


def test_weights_change_with_the_network_and_not_with_its_story(tmp_path: Path) -> None:
    path = tmp_path / "tiny.json"
    save_tiny(path, "rogue", "attacker", overrides=SHORT)
    before = weights_of(f"zoo:{path}?seed=1")
    save_tiny(
        path, "rogue", "attacker", overrides=SHORT, evaluation={"pd": {"mean": 3.0, "metric": "gap_m"}}, command="other"
    )
    assert weights_of(f"zoo:{path}") == before
    save_tiny(path, "rogue", "attacker", overrides=SHORT, frame_skip=2)
    assert weights_of(f"zoo:{path}") != before
    assert weights_of("square") == {}


def test_each_gets_the_form_it_was_trained_with(tmp_path: Path) -> None:
    path = tmp_path / "tiny.json"
    save_tiny(path, "fdi", "attacker", preset="easy")
    config = find_problem("fdi").config("paper", {"attacked": "x1", "target": 1})
    assert form_of(f"zoo:{path}", config) == {"tasks": "x1>1"}
    assert form_of("oracle", config) == {}
    venue = Venue("fdi", "paper", {"attacked": "x1", "target": 1})
    attackers = [Contestant(f"zoo:{path}"), Contestant("oracle")]
    table = Table(venue, attackers, [Contestant("none")], 2, judged="attacker")
    trained, oracle = (table.meetings(pair) for pair in table.pairs)
    assert len(trained) == 2
    assert trained[0].venue.overrides["tasks"] == "x1>1"
    assert "tasks" not in oracle[0].venue.overrides
    assert len(scores([meeting.run() for meeting in trained], "impact_speed_mps", "oracle_value_mps")) == 2
    assert scores([oracle[0].run()], "impact_speed_mps", "oracle_value_mps").mean() == pytest.approx(1.0)


def test_the_share_of_episodes_in_which_something_happened() -> None:
    found = scores([{"metrics": {"collided": [0.0, 2.0, 1.0, 0.0]}}], "collided>0")
    np.testing.assert_array_equal(found, [[0.0, 100.0, 100.0, 0.0]])
    with pytest.raises(UnknownNameError, match="collided"):
        scores([{"metrics": {"collided": [0.0]}}], "colided>0")


def test_a_judged_table_plays_every_training_seed_on_the_evaluation_seeds(tiny: str) -> None:
    venue = Venue("rogue", "paper", SHORT)
    table = Table(venue, [Contestant(tiny)], [Contestant("pd")], 3, judged="attacker")
    found = scores([meeting.run() for meeting in table.meetings((0, 0))], "damage")
    expected = play(find_problem("rogue"), f"{tiny}?seed=2", "pd", range(3), **SHORT)["damage"]
    np.testing.assert_array_equal(found[2], expected)
    with pytest.raises(UnknownNameError, match="Did you mean 'damage'"):
        scores([{"metrics": {"damage": [1.0]}}], "damge")
    with pytest.raises(ValueError, match="0 in some episode"):
        scores([{"metrics": {"damage": [1.0], "alarms": [0.0]}}], "damage", "alarms")


def test_an_advantage_is_one_only_if_the_interval_excludes_zero() -> None:
    more, unclear = Estimate(1.0, 0.5, 1.5, 5, 10), Estimate(1.0, -0.5, 2.5, 5, 10)
    assert is_better(more, "attacker") is True
    assert is_better(more, "defender") is False
    assert is_better(unclear, "attacker") is None


def test_evaluate_prints_json(tiny: str) -> None:
    arguments = ["--attacker", tiny, "--baseline", "square", "--baseline", "none", "--episodes", "2", "--json"]
    result = succeeded(*ROGUE, "--defender", "sliding", *arguments)
    found = json.loads(result.stdout)
    assert [(each["opponent"], each["policy"]) for each in found["standings"]] == [
        (opponent, policy) for opponent in ("pd", "sliding") for policy in (tiny, "square", "none")
    ]
    first, square, _ = found["standings"][:3]
    assert (first["seeds"], first["episodes"], np.shape(first["values"])) == (3, 2, (3, 2))
    assert first["low"] <= first["mean"] <= first["high"]
    assert first["differences"]["square"]["mean"] == pytest.approx(first["mean"] - square["mean"])
    assert square["differences"] == {}
    assert found["command"].startswith("cps-envs")


def test_evaluate_prints_tables(tiny: str) -> None:
    result = succeeded(*ROGUE, "--attacker", tiny, "--attacker", "square", "--baseline", "none")
    for text in ("attacker against pd: return", "95 % interval", "IQM", "3 x 50", "square", "minus none"):
        assert text in result.stdout


def test_the_worst_training_seed_stands_in_the_table(tiny: str) -> None:
    arguments = [*ROGUE, "--attacker", tiny, "--baseline", "square", "--episodes", "4"]
    first, square = json.loads(invoke(*arguments, "--json").stdout)["standings"][:2]
    assert first["worst_seed"] == pytest.approx(np.mean(first["values"], axis=1).min())
    assert (square["worst_seed"], square["hides_its_worst"]) == (None, False)
    assert {"worst", "seed"} <= set(invoke(*arguments).stdout.split())


def test_a_metric_counts_over_all_training_seeds_and_episodes(tiny: str) -> None:
    """Nobody says whether more of a metric is worse, so its table has ranges and no worst seed, and no colours."""
    arguments = [*ROGUE, "--attacker", tiny, "--baseline", "square", "--episodes", "4", "--metric", "collisions"]
    printed = set(invoke(*arguments).output.split())
    found = json.loads(invoke(*arguments, "--json").stdout)["standings"][0]
    values = np.array(found["values"])
    assert values.shape == (3, 4)
    assert found["mean"] == pytest.approx(values.mean())
    assert (found["worst_seed"], found["hides_its_worst"]) == (None, False)
    assert ranges(values)[1] == f"{values.min():.4g} to {values.max():.4g}"
    assert {"least", "most"} <= printed
    assert {"worst", "green"}.isdisjoint(printed)


def test_ranges_are_of_seeds_and_of_episodes() -> None:
    assert ranges(np.array([[1.0, 3.0], [-2.0, 8.0], [0.5, 0.5]])) == ("0.5 to 3", "-2 to 8")
    assert ranges(np.array([[1.0, 3.0]])) == ("", "1 to 3")


def test_a_worst_seed_outside_its_interval_is_marked() -> None:
    values = np.array([[1.0, 2.0], [3.0, 4.0], [-9.0, -8.0]])
    assert worst_of(values, "attacker") == -8.5
    assert worst_of(values, "defender") == 3.5  # what the attacker is paid is the defender's loss
    assert worst_of(values[:1], "attacker") is None
    found = [standing(worst) for worst in (None, 0.4, 0.5, 1.5, 1.6)]
    assert [each.hides_its_worst for each in found] == [False, True, False, False, True]


def standing(worst: float | None) -> Standing:
    spread = Estimate(1.0, 0.5, 1.5, 3, 10)
    return Standing("pd", "mine", False, spread, spread, {}, {}, np.ones((3, 10)), worst)


def test_all_stands_for_every_baseline_of_the_role() -> None:
    result = succeeded(*ROGUE, "--attacker", "square", "--baseline", "all", "--episodes", "1", "--json")
    first, *others = json.loads(result.stdout)["standings"]
    assert set(first["differences"]) == {each["policy"] for each in others} >= {"none", "duty_square", "random"}


def test_a_baseline_with_one_training_seed_is_marked(tiny: str) -> None:
    one = f"{tiny}?seed=1"
    arguments = [*ROGUE, "--attacker", "square", "--baseline", one, "--baseline", tiny, "--baseline", "none"]
    result = succeeded(*arguments, "--episodes", "2")
    assert f"* {one}: one training seed: its seed noise is not in the interval." in result.stdout
    assert result.output.count("one training seed") == 1
    result = invoke(*arguments, "--episodes", "2", "--json")
    differences = json.loads(result.stdout)["standings"][0]["differences"]
    assert differences[one]["caution"].startswith("one training seed")
    assert [differences[name]["caution"] for name in (tiny, "none")] == ["", ""]


def test_what_training_made() -> None:
    for trained in ("zoo:nobody?seed=1", "sb3:my.zip", 'mixture?policies=["none","zoo:nobody"]'):
        assert is_trained(trained)
    assert not is_trained("square?duty=0.3")
