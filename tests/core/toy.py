"""A toy problem that knows nothing of vehicles: an intruder heads for a beacon, two axes of a guard try to catch it.

It has what the real problems have between them: a random start and random drift in each step, a Discrete role with
masks that decides every third step, a Box role that decides every step, an end by physics, and a team of two agents.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.config import Range, bounds, quantity, validate
from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.game.game import Game
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.env import RoleEnv
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.policies.team import Team
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation, Role, State

MOVES = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)], float)
ARENA = 4.0


@dataclass(frozen=True)
class ToyConfig:
    duration_s: float = quantity(12.0, unit="s", low=3, high=600, source="chosen; a multiple of 3")
    intruder_speed: Range = quantity(0.5, unit="m/s", low=0.1, high=2, source="chosen", ranged=True)
    guard_speed: float = quantity(0.6, unit="m/s", low=0, high=5, source="chosen")
    reach_m: float = quantity(0.3, unit="m", low=0, high=2, source="chosen")
    drift: float = quantity(0.05, unit="m", low=0, high=1, source="chosen")
    catch_fee: float = quantity(0.5, low=0, high=10, source="chosen")
    mood: str = quantity("calm", choices=("calm", "brisk"), source="chosen")

    def __post_init__(self) -> None:
        validate(self)


def position_fields(config: ToyConfig) -> Fields:
    return Fields(
        Field("own", "m", -ARENA, ARENA, (2,), "own position"),
        Field("rival", "m", -ARENA, ARENA, (2,), "the rival's position"),
        Field("time_s", "s", 0, config.duration_s),
    )


def axis_fields(config: ToyConfig) -> Fields:
    return Fields(Field("own", "m", -ARENA, ARENA), Field("rival", "m", -ARENA, ARENA))


AXES = ("axis_0", "axis_1")


class Axes(Adapter):
    """One agent per axis of the guard's velocity."""

    local = True

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.agents, self.fields = AXES, axis_fields(spec.config)
        self.action_space, self.neutral_action = spaces.Box(-1.0, 1.0, (1,), np.float32), np.zeros(1)

    def observe(self, seen: Seen, state: State) -> Observation:
        assert seen.team is not None
        return seen.team.copy()

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        return actions[..., 0], state


class AxisTeam(Team):
    """What each axis sees by itself."""

    def __init__(self, game: ToyGame) -> None:
        self._game, self.agents, self._fields = game, AXES, axis_fields(game.config)

    def observe(self) -> Observation:
        values = np.stack([self._game.guard, self._game.intruder], axis=-1)
        return self._fields.encode(values.reshape(-1, 2)).reshape(values.shape)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        return np.repeat(-payoff[:, np.newaxis] / 2, 2, axis=1)


