"""The defenders of preset `learning` against their definitions, those who are told, and what there is to win."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_baselines.hvac.hypotheses import FilterChoices, spread_after
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.policy import AnalyticPolicy
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array
from cps_envs.hvac.config import LEARNING, PAPER
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.panels import RIVALS
from cps_envs.hvac.sensors import filter_sets
from tests.episodes import observed
from tests.hvac.games import go, play, spec_of, started, watched
from tests.turns import in_turn
from tools.challenge.constants.hvac import CONSTANTS

SETS = filter_sets(LEARNING)
MODEL, FIRST = 15, 16  # choices: the model, and the first filter
DAYS = range(5_000_000, 5_000_060)  # unlike those that anything was tuned on
NOISY = ("tracker", "ramp?rate_c_per_h=0.7&keep_noise=true", "mimic?keep_noise=true")
STRONG = (*NOISY, *(f"{name}{'&' if '?' in name else '?'}warmer=true" for name in NOISY), "brink", "constant")


@given(values=st.lists(st.floats(-20, 20), min_size=1, max_size=60))
def test_the_mean_square_stays_between_what_it_averages(values: Any) -> None:
    spread = np.ones(1)
    for value in values:
        before, spread = spread, spread_after(spread, np.array([value]))
        square = min(value**2, 9.0)
        assert min(before[0], square) - 1e-12 <= spread[0] <= max(before[0], square) + 1e-12


@pytest.mark.parametrize("attacker", in_turn(["brink", "brink?warmer=true", "tracker?noise=0"], 3))
def test_readings_without_noise_are_too_smooth(attacker: str) -> None:
    def paid(policy: str) -> float:
        return play(attacker, policy, range(30), "learning", compromised_weights=(0, 0, 1))["return"].mean()

    told = paid("informed")
    for name in ("cusum", "largest"):
        assert paid(name) < min(0.7 * paid(f"{name}?smooth=0"), told + 3.0), name


def cusum_of(
    readings_by_filter: Sequence[tuple[Array, Array]],
    kappa: float,
    limit: float,
    quiet: float,
    release: int,
    smooth: float,
) -> list[tuple[int, ...]]:
    """The definition in plain Python: the trusted sensors after each step, of r and its mean (F, S) at each."""
    trusted, up, down, calm, found = {0, 1, 2, 3}, [0.0] * 4, [0.0] * 4, [0] * 4, []
    square = [1.0] * 4
    for r, mean in readings_by_filter:
        own = SETS.index(tuple(sorted(s + 1 for s in trusted)))
        for s in range(4):
            up[s] = max(0.0, up[s] + r[own][s] - kappa)
            down[s] = max(0.0, down[s] - r[own][s] - kappa)
            square[s] += (min(r[own][s] ** 2, 9.0) - square[s]) / 30
            calm[s] = 0 if s in trusted or abs(mean[own][s]) > quiet or square[s] < smooth else calm[s] + 1
        worst = max(sorted(trusted), key=lambda s: max(up[s], down[s]), default=None)
        alarm = worst is not None and max(up[worst], down[worst]) > limit
        trusted |= {s for s in range(4) if calm[s] >= release}
        trusted -= {s for s in range(4) if square[s] < smooth}
        if alarm:
            trusted.discard(worst)
            up, down = [0.0] * 4, [0.0] * 4
        for s in range(4):
            if s not in trusted:
                up[s] = down[s] = 0.0
        found.append(tuple(sorted(s + 1 for s in trusted)))
    return found


@pytest.mark.parametrize("attacker", ["constant?reading_c=28", "ramp", "ramp?keep_noise=true", "none"])
def test_cusum_is_its_definition(attacker: str) -> None:
    def see(game: HvacGame) -> tuple[tuple[Array, Array], int]:
        fields = game.fields["defender"].decode(game.observe("defender"))
        return (fields["innovation"][0], fields["innovation_mean"][0]), int(game.state.choice[0])

    policy = "cusum?kappa=0.3&limit=6&quiet=0.5&release_h=1&smooth=0.4"
    days = {"compromised_weights": (0, 0, 1), "num_steps": 420, "onset_step": 230}
    shown, chosen = zip(*watched(see, attacker, policy, [11], **days), strict=True)
    expected = cusum_of(shown[:-1], 0.3, 6.0, 0.5, 30, 0.4)
    assert len(set(expected)) > 1
    ready = slice(201, None)
    assert [SETS[choice - FIRST] for choice in chosen[1:][ready]] == expected[ready]


def choosing(policy: AnalyticPolicy, innovations: Sequence[Array]) -> list[tuple[int, ...]]:
    """The sets that a policy chooses one after the other when it is shown these innovations (16, 4)."""
    state, found = policy.begin([None], [{}]), []
    for innovation in innovations:
        shown = observed(policy.spec, ready=[1], innovation=innovation)
        choices, state = policy.act(Seen(policy.spec.fields, shown), state)
        found.append(SETS[choices[0] - FIRST])
    return found


def test_largest_takes_the_most_sensors_without_an_alarm() -> None:
    policy = resolve_policy("largest?kappa=0.5&limit=3&release_h=1&smooth=0", spec_of("defender"))
    nothing, lie = np.zeros((16, 4)), np.zeros((16, 4))
    lie[[2 in sensors for sensors in SETS], 1] = -4.0  # sensor 2 is off wherever it is used
    assert choosing(policy, [nothing]) == [(1, 2, 3, 4)]
    assert choosing(policy, [lie, *[nothing] * 30]) == [(1, 3, 4)] * 30 + [(1, 2, 3, 4)]


def test_a_lie_outside_a_filter_does_not_raise_its_alarm() -> None:
    innovation = np.zeros((16, 4))
    innovation[SETS.index((1, 3, 4)), 1] = 9.0
    policy = resolve_policy("largest?smooth=0", spec_of("defender"))
    assert choosing(policy, [innovation] * 10)[-1] == (1, 2, 3, 4)


def test_the_informed_one_believes_all_but_the_liars() -> None:
    games, chosen = zip(
        *watched(lambda game: (game, game.state.choice.copy()), "ramp", "informed", range(8))[1:], strict=True
    )
    game: HvacGame = games[0]
    for b in range(8):
        intact = tuple(s + 1 for s in range(4) if not game.state.compromised[b, s])
        assert {int(choices[b]) for choices in chosen[200:]} == {FIRST + SETS.index(intact)}
        assert {int(choices[b]) for choices in chosen[:200]} == {MODEL}
    assert game.metrics()["flawed_steps"].max() == 0


def test_the_truth_is_the_nearest_estimate() -> None:
    def see(game: HvacGame) -> tuple[Array, ...]:
        state = game.state
        return state.choice.copy(), state.estimate.copy(), state.temperature.copy(), state.step[0] >= 200

    found = watched(see, "brink", "truth", range(3), num_steps=260, onset_step=210)
    for (_, estimate, true, ready), (choice, *_) in pairwise(found):
        nearest = ((estimate - true[:, np.newaxis]) ** 2).sum(axis=2).argmin(axis=1)
        np.testing.assert_array_equal(choice, nearest if ready else MODEL)


@pytest.mark.parametrize("name", ["informed", "truth"])
def test_who_is_told_says_so(name: str) -> None:
    policy = resolve_policy(name, spec_of("defender"))
    assert policy.privileged == {"truth"}
    with pytest.raises(TypeError, match="truth"):
        policy.predict(np.zeros((1, policy.spec.fields.size), np.float32))


def test_filters_are_named_by_the_sensors_that_are_wanted() -> None:
    filters = FilterChoices(LEARNING)
    wanted = np.array([[1, 1, 1, 1], [0, 0, 0, 0], [1, 0, 1, 1], [0, 1, 0, 0]], bool)
    assert [SETS[index] for index in filters.index_of(wanted)] == [(1, 2, 3, 4), (), (1, 3, 4), (2,)]
    with pytest.raises(ConfigurationError, match="kalman_filters=true"):
        FilterChoices(PAPER)


@pytest.mark.parametrize("name", ["cusum", "largest"])
def test_honest_days_cost_little_though_heat_comes_in_steps(name: str) -> None:
    """Steps of heat look like lies, so some sensor is distrusted for part of the day; but zones are linked."""
    apart = []

    def note(game: HvacGame) -> None:
        if game.state.step[0] > 200:
            apart.append((game.state.choice != FIRST + 14).mean())

    days, honest = range(700, 760), {"compromised_weights": (1,)}
    paid = play("none", name, days, "learning", on_step=note, **honest)["return"]
    everything = play("none", f"always?action={FIRST + 14}", days, "learning", **honest)["return"]
    assert 0.02 < np.mean(apart) < 0.6
    assert (paid - everything).mean() < 2.0


def test_truth_of_a_game_changes_with_it() -> None:
    game = started([0, 1], preset="learning")
    told = game.truth(1)
    before = told["temperature"].copy()
    go(game, 0, num_steps=20)
    assert (told["temperature"] != before).all()
    np.testing.assert_array_equal(told["compromised"], game.state.compromised[1])


def test_constants_of_the_defender_are_all_there_are() -> None:
    count = spec_of("defender").action_space.n
    assert CONSTANTS["defender"] == tuple(f"always?action={choice}" for choice in range(count))


@lru_cache
def paid(attacker: str, defender: str, **overrides: Any) -> Array:
    return play(attacker, defender, DAYS, "learning", **overrides)["return"]


def mean_over(defender: str) -> float:
    return np.mean([paid(attacker, defender).mean() for attacker in ("none", *STRONG)])


@pytest.mark.slow
def test_something_is_left_to_infer_and_something_can_be_done() -> None:
    scores = {name: mean_over(name) for name in ("none", "mtd2", "model_only", "cusum", "largest", "informed", "truth")}
    best = min(scores[name] for name in ("none", "mtd2", "model_only", "cusum", "largest"))
    assert max(scores["informed"], scores["truth"]) + 2.0 < best
    assert best + 20.0 < scores["none"]


@pytest.mark.slow
def test_no_choice_that_never_changes_is_as_good_as_the_best_detector() -> None:
    bar = mean_over("largest")
    assert bar < min(mean_over(constant) for constant in CONSTANTS["defender"])


@pytest.mark.slow
def test_lies_of_both_signs_matter() -> None:
    for defender in ("mtd2", "cusum", "largest"):
        for attacker in STRONG[:6]:
            excess = paid(attacker, defender) - paid("none", defender)
            assert excess.mean() > 1.0, (attacker, defender)


@pytest.mark.slow
def test_believing_nobody_is_no_way_out() -> None:
    for attacker in ("none", *STRONG):
        excess = paid(attacker, "model_only") - paid(attacker, "largest")
        assert excess.mean() - 2.0 * excess.std() / np.sqrt(len(excess)) > 0.0, attacker


@pytest.mark.slow
def test_more_liars_cost_more() -> None:
    """Excess over who is told who lies, on the same days."""
    found = []
    for liars in (1, 3):
        days = {"compromised_weights": (), "num_compromised": liars}
        found.append((paid("tracker", "largest", **days) - paid("tracker", "informed", **days)).mean())
    assert found[1] > 2.0 * found[0]


@pytest.mark.slow
def test_being_told_whom_one_faces_pays_more_than_bold_lies() -> None:
    """Bold lies earn most on the mean of what needs no telling, and the best answer to each defender earns more."""
    defenders = [contestant.reference for contestant in RIVALS["defender"]]
    bold, creeping, tracking = (
        np.array([paid(attacker, defender) for defender in defenders])
        for attacker in ("constant?reading_c=10", "brink", "tracker")
    )
    told = np.array([max((bold, creeping, tracking), key=lambda pay: pay[place].mean())[place] for place in range(7)])
    lead = (told - bold).mean(axis=0)
    assert lead.mean() - 2.0 * lead.std() / np.sqrt(len(lead)) > 0.0
