"""Everybody against everybody: the matrix, who is left out, files, resumption."""

from __future__ import annotations

import csv
import json
import signal
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy")
pytest.importorskip("matplotlib")

from cps_agents.arena.admission import admit, contestants, short_name, usual, wanted
from cps_agents.arena.meeting import Meeting
from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError
from cps_agents.league.league import League, asked, play_league, standings, strategies
from cps_agents.league.meetings import Clash, has_played, left_out_for
from cps_envs import find_problem
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.errors import UnknownNameError
from cps_envs.core.types import Role
from tests import episodes
from tests.agents.command_line import succeeded
from tests.agents.trained import save_tiny

SHORT = {"duration_s": 3.0}
VENUE = Venue("rogue", "easy", SHORT)
PAIR: Mapping[Role, Sequence[str]] = {"attacker": ["square", "none"], "defender": ["pd", "sliding"]}


def play(
    folder: Path,
    references: Mapping[Role, Sequence[str]] = PAIR,
    venue: Venue = VENUE,
    episodes: int = 2,
    metric: str = "return",
) -> League:
    return play_league(asked(venue, references, episodes, metric), references, Store(folder), 1)


def reused(folder: Path, references: Mapping[Role, Sequence[str]] = PAIR) -> int:
    """How many meetings of a league were finished before."""
    store = Store(folder)
    play_league(asked(VENUE, references, 2, "return"), references, store, 1)
    return store.reused


def test_the_matrix_is_what_the_pairs_play(tmp_path: Path) -> None:
    found = play(tmp_path, episodes=3)
    assert found.payoffs.values.shape == (2, 2, 3)
    alone = episodes.play(find_problem("rogue"), "square", "sliding", range(3), "easy", **SHORT)["return"]
    np.testing.assert_array_equal(found.payoffs.values[0, 1], alone)
    assert found.cells[0][1].mean == pytest.approx(found.payoffs.means[0, 1])
    assert found.cells[0][1].low is not None


def test_a_metric_of_ones_own(tmp_path: Path) -> None:
    found = play(tmp_path, metric="reference_error_m")
    alone = episodes.play(find_problem("rogue"), "square", "pd", range(2), "easy", **SHORT)["reference_error_m"]
    np.testing.assert_array_equal(found.payoffs.values[0, 0], alone)
    with pytest.raises(UnknownNameError, match=r"no metric 'reference_eror_m'.*Did you mean"):
        play(tmp_path, metric="reference_eror_m")


def test_the_usual_policies_take_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_tiny(tmp_path / "rogue-tiny.json", "rogue", "attacker")
    save_tiny(tmp_path / "fdi-tiny.json", "fdi", "attacker")
    for module in ("files", "references"):
        monkeypatch.setattr(f"cps_agents.zoo.{module}.find", lambda name: tmp_path / f"{name}.json")
    monkeypatch.setattr("cps_agents.arena.admission.SHIPPED", tmp_path)
    monkeypatch.setattr("cps_agents.arena.admission.shipped_names", lambda: ["fdi-tiny", "rogue-tiny"])
    names = usual(VENUE, "attacker")
    assert {"square", "switching", "zoo:rogue-tiny"} <= set(names)
    assert not {"mixture", "zoo:fdi-tiny"} & set(names)
    assert wanted(VENUE, "attacker", ["all", "square?duty=0.3"]) == [*names, "square?duty=0.3"]
    assert wanted(VENUE, "attacker", []) == names


def test_who_cannot_play_is_left_out(tmp_path: Path) -> None:
    fits, other = tmp_path / "fits.json", tmp_path / "other.json"
    save_tiny(fits, "fdi", "defender", overrides={"correction_levels": 2})
    save_tiny(other, "rogue", "defender")
    venue = Venue("fdi", "paper", {})
    references: dict[Role, list[str]] = {
        "attacker": ["oracle"],
        "defender": [
            f"zoo:{fits}",
            f"zoo:{other}",
            "random?chance=1",
            "tests.agents.players:Constant?value=0.5",
            "none",
        ],
    }
    found = play(tmp_path / "cells", references, venue, 1)
    reasons = {reference: reason for (_, reference), reason in found.left_out.items()}
    assert set(reasons) == {f"zoo:{other}", "random?chance=1", "tests.agents.players:Constant?value=0.5"}
    assert "trained as defender of rogue" in reasons[f"zoo:{other}"]
    assert "has no option" in reasons["random?chance=1"]
    assert "impossible actions" in reasons["tests.agents.players:Constant?value=0.5"]
    assert found.table.defenders[0].overrides == {"correction_levels": 2}


