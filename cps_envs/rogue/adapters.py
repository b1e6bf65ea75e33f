"""How learners play the two roles: the seized vehicle by three efforts, the others by a controller for each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.kernels import borrowed, inlined, kernel, room
from cps_envs.core.declare.config import Range, bounds
from cps_envs.core.declare.fields import Field, Fields, decode_entry, encode_row
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.inside import Alone, InsideAdapter, begin_blank
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, State
from cps_envs.rogue.actions import PLAIN, choices_of, order_space
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.fields import ACCELERATION_MPS2, DETECTOR_SPAN, NEAR, compressed, vehicle_fields
from cps_envs.rogue.formation import FAR
from cps_envs.rogue.swarm import names_of, seized_names

EFFORTS = np.array([-1.0, 0.0, 1.0], np.float32)  # full braking, the present speed, full driving
CRUISE = 1  # the second of them
FAR_M, FAST_MPS, LOST_M = 60.0, 25.0, 500.0  # chosen: errors from there on look alike
SIDES = ("front_gap_error", "front_gap_rate", "rear_gap_error", "rear_gap_rate")
SHOWN = 12  # fields that one seized vehicle sees
SPEEDS_MPS = (0.0, 50.0)  # chosen: v_max


class Effort(Adapter):
    """The seized vehicle brakes in full (0), keeps its speed (1) or drives in full (2).

    The best attacks that are known do nothing else. It sees what the attacker sees; what an untrained policy hardly
    reaches lies beyond the bounds (chosen). Several seized vehicles are an agent each, with the own sensors, and with
    what the others do: one network can drive them all.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        config = spec.config
        self.agents = seized_names(config)
        self.action_space, self.neutral_action = spaces.Discrete(len(EFFORTS)), np.array(CRUISE)
        others = (
            Field("others_speed", "m/s", -25, 25, (), "mean of the other seized vehicles minus own"),
            Field("others_effort", "-", config.min_effort, config.max_effort, (), "mean of the other seized vehicles"),
        )
        far = FAR * config.separation_m  # as far as its sensors see: run-ups are as long
        self.fields = self._shown = Fields(
            Field("front_gap_error", "m", -far, far, (), "distance to the vehicle ahead minus sigma"),
            Field("front_gap_rate", "m/s", -25, 25, (), "speed of the vehicle ahead minus own"),
            Field("rear_gap_error", "m", -15, 15, (), "distance to the vehicle behind minus sigma"),
            Field("rear_gap_rate", "m/s", -10, 10, (), "own speed minus that of the vehicle behind"),
            Field("speed", "m/s", *SPEEDS_MPS, (), "own"),
            Field("effort", "-", config.min_effort, config.max_effort, (), "own, in the last integration step"),
            range_field("reference_speed", "m/s", config.reference_range_mps, "v_ref"),
            range_field("power_ratio", "-", config.power_ratio, "own alpha over that of the others"),
            range_field("attacker_index", "-", config.seat_range, "of the seized vehicle, 1 = rear"),
            range_field("num_vehicles", "-", config.num_vehicles, "of the platoon"),
            Field("until_onset_s", "s", 0, 60, (), "until the own effort takes effect"),
            Field("time_left_s", "s", 0, config.duration_s, (), "until the end of the episode"),
            *(others if len(self.agents) > 1 else ()),
        )
        places = [np.arange(spec.fields.size)[spec.fields.slices[field.name]] for field in self.fields[:SHOWN]]
        self._known = Known(
            source=np.concatenate(places),
            fields=Layout(spec.fields.offsets, spec.fields.scale),
            scale=self.fields.scale,
            soon_s=np.array([config.dt_s / 2]),
            efforts=EFFORTS,
        )

    def observe(self, seen: Seen, state: State) -> Observation:
        """The rows (B, A, m) of the seized vehicles, of one (B, 1, m)."""
        if len(self.agents) == 1:
            shown = np.empty((len(seen), 1, self._shown.size), np.float32)  # a subclass may show more
            show_again(self._known, Alone(EFFORTS), seen.observation, shown)
            return shown
        shape = (len(seen), len(self.agents))
        rows = {name: each.reshape(len(seen), -1) for name in self.spec.fields.slices if (each := seen[name]).size}
        speed, effort = (self._of_others(rows[name]) for name in ("speed", "effort"))
        rows |= {"others_speed": speed - rows["speed"], "others_effort": effort}
        columns = {name: np.broadcast_to(values, shape).reshape(-1) for name, values in rows.items()}
        return encoded(self._shown, columns, seen).reshape(*shape, -1)

    def inside(self) -> InsideAdapter | None:
        """Of a single seized vehicle; a subclass shows and does other things."""
        if len(self.agents) > 1 or type(self) is not Effort:
            return None
        remember = Alone(EFFORTS)
        return InsideAdapter(self._known, lambda _: remember, begin_blank, show_again, mark_begun, take_effort)

    def _of_others(self, values: FloatArray) -> FloatArray:
        """The mean of the other agents, of values (B, A)."""
        rest: FloatArray = (values.sum(axis=1, keepdims=True) - values) / (len(self.agents) - 1)
        return rest

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Whether the attack has begun, (B, A)."""
        begun = seen["until_onset_s"][:, np.newaxis] < self.spec.config.dt_s / 2
        agents: BoolArray = np.repeat(begun, len(self.agents), axis=1)
        return agents

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The efforts (B, A)."""
        return EFFORTS[actions], state


