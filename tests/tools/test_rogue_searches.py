"""Tools that search attacks on `box_in` and its numbers, judge both, and measure the room for learning."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cma", reason="needs the baselines")

from cps_baselines.rogue.families import BOXING_IN
from cps_baselines.searched import searched
from cps_envs.core.documents import DamagedFileError
from cps_envs.core.types import FloatArray
from cps_envs.rogue.problem import ROGUE
from tests.agents.command_line import invoke, succeeded
from tools.command import program
from tools.recipes.rogue import EXPLOITERS
from tools.rogue import judging, rounds, span

SHIPPED = BOXING_IN.row(searched("rogue", "box_in"))
PEAK = np.array([2.0, -1.0, 0.5, 0.0, 0.0, -1.0, 0.0])  # the law that does most
GUARDED = BOXING_IN.names.index("ahead_slow_mps")  # the number that lowers what attacks do


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Episodes of twenty seconds."""

    def begun(ratio: Any, *, refined: bool = False) -> Any:
        return replace(long(ratio, refined=refined), duration_s=20.0)

    long = rounds.boxed_in
    monkeypatch.setattr(rounds, "boxed_in", begun)
    monkeypatch.setattr(judging, "boxed_in", begun)


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    """A game without vehicles: a law does the more the nearer it is to PEAK, and the less one number lets it."""

    def damages(numbers: FloatArray, laws: FloatArray, ratio: float, worlds: range, **options: Any) -> FloatArray:
        near = 50.0 - np.square(laws - PEAK).sum(axis=1)
        noise = np.random.default_rng(worlds.start).normal(scale=0.01, size=len(worlds))
        done: FloatArray = near[None, :, None] * numbers[:, GUARDED, None, None] / 20.0 + noise
        return done

    for tool in (rounds, judging):
        monkeypatch.setattr(tool, "damages", damages)
    monkeypatch.setattr(rounds, "usual", lambda numbers, first, episodes: np.ones((len(numbers), 2)))


@pytest.mark.usefixtures("short")
def test_numbers_and_laws_meet_in_the_same_worlds() -> None:
    numbers = np.concatenate([SHIPPED, BOXING_IN.row({})])
    laws, worlds = np.array(EXPLOITERS[:3]), range(7, 9)
    together = rounds.damages(numbers, laws, 1.3, worlds)
    assert together.shape == (2, 3, 2)
    assert together[1, 2, 1] == rounds.damages(numbers[[1]], laws[[2]], 1.3, range(8, 9))[0, 0, 0]
    assert (together[0] != together[1]).any()


@pytest.mark.usefixtures("short")
def test_what_the_usual_attackers_do_is_a_mean_for_each_row_of_numbers() -> None:
    twice = np.concatenate([SHIPPED, SHIPPED])
    means = rounds.usual(twice, 3, 2)
    assert means.shape == (2, 2)
    assert (means[0] == means[1]).all()
    assert (means[0] == rounds.usual(SHIPPED, 3, 2)[0]).all()


@pytest.mark.usefixtures("toy")
def test_a_search_finds_the_law_that_does_most() -> None:
    start = np.array(EXPLOITERS[:2])
    found = rounds.search_attacks(SHIPPED, 1.3, start, 0, 30)
    assert found.shape == (9, 7)  # the last three of three runs
    assert np.square(found - PEAK).sum(axis=1).min() < 0.1
    assert (found == rounds.search_attacks(SHIPPED, 1.3, start, 0, 30)).all()
    law, done = rounds.worst(SHIPPED, np.concatenate([start, found, PEAK[None]]), 1.3)
    assert law.tolist() == PEAK.tolist()
    assert done == pytest.approx(50.0 * SHIPPED[0, GUARDED] / 20.0, abs=0.02)


@pytest.mark.usefixtures("toy")
def test_numbers_are_searched_that_let_attacks_do_less(monkeypatch: pytest.MonkeyPatch) -> None:
    laws = dict.fromkeys(rounds.RATIOS, PEAK[np.newaxis])
    found = rounds.search_numbers(SHIPPED, laws, 0, 15)
    assert found.shape == SHIPPED.shape
    assert found[0, GUARDED] < 0.95 * SHIPPED[0, GUARDED]

    def dear(numbers: FloatArray, first: int, episodes: int) -> FloatArray:
        return np.repeat(SHIPPED[0, GUARDED] / numbers[:, [GUARDED]], 2, axis=1) * 10.0

    monkeypatch.setattr(rounds, "usual", dear)  # now whatever lowers the number lets the usual attackers do more
    assert rounds.search_numbers(SHIPPED, laws, 0, 15)[0, GUARDED] > 0.95 * SHIPPED[0, GUARDED]


