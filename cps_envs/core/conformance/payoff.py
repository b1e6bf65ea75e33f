"""The payoff is zero-sum, its sum is the published metric, and the metrics have the same names everywhere."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from pettingzoo import ParallelEnv

from cps_envs.core.conformance.recording import BATCHES, record
from cps_envs.core.conformance.subject import NotApplicableError, Subject
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.types import AGENTS, ROLES, SIGN

TOLERANCE = 1e-9
BESIDE = {"action_mask", "due", "final_obs", "final_info"}  # what infos have beside the metrics


def check_return(subject: Subject) -> None:
    """The undiscounted return is what `game.terms` make of the last info, its negative for the defender."""
    sign = SIGN[subject.role]
    for boldness in (0.0, 0.7):
        env = subject.single()
        results = record(env, seed=71, boldness=boldness)[1]
        parts = env.game.terms
        paid = math.fsum(result[1] for result in results[1:])
        _assert_equal(
            paid, sign * math.fsum(weight * results[-1][-1][part] for part, weight in parts), parts, "single", sign
        )
    if subject.interface != NATIVE:
        return  # agents of a team may each be paid what the whole is
    both = subject.parallel()
    results = record(both, seed=72)[1]
    for role in ROLES:
        agent = AGENTS[role]
        paid = math.fsum(result[1][agent] for result in results[1:])
        total = SIGN[role] * math.fsum(weight * results[-1][-1][agent][part] for part, weight in both.game.terms)
        _assert_equal(paid, total, both.game.terms, "parallel", SIGN[role])


def _assert_equal(paid: float, total: float, terms: tuple[tuple[str, float], ...], interface: str, sign: float) -> None:
    parts = [part if weight == 1 else f"{weight:g} {part}" for part, weight in terms]
    formula = " + ".join(parts) if sign > 0 else f"-({' + '.join(parts)})"
    close = abs(paid - total) <= TOLERANCE * max(1.0, abs(total))
    assert close, f"the return of the {interface} interface is {paid!r}, but {formula} of the last info is {total!r}"


def check_cost(subject: Subject) -> None:
    """The `cost` in the infos of an episode sums to the metric that the problem counts, in every interface.

    Raises:
        NotApplicableError: the problem counts none.
    """
    metric = subject.problem.cost
    if not metric:
        raise NotApplicableError("the problem names no cost")
    for name, make in subject.interfaces().items():
        env = make()
        total: Any = 0.0
        for step, result in enumerate(record(env, seed=75)[1]):
            info, *final = _infos(result[-1], env)
            total = total + info["cost"]
            counted, ended = info[metric], np.zeros(np.shape(total), np.bool_)
            if isinstance(env, BATCHES) and final and "final_info" in result[-1]:
                ended = result[-1]["_final_obs"]
                counted = np.where(ended, final[0][metric], counted)
            close = np.abs(total - counted) <= TOLERANCE * np.maximum(1.0, np.abs(counted))
            where = f"the {name} interface's costs up to step {step}"
            assert np.all(close), f"{where} sum to {total}, but the metric {metric} is {counted}"
            total = np.where(ended, 0.0, total)


def check_zero_sum(subject: Subject) -> None:
    """At every step of the parallel interface the two rewards add up to zero."""
    for step, (_, rewards, *_) in enumerate(record(subject.parallel(), seed=73)[1][1:]):
        total = math.fsum(rewards.values())
        assert total == 0.0, f"the rewards {rewards} at step {step} of the parallel form add up to {total!r}, not to 0"


def check_metrics(subject: Subject) -> None:
    """Every interface's info, at reset and at each step, has the game's metrics; Python numbers where it is single."""
    game, cost = subject.game(), subject.problem.cost
    expected = set(game.metrics())
    missing = {*game.payoff_parts, *filter(None, [cost])} - expected
    assert not missing, f"payoff_parts or cost names {sorted(missing)}, which are no metrics"
    expected |= {"cost"} if cost else set()
    for name, make in subject.interfaces().items():
        env = make()
        for step, result in enumerate(record(env, seed=74)[1]):
            for info in _infos(result[-1], env):
                keys = {key for key in info if not key.startswith("_")} - BESIDE
                where = f"the {name} interface's info at step {step}"
                assert keys == expected, f"{where} differs from the game's metrics in {sorted(keys ^ expected)}"
                if not isinstance(env, BATCHES):
                    _assert_plain(info, expected, where)


def _infos(info: Mapping[str, Any], env: Any) -> Iterator[Mapping[str, Any]]:
    if isinstance(env, ParallelEnv):
        yield from info.values()
    else:
        agents = getattr(env, "possible_agents", ())
        yield {key: value for key, value in info.items() if key not in agents}
        if "final_info" in info:
            yield info["final_info"]


def _assert_plain(info: Mapping[str, Any], keys: set[str], where: str) -> None:
    for key in keys:
        value = info[key]
        assert type(value) in (int, float, bool), f"{where}: {key} is a {type(value).__name__}, not a Python number"
        assert math.isfinite(value), f"{where}: {key} = {value} is not finite"
