"""What learners play disbanding through: a follower's numbers for the defence, or one correction for each vehicle."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation, State
from cps_envs.disbanding.fields import vehicle_fields
from cps_envs.disbanding.follower import NUMBERS, PLAIN, Layout, follow_all, set_points
from cps_envs.disbanding.platoons import PlatoonRows

STEPS = 2.0  # units of the set-points within reach of an action, chosen: the best constants known lie within one


class Vehicle(Adapter):
    """One agent for each vehicle, front to rear, that sees its own row of sensors and corrects its own command.

    Its action times u_max - u_min is the correction.
    """

    local = True

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        check_vehicles(spec)
        self.agents = tuple(f"vehicle_{q}" for q in range(spec.config.max_vehicles))
        self.fields = vehicle_fields(spec.config)
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.neutral_action = np.zeros(1, np.float32)

    def observe(self, seen: Seen, state: State) -> Observation:
        """Own rows (B, M, size), see `fields.vehicle_fields`."""
        return _rows(seen).copy()

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Vehicles whose correction would act."""
        at = self.fields.slices["mitigable"].start
        active: BoolArray = _rows(seen)[:, :, at] > 0
        return active

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The corrections (B, M)."""
        return actions[..., 0], state


class Follow(Adapter):
    """One agent for each platoon, front to rear, that sets 22 numbers of a follower; zero is the plain one.

    The first eleven are the leader's, the others those of the vehicles behind, see `follower.SetPoints`. The follower
    itself corrects every intact vehicle ten times a second, so that agents may keep their numbers for long.
    """

    shared = False  # whether one agent chooses for all platoons

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        check_vehicles(spec)
        config = spec.config
        self._rows = PlatoonRows(spec)
        self.agents = ("road",) if self.shared else tuple(f"platoon_{p}" for p in range(config.max_platoons))
        self.fields = self._rows.road_fields if self.shared else self._rows.fields
        self.action_space = spaces.Box(-1.0, 1.0, (NUMBERS,), np.float32)
        self.neutral_action = np.zeros(NUMBERS, np.float32)
        self._layout = Layout(spec.fields.offsets, spec.fields.scale)
        limit_mps2 = config.max_acceleration_mps2 - config.min_acceleration_mps2
        self._road = (config.vehicles_per_platoon, config.desired_speed_mps, limit_mps2)

    def observe(self, seen: Seen, state: State) -> Observation:
        """What each platoon does and is told, see `platoons.platoon_fields`."""
        return self._rows.observe(seen.observation)

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Platoons that are there and intact."""
        return self._rows.intact(seen.observation)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The corrections (B, M) of the follower."""
        corrections = np.zeros((len(seen), self.spec.config.max_vehicles))
        points = set_points(actions, STEPS, self.neutral_points(seen))
        follow_all(seen.observation, self._layout, points, *self._road, corrections)
        return corrections, state

    def neutral_points(self, seen: Seen) -> FloatArray:
        """The set-points of action 0, (2, 11) or (B, 1, 2, 11)."""
        return PLAIN


class FollowRoad(Follow):
    """`Follow` with one agent that chooses the same 22 numbers for all platoons of the road."""

    shared = True

    def observe(self, seen: Seen, state: State) -> Observation:
        """The means and extremes over the intact platoons, (B, 1, size), see `platoons.road_fields`."""
        return self._rows.observe_road(seen.observation)

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Always, (B, 1)."""
        return np.ones((len(seen), 1), np.bool_)


def check_vehicles(spec: RoleSpec) -> None:
    """Ask for a configuration in which the defender corrects vehicles.

    Raises:
        ConfigurationError: it corrects platoons.
    """
    if spec.config.defense_action != "vehicle":
        raise ConfigurationError('this adapter corrects vehicles; it needs defense_action="vehicle"')


def _rows(seen: Seen) -> Observation:
    if seen.team is None:
        raise TypeError("the adapter is local: it needs `seen.team`, the own sensors of each vehicle")
    return seen.team
