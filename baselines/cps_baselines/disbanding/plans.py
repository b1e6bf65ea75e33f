"""Attacks that follow a plan fixed when the episode starts: which platoon of the paper's numbering, at which second."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, plays_in
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, Knowledge, State

Event = tuple[int, float]  # platoon (1 = rear), time in s
NEVER = np.inf


def plan_array(events: Sequence[Event], num_platoons: int) -> FloatArray:
    """The disbanding time of each platoon, (num_platoons,), +inf for those that are left alone.

    Raises:
        ConfigurationError: a platoon that does not exist or is named twice, or a time before 1 s.
    """
    times = np.full(num_platoons, NEVER)
    for platoon, time_s in events:
        if not 1 <= platoon <= num_platoons or platoon != int(platoon):
            raise ConfigurationError(f"a plan names platoon {platoon}; there are platoons 1 (rear) to {num_platoons}")
        if not time_s >= 1:
            raise ConfigurationError(f"platoon {platoon} cannot be disbanded at {time_s} s: attacks start at 1 s")
        if np.isfinite(times[int(platoon) - 1]):
            raise ConfigurationError(f"a plan disbands platoon {platoon} twice")
        times[int(platoon) - 1] = time_s
    return times


class PlannedAttack(AnalyticPolicy):
    """Base: plays the plans of its episodes, (B, N) disbanding times, by the clock it observes.

    At each decision it disbands a platoon whose time has come, the front one first; one per decision.
    """

    from_front = True  # the last row of a plan is the front platoon, also where fewer platoons are present

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Platoon to disband, or 0, for each episode (B,)."""
        plans = self._aligned(self.planned(state, seen), seen)
        due = (plans <= seen["time_s"][:, np.newaxis] + 1e-3) & (seen["disbanded"] < 0.5)
        due &= seen["budget_left"][:, np.newaxis] > 0.5
        platoons = np.arange(1, plans.shape[1] + 1)
        return np.max(np.where(due, platoons, 0), axis=1), state

    def planned(self, state: tuple[Array, ...], seen: Seen) -> FloatArray:
        """The plans (B, N) of the episodes: those that `begin` put into the state."""
        plans: FloatArray = state[0]
        return plans

    def _aligned(self, plans: FloatArray, seen: Seen) -> FloatArray:
        """Plans counted from the front, moved to the platoons present where their number is drawn."""
        if not self.from_front or "present" not in seen:
            return plans
        absent = np.sum(seen["present"] < 0.5, axis=1, keepdims=True)
        source = np.arange(plans.shape[1]) + absent
        shifted = np.take_along_axis(plans, np.minimum(source, plans.shape[1] - 1), axis=1)
        return np.where(source < plans.shape[1], shifted, NEVER)


class Plan(PlannedAttack):
    """Plays a given list of (platoon, second). With `from_front`, platoon N is the front one in shorter strings.

    Raises:
        ConfigurationError: an impossible plan, or one longer than the attacker's budget.
    """

    def __init__(self, spec: RoleSpec, events: Sequence[Event], *, from_front: bool = False) -> None:
        super().__init__(spec)
        self.from_front = from_front
        config = spec.config
        self.times = plan_array(events, config.max_platoons)
        if len(events) > config.max_budget:
            raise ConfigurationError(
                f"a plan with {len(events)} attacks needs attack_budget={len(events)}; it is {config.attack_budget}"
            )

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The same plan in every episode."""
        return (np.stack([self.times] * len(generators)),)


class RandomPlan(PlannedAttack):
    """Disbands K different platoons at K random whole seconds, drawn for each episode.

    A uniformly random *action* would spend the budget in the first seconds, which is nearly the best timing.
    `front_bias` weighs platoon i by exp(front_bias * i / N): 0 is uniform, larger prefers the front.

    Raises:
        ConfigurationError: `latest_s` is no time from 1 s on.
    """

    def __init__(self, spec: RoleSpec, latest_s: float | None = None, front_bias: float = 0.0) -> None:
        super().__init__(spec)
        self.latest_s = spec.config.duration_s if latest_s is None else latest_s
        if not 1 <= self.latest_s < np.inf:
            raise ConfigurationError(f"latest_s = {latest_s} must be 1 or more: attacks start at 1 s")
        weights = np.exp(front_bias * np.arange(1, spec.config.max_platoons + 1) / spec.config.max_platoons)
        self._shares = weights / weights.sum()

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """A plan per episode, for the largest budget; what the episode's own budget does not cover is left out."""
        return (np.stack([self._draw(generator) for generator in generators]),)

    def _draw(self, generator: np.random.Generator) -> FloatArray:
        config = self.spec.config
        chosen = generator.choice(config.max_platoons, config.max_budget, replace=False, p=self._shares)
        times = np.full(config.max_platoons, NEVER)
        times[chosen] = generator.integers(1, int(self.latest_s) + 1, config.max_budget)
        return times


class Spread(PlannedAttack):
    """Disbands the front platoons one after the other, spread over the episode, as many as the budget allows."""

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        platoons = spec.config.max_platoons
        self.times = np.stack(
            [plan_array(_spread(budget, platoons), platoons) for budget in range(spec.config.max_budget + 1)]
        )

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Nothing to draw: the budget is seen."""
        return (np.zeros((len(generators), 0)),)

    def planned(self, state: tuple[Array, ...], seen: Seen) -> FloatArray:
        """The plans (B, N) of the budgets that the episodes began with."""
        budgets = np.rint(seen["budget_left"] + seen["disbanded"].sum(axis=1)).astype(int)
        plans: FloatArray = self.times[np.minimum(budgets, len(self.times) - 1)]  # jolts disband more than they cost
        return plans


def _spread(budget: int, platoons: int) -> list[Event]:
    pause_s = 98.0 if budget <= 2 else np.floor(170.0 / budget)
    return [(platoons - i, 1.0 + i * pause_s) for i in range(budget)]


def lead(spec: RoleSpec, time_s: float = 1.0) -> Plan:
    """Disbands the lead platoon at the first instant: the paper's optimal single attack (Table 2.2)."""
    return Plan(spec, [(spec.config.max_platoons, time_s)], from_front=True)


def table_2_3(spec: RoleSpec) -> Plan:
    """Disbands the lead platoon at 2 s and the next one at 100 s (Table 2.3)."""
    platoons = spec.config.max_platoons
    return Plan(spec, [(platoons, 2.0), (platoons - 1, 100.0)], from_front=True)


@plays_in("paper with attack_budget=5")
def every_other(spec: RoleSpec) -> Plan:
    """Disbands every other platoon from the front, one every 30 s (Fig. 2.1e)."""
    platoons = spec.config.max_platoons
    return Plan(spec, [(platoons - 2 * i, 2.0 + 30.0 * i) for i in range(platoons // 2)], from_front=True)
