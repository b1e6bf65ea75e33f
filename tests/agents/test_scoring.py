"""Scores of tracks: what they weigh, their intervals and differences, who plays which episodes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces

pytest.importorskip("scipy", reason="needs the baselines")
pytest.importorskip("typer", reason="needs the command line")


from cps_agents import score
from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.errors import CommandError
from cps_agents.scoring import board, frozen
from cps_agents.scoring import tracks as declared
from cps_agents.scoring.kind import Kind
from cps_agents.scoring.score import Score
from cps_agents.scoring.tracks import Track
from cps_agents.workers import Workers
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.declare.seeds import score_seeds
from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.registration import find_problem
from tools.challenge import freezing

EPISODES = 24
PANEL = (Contestant("cusum", answer="tracker", weight=2.0), Contestant("chi2", answer="tracker"))
SMALL = Track("fdi", "attacker", EPISODES, PANEL)
DEFENSE = Track("fdi", "defender", EPISODES, (Contestant("tracker", answer="informed"),))
CONSTANTS = ("always?action=26", "always?action=20")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Two small tracks, frozen."""
    made = tmp_path_factory.mktemp("v1")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(declared, "tracks", lambda: {track.name: track for track in (SMALL, DEFENSE)})
        patch.setattr(frozen, "FOLDER", made)
        patch.setattr(board, "FOLDER", made / "board")
        patch.setattr(freezing, "declared", lambda _, role: CONSTANTS * (role == "attacker"))
        for track in (SMALL, DEFENSE):
            freezing.freeze(track, 64)
        yield made


@pytest.fixture(scope="module")
def tracker(folder: Path) -> Score:
    return score("fdi-attack", "tracker")


BEST = [np.linspace(5, 7, EPISODES), np.linspace(4, 8, EPISODES)]
MADE = frozen.Frozen(SMALL, 2.0, 6.0, "none", 64, {"test": BEST, "dev": [each[:3] for each in BEST]}, "0" * 12)


def made(seeds: int = 1, spread: float = 1.0, draw: int = 0, **changed: Any) -> Score:
    """A score by drawn pays, which take no playing."""
    generator, size = np.random.default_rng(draw), EPISODES // seeds
    names = map(str, range(seeds)) if seeds > 1 else [""]
    pays = {name: list(generator.normal([[3], [5]], spread, (2, size))) for name in names}
    return replace(Score(MADE, "test", "mine", Kind("from scratch"), pays), **changed)


def single(found: Score) -> list[Any]:
    """The scores of single episodes (training seeds, episodes) against either opponent: 4 a score of 100 apart."""
    pays = [np.array(paid) for paid in zip(*found.pays.values(), strict=True)]
    return [100 + 25 * (paid - best[: paid.size].reshape(paid.shape)) for paid, best in zip(pays, BEST, strict=True)]


@pytest.mark.parametrize("seeds", [1, 2, 4])
def test_a_score_weighs_what_the_best_answers_get_more(seeds: int) -> None:
    """Its interval is over episodes, or over training seeds where there are several."""
    found = made(seeds)
    cusum, chi2 = single(found)
    assert found.opponents == pytest.approx({"cusum": cusum.mean(), "chi2": chi2.mean()})
    assert found.estimate.mean == pytest.approx((2 * cusum.mean() + chi2.mean()) / 3)
    by_seed = (2 * cusum.mean(axis=1) + chi2.mean(axis=1)) / 3
    episodes = [((4 * cusum - 100) / 3).reshape(1, -1), ((2 * chi2 + 100) / 3).reshape(1, -1)]
    both = [estimate(episodes), *([estimate([by_seed[:, np.newaxis]])] if seeds > 1 else [])]
    alone = max(both, key=lambda each: each.high - each.low)  # type: ignore[operator]
    assert found.by_seed == pytest.approx(dict(zip(found.pays, by_seed, strict=True)))
    assert found.estimate.low == pytest.approx(alone.low, abs=2)  # of fewer resamples
    assert found.half_width == pytest.approx((alone.high - alone.low) / 2, rel=0.1)  # type: ignore[operator]
    assert (found.estimate.seeds, found.estimate.episodes) == (seeds, 2 * EPISODES if seeds == 1 else 1)
    assert found.episodes == EPISODES


def test_the_line_names_the_worst_opponent_and_how_few_seeds_there_are() -> None:
    for seeds, told in ((1, ", 1 training seed ("), (4, ", 4 training seeds ("), (5, " (")):
        found = made(seeds)
        assert found.opponents["cusum"] < found.opponents["chi2"]
        start = f"challenge-v1 fdi-attack test/24: {found.estimate.mean:.1f} ± {found.half_width:.1f}"
        assert found.line == f"{start}, worst {found.opponents['cusum']:.0f} (cusum){told}digest 000000000000, fdi-v0)"
        assert "training seed" not in replace(found, kind=Kind("hand-set")).line


