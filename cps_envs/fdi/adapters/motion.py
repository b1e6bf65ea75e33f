"""Lies that look like a vehicle: one number a decision, how the lie accelerates."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, FloatArray
from cps_envs.fdi.adapters.lying import Lying

LEVELS_MPS2 = (-2.0, -1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0, 2.0)  # chosen; disturbances deviate by 0.3 to 0.5


class Motion(Lying):
    """Discrete (9,): the acceleration r'' of the lie. Attacked ranges tell r more, attacked range-rates r'.

    With an error e the vehicles see e + r, which moves as if the vehicle ahead accelerated by r'' more than it does. A
    filter cannot tell that from a disturbance of this size. Before injections work the lie stands still.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec, LEVELS_MPS2)
        self.action_space = spaces.Discrete(len(LEVELS_MPS2))
        self.neutral_action = np.array(LEVELS_MPS2.index(0.0))

    def begin(self, num_envs: int) -> State:
        """The lies about range, m, and range-rate, m/s: (B, 2)."""
        return (np.zeros((num_envs, 2)),)

    def lies(self, seen: Seen, state: State) -> FloatArray:
        """The state."""
        return state[0]

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The levels nearest to the lies, one step on."""
        return self.tell(seen, state, self.levels[actions[:, 0]])

    def tell(self, seen: Seen, state: State, acceleration_mps2: FloatArray) -> tuple[Array, State]:
        """The role's actions (B, S), and the next state, of lies that accelerate by so much, (B,)."""
        dt_s = self.spec.config.dt_s
        pushed, (lie_m, lie_mps) = acceleration_mps2 * self.works(seen), state[0].T
        lies = np.stack([lie_m + dt_s * lie_mps + dt_s**2 / 2 * pushed, lie_mps + dt_s * pushed], axis=1)
        wanted = np.rint(lies[:, np.where(self.ranges, 0, 1)] / self.resolution)
        lying = self.works(seen)[:, np.newaxis] & self.attacked(seen)
        return self.say(wanted * lying), (lies,)
