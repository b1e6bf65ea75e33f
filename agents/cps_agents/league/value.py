"""The value of a zero-sum game whose payoffs are means of few episodes, and what mixed strategies guarantee.

The value of a matrix of noisy means is biased: each side picks the policies that were lucky, and the side with more
policies is luckier. So strategies are chosen on one half of the episodes and valued on the other, and the halves swap
roles (cross-fitting).

What is chosen without an episode says something true about it. Whatever mixture x the attacker plays, the value of
the game is at least the least mean that x is paid by any defender; whatever y the defender plays, at most the greatest
mean that y concedes to any attacker. The interval goes from a lower confidence limit of the first to an upper one of
the second. Taking the least of the limits needs no correction for the number of policies: the limit of the one defender
that truly pays least is among them.
"""

from __future__ import annotations

import numpy as np

from cps_agents.arena.statistics import LEVEL, Estimate
from cps_agents.league.equilibrium import maximin, solve
from cps_envs.core.errors import require
from cps_envs.core.types import FloatArray

HALVES = 2


def game_value(payoffs: FloatArray, *, level: float = LEVEL) -> Estimate:
    """The value of the game of the true means, for episodes (m, n, E) that share their seeds.

    `mean` is what the attacker is paid when both play mixtures that were chosen without the episode. `low` and `high`
    hold the value of the game in at least `level` of cases. A single episode has no interval.

    Raises:
        ValueError: no entries, or some that are not finite.
        MissingExtraError: scipy is not installed.
    """
    rows, columns, count = payoffs.shape
    if count < HALVES or (payoffs == payoffs[:, :, :1]).all():
        value = solve(payoffs[:, :, 0]).value
        known = None if count < HALVES else value
        return Estimate(value, known, known, 1, count)
    paid, conceded, met = np.zeros((columns, count)), np.zeros((rows, count)), np.zeros(count)
    for half in range(HALVES):
        here = np.arange(count) % HALVES == half
        chosen_on = payoffs[:, :, ~here].mean(axis=2)
        attacker, defender = maximin(chosen_on), maximin(-chosen_on.T)
        paid[:, here] = np.einsum("m,mne->ne", attacker, payoffs[:, :, here])
        conceded[:, here] = np.einsum("mne,n->me", payoffs[:, :, here], defender)
        met[here] = attacker @ conceded[:, here]
    return guaranteed(paid, conceded, met, level=level)


def guaranteed(paid: FloatArray, conceded: FloatArray, met: FloatArray, *, level: float = LEVEL) -> Estimate:
    """The value of a game from mixtures that were chosen without these E episodes.

    `paid` (n, E) is what each defender pays the attacker's mixture, `conceded` (m, E) what the defender's mixture
    concedes to each attacker, `met` (E,) what the attacker is paid when both play theirs.
    """
    mean, count = float(met.mean()), len(met)
    if count < HALVES:
        return Estimate(mean, None, None, 1, count)
    least = float(_limits(paid, -1.0, level).min())
    most = float(_limits(conceded, 1.0, level).max())
    return Estimate(mean, min(least, mean), max(most, mean), 1, count)


def _limits(values: FloatArray, sign: float, level: float) -> FloatArray:
    """One-sided confidence limits of the means of rows (k, E), by Student's t."""
    stats = require("scipy.stats", extra="baselines", purpose="an interval")
    count = values.shape[1]
    reach = stats.t.ppf((1 + level) / 2, count - 1) * values.std(axis=1, ddof=1) / np.sqrt(count)
    found: FloatArray = values.mean(axis=1) + sign * reach
    return found