def test_differences_are_taken_on_the_same_episodes_where_they_can_be() -> None:
    one, four, three = made(1), made(4, draw=1), made(3, draw=2)
    difference = one.minus(four)
    cusum, chi2 = (mine.reshape(4, 6) - theirs for mine, theirs in zip(single(one), single(four), strict=True))
    assert difference.mean == pytest.approx((2 * cusum.mean() + chi2.mean()) / 3)
    assert (difference.seeds, difference.episodes) == (4, 1)
    assert four.minus(replace(four, pays=dict(four.pays))).high == 0.0
    other, around = four.minus(three), float(np.hypot(four.half_width, three.half_width))
    middle = four.estimate.mean - three.estimate.mean
    assert other == Estimate(middle, middle - around, middle + around, 4, EPISODES)
    with pytest.raises(CommandError, match="scores of fdi-attack test and fdi-attack dev cannot be compared"):
        one.minus(replace(one, split="dev"))


def test_a_file_has_what_the_score_says_with_few_digits() -> None:
    found = made(2, cpu_s=1.26, policy="x", sources={"a": "1"}, versions={"numpy": "2"})
    document = found.to_json()
    assert document["score"] == round(found.estimate.mean, 2)
    assert document["half_width"] == round(found.half_width, 2)
    assert document["opponents"] == {name: round(value, 2) for name, value in found.opponents.items()}
    assert (document["line"], document["cpu_s"], document["began"]) == (found.line, 1.3, None)
    assert document["by_seed"] == {seed: round(value, 2) for seed, value in found.by_seed.items()}
    assert [float(word) for word in document["pays"]["1"][0].split()] == np.round(found.pays["1"][0], 3).tolist()


def test_each_training_seed_plays_its_part_and_progress_counts_them_all(monkeypatch: pytest.MonkeyPatch) -> None:
    played: list[Any] = []
    reported: list[int] = []

    def pays(track: Track, player: Any, seeds: Any, report: Any, pool: Workers) -> list[Any]:
        played.append((player, seeds))
        report(sum(map(len, seeds)), 1.5)
        return [np.arange(len(own)) + 0.12345 for own in seeds]

    module = sys.modules["cps_agents.scoring.score"]
    monkeypatch.setattr(module, "find_track", lambda name: SMALL)
    monkeypatch.setattr(module, "read_frozen", lambda track: replace(MADE, track=SMALL))
    monkeypatch.setattr(frozen.Frozen, "check_game", lambda self: None)
    monkeypatch.setattr(module, "pays", pays)
    found = score("fdi-attack", "zoo:fdi-attack", report=reported.append)
    assert list(found.pays) == ["0", "1", "2", "3", "4"]
    assert [player for player, _ in played] == [f"zoo:fdi-attack?seed={seed}" for seed in range(5)]
    everything = [score_seeds("test", place, EPISODES) for place in range(2)]
    for place, (_, seeds) in enumerate(played):
        assert [list(own) for own in seeds] == [list(own[4 * place : 4 * place + 4]) for own in everything]
    assert reported == [8, 16, 24, 32, 40]
    assert found.pays["3"][1].tolist() == [0.123, 1.123, 2.123, 3.123]
    assert (found.policy, found.kind, found.playable) == ("zoo:fdi-attack", Kind("from scratch"), True)
    assert list(found.sources) == ["fdi-attack"]
    assert found.cpu_s == 5 * 1.5
    with pytest.raises(CommandError, match="is an object plays in this process"):
        score("fdi-attack", object(), workers=2)  # type: ignore[arg-type]
    look = score("fdi-attack", "tracker", split="dev")
    assert (look.episodes, look.kind, len(look.pays[""][0])) == (3, Kind("hand-set"), 3)
    built = find_problem("fdi").policy("none", find_problem("fdi").game(SMALL.venue.config, 1), "attacker")
    handed = score("fdi-attack", built)
    assert (handed.playable, handed.sources) == (False, {})
    assert handed.policy == f"{type(built).__module__}:{type(built).__qualname__}"


def test_the_best_answer_has_100_and_the_best_constant_about_0(folder: Path, tracker: Score) -> None:
    assert tracker.estimate.mean == pytest.approx(100.0, abs=0.1)
    assert tracker.half_width < 0.1
    zero = score("fdi-attack", tracker.frozen.zero_policy)
    assert abs(zero.estimate.mean) <= 3 * zero.half_width
    assert tracker.opponents.keys() == {"cusum", "chi2"}
    weighted = (2 * zero.opponents["cusum"] + zero.opponents["chi2"]) / 3
    assert zero.estimate.mean == pytest.approx(weighted)


def test_the_line_says_what_was_played(tracker: Score) -> None:
    digest = tracker.frozen.digest
    assert tracker.line.startswith("challenge-v1 fdi-attack test/24: 100.0 ± 0.0, worst 100 (")
    assert tracker.line.endswith(f"(digest {digest}, fdi-v0)")
    network = replace(tracker, kind=Kind("from scratch"))
    assert ", 1 training seed (digest" in network.line