class Layout(NamedTuple):
    """How a role's observations are encoded."""

    offsets: Array  # (1,)
    scale: FloatArray  # (2, n)


class Known(NamedTuple):
    """What the functions of one seized vehicle know."""

    source: IntArray  # (m,) entries of the role's observation that it sees
    fields: Layout
    scale: FloatArray  # (2, m)
    soon_s: FloatArray  # (1,)
    efforts: Observation  # (3,)


@kernel
def show_again(known: Known, memory: Alone, seen: Observation, shown: Observation) -> None:
    """`Effort.observe`: fill (B, 1, m) with entries of the role's observation (B, n) within other bounds."""
    values = room(shown.shape[2])
    for b in range(shown.shape[0]):
        for i in range(values.size):
            values[i] = decode_entry(borrowed(seen)[b], borrowed(known.fields.scale), known.source[i])
        encode_row(borrowed(values), borrowed(known.scale), borrowed(shown)[b, 0])


@inlined
def mark_begun(known: Known, memory: Alone, seen: Observation, active: BoolArray) -> None:
    """`Effort.active`."""
    fields = known.fields
    active[0, 0] = decode_entry(seen[0], fields.scale, fields.offsets[0].until_onset_s) < known.soon_s[0]


@inlined
def take_effort(known: Known, memory: Alone, seen: Observation, kept: IntArray, action: FloatArray) -> None:
    """`Effort.act`."""
    action[0, 0] = known.efforts[kept[0, 0, 0]]


class VehicleFull(Adapter):
    """Each vehicle that gets orders sees its own row, `fields.vehicle_fields`, and chooses all of its orders.

    These are its controller and whether following is modified, or with `defense_action="command"` its acceleration.
    """

    local = True

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        config: RogueConfig = spec.config
        self.agents, self.fields = names_of(config), vehicle_fields(config)
        self.action_space = order_space(config, 1)
        self.neutral_action = spec.neutral_action.reshape(len(self.agents), -1)[0]

    def observe(self, seen: Seen, state: State) -> Observation:
        """The vehicles' own rows (B, A, m)."""
        shown: Observation = team_of(seen).copy()
        return shown

    def active(self, seen: Seen, state: State) -> BoolArray:
        """The vehicles (B, A) that the platoon has; which of them is seized the defender does not know."""
        agents, extra = np.arange(len(self.agents)), seen["present"]
        there: BoolArray = agents - len(agents) < extra.sum(axis=1, keepdims=True) - extra.shape[1] - 0.5
        return there

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The defender's action: (B, 2 A) from (B, A, 2), or (B, A) from (B, A, 1)."""
        return actions.reshape(len(actions), -1), state


