from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.places import JUDGED, LEARNED, Places, halves_of, place_episodes
from cps_envs.core.declare.seeds import TRAINING_START, VALIDATION, fresh_seeds, is_judged, score_seeds, training_seed
from cps_envs.core.declare.series import Series
from cps_envs.core.errors import ConfigurationError

DAY_S = 86_400.0
YEAR = Series(np.arange(28 * 24.0), 3600.0, source="year.csv")  # of four weeks


def placed(series: tuple[Series, ...] = (YEAR,), **changes: Any) -> Places:
    day = {"step_s": 600.0, "steps": 145, "every_s": DAY_S, "split": "seed", "block_s": 7 * DAY_S}
    return place_episodes(series, **{**day, **changes})


def days(places: Places, half: int) -> list[int]:
    return (places.first[half, : places.counts[half]] * 600.0 // DAY_S).astype(int).tolist()


def test_days_of_one_half_are_none_of_the_other() -> None:
    places = placed()
    assert days(places, LEARNED) == [*range(7), *range(14, 21)]
    assert days(places, JUDGED) == [*range(7, 14), *range(21, 27)]  # the last day has no last hour
    assert (places.begin_s, places.steps) == (0.0, 27 * 144 + 139)


def test_no_episode_reaches_out_of_its_block() -> None:
    places = placed(steps=145 + 36)  # with six hours ahead
    assert days(places, LEARNED) == [*range(6), *range(14, 20)]


def test_a_split_can_be_named() -> None:
    assert days(placed(split="test"), LEARNED) == days(placed(), JUDGED) == days(placed(split="test"), JUDGED)
    assert days(placed(split="train"), JUDGED) == days(placed(), LEARNED)
    assert days(placed(split="all"), JUDGED) == [*range(27)]


def test_the_time_that_all_series_share_counts() -> None:
    late = Series(np.zeros(21 * 24), 3600.0, 5.5 * DAY_S)
    repeating = Series([1.0, 2.0], 3600.0, repeats=True)
    places = placed((YEAR, late, repeating))
    assert places.begin_s == 6 * DAY_S
    assert days(places, LEARNED) == [*range(7), *range(14, 20)]


def test_without_a_series_that_ends_there_is_one_place() -> None:
    for series in ((), (Series([1.0, 2.0], 3600.0, repeats=True),)):
        places = placed(series)
        assert (places.first.tolist(), places.counts.tolist(), places.steps) == ([[0], [0]], [1, 1], 145)


def test_places_can_be_as_close_as_steps() -> None:
    cycle = Series(np.zeros(101), 1.0)
    places = place_episodes([cycle], step_s=0.5, steps=21, every_s=0.5, split="seed", block_s=20.0)
    assert places.first[LEARNED, : places.counts[LEARNED]].tolist()[:22] == [*range(21), 80]


@pytest.mark.parametrize(
    ("series", "changes", "said"),
    [
        (Series(np.zeros(24), 3600.0, source="short.csv"), {}, r"short.csv: there are 23 h from 0 s on.*needs 24 h"),
        (Series(np.zeros(40), 3600.0, 3600.0), {}, r"there are 16 h from 24 h on"),
        (Series(np.zeros(3 * 24), 3600.0), {}, r"2 places for learning, 0 for judgements.*series_split=\"all\""),
        (Series(np.zeros(3 * 24), 3600.0), {"split": "test"}, "0 places for learning, 0 for judgements"),
        (YEAR, {"block_s": 3600.0}, "in blocks of 1 h"),
    ],
)
def test_series_that_are_too_short_are_refused(series: Series, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        placed((series,), **changes)


def test_seeds_of_judgements_are_no_others() -> None:
    judged = [0, 999_999, *score_seeds("dev", 7, 4096)[:2], fresh_seeds(900, 3, 8)[0]]
    others = [VALIDATION[0], TRAINING_START, training_seed(8999) + 7, 2**31, 2**100, -1]
    assert [is_judged(seed) for seed in judged] == [True] * len(judged)
    assert [is_judged(seed) for seed in others] == [False] * len(others)


def test_an_episode_has_the_half_of_its_seed() -> None:
    seeds = [3, VALIDATION[5], TRAINING_START + 3, 7]
    everyone = np.ones(4, np.bool_)
    lazy = seeded(seeds)
    objects = [np.random.default_rng(seed) for seed in seeds]
    for generators in (lazy, objects, [lazy[b] for b in range(4)]):
        assert halves_of(generators, everyone).tolist() == [JUDGED, LEARNED, LEARNED, JUDGED]
    assert halves_of([np.random.default_rng([1, 2])], np.ones(1, np.bool_)).tolist() == [LEARNED]
