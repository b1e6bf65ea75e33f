"""A problem of your own in one file: a water tank whose level sensor an attacker can bias.

A pump holds the level of a leaking tank at a set-point. The attacker biases the level sensor. The defender decides
whether the pump's observer believes that sensor, or trusts its model of the tank, which knows nothing of the leak.

    python examples/own_problem.py                             # plays each attacker against each defender
    PYTHONPATH=examples cps-envs --trust play own_problem:TANK --render tank.gif  # --trust: this runs your own code
    gymnasium.make("own_problem:own_problem/TankDefense-v0")   # with examples/ on the path; also TankAttack-v0
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import sqrt
from typing import NamedTuple

import numpy as np
from gymnasium import spaces

import cps_envs
from cps_baselines import Family, between
from cps_envs import (
    AnalyticPolicy,
    CanvasViewer,
    Field,
    Fields,
    Game,
    Problem,
    RoleSpec,
    Seen,
    borrowed,
    clip,
    config,
    declare,
    encode_row,
    inlined,
    kernel,
    pack,
    play_episodes,
    records,
    register,
    types,
    unpack,
    view,
)

AREA_M2, OUTLET_M2, PUMP_M3PS, TWICE_GRAVITY, STEPS_PER_SECOND = 0.1, 0.002, 0.02, 19.62, 10
Moves = tuple[types.Array, ...]  # the attacker's bias (B, 1) in [-1, 1]; the defender's choice (B,), 0 to believe


@dataclass(frozen=True)
class TankConfig:
    """Every number with its unit, its bounds and its source. A ranged one may be a pair, from which resets draw."""

    duration_s: int = config.quantity(120, unit="s", low=10, high=3600, source="chosen")
    set_point_m: config.Range = config.quantity(1.0, unit="m", low=0.5, high=1.1, source="chosen", ranged=True)
    leak_m2: config.Range = config.quantity(
        0.0002, unit="m2", low=0, high=0.001, source="chosen; unknown to the model", ranged=True
    )
    height_m: float = config.quantity(1.25, unit="m", low=1.2, high=5, source="chosen")
    gain_per_m: float = config.quantity(4.0, unit="1/m", low=0, high=100, source="chosen: of the valve")
    correction_per_s: float = config.quantity(0.5, unit="1/s", low=0, high=5, source="chosen: of the observer")
    max_bias_m: float = config.quantity(0.3, unit="m", low=0, high=1, source="chosen: the attacker's reach")
    flood_fee_ms: float = config.quantity(30.0, unit="m s", low=0, high=1000, source="chosen: price of an overflow")

    def __post_init__(self) -> None:
        config.validate(self)


class Tanks(NamedTuple):
    """The state: arrays with a leading axis of B environments."""

    step: types.IntArray  # (B,) integration steps done
    level: types.FloatArray  # (B,) m
    estimate: types.FloatArray  # (B,) m, the observer's
    reading: types.FloatArray  # (B,) m, what the sensor says
    valve: types.FloatArray  # (B,) opening, 0 to 1
    set_point: types.FloatArray  # (B,) m, drawn at the start of an episode
    leak: types.FloatArray  # (B,) m2, drawn
    flooded: types.BoolArray  # (B,) ended by running over


class Rules(NamedTuple):
    """What is the same in every episode."""

    height_m: float
    gain_per_m: float
    correction_per_s: float
    max_bias_m: float
    flood_fee_ms: float
    duration_s: int


class Metrics(NamedTuple):
    """What is measured; the attacker is paid the increase of both."""

    error_ms: float  # m s, integral of the level's distance from its set-point
    flood_fee_ms: float  # m s, once the tank has run over


@kernel
def step(
    tanks: Tanks,
    rules: types.Array,
    moves: Moves,
    envs: types.BoolArray,
    seconds: int,
    scores: types.Array,
    paid: types.FloatArray,
) -> None:
    """Move the marked tanks (B,) by whole seconds, and write what the attacker is paid (B,)."""
    r, (bias, choice) = unpack(Rules, rules, 0), moves
    for b in range(envs.size):
        if envs[b]:
            tank, score = view(tanks, b), scores[b]
            before = score.error_ms + score.flood_fee_ms
            for _ in range(seconds * STEPS_PER_SECOND):
                if not tank.flooded[0]:
                    flow(tank, r.max_bias_m * bias[b, 0], choice[b] == 0, r)
                    score.error_ms += abs(tank.level[0] - tank.set_point[0]) / STEPS_PER_SECOND
                    if tank.level[0] >= r.height_m:
                        tank.flooded[0], score.flood_fee_ms = True, r.flood_fee_ms
            paid[b] = score.error_ms + score.flood_fee_ms - before


@inlined
def flow(tank: Tanks, bias_m: float, trusted: bool, r: Rules) -> None:
    """One integration step of the tank, the sensor, the observer and the valve."""
    dt_s, inflow = 1.0 / STEPS_PER_SECOND, PUMP_M3PS * tank.valve[0]
    outflow = (OUTLET_M2 + tank.leak[0]) * sqrt(TWICE_GRAVITY * tank.level[0])
    tank.level[0] = max(0.0, tank.level[0] + dt_s * (inflow - outflow) / AREA_M2)
    tank.reading[0] = tank.level[0] + bias_m
    change = (inflow - OUTLET_M2 * sqrt(TWICE_GRAVITY * tank.estimate[0])) / AREA_M2
    if trusted:
        change += r.correction_per_s * (tank.reading[0] - tank.estimate[0])
    tank.estimate[0] = max(0.0, tank.estimate[0] + dt_s * change)
    balance = OUTLET_M2 * sqrt(TWICE_GRAVITY * tank.set_point[0]) / PUMP_M3PS
    tank.valve[0] = clip(balance + r.gain_per_m * (tank.set_point[0] - tank.estimate[0]), 0.0, 1.0)
    tank.step[0] += 1


def tank_fields(config: TankConfig) -> Fields:
    """What both roles observe; only the attacker sees the true level."""
    reach_m = 2 * config.height_m
    return Fields(
        Field("level", "m", -reach_m, reach_m, (), "true for the attacker; as the sensor says for the defender"),
        Field("estimate", "m", 0, reach_m, (), "of the observer"),
        Field("set_point", "m", 0, config.height_m, (), "where the level ought to be"),
        Field("time_left_s", "s", 0, config.duration_s, (), "until the end of the episode"),
    )


@kernel
def observe(
    tanks: Tanks,
    rules: types.Array,
    true: bool,
    offsets: types.Array,
    scale: types.FloatArray,
    encoded: types.Observation,
) -> None:
    """Fill the observations (B, size) of a role."""
    at, row, r = offsets[0], np.empty(scale.shape[1]), unpack(Rules, rules, 0)
    for b in range(encoded.shape[0]):
        tank = view(tanks, b)
        row[at.level] = tank.level[0] if true else tank.reading[0]
        row[at.estimate], row[at.set_point] = tank.estimate[0], tank.set_point[0]
        row[at.time_left_s] = r.duration_s - tank.step[0] / STEPS_PER_SECOND
        encode_row(borrowed(row), borrowed(scale), borrowed(encoded)[b])


class TankGame(Game):
    """B tanks. A game step is a second, and both roles decide in each."""

    name = "tank"
    threaded = True

    def __init__(self, config: TankConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config, self.horizon, self.step_s = config, config.duration_s, 1.0
        self.decision_interval = {"attacker": 1, "defender": 1}
        self.fields = {"attacker": tank_fields(config), "defender": tank_fields(config)}
        self.action_space = {"attacker": spaces.Box(-1.0, 1.0, (1,), np.float32), "defender": spaces.Discrete(2)}
        self.neutral_action = {"attacker": np.zeros(1), "defender": np.array(0)}
        self.payoff_parts = ("error_ms", "flood_fee_ms")
        level, estimate, reading, valve, set_point, leak = (np.zeros(num_envs) for _ in range(6))
        whole = np.zeros(num_envs, np.int64)
        self.tanks = Tanks(whole, level, estimate, reading, valve, set_point, leak, self.terminated)
        self.scores = records(Metrics, num_envs)
        self.rules = pack(Rules(**{name: getattr(config, name) for name in Rules._fields}))
        self.neutral = {role: np.array([action] * num_envs) for role, action in self.neutral_action.items()}
        self._draw_from(config)

    def _draw_from(self, drawn: TankConfig) -> None:
        """Draw from these ranges: those of the configuration, or others that a reset names in its options."""
        self.ranges = config.bounds(drawn.set_point_m), config.bounds(drawn.leak_m2)

    def _reset(self, envs: types.BoolArray, generators: Sequence[np.random.Generator]) -> None:
        for array in (*self.tanks, self.scores):
            array[envs] = 0
        for b in np.flatnonzero(envs).tolist():
            self.tanks.set_point[b], self.tanks.leak[b] = (generators[b].uniform(*ends) for ends in self.ranges)
        for level in (self.tanks.level, self.tanks.estimate, self.tanks.reading):
            level[envs] = self.tanks.set_point[envs]

    def _advance(
        self, actions: Mapping[types.Role, types.Array], envs: types.BoolArray, num_steps: int
    ) -> types.FloatArray:
        moves = tuple(actions.get(role, self.neutral[role]) for role in types.ROLES)
        given, paid = (num_steps, self.scores), np.zeros(self.num_envs)
        self.threads.run(lambda mine: step(self.tanks, self.rules, moves, mine, *given, paid), envs, num_steps)
        return paid

    def observe(self, role: types.Role) -> types.Observation:
        """See `tank_fields`."""
        fields = self.fields[role]
        encoded = np.empty((self.num_envs, fields.size), np.float32)
        observe(self.tanks, self.rules, role == "attacker", fields.offsets, fields.scale, encoded)
        return encoded

    def metrics(self) -> dict[str, types.Array]:
        """`Metrics` so far, each (B,)."""
        return {name: self.scores[name] for name in Metrics._fields}

    def scene(self, b: int) -> types.FloatArray:
        """What the viewer draws: level, estimate, set-point and height, m."""
        tanks = self.tanks
        return np.array([tanks.level[b], tanks.estimate[b], tanks.set_point[b], self.config.height_m])


class Viewer(CanvasViewer):
    """The tank, its set-point in green and what the observer believes in red."""

    size = (240, 240)

    def draw(self, scene: types.FloatArray) -> None:
        """Draw a scene on the canvas."""
        canvas = self._canvas
        level, estimate, set_point, height = (200 * scene / scene[-1]).tolist()
        canvas.fill((250, 250, 250))
        canvas.box((60, 220 - level, 120, level), (96, 160, 224))
        canvas.box((60, 220 - height, 120, height), (60, 60, 60), border=2)
        for mark, color in ((set_point, (40, 140, 60)), (estimate, (210, 40, 40))):
            canvas.box((50, 220 - mark, 140, 2), color)


class Bias(AnalyticPolicy):
    """The sensor reads too low, at once or slowly, so that the pump overfills the tank."""

    def __init__(self, spec: RoleSpec, rise_s: float = 1.0) -> None:
        super().__init__(spec)
        self.rise_s = rise_s  # until the bias is as large as it can be

    def act(self, seen: Seen, state: types.State) -> tuple[types.Array, types.State]:
        """The bias (B, 1)."""
        gone_s = self.spec.config.duration_s - seen["time_left_s"]
        return -np.minimum((gone_s + 1.0) / self.rise_s, 1.0)[:, np.newaxis], state


class Doubt(AnalyticPolicy):
    """Believes the sensor only while it is near the estimate."""

    def __init__(self, spec: RoleSpec, threshold_m: float = 0.1) -> None:
        super().__init__(spec)
        self.threshold_m = threshold_m

    def act(self, seen: Seen, state: types.State) -> tuple[types.Array, types.State]:
        """The choice (B,)."""
        return (np.abs(seen["level"] - seen["estimate"]) > self.threshold_m).astype(np.int64), state


PLAYERS: Mapping[types.Role, str] = {"attacker": f"{__name__}:Bias", "defender": f"{__name__}:Doubt"}
# Numbers that `cps-envs best-response --oracle search` may change, and their bounds.
BIAS = Family(f"{__name__}:TANK", "attacker", PLAYERS["attacker"], between({"rise_s": (1.0, 60.0)}))
DOUBT = Family(f"{__name__}:TANK", "defender", PLAYERS["defender"], between({"threshold_m": (0.0, 0.5)}))
TANK = Problem(
    name="tank",
    version=0,
    summary="An attacker biases the level sensor of a tank; the defender decides when to believe it.",
    presets={"paper": TankConfig(), "learning": TankConfig(set_point_m=(0.8, 1.0), leak_m2=(0.0, 0.0004))},
    game=TankGame,
    fields={"attacker": tank_fields, "defender": tank_fields},
    opponents={"paper": PLAYERS, "learning": PLAYERS},  # who plays the role that you do not
    viewer=f"{__name__}:Viewer",
    namespace="own_problem",
    unit="m s",
)
PAGE = "{}, every second.\n\n## Observation Space\n{{observation_table}}\n\n## Arguments\n{{parameter_table}}"
ATTACK = PAGE.format("Flood the tank. `Box(-1, 1, (1,))`: the bias of its level sensor")
DEFENSE = PAGE.format("Hold the level. `Discrete(2)`: believe the level sensor (0) or not (1)")
forms = declare(TANK, __name__, attack=ATTACK, defense=DEFENSE, rhythm="every second")
TankAttackEnv, TankAttackVectorEnv = forms.attack
TankDefenseEnv, TankDefenseVectorEnv = forms.defense
parallel_env, env = forms.parallel_env, forms.env
register(TANK, __name__)


def main() -> None:
    """Play each attacker against each defender, and print the mean payoff of 32 episodes."""
    cps_envs.trust()  # the names below are those of code of our own
    attackers, defenders = ("none", "Bias", "Bias?rise_s=60"), ("none", "Doubt", "Doubt?threshold_m=0.02")
    for attacker, defender in product(attackers, defenders):
        names = [name if name == "none" else f"{__name__}:{name}" for name in (attacker, defender)]
        players: dict[types.Role, str] = {"attacker": names[0], "defender": names[1]}
        found = play_episodes(TANK, TANK.presets["learning"], players, range(32))
        print(f"{attacker:>14} against {defender:<22} {found['return'].mean():5.1f} m s")


if __name__ == "__main__":
    main()
