"""Zero-sum matrix games: the attacker picks a row and is paid the entry by the defender, who picks a column.

Where payoffs are means of few episodes, the value of the matrix is biased: each side picks the policies that were
lucky, and the side with more policies is luckier. So strategies are chosen on one half of the episodes and valued on
the other, and the halves swap roles (cross-fitting).

What is chosen without an episode says something true about it. Whatever mixture x the attacker plays, the value of
the game is at least the least mean that x is paid by any defender; whatever y the defender plays, at most the greatest
mean that y concedes to any attacker. The interval goes from a lower confidence limit of the first to an upper one of
the second. Taking the least of the limits needs no correction for the number of policies: the limit of the one defender
that truly pays least is among them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_agents.arena.statistics import LEVEL, Estimate
from cps_envs.core.errors import require
from cps_envs.core.types import FloatArray

TOLERANCE = 1e-7  # of the spread of the entries


@dataclass(frozen=True)
class Equilibrium:
    """Mixed strategies that are best replies to each other, one pair of perhaps many; all have the same value."""

    attacker: FloatArray  # (m,) probabilities of the rows
    defender: FloatArray  # (n,) probabilities of the columns
    value: float
    gap: float  # what both could still gain by best replies, together: the proof; 0 up to rounding


def solve(payoff: FloatArray) -> Equilibrium:
    """The equilibrium of a matrix (m, n), by a linear program for each side.

    The value is what the attacker's program finds; weak duality bounds it from above by what the defender's strategy
    concedes to the best row, so a small `gap` proves both.

    Raises:
        ValueError: no entries, or some that are not finite.
        ArithmeticError: the two programs do not agree.
        MissingExtraError: scipy is not installed.
    """
    payoff = _checked(payoff)
    attacker, defender = maximin(payoff), maximin(-payoff.T)
    floor, ceiling = float((attacker @ payoff).min()), float((payoff @ defender).max())
    if ceiling - floor > TOLERANCE * _spread(payoff):
        raise ArithmeticError(f"the sides' linear programs disagree on the value: {floor:.9g} and {ceiling:.9g}")
    return Equilibrium(attacker, defender, (floor + ceiling) / 2, ceiling - floor)


def maximin(payoff: FloatArray) -> FloatArray:
    """The probabilities (m,) of the rows whose least mean over the columns is greatest."""
    rows, columns = payoff.shape
    scaled = (payoff - payoff.min()) / _spread(payoff)
    at_least = np.hstack([-scaled.T, np.ones((columns, 1))])  # value - sum_i x_i payoff_ij <= 0
    found = _program(
        np.append(np.zeros(rows), -1.0),
        A_ub=at_least,
        b_ub=np.zeros(columns),
        A_eq=np.append(np.ones(rows), 0.0)[np.newaxis],
        b_eq=[1.0],
        bounds=[(0.0, 1.0)] * rows + [(None, None)],
    )
    return _probabilities(found[:-1])


def dominating(payoff: FloatArray) -> list[FloatArray | None]:
    """For each row of (m, n) the probabilities (m,) of rows that together pay more in every column; None if none do.

    A single row that does it is preferred to a mixture.
    """
    return [_dominating(payoff, row) for row in range(len(payoff))]


def _dominating(payoff: FloatArray, row: int) -> FloatArray | None:
    others = np.delete(np.arange(len(payoff)), row)
    if not len(others):
        return None
    margin = (payoff[others] - payoff[row]) / _spread(payoff)
    least = margin.min(axis=1)
    chosen = np.eye(len(others))[least.argmax()] if least.max() > TOLERANCE else maximin(margin)
    if (chosen @ margin).min() <= TOLERANCE:
        return None
    probabilities = np.zeros(len(payoff))
    probabilities[others] = chosen
    return probabilities


def _program(costs: FloatArray, **constraints: Any) -> FloatArray:
    optimize = require("scipy.optimize", extra="baselines", purpose="the equilibrium of a matrix game")
    accuracy = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    found = optimize.linprog(costs, method="highs", options=accuracy, **constraints)
    if not found.success:
        raise ArithmeticError(f"the linear program of a matrix game was not solved: {found.message}")
    solution: FloatArray = found.x
    return solution


def _probabilities(weights: FloatArray) -> FloatArray:
    kept = np.where(weights > TOLERANCE, weights, 0.0)
    found: FloatArray = kept / kept.sum()
    return found


def _checked(payoff: FloatArray) -> FloatArray:
    payoff = np.asarray(payoff, np.float64)
    if payoff.ndim != 2 or not payoff.size or not np.isfinite(payoff).all():
        raise ValueError("a matrix game needs a matrix (attackers, defenders) of finite payoffs, at least one")
    return payoff


def _spread(payoff: FloatArray) -> float:
    """The number by which payoffs are divided before the linear programs; 1 where all are the same."""
    return float(np.ptp(payoff)) or 1.0


HALVES = 2


def game_value(payoffs: FloatArray) -> Estimate:
    """The value of the game of the true means, for episodes (m, n, E) that share their seeds.

    `mean` is what the attacker is paid when both play mixtures that were chosen without the episode. `low` and `high`
    hold the value of the game in at least 95 % of cases. A single episode has no interval.

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
    return guaranteed(paid, conceded, met)


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
