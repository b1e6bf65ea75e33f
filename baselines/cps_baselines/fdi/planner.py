"""An attacker that plans its injections in the model of the platoon, and improves the plan at every step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cps_baselines.family import as_records
from cps_baselines.fdi.injection import InjectionPolicy, View, view_of
from cps_baselines.fdi.planning import MODULUS, Habits, improve_plans
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, IntArray, State
from cps_envs.fdi.selection import chosen_tasks

FIRST_PLANS, LATER_PLANS = 3000, 50  # tried at the first step, and at every later one

# The plans to begin with, by hand, for a task whose target is the pair of the attacked sensor; one ahead of the last
# vehicle, which nobody follows; and any other pair ahead. An own pair collides after braking and pushing. Another one
# can only collide in the same sample as the attacked one, which has to wait close behind.
OWN, LAST, AHEAD = range(3)
LENGTHS_S = np.array(  # of stretches: brake, push, back, hold, push once more; then back again
    [(1.4, 60.0, 0.0, 0.0, 0.0), (0.0, 1.9, 1.3, 0.1, 0.6), (0.2, 1.6, 0.6, 1.2, 0.3)]
)
SHARES = np.array([0.0, 0.97, 0.03, 0.25, 1.0, 0.03])


class Planner(InjectionPolicy):
    """Begins with a plan of a few stretches, and tries random changes of it in the model: many at the first step.

    `habits` (B, 11) are those of `planning.Habits`; B may be 1 for all episodes. The platoon has to be undefended and
    undisturbed, and its commands held over a step.

    Raises:
        ConfigurationError: limits that clip, commands that are not held, disturbances, or two attacked sensors.
    """

    exact = True

    def __init__(
        self,
        spec: RoleSpec,
        habits: FloatArray,
        *,
        first_plans: int = FIRST_PLANS,
        later_plans: int = LATER_PLANS,
    ) -> None:
        super().__init__(spec)
        config, single = self.config, all(task.sensors.count == 1 for task in chosen_tasks(self.config))
        if config.limits != "hard" or config.discretisation != "zohu" or config.disturbed or not single:
            raise ConfigurationError(
                'Planner needs limits = "hard", discretisation = "zohu", no disturbance and one attacked sensor, as in '
                'preset "drawn"'
            )
        self.habits = as_records(Habits, habits)
        self.first_plans, self.later_plans = first_plans, later_plans

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """Plans (B, horizon) that are not made yet, and the states of the random numbers (B,)."""
        draws = np.array([generator.integers(MODULUS) for generator in generators])
        return np.full((len(generators), self.config.horizon), np.nan), draws

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S), see the class."""
        assert state is not None
        views, plans, draws = view_of(self.form, seen), state[0].copy(), state[1].copy()
        fresh = np.isnan(plans[:, -1])
        plans[fresh] = self._first(views)[fresh]
        gains = np.full((len(seen), 2), (self.config.proportional_gain, self.config.derivative_gain))
        if self.config.gain_spread > 0:
            gains *= seen["gain"]
        habits = np.resize(self.habits, len(seen))
        counts, levels = np.where(fresh, self.first_plans, self.later_plans), np.zeros(len(seen), np.int64)
        improve_plans(self.form.held.constants, views, gains, habits, counts, plans, draws, levels)
        wishes: IntArray = np.where(views.attacked, levels[:, np.newaxis], 0)
        return self.say(views, wishes, seen.masks), (plans, draws)

    def _first(self, views: View) -> FloatArray:
        """The plans (B, horizon) to begin with."""
        vehicle = self.form.sensors[views.attacked.argmax(axis=1)] % self.config.num_vehicles
        kind = np.where(views.target == vehicle, OWN, np.where(vehicle == 0, LAST, AHEAD))
        ends_s = np.cumsum(LENGTHS_S, axis=1)[kind]  # (B, 5)
        times_s = np.arange(self.config.horizon) * self.config.dt_s
        plans: FloatArray = SHARES[(times_s[np.newaxis, :, np.newaxis] >= ends_s[:, np.newaxis]).sum(axis=2)]
        return plans