def test_a_quick_look_plays_other_seeds(folder: Path) -> None:
    look = score("fdi-attack", "tracker", split="dev")
    assert look.episodes == EPISODES // frozen.DEV
    assert "dev/3" in look.line


def test_an_object_scores_as_its_reference(folder: Path, tracker: Score) -> None:
    built = find_problem("fdi").policy("none", find_problem("fdi").game(SMALL.venue.config, 1), "attacker")
    handed = score("fdi-attack", built)
    assert handed.estimate.mean == score("fdi-attack", "none").estimate.mean
    assert handed.kind == Kind("code")
    assert not handed.playable


def test_training_seeds_divide_the_episodes_and_are_the_sample(folder: Path, tracker: Score) -> None:
    network, part = score("fdi-attack", "zoo:fdi-attack"), EPISODES // 5
    assert {len(rows[0]) for rows in network.pays.values()} == {part}
    alone = score(
        "fdi-attack", "zoo:fdi-attack?seed=1"
    )  # the second of five: it plays the second part in the first score
    np.testing.assert_array_equal(network.pays["1"][0], alone.pays[""][0][part : 2 * part])
    assert (network.estimate.seeds, network.estimate.episodes) == (5, 1)
    found = network.opponents
    assert network.estimate.mean == pytest.approx((2 * found["cusum"] + found["chi2"]) / 3)
    played = [values[0, : 5 * part].mean() for values in tracker.strata]
    assert network.minus(tracker).mean == pytest.approx(network.estimate.mean - np.mean(played))
    fewer = replace(network, pays={seed: network.pays[seed] for seed in ("0", "1")})
    assert fewer.minus(network).high > network.estimate.high - network.estimate.mean  # type: ignore[operator]


def test_mistakes_get_one_sentence(folder: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"no track 'fdi-atack'\. Did you mean 'fdi-attack'"):
        score("fdi-atack", "none")
    with pytest.raises(UnknownNameError, match="'cusum' is a defender of fdi"):
        score("fdi-attack", "cusum")
    with pytest.raises(TypeError, match="is not a policy"):
        score("fdi-attack", object())

    class Model:
        observation_space = spaces.Box(0.0, 1.0, (3,))

        def predict(self, *arguments: Any, **options: Any) -> Any:
            """Never asked."""

    with pytest.raises(ConfigurationError, match="has the observation_space"):
        score("fdi-attack", Model())


def test_another_game_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = frozen.read_frozen(SMALL)
    pays = {**known.pays, "test": [paid + 0.01 for paid in known.pays["test"]]}
    with pytest.raises(CommandError, match="plays another game"):
        replace(known, pays=pays).check_game()
    with pytest.raises(CommandError, match="panel, configuration or version"):
        frozen.read_frozen(replace(SMALL, panel=PANEL[:1]))
    monkeypatch.setattr(frozen, "FOLDER", folder / "empty")
    with pytest.raises(CommandError, match="not frozen yet"):
        frozen.read_frozen(SMALL)


def test_halves_of_the_episodes_agree_about_what_is_surely_different(folder: Path, tracker: Score) -> None:
    better = replace(tracker, pays={"": [paid + 1.0 for paid in tracker.pays[""]]})
    rows = [board.BoardEntry("better", better, 1), board.BoardEntry("a", tracker, 2), board.BoardEntry("b", tracker, 2)]
    alike = board.agreement(rows)
    assert alike == board.Agreement(3, 1.0, pytest.approx(2 / 3))  # of three pairs one is no order
    assert "tau-b 1.00" in str(alike)
    assert str(alike).endswith("or 0.67 where none share a rank.")
    assert board.agreement(rows[1:]) is None
    assert board.agreement(rows[:1]) is None


def test_an_interval_is_never_shorter_than_that_of_the_episodes() -> None:
    """Seeds whose means agree by chance say nothing about how sure each mean is."""
    noise = np.random.default_rng(0).normal(0.0, 2.0, (4, 2, EPISODES // 4))
    noise -= noise.mean(axis=2, keepdims=True)
    answers = [best.reshape(4, -1) for best in BEST]
    alike = made(
        4, pays={str(seed): [answers[place][seed] + noise[seed, place] for place in (0, 1)] for seed in range(4)}
    )
    episodes = estimate([values.reshape(1, -1) for values in alike.strata])
    assert alike.half_width == pytest.approx((episodes.high - episodes.low) / 2, rel=0.1)  # type: ignore[operator]
    assert alike.half_width > 5


def test_what_training_added_is_taken_in_pairs() -> None:
    began = made(1, draw=1)
    found = made(4, began=began)
    assert made(4).added is None
    assert found.added == found.minus(began)
    assert found.to_json()["added"][0] == round(found.minus(began).mean, 2)