class ToyGame(Game):
    """Steps of 1 s; payoff: closeness of the intruder to the beacon at the origin, minus a fee when it is caught."""

    name = "toy"
    threaded = True
    adapters: Any = {"defender": {"axis": Axes}}

    def __init__(self, config: ToyConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config = config
        self.horizon, self.step_s = round(config.duration_s), 1.0
        self.decision_interval = {"attacker": 3, "defender": 1}
        self.fields = {"attacker": position_fields(config), "defender": position_fields(config)}
        self.action_space = {"attacker": spaces.Discrete(5), "defender": spaces.Box(-1.0, 1.0, (2,), np.float32)}
        self.neutral_action = {"attacker": np.int64(0), "defender": np.zeros(2)}
        self.payoff_parts = ("closeness", "fee")
        self.intruder, self.guard = np.zeros((num_envs, 2)), np.zeros((num_envs, 2))
        self.speed, self.steps = np.zeros(num_envs), np.zeros(num_envs, np.int64)
        self.closeness, self.fee = np.zeros(num_envs), np.zeros(num_envs)
        self.generators: list[np.random.Generator | None] = [None] * num_envs
        self._draw_from(config)

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        for b in np.flatnonzero(envs):
            generator = self.generators[b] = generators[b]
            self.intruder[b], self.guard[b] = generator.uniform(-3, 3, 2), generator.uniform(-1, 1, 2)
            self.speed[b] = generator.uniform(*self.drawn_speed)
        for array in (self.steps, self.closeness, self.fee):
            array[envs] = 0

    def _draw_from(self, drawn: ToyConfig) -> None:
        self.drawn_speed = bounds(drawn.intruder_speed)

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        before = self.closeness + self.fee
        moves = MOVES[actions.get("attacker", np.zeros(self.num_envs, np.int64))]
        pushes = actions.get("defender", np.zeros((self.num_envs, 2)))
        self.threads.run(lambda mine: self._move(moves, pushes, mine, num_steps), envs, num_steps)
        return self.closeness + self.fee - before

    def _move(self, moves: Array, pushes: Array, envs: BoolArray, num_steps: int) -> None:
        for _ in range(num_steps):
            for b in np.flatnonzero(envs & ~self.terminated):
                self._step(b, moves[b], pushes[b])

    def _step(self, b: int, move: Array, push: Array) -> None:
        drift = self.config.drift * self.generators[b].standard_normal(2)
        self.intruder[b] = np.clip(self.intruder[b] + self.speed[b] * move + drift, -ARENA, ARENA)
        self.guard[b] = np.clip(self.guard[b] + self.config.guard_speed * push, -ARENA, ARENA)
        self.steps[b] += 1
        self.closeness[b] += 1.0 - np.abs(self.intruder[b]).max() / ARENA
        if np.linalg.norm(self.intruder[b] - self.guard[b]) < self.config.reach_m:
            self.fee[b] -= self.config.catch_fee
            self.terminated[b] = True

    def observe(self, role: Role) -> Observation:
        own, rival = (self.intruder, self.guard) if role == "attacker" else (self.guard, self.intruder)
        return self.fields[role].encode(np.column_stack([own, rival, self.steps * self.step_s]))

    def action_mask(self, role: Role) -> BoolArray | None:
        """Moves that would leave the arena are illegal."""
        if role == "defender":
            return None
        there = self.intruder[:, np.newaxis] + self.speed[:, np.newaxis, np.newaxis] * MOVES
        due = (self.elapsed % 3 == 0)[:, np.newaxis]
        mask = (np.abs(there) <= ARENA).all(axis=-1) & due
        mask[:, 0] = True
        return mask

    def metrics(self) -> dict[str, Array]:
        distance = np.linalg.norm(self.intruder - self.guard, axis=1)
        return {"closeness": self.closeness, "fee": self.fee, "distance_m": distance}

    def team(self, role: Role) -> Team:
        return AxisTeam(self) if role == "defender" else super().team(role)

    def scene(self, b: int) -> Any:
        return self.intruder[b].copy(), self.guard[b].copy()


class ToyViewer:
    """Two bright pixels on a dark square."""

    def __init__(self, config: ToyConfig) -> None:
        self.size = 32

    def frame(self, scene: tuple[FloatArray, FloatArray]) -> Array:
        picture = np.zeros((self.size, self.size, 3), np.uint8)
        for channel, place in enumerate(scene):
            x, y = ((place + ARENA) / (2 * ARENA) * (self.size - 1)).astype(int)
            picture[y, x, channel] = 255
        return picture


TOY = Problem(
    name="toy",
    version=0,
    summary="An intruder and a guard.",
    presets={"paper": ToyConfig(), "learning": ToyConfig(intruder_speed=(0.3, 0.9))},
    game=ToyGame,
    fields={"attacker": position_fields, "defender": position_fields},
    opponents={
        "paper": {"attacker": "tests.core.toy_policies:Approach", "defender": "tests.core.toy_policies:Chase"},
        "learning": {"attacker": "tests.core.toy_policies:Wander", "defender": "cps_envs.core.policies.policy:Idle"},
    },
    viewer="tests.core.toy:ToyViewer",
    swarm={"defender": "axis"},
    cost="closeness",
    cost_limit=6.0,
    namespace="toys",
)


class ToyAttackEnv(RoleEnv):
    """Reach the beacon. {observation_table} {parameter_table}"""

    problem, role = TOY, "attacker"


class ToyDefenseEnv(RoleEnv):
    """Catch the intruder. {observation_table}"""

    problem, role = TOY, "defender"


class ToyAttackVectorEnv(RoleVectorEnv):
    problem, role = TOY, "attacker"


class ToyDefenseVectorEnv(RoleVectorEnv):
    problem, role = TOY, "defender"


for _side in ("Attack", "Defense"):
    if f"toys/Toy{_side}-v0" not in gymnasium.registry:
        gymnasium.register(
            f"toys/Toy{_side}-v0",
            entry_point=f"{__name__}:Toy{_side}Env",
            vector_entry_point=f"{__name__}:Toy{_side}VectorEnv",
        )