class Vehicle(VehicleFull):
    """Each vehicle that gets orders chooses one of its controllers or accelerations; following is never modified.

    It sees its own row without what it has chosen itself, how far it is from its place in the platoon, and errors e as
    arsinh(e / 0.2).

    Raises:
        ConfigurationError: the environment takes accelerations, not controllers.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        config = spec.config
        if config.defense_action == "command":
            raise ConfigurationError('the adapter "vehicle" selects controllers; it needs defense_action="mode"')
        self._rows = self.fields
        self.action_space = spaces.Discrete(choices_of(config))
        self.neutral_action = np.array(CONTROLLERS.index(config.neutral_controller))
        spread = DETECTOR_SPAN * config.alarm_threshold
        self.fields = self._shown = Fields(
            Field("leads", "-", 0, 1, (), "the vehicle is the leader, whose front neighbour is the reference"),
            Field("trails", "-", 0, 1, (), "nobody is behind"),
            *(compressed_field(name) for name in SIDES),
            compressed_field("place_error", LOST_M),
            Field("speed", "m/s", *SPEEDS_MPS, (), "own"),
            range_field("reference_speed", "m/s", config.reference_range_mps, "v_ref"),
            Field("front_acceleration", "m/s2", -ACCELERATION_MPS2, ACCELERATION_MPS2, (), "ahead"),
            Field("rear_acceleration", "m/s2", -ACCELERATION_MPS2, ACCELERATION_MPS2, (), "behind"),
            Field("front_detector", "m2/s3", 0, spread, (), "own z_f"),
            Field("rear_detector", "m2/s3", 0, spread, (), "own z_r"),
            Field("alarm", "-", -1, 1, (), "1: front neighbour detected, -1: rear one, 0: none; latched"),
            Field("time_left_s", "s", 0, config.duration_s, (), "until the end of the episode"),
        )

    def observe(self, seen: Seen, state: State) -> Observation:
        """The vehicles' rows (B, A, m)."""
        rows = Seen(self._rows, team_of(seen).reshape(-1, self._rows.size))
        columns = {name: compressed(rows[name]) for name in SIDES}
        columns["place_error"] = compressed(self._behind(seen).reshape(-1))
        shown = encoded(self._shown, columns, rows)
        return shown.reshape(len(seen), len(self.agents), -1)

    def _behind(self, seen: Seen) -> FloatArray:
        """How far each vehicle is behind its place, (B, A) in m: by the gaps ahead of it and the leader's error."""
        gap_error = seen["gap_error"]
        behind = np.zeros((len(gap_error), gap_error.shape[1] + 1))
        np.cumsum(gap_error[:, ::-1], axis=1, out=behind[:, -2::-1])
        behind += seen["reference_error"][:, np.newaxis]
        if "attacker_index" not in seen:
            return behind
        agents = np.broadcast_to(np.arange(len(self.agents)), (len(seen), len(self.agents)))  # no seized vehicle is one
        seats = seen["attacker_index"].reshape(len(seen), -1)
        for seat in range(seats.shape[1]):
            agents = agents + (agents >= seats[:, seat, np.newaxis] - 1.5)
        found: FloatArray = np.take_along_axis(behind, agents, axis=1)
        return found

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The controllers (B, 2 A), all plain, from (B, A)."""
        return super().act(seen, state, np.stack([actions, np.full_like(actions, PLAIN)], axis=-1))


def compressed_field(name: str, far_m: float = FAR_M) -> Field:
    """The field of a compressed error, by its name one in m or something in m/s."""
    unit, far = ("m", far_m) if name.endswith("error") else ("m/s", FAST_MPS)
    high = float(compressed(np.array(far)))
    return Field(name, "-", -high, high, (), f"arsinh of the error in {NEAR:g} {unit}")


def range_field(name: str, unit: str, drawn_from: Range, meaning: str) -> Field:
    """The field of something that episodes draw; without entries where it is always the same."""
    low, high = bounds(drawn_from)
    return Field(name, unit, low, high, (), meaning) if low < high else Field(name, unit, low, low + 1, (0,))


def encoded(fields: Fields, columns: dict[str, FloatArray], seen: Seen) -> Observation:
    """Rows (K, m) of fields: given columns (K,), the others as they are seen."""
    names = [field.name for field in fields if field.size]
    return fields.encode(np.stack([columns[name] if name in columns else seen[name] for name in names], axis=1))


def team_of(seen: Seen) -> Observation:
    """The own rows of the vehicles, (B, A, m)."""
    assert seen.team is not None  # adapters that are `local` are shown it
    return seen.team
