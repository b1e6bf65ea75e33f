"""Faulty versions of the toy problem, one for each thing that the conformance checks are there to find."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import gymnasium
import numpy as np

from cps_envs.core.conformance import Subject
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv, RolesVectorEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv, SwarmVectorEnv
from cps_envs.core.types import Role
from tests.core.toy import (
    TOY,
    AxisTeam,
    ToyAttackEnv,
    ToyAttackVectorEnv,
    ToyDefenseEnv,
    ToyDefenseVectorEnv,
    ToyGame,
)

SINGLE = {"attacker": ToyAttackEnv, "defender": ToyDefenseEnv}
BATCH = {"attacker": ToyAttackVectorEnv, "defender": ToyDefenseVectorEnv}
MUTANTS: dict[str, list[Callable[[], Subject]]] = {}


def of(role: Role = "attacker", **parts: Any) -> Subject:
    """The healthy toy with some of its classes replaced; `game` and `viewer` replace parts of the problem."""
    changes = {name: parts.pop(name) for name in ("game", "viewer") if name in parts}
    problem = replace(TOY, **changes)
    members = {"problem": problem, "role": role}
    single = type("Single", (parts.pop("single_class", SINGLE[role]),), dict(members))
    batch = type("Batch", (parts.pop("vector_class", BATCH[role]),), dict(members))
    return Subject(single, batch, **{"kwargs": {"preset": "learning"}, **parts})


def mutant(*checks: str, role: Role = "attacker", part: str = "game", **kwargs: Any) -> Callable[[type], type]:
    """Register a class as a mutant that these checks have to find."""

    def add(cls: type) -> type:
        for check in checks:
            MUTANTS.setdefault(f"check_{check}", []).append(lambda: of(role, **{part: cls}, **kwargs))
        return cls

    return add


def wrong(method: str, instead: Callable[..., Any], *checks: str, part: str = "game", role: Role = "attacker") -> None:
    """Register a mutant: `instead(itself, the toy's own method, *arguments)` takes the place of a method."""
    base: Any = {
        "game": ToyGame,
        "single_class": SINGLE[role],
        "vector_class": BATCH[role],
        "parallel_class": RolesParallelEnv,
        "swarm_class": SwarmEnv,
    }[part]
    real = getattr(base, method)

    def replaced(self: Any, *args: Any, **kwargs: Any) -> Any:
        return instead(self, partial(real, self), *args, **kwargs)

    mutant(*checks, role=role, part=part)(type(f"Wrong{method}", (base,), {method: replaced}))


class DeadAxes(AxisTeam):
    def observe(self) -> Any:
        return super().observe() * np.array([1, 0], np.float32)


SINGLY, BATCHED, PAIRED = {"part": "single_class"}, {"part": "vector_class"}, {"part": "parallel_class"}
wrong("action_space", lambda env, real, agent: gymnasium.spaces.Discrete(5), "pettingzoo", **PAIRED)  # a new one
wrong("_step", lambda game, real, *to: (np.random.random(), real(*to)), "global_random_state")
wrong(  # another state, whatever earlier tests have seeded
    "_reset", lambda game, real, *to: (random.seed(random.random()), real(*to)), "global_random_state"
)
wrong("step", lambda env, real, actions: real({**actions, "attacker_0": 0}), "parallel", **PAIRED)  # it is lost
wrong(  # a bonus per call: a decision of three steps gets it once, three steps get it three times
    "_advance", lambda game, real, actions, envs, steps: real(actions, envs, steps) + 0.01 * envs, "parallel", "return"
)
wrong("_advance", lambda game, real, *to: 2 * real(*to), "return")
wrong(  # every game step counts, not only those at which the attacker decides
    "step",
    lambda env, real, actions: (setattr(env._batch.hands["attacker"], "interval", 1), real(actions))[1],
    "held_actions",
    **PAIRED,
)
wrong(
    "step",
    lambda env, real, actions: (env.game.advance({}, np.ones(1, np.bool_), 1), real(actions))[1],
    "swarm",
    part="swarm_class",
    role="defender",
)
wrong("metrics", lambda game, real: {name: values.sum() for name, values in real().items()}, "declaration")
wrong(  # all environments, whatever the mask says
    "_reset_mask",
    lambda env, real, options: (real(options), np.ones(env.num_envs, np.bool_))[1],
    "reset_mask",
    "autoreset",
    **BATCHED,
)
wrong(  # takes any mask
    "_reset_mask",
    lambda env, real, options: np.resize(np.asarray((options or {}).get("reset_mask", [1]), np.bool_), env.num_envs),
    "reset_mask",
    **BATCHED,
)
wrong(
    "__init__",
    lambda env, real, num_envs=1, max_episode_steps=None, **to: real(num_envs, reach_m=0.0, **to),
    "time_limit",
    role="defender",
    **BATCHED,
)
wrong("observe", lambda game, real, role: 2 * real(role), "observations")
wrong("team", lambda game, real, role: DeadAxes(game), "live_swarm", role="defender")
wrong("__init__", lambda game, real, *to: (real(*to), setattr(game, "horizon", 11))[1], "endings")  # no multiple of 3
wrong("_check_running", lambda env, real: None if env._generators else env.reset() and None, "reset_needed", **BATCHED)
wrong("_check_end", lambda *ignored: None, "horizon")
wrong("_check_end", lambda game, real, *to: (game._advance({}, *to), real(*to)), "horizon")  # looks too late
wrong("__init__", lambda env, real, frame_skip=1, **to: real(**to), "frame_skip", **SINGLY)
wrong(
    "__init__",
    lambda env, real, num_envs=1, frame_skip=1, **to: real(num_envs, frame_skip=max(frame_skip - 1, 1), **to),
    "frame_skip",
    role="defender",
    **BATCHED,
)
wrong("_infos", lambda env, real: {agent: {**to, "extra": 1.0} for agent, to in real().items()}, "metrics", **PAIRED)
wrong("metrics", lambda game, real: {**real(), "distance_m": np.full(game.num_envs, np.nan)}, "metrics", "gymnasium")
wrong(
    "__init__", lambda game, real, *to: (real(*to), setattr(game, "payoff_parts", ("closeness", "fees")))[1], "metrics"
)
wrong("action_mask", lambda game, real, role: None if role == "defender" else real(role) | True, "action_masks")
wrong(
    "step",
    lambda env, real, action: real(np.nan_to_num(action) if np.shape(action) == (2,) else action),
    "bad_actions",
    role="defender",
    **SINGLY,
)


@mutant("gymnasium", "determinism", part="single_class")
class IgnoresSeed(ToyAttackEnv):
    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        return super().reset(seed=None, options=options)


@mutant("gymnasium", part="single_class")
class SharesInfo(ToyAttackEnv):
    shared: dict[str, Any] = {"action_mask": np.ones(5, np.int8)}

    def step(self, action: Any) -> Any:
        return (*super().step(action)[:4], self.shared)

    def reset(self, **kwargs: Any) -> Any:
        return super().reset(**kwargs)[0], self.shared


@mutant("pettingzoo", "determinism", part="parallel_class")
class ParallelIgnoresSeed(RolesParallelEnv):
    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        self._generator = np.random.default_rng()
        return super().reset(None, options)


@mutant("stable_baselines3", "observations", part="single_class", role="defender")
class DoubleObservation(ToyDefenseEnv):
    def step(self, action: Any) -> Any:
        observation, *rest = super().step(action)
        return (observation.astype(np.float64), *rest)


@mutant("determinism")
class CarriesOver(ToyGame):
    wind = 0.0

    def _step(self, b: int, move: Any, push: Any) -> None:
        self.wind += 1e-4
        super()._step(b, move + self.wind, push)


@mutant("seeding", part="single_class")
class ForgetsGenerator(ToyAttackEnv):
    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        if seed is None:
            self.np_random = np.random.default_rng()
        return super().reset(seed=seed, options=options)


@mutant("batch", "autoreset")
class SharesGenerator(ToyGame):
    def _step(self, b: int, move: Any, push: Any) -> None:
        self.generators[b] = self.generators[0]
        super()._step(b, move, push)


@mutant("autoreset", part="vector_class")
class FinalAfterReset(ToyAttackVectorEnv):
    def step(self, actions: Any) -> Any:
        result = super().step(actions)
        for b in np.flatnonzero(result[-1].get("_final_obs", [])):
            result[-1]["final_obs"][b] = result[0][b]
        return result


@mutant("autoreset", "batch", part="vector_class")
class NoMetricsInFinalInfo(ToyAttackVectorEnv):
    def step(self, actions: Any) -> Any:
        *rest, info = super().step(actions)
        info["_distance_m"] = np.zeros(self.num_envs, np.bool_)
        return (*rest, info)


@mutant("aliasing")
class OneBuffer(ToyGame):
    def observe(self, role: Role) -> Any:
        fresh = super().observe(role)
        if not hasattr(self, "buffer"):
            self.buffer = fresh.copy()
        self.buffer[:] = fresh
        return self.buffer


@mutant("aliasing")
class LendsMask(ToyGame):
    def action_mask(self, role: Role) -> Any:
        if not hasattr(self, "mask"):
            self.mask = super().action_mask("attacker")
        return self.mask if role == "attacker" else None


@mutant("actions_untouched", part="single_class", role="defender")
class ChangesAction(ToyDefenseEnv):
    def step(self, action: Any) -> Any:
        result = super().step(action)
        action *= 0
        return result


@mutant("actions_untouched", part="parallel_class")
class KeepsReference(RolesParallelEnv):
    def step(self, actions: Any) -> Any:
        due = not hasattr(self, "kept") or self.game.elapsed[0] % 3 == 0
        self.kept = actions if due else self.kept
        self._batch.hands["attacker"].interval = 1  # so that it is read again
        return super().step({**actions, "attacker_0": self.kept["attacker_0"]})


@mutant("observations")
class ShowsNaN(ToyGame):
    def _step(self, b: int, move: Any, push: Any) -> None:
        super()._step(b, move, push)
        self.guard[b] = np.nan


@mutant("live_observations")
class StoppedClock(ToyGame):
    def observe(self, role: Role) -> Any:
        observation = super().observe(role)
        observation[:, -1] = 0
        return observation


@mutant("endings", part="single_class")
class ClockTruncates(ToyAttackEnv):
    def step(self, action: Any) -> Any:
        observation, reward, terminated, _, info = super().step(action)
        late = self.game.elapsed.item(0) >= self.game.horizon
        return observation, reward, terminated and not late, late, info


@mutant("endings", part="single_class")
class EndsTwice(ToyAttackEnv):
    def step(self, action: Any) -> Any:
        observation, reward, terminated, _, info = super().step(action)
        return observation, reward, terminated, terminated, info


@mutant("reset_needed", part="single_class")
class GoesOn(ToyAttackEnv):
    def step(self, action: Any) -> Any:
        self._running = True
        return super().step(action)


@mutant("frame_skip")
class LooksCost(ToyGame):
    """What is observed changes the game, so that steps that nobody looks at differ."""

    def observe(self, role: Role) -> Any:
        self.fee = self.fee - 0.01  # at each look
        return super().observe(role)


@mutant("threads")
class CountsItsBlock(ToyGame):
    def _move(self, moves: Any, pushes: Any, envs: Any, num_steps: int) -> None:
        super()._move(moves, pushes, envs, num_steps)
        self.closeness[envs] += 1e-6 * envs.sum()


@mutant("zero_sum", part="parallel_class")
class PaysBoth(RolesParallelEnv):
    def step(self, actions: Any) -> Any:
        observations, rewards, *rest = super().step(actions)
        return (observations, {**rewards, "defender_0": abs(rewards["attacker_0"])}, *rest)


@mutant("action_masks", part="single_class")
class TwoMasks(ToyAttackEnv):
    def action_masks(self) -> Any:
        return ~super().action_masks()


@mutant("bad_actions", part="single_class")
class ActsBeforeItLooks(ToyAttackEnv):
    def step(self, action: Any) -> Any:
        try:
            return super().step(action)
        except ValueError:
            super().step(0)
            raise


@mutant("agents_batch", part="parallel_vector_class")
class LastMetricsOfTheNewEpisode(RolesVectorEnv):
    def step(self, actions: Any) -> Any:
        *rest, infos = super().step(actions)
        if "final_info" in infos:
            infos["final_info"]["closeness"] = infos["closeness"]
        return (*rest, infos)


@mutant("agents_batch", part="swarm_vector_class", role="defender")
class OneSeedForAll(SwarmVectorEnv):
    def reset(self, seed: Any = None, options: Any = None) -> Any:
        return super().reset([seed] * self.num_envs if isinstance(seed, int) else seed, options)


@mutant("flat", part="single_class")
class FlatCountsBackwards(ToyAttackEnv):
    def __init__(self, *, flat: bool = False, **kwargs: Any) -> None:
        super().__init__(flat=flat, **kwargs)
        vars(self)["flat"] = flat

    def step(self, action: Any) -> Any:
        return super().step(4 - action if self.flat else action)


@mutant("cost", part="single_class")
class CostsSoFar(ToyAttackEnv):
    def step(self, action: Any) -> Any:
        *rest, info = super().step(action)
        return (*rest, {**info, "cost": info["closeness"]})


@mutant("cost", part="vector_class")
class CostsOfTheNewEpisode(ToyAttackVectorEnv):
    """A learner that reads `cost` beside the reward never hears of the last step's."""

    def step(self, actions: Any) -> Any:
        *rest, info = super().step(actions)
        info["cost"] = np.where(info.get("_final_info", False), 0.0, info["cost"])
        return (*rest, info)


@mutant("configurations", part="parallel_class", role="defender")
class DividesByFee(RolesParallelEnv):
    """A fee of 0 is within its bounds."""

    def _infos(self) -> Any:
        fee = np.float64(self.game.config.catch_fee)
        with np.errstate(all="ignore"):
            return {agent: {**info, "caught": float(info["fee"] / fee)} for agent, info in super()._infos().items()}


@mutant("configurations")
class ShowsNothingWhenBrisk(ToyGame):
    def observe(self, role: Role) -> Any:
        return super().observe(role) * np.float32(1 if self.config.mood == "calm" else np.nan)


@mutant("configurations")
class FailsWhenBothStandStill(ToyGame):
    """Two fields have to be at their ends together."""

    def __init__(self, config: Any, num_envs: int) -> None:
        super().__init__(config, num_envs)
        if config.drift == config.guard_speed == 0:
            raise ZeroDivisionError
