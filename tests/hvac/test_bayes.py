"""The defender that weighs sets of liars by Bayes' rule against its definition."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.family import Members, find_family
from cps_baselines.hvac.bayes import MOST_SQUARED, Bayes, choose
from cps_baselines.hvac.hypotheses import BIAS_KEPT, START, hypotheses, liar_sets
from cps_envs.core.errors import ConfigurationError
from cps_envs.hvac.config import LEARNING, PAPER
from cps_envs.hvac.kalman import memory
from cps_envs.hvac.model import build_model
from tests.hvac.games import play, spec_of, watched

FAMILY = find_family("hvac-bayes")
KINDS = 3  # slow, bold and still liars


class Remembering(Bayes):
    """Notes its state after each decision, and what it saw."""

    def __init__(self, spec: Any, **options: Any) -> None:
        super().__init__(spec, **options)
        self.notes = []

    def act(self, seen: Any, state: Any) -> Any:
        choice, state = super().act(seen, state)
        self.notes.append((seen["heating"][0].copy(), seen["reading"][0].copy(), *(part[0].copy() for part in state)))
        return choice, state


def remembered(attacker: Any, seed: Any, beliefs: Any = START, **overrides: Any) -> Any:
    policy = Remembering(spec_of("defender", **overrides), beliefs=(beliefs,))
    watched(attacker, policy, [seed], lambda game: None, **overrides)
    return policy.notes


def by_definition(notes: Any, beliefs: Any) -> Any:
    """The estimates (H, 16) and weights (H,) after the last note, in plain NumPy."""
    model, t, phi = build_model(LEARNING), hypotheses(LEARNING, beliefs), memory(LEARNING)
    z, w = np.zeros((len(t.prior), 16)), np.zeros(len(t.prior))
    z[:, :4], w[0] = LEARNING.initial_c, 1.0
    for k, (heating, reading, *_) in enumerate(notes):
        coming = w[0] * t.onset * t.prior
        share = np.divide(coming, w + coming, out=np.zeros_like(w), where=coming > 0)[:, np.newaxis]
        z, w = z + share * (z[0] - z), np.where(t.prior > 0, w + coming, w * (1 - t.onset))
        for first in range(1, len(w), KINDS):
            kinds = slice(first, first + KINDS)
            turned = t.change * np.outer(t.kinds, w[kinds]) + (1 - t.change) * np.diag(w[kinds])
            z[kinds], w[kinds] = turned @ z[kinds] / turned.sum(axis=1, keepdims=True), turned.sum(axis=1)
        if k > 0:
            x = z[:, :4] @ model.A.T + model.B * (heating + z[:, 4:8]) + model.G * model.weather[k - 1]
            z = np.hstack([x, phi * z[:, 4:8], BIAS_KEPT * z[:, 8:12] + z[:, 12:], t.growth_kept * z[:, 12:]])
        innovation = reading - z[:, :4] - z[:, 8:12] * t.lies
        squared = (np.einsum("hij,hj->hi", t.whiten, innovation) ** 2).sum(axis=1)
        w = w * np.exp(t.trust * (t.offset - 0.5 * np.minimum(squared, MOST_SQUARED)))
        z, w = z + np.einsum("hij,hj->hi", t.gain, innovation), w / w.sum()
    return z, w


@pytest.mark.parametrize("attacker", ["tracker", "constant"])
def test_weights_and_estimates_are_their_definition(attacker: Any) -> None:
    beliefs = START._replace(trust=0.8, onset_per_h=2.0)
    days = {"num_steps": 120, "window_steps": 40, "onset_step": 60, "compromised_weights": (0, 0, 1)}
    notes = [(h, y, z, w) for h, y, z, w, _ in remembered(attacker, 3, beliefs, **days)]
    z, w = by_definition([note[:2] for note in notes], beliefs)
    weights = np.exp(notes[-1][3])
    np.testing.assert_allclose(weights / weights.sum(), w, atol=1e-6)
    np.testing.assert_allclose(notes[-1][2][:, :4], z[:, :4], atol=1e-5)


def test_without_an_attack_the_first_hypothesis_is_the_filter_of_all_sensors() -> None:
    shown, short = [], {"onset_step": 250, "num_steps": 300}
    beliefs = START._replace(heat_w=LEARNING.filter_heat_w)
    policy = Remembering(spec_of("defender", **short), beliefs=(beliefs,))
    watched("none", policy, [5], lambda game: shown.append(game.state.filtered[0, 14].copy()), **short)
    for (_, _, z, *_), filtered in zip(policy.notes[1:], shown, strict=False):
        np.testing.assert_allclose(z[0, :8], filtered, atol=1e-3)


@pytest.mark.parametrize(
    ("attacker", "most"),
    [
        ("constant?reading_c=15", 0.1),
        ("ramp?rate_c_per_h=3&keep_noise=true", 1.0),  # who may lie smoothly may also lie by next to nothing
    ],
)
def test_it_finds_who_lies(attacker: Any, most: Any) -> None:
    lies = liar_sets(LEARNING)
    for liars in (1, 2, 3):
        days = {"compromised_weights": (), "num_compromised": liars, "random_compromise": False, "onset_step": 300}
        _, _, _, weights, _ = remembered(attacker, 2, **days)[520]
        probability = np.exp(weights) / np.exp(weights).sum()
        who = np.repeat(lies, [1] + [KINDS] * (len(lies) - 1), axis=0)
        assert (probability @ who)[[1, 0, 3][:liars]].min() > 0.9
        assert (probability @ who)[[1, 0, 3, 2][liars:]].max() <= most


@pytest.mark.parametrize("too_cold", [1.0, 5.0])
def test_the_choice_has_the_least_expected_error(too_cold: Any) -> None:
    generator = np.random.default_rng(0)
    offered, z = generator.normal(25, 1, (7, 31, 4)), generator.normal(25, 1, (7, 6, 16))
    weights, choice = -generator.random((7, 6)), np.zeros(7, np.int64)
    choose(offered, z, weights, np.full(7, too_cold), choice)
    error = offered[:, :, np.newaxis] - z[:, np.newaxis, :, :4]
    cost = (np.where(error < 0, too_cold, 1.0) * error**2).sum(axis=3)
    np.testing.assert_array_equal(choice, np.einsum("bah,bh->ba", cost, np.exp(weights)).argmin(axis=1))


def test_each_episode_is_played_by_its_own_beliefs() -> None:
    spec, days = spec_of("defender"), {"num_steps": 330, "onset_step": 220}
    values = FAMILY.values(np.random.default_rng(1).standard_normal((3, len(FAMILY.numbers))))
    together = play("tracker", Members(spec, FAMILY, values), [1, 2, 3], "learning", **days)["return"]
    for row in range(3):
        alone = play("tracker", FAMILY.build(spec, values[row : row + 1]), [row + 1], "learning", **days)["return"]
        np.testing.assert_allclose(together[row], alone[0], rtol=1e-12)


def test_wrong_beliefs_and_configurations_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="have to be positive"):
        Bayes(spec_of("defender"), beliefs=(START._replace(trust=0.0),))
    with pytest.raises(ConfigurationError, match="kalman_filters=true"):
        Bayes(spec_of("defender", preset="paper"))
    assert not PAPER.kalman_filters


def test_it_pays_less_than_largest_to_those_who_hide() -> None:
    days = {"compromised_weights": (0, 0, 1, 1)}
    weighed, largest = (
        play("tracker", policy, range(24), "learning", **days)["return"].mean()
        for policy in (Bayes(spec_of("defender")), "largest")
    )
    assert weighed < 0.8 * largest
