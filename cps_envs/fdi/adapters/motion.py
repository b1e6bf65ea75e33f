"""Lies that look like a vehicle: one number a decision, how the lie accelerates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.kernels import inlined, kernel, nearest, room
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.policies.inside import InsideAdapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, State
from cps_envs.fdi.adapters.lying import SOON_S, Lying, Sight, Voice, observe_gap

LEVELS_MPS2 = (-2.0, -1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0, 2.0)  # chosen; disturbances deviate by 0.3 to 0.5


class Motion(Lying):
    """Discrete (9,): the acceleration r'' of the lie. Attacked ranges tell r more, attacked range-rates r'.

    With an error e the vehicles see e + r, which moves as if the vehicle ahead accelerated by r'' more than it does. A
    filter cannot tell that from a disturbance of this size. Before injections work the lie stands still.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self._levels: FloatArray = np.array(LEVELS_MPS2)
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
        return self.tell(seen, state, self._levels[actions[:, 0]])

    def inside(self) -> InsideAdapter:
        """`observe_gap` and `_tell` of one environment."""
        known = Told(self._sight, self._voice, self._levels, np.array([self.spec.config.dt_s]))
        return InsideAdapter(known, lambda count: Lies(*self.begin(count)), _begin, _look, _soon, _move)

    def tell(self, seen: Seen, state: State, acceleration_mps2: FloatArray) -> tuple[Array, State]:
        """The role's actions (B, S), and the next state, of lies that accelerate by so much, (B,)."""
        lies, actions = state[0].copy(), np.empty((len(seen), len(self.sensors)), np.int64)
        _tell(self._sight, self._voice, self.spec.config.dt_s, seen.observation, acceleration_mps2, lies, actions)
        return actions, (lies,)


@kernel
def _tell(
    sight: Sight,
    voice: Voice,
    dt_s: float,
    observation: Observation,
    acceleration_mps2: FloatArray,
    lies: FloatArray,
    actions: IntArray,
) -> None:
    """Move the lies (B, 2) by a step, and fill the actions (B, S) that tell them."""
    at, scale = sight.offsets[0], sight.scale
    for b in range(lies.shape[0]):
        works = decode_entry(observation[b], scale, at.wait) < 0.5
        pushed = acceleration_mps2[b] if works else 0.0
        lies[b, 0] = lies[b, 0] + dt_s * lies[b, 1] + dt_s**2 / 2.0 * pushed
        lies[b, 1] += dt_s * pushed
        for slot in range(actions.shape[1]):
            told, most = lies[b, 0 if voice.ranges[slot] else 1], voice.bounds[slot]
            level = 0
            if works and (sight.shape[2] == 0 or decode_entry(observation[b], scale, at.attacked + slot) > 0.5):
                level = nearest(told / voice.resolution[slot])
            actions[b, slot] = min(max(level, -most), most) + most


class Told(NamedTuple):
    """What the functions below know."""

    sight: Sight
    voice: Voice
    levels_mps2: FloatArray  # (9,)
    dt_s: FloatArray  # (1,)


class Lies(NamedTuple):
    """What they remember."""

    lies: FloatArray  # (B, 2) m and m/s


@inlined
def _begin(known: Told, memory: Lies, stream: Array) -> None:
    """Tell no lies yet."""
    memory.lies[0, 0] = memory.lies[0, 1] = 0.0


@inlined
def _look(known: Told, memory: Lies, seen: Observation, shown: Observation) -> None:
    """`Lying.observe`: fill (1, 1, m)."""
    observe_gap(known.sight, seen, memory.lies, shown[:, 0])


@inlined
def _soon(known: Told, memory: Lies, seen: Observation, active: BoolArray) -> None:
    """`Lying.active`."""
    sight = known.sight
    active[0, 0] = decode_entry(seen[0], sight.scale, sight.offsets[0].wait) * known.dt_s[0] <= SOON_S + 1e-6


@inlined
def _move(known: Told, memory: Lies, seen: Observation, kept: IntArray, action: IntArray) -> None:
    """`Motion.act`."""
    pushed = room(1)
    pushed[0] = known.levels_mps2[kept[0, 0, 0]]
    _tell(known.sight, known.voice, known.dt_s[0], seen, pushed, memory.lies, action)