def test_a_form_that_makes_no_configuration_is_refused(tmp_path: Path) -> None:
    odd, rival = Contestant("odd", "square", overrides={"duration_s": -1.0}), Contestant("pd", "pd")
    assert "duration_s" in admit(VENUE, "attacker", odd).refusal
    assert not has_played(Table(VENUE, [odd], [rival], 2), "attacker", 0, Store(tmp_path))


def test_oracles_have_to_be_asked_for(tmp_path: Path) -> None:
    venue = Venue("disbanding", "paper", {"duration_s": 5, "num_platoons": 2})
    without = play(tmp_path, {"attacker": ["all"], "defender": ["none"]}, venue, 1)
    assert [member for member, reason in without.left_out.items() if "oracle" in reason] == [("attacker", "ga")]
    assert "ga" not in [player.name for player in without.table.attackers]
    named = ["ga?population=4&generations=1", "none"]
    assert len(play(tmp_path, {"attacker": named, "defender": ["none"]}, venue, 1).table.attackers) == 2


def test_a_mistyped_name_is_an_error_and_so_is_nobody(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match=r"attacker 'sqare'.*Did you mean 'square'"):
        play(tmp_path, {**PAIR, "attacker": ["sqare"]})
    with pytest.raises(CommandError, match=r"no attacker can play this configuration\. square\?duty=7: a square wave"):
        play(tmp_path, {**PAIR, "attacker": ["square?duty=7"]})


def test_an_interrupted_league_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[Meeting] = []
    whole = Meeting.run

    def run(job: Meeting) -> dict[str, Any]:
        if len(done) == 3:
            signal.raise_signal(signal.SIGINT)
        done.append(job)
        return whole(job)

    monkeypatch.setattr(Meeting, "run", run)
    with pytest.raises(KeyboardInterrupt):
        play(tmp_path)
    assert len(list(tmp_path.glob("*.json"))) == 3
    monkeypatch.setattr(Meeting, "run", whole)
    assert reused(tmp_path) == 3
    resumed = play(tmp_path)
    fresh = play(tmp_path / "fresh")
    np.testing.assert_array_equal(resumed.payoffs.values, fresh.payoffs.values)
    assert reused(tmp_path) == 4


def test_another_network_is_played_again(tmp_path: Path) -> None:
    card = tmp_path / "tiny.json"
    save_tiny(card, "rogue", "attacker")
    references: dict[Role, list[str]] = {"attacker": [f"zoo:{card}", "none"], "defender": ["pd"]}
    play(tmp_path / "cells", references)
    assert reused(tmp_path / "cells", references) == 2
    save_tiny(card, "rogue", "attacker", best=1)
    assert reused(tmp_path / "cells", references) == 1


def test_standings_tell_best_opponents_and_what_is_dominated(tmp_path: Path) -> None:
    found = play(tmp_path)
    object.__setattr__(found.payoffs, "values", np.array([[3.0, 1.0], [0.0, 0.0]])[:, :, None])
    square, none = standings(found, "attacker")
    assert (square.probability, square.best_opponent, square.payoff.mean) == (1.0, "sliding", 1.0)
    assert none.dominated_by == {"square": 1.0}
    pd, sliding = standings(found, "defender")
    assert (pd.best_opponent, pd.payoff.mean, pd.probability) == ("square", 3.0, 0.0)
    assert sliding.dominated_by == {}
    assert strategies(found) == {"attacker": {"square": 1.0}, "defender": {"sliding": 1.0}}
    assert found.equilibrium.value == 1.0
    assert (found.value.mean, found.value.low) == (1.0, None)