@pytest.mark.usefixtures("toy")
def test_rounds_print_what_they_gained_and_keep_it(tmp_path: Path) -> None:
    path = tmp_path / "found.json"
    short = ("--rounds", "1", "--generations", "3", "--attacks", "3", "--out", str(path))
    result = succeeded(*short, program=program(rounds.rounds))
    assert "worst attack, ratio 1.15" in result.stdout
    kept = json.loads(path.read_text(encoding="utf-8"))
    assert list(kept["numbers"]) == list(BOXING_IN.names)
    assert kept["numbers"]["ahead_slow_mps"] != SHIPPED[0, GUARDED]
    assert len(kept["worst"]) == 2 * len(rounds.RATIOS)
    game = ROGUE.game(rounds.boxed_in(1.3), 1)
    assert all(ROGUE.policy(law, game, "attacker") for law in kept["worst"].values())
    assert judging.numbers_in(path)[0].tolist() == list(kept["numbers"].values())


def test_numbers_are_read_from_every_file_that_holds_them(tmp_path: Path) -> None:
    numbers = dict(zip(BOXING_IN.names, SHIPPED[0].tolist(), strict=True))
    path = tmp_path / "numbers.json"
    for document in ({"numbers": numbers}, {"box_in": {"numbers": numbers}, "guard": {}}):
        path.write_text(json.dumps(document), encoding="utf-8")
        assert (judging.numbers_in(path) == SHIPPED).all()
    path.write_text(json.dumps({"numbers": {**numbers, "ahead_slow_mps": "much"}}), encoding="utf-8")
    with pytest.raises(DamagedFileError, match="ahead_slow_mps"):
        judging.numbers_in(path)


@pytest.mark.usefixtures("toy", "short")
def test_judging_compares_in_pairs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert {"contested", "probe", "switching"} <= {each.name for each in judging.attackers()}
    some = tuple(each for each in judging.attackers() if each.name in ("none", "square"))
    monkeypatch.setattr(judging, "attackers", lambda: some)
    better = SHIPPED[0].copy()
    better[GUARDED] *= 0.5
    path = tmp_path / "numbers.json"
    path.write_text(json.dumps({"numbers": dict(zip(BOXING_IN.names, better.tolist(), strict=True))}))
    result = invoke(
        str(path), "--episodes", "2", "--worlds", "2", "--attacks", "3", columns=160, program=program(judging.judging)
    )
    assert result.exit_code == 0, result.output
    rows = {line.partition("  ")[0]: line.split() for line in result.stdout.splitlines()}
    assert {"none", "square", "formation cost of all attackers, s"} < rows.keys()
    for ratio in rounds.RATIOS:
        shipped, other = map(float, rows[f"worst law, ratio {ratio}"][4:6])
        assert shipped == pytest.approx(2 * other, abs=0.1)


def paid(policies: Any, config: Any, first: int, episodes: int) -> FloatArray:
    """A game without vehicles: told policies are paid 1, others 5; laws of policies that never look 9, alone 10."""
    alone = config.defense_action == "mode"
    one = [1.0 if each == "escort" else 9.0 + alone if each.startswith("always") else 5.0 for each in policies]
    noise = np.random.default_rng(first).normal(scale=0.1, size=(len(one), episodes))
    return np.array(one)[:, None] + noise


def test_the_span_is_of_policies_that_can_play() -> None:
    laws, either = (ROGUE.config("learning", {"defense_action": form}) for form in span.FORMS.values())
    assert {"none", "random"} < set(span.blind(laws)) < set(span.blind(either))
    assert "escort" in span.known(either)
    assert "escort" not in span.known(laws)
    assert "monitor" in span.known(laws)


def test_one_policy_is_chosen_for_all_attackers_or_one_for_each(monkeypatch: pytest.MonkeyPatch) -> None:
    def by_place(policies: Any, config: Any, first: int, episodes: int) -> FloatArray:
        table = {"even": [3.0] * 6, "first": [1.0, *[9.0] * 5], "others": [9.0, *[2.9] * 5]}
        return np.array([[table[each][place]] * episodes for place, each in enumerate(policies)])

    monkeypatch.setattr(span, "pays", by_place)
    everybody = ["even", "first", "others"]
    assert span.chosen(everybody, None, for_each=True) == ["first", *["others"] * 5]  # type: ignore[arg-type]
    assert span.chosen(everybody, None, for_each=False) == ["even"] * 6  # type: ignore[arg-type]


def test_the_span_of_both_forms_is_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(span, "pays", paid)
    monkeypatch.setattr(span, "blind", lambda config: ["always?action=1"])
    told = {"mode": ["monitor"], "either": ["monitor", "escort"]}
    monkeypatch.setattr(span, "known", lambda config: told[config.defense_action])
    result = succeeded("--episodes", "16", columns=120, program=program(span.span))
    laws, both = (line.split() for line in result.stdout.splitlines() if line.startswith("laws"))
    assert [*map(float, laws[1:3])] == pytest.approx([10.0, 5.0], abs=0.2)
    assert [*map(float, both[3:5])] == pytest.approx([9.0, 1.0], abs=0.2)
    assert "Accelerations change the span by 3." in result.stdout
