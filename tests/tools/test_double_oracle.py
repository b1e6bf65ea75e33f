"""The double oracle over fixed defenders and searched attackers, and its command."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.rogue.problem import ROGUE
from tests.agents.command_line import refusal, succeeded
from tools.command import program
from tools.double_oracle.__main__ import double_oracle
from tools.double_oracle.fixed_game import ASSIGNED, DEFENDERS, DETECTING, FixedGame
from tools.double_oracle.rounds import Row, fresh_value, play_rounds

CHOICES = 101


@dataclass
class Meeting:
    """Both sides name a place in [0, 1]; the attacker is paid the squared distance.

    The value is 1/4: the ends against the middle. The attacker's best response to a mixture is one of the ends.
    """

    searches: int = 0

    def first(self) -> list[FloatArray]:
        return [np.array([0.3])]

    def row(self, attack: FloatArray) -> FloatArray:
        paid: FloatArray = (attack[0] - np.linspace(0, 1, CHOICES)) ** 2
        return paid

    def fresh(self, attack: FloatArray, defenders: IntArray) -> FloatArray:
        noise = np.random.default_rng(int(1000 * attack[0])).normal(scale=0.01, size=(len(defenders), 20))
        return self.row(attack)[defenders][:, None] + noise

    def respond(self, defender: FloatArray, known: FloatArray, number: int) -> FloatArray:
        self.searches += 1
        return max((np.array([0.0]), np.array([1.0])), key=lambda end: float(self.row(end) @ defender))


def test_the_value_rises_to_that_of_the_whole_game_and_the_gap_closes() -> None:
    rounds = list(play_rounds(Meeting(), [], 4))
    values = [each.value for each in rounds]
    assert values == sorted(values)
    assert values[0] == pytest.approx(0.0, abs=1e-6)
    assert values[-1] == pytest.approx(0.25, abs=1e-6)
    assert rounds[-1].response == pytest.approx(0.25, abs=1e-6)
    assert all(each.response >= each.value - 1e-9 for each in rounds)
    assert all(each.least >= each.value - 1e-9 for each in rounds)
    assert rounds[-1].defender.argmax() == CHOICES // 2


def test_the_value_is_that_of_fresh_episodes() -> None:
    game, rows = Meeting(), list[Row]()
    found = fresh_value(game, rows, list(play_rounds(game, rows, 4))[-1])
    assert found.low is not None
    assert found.high is not None
    assert found.low <= 0.25 <= found.high
    assert found.mean == pytest.approx(0.25, abs=0.01)
    assert found.high - found.low < 0.05


def test_known_rows_are_not_searched_again() -> None:
    game, rows = Meeting(), list[Row]()
    whole = list(play_rounds(game, rows, 3))
    assert (game.searches, len(rows)) == (3, 4)
    again = Meeting()
    assert [each.value for each in play_rounds(again, rows[:3], 3)] == [each.value for each in whole]
    assert again.searches == 1


def test_every_assignment_of_laws_is_there_once() -> None:
    assert (len(ASSIGNED), len(set(DEFENDERS))) == (500, 504)
    assert not [laws for laws in ASSIGNED if laws[0] == "r" or len(laws) != 4]


@pytest.mark.parametrize("name", ["shll", "llll", "shsr", *DETECTING[:2]])
def test_a_row_holds_what_the_registered_policy_pays(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    few = ("llll", "shll", "shsr")
    monkeypatch.setattr("tools.double_oracle.fixed_game.DEFENDERS", (*few, *DETECTING))
    game = FixedGame(1.3, weight_mps2=0.5, worlds=2)
    attack = game.first()[0]
    paid = game.row(attack)[[*few, *DETECTING].index(name)]
    config = game._config()
    assert config.formation_weight_mps2 == 0.5
    players = {"attacker": "switching", "defender": name if name in DETECTING else f"assigned?laws={name}"}
    seeds = [30_000_000, 30_000_001]
    played = play_episodes(ROGUE, config, players, seeds)  # type: ignore[arg-type]
    assert paid == pytest.approx(float(played["return"].mean()), abs=1e-9)
    fresh = game.fresh(attack, np.array([0, len(few)]))
    assert fresh.shape == (2, game.fresh_worlds)
    charge = played["return"] - played["damage"]
    assert charge == pytest.approx(0.5 * played["formation_cost_s"], abs=1e-9)


def test_a_search_improves_on_what_is_known_and_is_repeatable() -> None:
    pytest.importorskip("cma")
    game, defender = FixedGame(1.0, worlds=1, population=6, generations=4), np.zeros(len(DEFENDERS))
    defender[DEFENDERS.index("llll")] = 1.0
    throttle = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    found = game.respond(defender, throttle, 0)
    assert found == pytest.approx(game.respond(defender, throttle, 0))
    paid = [game._judge(each[np.newaxis], defender, 1)[0] for each in (throttle, found)]
    assert paid[1] > 1.5 * paid[0]


def test_the_command_keeps_its_rows_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("cma")
    for module in ("fixed_game", "__main__"):
        monkeypatch.setattr(f"tools.double_oracle.{module}.DEFENDERS", ("llll", "shll"))

    def row(self: FixedGame, weights: FloatArray) -> FloatArray:
        return np.array([1.0, 2.0]) + weights[:2]

    def respond(self: FixedGame, defender: FloatArray, known: FloatArray, number: int) -> FloatArray:
        return known + number

    def fresh(self: FixedGame, weights: FloatArray, defenders: IntArray) -> FloatArray:
        paid: FloatArray = (np.array([1.0, 2.0]) + weights[:2])[defenders][:, None] + np.array([-0.1, 0.0, 0.1])
        return paid

    monkeypatch.setattr(FixedGame, "row", row)
    monkeypatch.setattr(FixedGame, "fresh", fresh)
    monkeypatch.setattr(FixedGame, "respond", respond)
    target = tmp_path / "game.json"
    arguments, tool = ["--ratio", "1.3", "--out", str(target)], program(double_oracle)
    first = succeeded(*arguments, "--rounds", "1", program=tool)
    assert "The defender plays" in first.stdout
    assert "Value in 8 fresh worlds" in first.stdout
    rows = json.loads(target.read_text())["games"][0]["rows"]
    second = succeeded(*arguments, "--rounds", "2", "--json", program=tool)
    (found,) = json.loads(second.stdout)
    assert len(found["rounds"]) == 2
    assert found["value"]["low"] <= found["value_of_means"] <= found["value"]["high"]
    assert json.loads(target.read_text())["games"][0]["rows"][: len(rows)] == rows
    whole = json.loads(target.read_text())
    whole["games"][0]["rows"][0]["paid"][1] = float("nan")
    for document, reason in (({}, "the entry games is missing"), (whole, "NaN is no number of JSON")):
        target.write_text(json.dumps(document))
        assert f"is no file of a double oracle ({reason}). Choose another --out" in refusal(*arguments, program=tool)