def test_names_are_short_and_differ(tmp_path: Path) -> None:
    path = tmp_path / "very_long_name_of_a_folder" / "seed-3"
    assert short_name(f"zoo:{path}") == "zoo:very_long_name_of_a_folder/seed-3"
    assert short_name("mixture?policies=" + 20 * "abc").endswith("...")
    mixtures = [f'mixture?policies=["square","none"]&weights=[{k},1]' for k in range(1, 3)]
    first, second = contestants(VENUE, mixtures)
    assert second.name == f"{first.name} #2"


def test_the_command_writes_its_files(tmp_path: Path, meetings: Path) -> None:
    names = ["--attacker", "square", "--attacker", "none", "--defender", "pd", "--defender", "sliding"]
    short = ["--set", "duration_s=3", "--episodes", "3", "--jobs", "1", "--out", str(tmp_path / "out")]
    first = succeeded("league", "rogue", *names, *short)
    assert "Value of the game" in first.stdout
    assert {file.name for file in (tmp_path / "out").iterdir()} == {"rogue.json", "rogue.csv", "rogue.png", ".lock"}
    assert len(list(meetings.glob("*.json"))) == 4
    rows = list(csv.DictReader((tmp_path / "out" / "rogue.csv").read_text().splitlines()))
    assert [(row["attacker"], row["defender"]) for row in rows][:2] == [("square", "pd"), ("square", "sliding")]
    second = succeeded("league", "rogue", *names, *short, "--json")
    assert "Reused 4 of 4 meetings" in second.stderr
    found = json.loads(second.stdout)
    kept = json.loads((tmp_path / "out" / "rogue.json").read_text())
    for volatile in ("wall_s", "command"):
        assert found.pop(volatile) is not None
        kept.pop(volatile)
    assert kept == found
    assert found["equilibrium"]["low"] <= found["equilibrium"]["value"] <= found["equilibrium"]["high"]
    assert sum(found["equilibrium"]["attacker"]["probabilities"].values()) == pytest.approx(1.0)
    third = succeeded("league", "rogue", *names, *short, "--fresh")
    assert "Reused" not in third.stderr


def test_a_trained_policy_whose_form_the_preset_refuses_is_left_out(tmp_path: Path) -> None:
    tiny = f"zoo:{tmp_path / 'tiny.json'}"
    slow = {"control_period_s": 0.2, "attack_hold_s": 0.2}  # of these a defender brings the first along
    save_tiny(tmp_path / "tiny.json", "rogue", "defender", overrides=slow)
    references: dict[Role, list[str]] = {"attacker": ["none"], "defender": [tiny, "pd"]}
    found = play(tmp_path / "cells", references, VENUE, 1)
    assert list(found.left_out) == [("defender", tiny)]
    assert "attack_hold_s" in found.left_out["defender", tiny]


def test_who_cannot_meet_the_others_is_left_out(tmp_path: Path) -> None:
    tiny = tmp_path / "tiny.json"
    save_tiny(tiny, "hvac", "defender", preset="learning", overrides={"kalman_filters": False})
    named: dict[Role, list[str]] = {"attacker": ["tracker", "none"], "defender": ["none", f"zoo:{tiny}"]}
    venue = Venue("hvac", "learning", {"num_steps": 300, "onset_step": 210})
    found = play(tmp_path / "cells", named, venue, 1)
    ((left, reason),) = found.left_out.items()
    assert left == ("attacker", "tracker")
    assert reason.startswith(f"it cannot meet zoo:{tiny}: no Kalman filters")
    assert found.payoffs.values.shape == (1, 2, 1)


def test_who_clashes_most_is_left_out_first_and_named_ones_last() -> None:
    def pair(attacker: str, defender: str) -> Clash:
        return ("attacker", attacker), ("defender", defender)

    many = {pair("a", "x"): "1", pair("a", "y"): "2", pair("b", "y"): "3", pair("c", "y"): "4"}
    assert list(left_out_for(many, {})) == [("defender", "y"), ("attacker", "a")]
    one = {pair("a", "zoo:x"): "why"}
    assert left_out_for(one, {}) == {("attacker", "a"): "it cannot meet zoo:x: why"}
    assert list(left_out_for(one, {"attacker": ["a"]})) == [("defender", "zoo:x")]
