"""The rogue-vehicle game: B platoons, an attacker who drives one vehicle, a defender who drives the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.generators import drawing
from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import records, unpack
from cps_envs.core.declare.columns import ActionColumn, counted, numbered
from cps_envs.core.declare.measures import Measure, measures_of
from cps_envs.core.declare.places import halves_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.game import Adapters, Game
from cps_envs.core.policies.inside import InsidePhysics
from cps_envs.core.policies.team import Team
from cps_envs.core.types import ROLES, Array, BoolArray, FloatArray, IntArray, Observation, Role
from cps_envs.rogue import inside
from cps_envs.rogue.actions import PLAIN, choices_of, command_limits, order_space, read_choices, read_levels
from cps_envs.rogue.adapters import Effort, Vehicle, VehicleFull
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import COMMANDED, CONTROLLERS
from cps_envs.rogue.fields import attacker_fields, defender_fields
from cps_envs.rogue.give_way import GiveWay, GiveWayVehicle
from cps_envs.rogue.moves import step
from cps_envs.rogue.observation import observe_attacker, observe_defender
from cps_envs.rogue.payoff import HIDDEN_ONLY, PAYOFF_PARTS, Metrics
from cps_envs.rogue.picture.scene import Scene, scene_of
from cps_envs.rogue.privileged import Truth
from cps_envs.rogue.start import Where, builds_of, chances_of, ranges_of, start_episodes
from cps_envs.rogue.state import NEVER, Drawn, State, allocate, rules_of
from cps_envs.rogue.swarm import SeizedTeam, VehicleTeam

KERNELS = {"attacker": observe_attacker, "defender": observe_defender}


class RogueGame(Game):
    """A game step is a control period of 0.1 s; the vehicles' controllers run inside it at every integration step.

    Attacker: Box (k,) for k seized vehicles from the rear, one in most configurations, set at each decision and held:
    -1 is full braking effort, 0 the effort that keeps the present speed, 1 full driving effort.
    Defender, `defense_action="mode"`: MultiDiscrete, for each intact vehicle from the rear its controller
    (`controllers.CONTROLLERS`) and whether following is modified: growing separation, authority (5.12). `"command"`:
    Box (n - 1,), accelerations. `"either"`: MultiDiscrete with `actions.LEVELS` of them after the controllers.
    With `orders="all"` for each vehicle: the seized one ignores its own from the onset on.

    Payoff: the increase of the damage D (5.8), plus w times the increase of the formation cost, or what `payoff` says.
    Nothing terminates.
    """

    name = "rogue"
    threaded = True
    measures: ClassVar[Mapping[str, Measure]] = measures_of(Metrics)
    adapters: ClassVar[Adapters] = {
        "attacker": {"effort": Effort},
        "defender": {
            "give_way": GiveWay,
            "give_way_vehicle": GiveWayVehicle,
            "vehicle": Vehicle,
            "vehicle_full": VehicleFull,
        },
    }

    def __init__(self, config: RogueConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config: RogueConfig = config
        self.horizon = round(config.duration_s / config.control_period_s)
        self.step_s = config.control_period_s
        self.decision_interval = {"attacker": round(config.attack_hold_s / config.control_period_s), "defender": 1}
        self.fields = {"attacker": attacker_fields(config), "defender": defender_fields(config)}
        ordered = config.num_orders
        self.modes = choices_of(config) > 0
        defense = order_space(config, ordered)
        self.action_space = {"attacker": spaces.Box(-1.0, 1.0, (config.num_seized,), np.float32), "defender": defense}
        plain = np.tile([CONTROLLERS.index(config.neutral_controller), PLAIN], ordered)
        still = plain if self.modes else np.zeros(ordered)
        self.neutral_action = {"attacker": np.zeros(config.num_seized), "defender": still}
        self.payoff_parts = PAYOFF_PARTS
        self.rules = rules_of(config)
        self._draw_from(config)
        self._limits = command_limits(config)
        self.state: State = allocate(num_envs, config.max_vehicles, config.num_bodies)
        self._places, self._leader_mps = config.places, config.leader_mps
        self.drawn, self._scores = records(Drawn, num_envs), records(Metrics, num_envs)
        self._held, self._episodes = hold(self.state), np.zeros(num_envs, np.int64)
        self._neutral = {role: np.stack([action] * num_envs) for role, action in self.neutral_action.items()}
        self._orders = np.full((num_envs, ordered, 2), (COMMANDED, 0))
        self._usual = self._moves(self._neutral["defender"])
        self._measured = tuple(name for name in Metrics._fields if config.hidden or name not in HIDDEN_ONLY)
        self.pay_as_configured()

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        self._episodes[envs] += 1
        halves = halves_of(generators, envs) if self.config.has_cycle else self._episodes
        given = (self._chances, self._ranges, self._builds, self.rules, self._places, halves, self._leader_mps)
        with drawing(generators, np.flatnonzero(envs)) as streams:
            start_episodes(self._held, self.drawn, self._scores, streams, envs, *given)

    def _draw_from(self, drawn: RogueConfig) -> None:
        self._ranges, self._chances, self._builds = ranges_of(drawn), chances_of(drawn), hold(builds_of(drawn))

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        attack = actions.get("attacker", self._neutral["attacker"])
        ordered = self._moves(actions["defender"]) if "defender" in actions else self._usual
        moves, payoff = (attack, *ordered), np.zeros(self.num_envs)
        given = (self._held, self.drawn, self.rules, self._leader_mps, moves)
        self.threads.run(lambda mine: step(*given, mine, num_steps, self._scores, payoff), envs, num_steps)
        return payoff

    def _moves(self, action: Array) -> tuple[IntArray, FloatArray]:
        """Controllers (B, k, 2) and accelerations (B, k) in m/s2 of the k vehicles that get orders."""
        orders, accelerations = self._orders, np.empty(self._orders.shape[:2])
        if self.modes:
            orders = np.empty_like(orders)
            read_choices(action, self._limits, orders, accelerations)
        else:
            read_levels(action, self._limits, accelerations)
        return orders, accelerations

    def observe(self, role: Role) -> Observation:
        """See `fields.attacker_fields` and `fields.defender_fields`."""
        fields = self.fields[role]
        encoded = np.empty((self.num_envs, fields.size), np.float32)
        KERNELS[role](self._held, self.drawn, self.rules, fields.offsets, fields.scale, encoded)
        return encoded

    def metrics(self) -> dict[str, Array]:
        """`payoff.Metrics` so far, each (B,)."""
        return {name: self._scores[name] for name in self._measured}

    def episode_metrics(self, b: int) -> dict[str, float]:
        """`metrics` of one episode as Python numbers."""
        found = dict(zip(Metrics._fields, self._scores.item(b)))  # noqa: B905, strict costs a microsecond
        return found if self.config.hidden else {name: found[name] for name in self._measured}

    def parts(self) -> tuple[Array, ...]:
        """See the base class."""
        return (*self.state, self.drawn, self._scores)

    def truth(self, b: int) -> dict[str, Any]:
        """Privileged: `seat` (0 = rear), `onset_s` (inf without an attack) and `power_ratio` of an episode.

        Of several seized vehicles `seat` is the rearmost; `seats` (k,) are all.
        """
        c = unpack(Drawn, self.drawn, b)
        onset_s = c.onset_step * self.config.dt_s if c.onset_step < NEVER else np.inf
        power_ratio, seats = c.attacker_drive_mps2 / c.drive_mps2, np.flatnonzero(self.state.rogue[b])
        return {"seat": c.attacker, "seats": seats, "onset_s": onset_s, "power_ratio": power_ratio}

    def privileged(self, role: Role) -> Observation:
        """See `privileged.Truth`."""
        truth = Truth(self.config, self._held, self.drawn)
        return truth.attacker() if role == "attacker" else truth.defender()

    def scene(self, b: int) -> Scene:
        """What the viewer draws of an episode."""
        return scene_of(self.state, self.drawn, b, self.config, self.episode_metrics(b))

    def inside(self) -> InsidePhysics:
        """See the base class."""
        if self.config.has_cycle:
            raise ConfigurationError(
                'episodes that follow a leader\'s series do not play on a GPU: leave device = "cuda" out, or give '
                "leader_speed_mps up"
            )
        shown = [inside.Shown(self.fields[role].offsets, self.fields[role].scale) for role in ROLES]
        held = inside.Held(
            self._held,
            self.drawn,
            self._scores,
            self.rules,
            self._chances,
            self._ranges,
            self._builds,
            Where(self._places.first, self._places.counts),
            self._episodes,
            self._leader_mps,
            np.array(self._limits),
            self._orders.copy(),
            self._usual[1].copy(),
            *shown,
        )
        advance = inside.advance if self.modes else inside.advance_commanded
        shows: dict[Role, Any] = {"attacker": inside.show_attacker, "defender": inside.show_defender}
        return InsidePhysics(held, inside.reset, advance, shows)

    def columns(self, role: Role) -> tuple[ActionColumn, ...]:
        """The effort of each seized vehicle, or the orders of the others."""
        if role == "attacker":
            seats = self.config.attacker_indices
            efforts = [f"effort_{seat}" for seat in seats] or ["effort"]
            return numbered(efforts, "-", "-1 brakes fully, 0 keeps the speed, 1 drives fully")
        count = self.config.num_orders
        if not self.modes:
            braking, driving = self._limits
            return numbered(counted("command_mps2", count), "m/s2", "from the rear", driving, below=braking)
        pairs = [f"{name}_{k}" for k in range(1, count + 1) for name in ("controller", "modified")]
        names = ", ".join(f"{place} {name}" for place, name in enumerate(CONTROLLERS))
        return numbered(pairs, "-", f"from the rear; controllers: {names}, then levels")

    def team(self, role: Role) -> Team:
        """The defender as one agent for each vehicle that gets orders, several attackers as one for each of them."""
        if role == "defender":
            return VehicleTeam(self.config, self._held, self.drawn, self.rules, self._episodes)
        return SeizedTeam(self.config, self._held, self.drawn)
