"""Statistics of evaluations against closed forms and scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from cps_agents.arena.statistics import Estimate, _factors, _stretch, difference, estimate, interquartile_mean, mean

NUMBERS = st.floats(-1e3, 1e3).map(lambda value: round(value, 3))
SHAPES = st.tuples(st.integers(1, 6), st.integers(1, 8))
MATRICES = SHAPES.flatmap(lambda shape: arrays(np.float64, shape, elements=NUMBERS))
FEW = {"resamples": 200}


@given(values=MATRICES)
def test_point_estimates_are_those_of_numpy_and_scipy(values: Any) -> None:
    assert estimate([values], **FEW).mean == pytest.approx(values.mean(), abs=1e-9)
    found = estimate([values], interquartile_mean, **FEW).mean
    assert found == pytest.approx(stats.trim_mean(values.ravel(), 0.25), abs=1e-9)


@given(values=MATRICES)
def test_the_mean_lies_in_its_interval(values: Any) -> None:
    found = estimate([values], **FEW)
    if values.size == 1:
        assert (found.low, found.high) == (None, None)
    else:
        assert found.low <= found.mean <= found.high


@given(values=MATRICES, shift=NUMBERS, scale=st.floats(0.1, 10))
@examples(max_examples=50)
def test_the_interval_moves_with_the_data(values: Any, shift: float, scale: float) -> None:
    before, after = estimate([values], **FEW), estimate([scale * values + shift], **FEW)
    if values.size > 1:
        tolerance = {"rel": 1e-6, "abs": 1e-6}
        assert after.low == pytest.approx(scale * before.low + shift, **tolerance)
        assert after.high == pytest.approx(scale * before.high + shift, **tolerance)


@given(values=MATRICES, order=st.randoms(use_true_random=False))
@examples(max_examples=50)
def test_the_order_of_seeds_and_episodes_does_not_matter(values: Any, order: Any) -> None:
    # Without ties: seeds with the same scores in other episodes have no order.
    values = values + np.ptp(values) * np.random.default_rng(0).uniform(-1.0, 1.0, values.shape)
    rows, columns = list(range(len(values))), list(range(values.shape[1]))
    order.shuffle(rows)
    order.shuffle(columns)
    options = {"resamples": 4000}
    before, after = estimate([values], **options), estimate([values[rows][:, columns]], **options)
    assert after.mean == pytest.approx(before.mean, abs=1e-9)
    if values.size > 1:
        assert (after.low, after.high) == pytest.approx((before.low, before.high), rel=1e-9, abs=1e-9)


@given(value=NUMBERS, shape=st.tuples(st.integers(1, 5), st.integers(1, 5)))
def test_constant_data_have_no_width(value: Any, shape: Any) -> None:
    found = estimate([np.full(shape, value)], **FEW)
    assert found.mean == value
    if np.prod(shape) > 1:
        assert (found.low, found.high) == (value, value)
        assert found.excludes_zero == (value != 0)
    else:
        assert not found.excludes_zero  # one number tells nothing about the next


@pytest.mark.parametrize(("seeds", "episodes"), [(5, 1), (1, 50)])  # both: tests/tools/test_coverage.py
def test_intervals_hold_the_mean_of_normal_data_as_often_as_they_say(seeds: int, episodes: Any) -> None:
    generator = np.random.default_rng(1)
    hits, trials = 0, 400
    for _ in range(trials):
        by_seed, by_episode = generator.normal(size=(seeds, 1)), 2 * generator.normal(size=(1, episodes))
        values = 3.0 + (by_seed if seeds > 1 else 0) + (by_episode if episodes > 1 else 0)
        found = estimate([values], resamples=400)
        hits += found.low <= 3.0 <= found.high
    assert 0.91 <= hits / trials <= 0.98


def test_independent_noise_only_makes_the_interval_longer() -> None:
    generator = np.random.default_rng(2)
    hits = 0
    for _ in range(200):
        found = estimate([generator.normal(size=(5, 20))], resamples=400)
        hits += found.low <= 0 <= found.high
    assert hits / 200 >= 0.95


def test_one_factor_alone_gives_student_s_interval() -> None:
    values = np.random.default_rng(3).normal(size=(40, 1))
    found = estimate([values], resamples=20_000)
    half = stats.t.ppf(0.975, 39) * values.std(ddof=1) / np.sqrt(40)
    assert found.high - found.low == pytest.approx(2 * half, rel=0.05)


def test_an_estimate_is_written_with_its_interval_where_there_is_one() -> None:
    assert f"{Estimate(1.0, 0.52, 1.5, 5, 9):.1f}" == "1.0 (0.5 to 1.5)"
    assert f"{Estimate(1.0, None, None, 1, 1):.1f}" == "1.0"


def test_strata_count_equally_and_share_the_training_seeds() -> None:
    first, second = np.array([[1.0], [2.0], [3.0]]), np.array([[3.0, 3.0], [2.0, 2.0], [1.0, 1.0]])
    found = estimate([first, second], **FEW)
    assert found.mean == 2.0
    assert (found.low, found.high) == (2.0, 2.0)  # a seed that is good at one is as bad at the other
    assert (found.seeds, found.episodes) == (3, 3)
    assert mean([np.zeros((1, 2, 9)), np.ones((1, 2, 1))]) == [0.5]


@given(values=MATRICES, gain=st.floats(0.5, 5))
def test_a_difference_is_paired(values: Any, gain: float) -> None:
    baseline = values[:1]
    learned = np.repeat(baseline, 3, axis=0) + gain
    found = difference([learned], [baseline], **FEW)
    assert found.mean == pytest.approx(gain, abs=1e-6)
    assert found.low == pytest.approx(gain, abs=1e-6)
    assert found.excludes_zero


def test_a_difference_takes_what_both_played() -> None:
    learned, few = np.arange(8.0)[np.newaxis], np.array([[0.0, 1.0, 5.0]])
    assert difference([learned], [few]).episodes == 3
    assert difference([learned], [few]).mean == pytest.approx(-1.0)
    assert difference([np.array([[4.0]])], [np.array([[1.0, 3.0]])]).mean == 2.0  # one episode stands for all
    assert difference([learned], [np.array([[2.0], [4.0]])]).mean == pytest.approx(3.5 - 3.0)
    assert difference([learned], [learned], factor=0.5).mean == pytest.approx(3.5 / 2)


@pytest.mark.parametrize("luck", [0.0, 10.0])
def test_the_seeds_of_both_sides_widen_a_difference(luck: float) -> None:
    """However much both sides owe to the same episodes."""
    generator = np.random.default_rng(6)
    learned, baseline = generator.normal(size=(5, 1)) + np.zeros((1, 60)), generator.normal(size=(5, 1))
    shared = luck * generator.normal(size=(1, 60))
    found = difference([learned + shared], [np.repeat(baseline, 60, axis=1) + shared], resamples=20_000)
    spread = np.sqrt((learned[:, 0].var(ddof=1) + baseline.var(ddof=1)) / 5)
    welch = stats.ttest_ind(learned[:, 0], baseline[:, 0], equal_var=False).confidence_interval()
    assert found.mean == pytest.approx(learned.mean() - baseline.mean())
    assert found.high - found.low == pytest.approx(welch.high - welch.low, rel=0.1)
    assert found.high - found.low > 3.5 * spread


@given(values=MATRICES, factor=st.floats(0.5, 2), order=st.randoms(use_true_random=False))
@examples(max_examples=25)
def test_a_difference_does_not_depend_on_the_order_of_seeds(values: Any, factor: float, order: Any) -> None:
    noise = np.random.default_rng(0).uniform(-1.0, 1.0, (3, *values.shape))
    learned, baseline = values + np.ptp(values) * noise[0], values + np.ptp(values) * noise[1]
    rows = list(range(len(values)))
    order.shuffle(rows)
    before = difference([learned], [baseline], factor, **FEW)
    after = difference([learned[rows[::-1]]], [baseline[rows]], factor, **FEW)
    assert (after.mean, after.low or 0, after.high or 0) == pytest.approx(
        (before.mean, before.low or 0, before.high or 0), rel=1e-6, abs=1e-6
    )


def test_episodes_differ_by_what_one_side_has_more_than_the_other() -> None:
    learned, baseline = np.array([[1.0, 5.0], [3.0, 7.0]]), np.array([[2.0, 4.0]])
    seeds, others, episodes = _factors([[learned], [baseline]])
    assert (seeds[0].tolist(), others[0].tolist(), episodes[0].tolist()) == ([3.0, 5.0], [3.0], [0.0, 2.0])
    assert [weight for _, weight in (seeds, others, episodes)] == [1.0, 1.0, 1.0]


def test_equal_policies_have_no_difference_at_all() -> None:
    same = np.repeat(np.random.default_rng(7).normal(size=(1, 9)), 4, axis=0)
    found = difference([same], [same])
    assert (found.mean, found.low, found.high) == (0.0, 0.0, 0.0)


def test_the_same_data_give_the_same_interval() -> None:
    values = np.random.default_rng(4).normal(size=(5, 7))
    assert estimate([values]) == estimate([values.copy()])
    assert estimate([values], seed=1) != estimate([values])


@pytest.mark.parametrize(
    ("strata", "message"),
    [
        ([], "needs an array"),
        ([np.zeros((0, 3))], "needs an array"),
        ([np.zeros(3)], "needs an array"),
        ([np.zeros((2, 3)), np.zeros((3, 3))], "same training seeds"),
        ([np.array([[np.nan]])], "finite"),
    ],
)
def test_wrong_data_are_refused(strata: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        estimate(strata)


def test_different_strata_cannot_be_paired() -> None:
    with pytest.raises(ValueError, match="1 and 2 strata"):
        difference([np.zeros((1, 2))], [np.zeros((1, 2))] * 2)


def test_each_resample_has_a_middle_half_of_its_own() -> None:
    scores = np.random.default_rng(0).normal(size=(6, 2, 8))
    expected = [stats.trim_mean(resample.ravel(), 0.25) for resample in scores]
    np.testing.assert_allclose(interquartile_mean([scores]), expected)
    np.testing.assert_allclose(interquartile_mean([scores[:, :1], scores[:, 1:]]), expected)


def test_the_stretch_weighs_seeds_and_the_episodes_of_each_stratum() -> None:
    strata = [np.random.default_rng(k).normal(size=(5, 8)) for k in range(2)]
    factors = [(np.mean(strata, axis=0).mean(axis=1), 1.0), *((values.mean(axis=0), 0.25) for values in strata)]
    parts = np.array([squared * values.var(ddof=1) / len(values) for values, squared in factors])
    counts = np.array([len(values) for values, _ in factors])
    degrees = parts.sum() ** 2 / (parts**2 / (counts - 1)).sum()
    length = np.sqrt(parts.sum() / (parts * (counts - 1) / counts).sum())
    assert _stretch([strata], 0.95) == pytest.approx(length * stats.t.ppf(0.975, degrees) / stats.norm.ppf(0.975))


@pytest.mark.parametrize(("learned", "baseline"), [((1, 2), (1, 2)), ((2, 1), (1, 1)), ((1, 1), (2, 1))])
def test_two_of_anything_make_an_interval(learned: Any, baseline: Any) -> None:
    scores = np.random.default_rng(0)
    found = difference([scores.normal(size=learned)], [scores.normal(size=baseline)], **FEW)
    assert found.low < found.mean < found.high


def test_the_episodes_that_both_played_count_also_if_they_are_two() -> None:
    scores = np.arange(5.0)[np.newaxis]
    found = difference([scores[:, :2]], [scores**2], **FEW)
    assert (found.mean, found.episodes) == (0.0, 2)


def test_both_ends_lie_where_those_of_a_normal_mean_do() -> None:
    scores = np.random.default_rng(0).normal(size=(1, 400))
    found = estimate([scores], resamples=20_000)
    half = stats.t.ppf(0.975, 399) * scores.std(ddof=1) / 20.0
    assert found.mean - found.low == pytest.approx(half, rel=0.03)
    assert found.high - found.mean == pytest.approx(half, rel=0.03)
