"""An attacker whose lie moves like a vehicle: to a filter it is a vehicle ahead that accelerates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, IntArray, Knowledge, State
from cps_envs.fdi.adapters.motion import Motion


class Mimic(AnalyticPolicy):
    """Lies about ranges by a t^2 / 2 and about range-rates by a t, t since the lies began to work. Sees nothing else.

    With an error e the vehicles see E = e + a t^2 / 2, which obeys E'' = d + a - u: a disturbance d and an a of its
    size look the same. `acceleration_mps2` is a; 0.5 is the best constant against `hypotheses`. `by_task` has an a for
    each task that the configuration lists.

    Raises:
        ConfigurationError: there is no filter, actions are shares of what is legal, or there are other tasks.
    """

    def __init__(
        self, spec: RoleSpec, *, acceleration_mps2: float = 0.5, by_task: Sequence[float] | None = None
    ) -> None:
        super().__init__(spec)
        tasks, n = spec.config.listed_tasks, spec.config.num_vehicles
        if by_task is not None and len(by_task) != len(tasks):
            raise ConfigurationError(f"by_task has {len(by_task)} accelerations for {len(tasks)} tasks")
        self._accelerations = np.array(by_task if by_task is not None else [acceleration_mps2], np.float64)
        self._attacked = np.array([task.sensors.flags(n, rear=True) for task in tasks[: len(self._accelerations)]])
        self._motion = Motion(spec)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The lies (B, 2) about range and range-rate, m and m/s."""
        return self._motion.begin(len(generators))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S), see the class."""
        return self._motion.tell(seen, state, self._accelerations[self._task(seen)])

    def _task(self, seen: Seen) -> IntArray:
        """Which of the accelerations (B,) each episode has."""
        if len(self._accelerations) == 1:
            return np.zeros(len(seen), np.int64)
        same = (seen["attacked"][:, np.newaxis] > 0.5) == self._attacked
        found: IntArray = same.all(axis=2).argmax(axis=1)
        return found
