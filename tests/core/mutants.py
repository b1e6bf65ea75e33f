"""Faulty versions of the toy problem, one for each thing that the conformance checks are there to find."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np

from cps_envs.core.conformance import Subject
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv
from cps_envs.core.types import Role
from tests.core.toy import (
    TOY,
    Axes,
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


@mutant("pettingzoo", part="parallel_class")
class NewSpaces(RolesParallelEnv):
    def action_space(self, agent: str) -> Any:
        return gymnasium.spaces.Discrete(5)


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


@mutant("global_random_state")
class DrawsGlobally(ToyGame):
    def _step(self, b: int, move: Any, push: Any) -> None:
        np.random.random()
        super()._step(b, move, push)


@mutant("global_random_state")
class SeedsGlobally(ToyGame):
    def _reset(self, envs: Any, generators: Any) -> None:
        random.seed(random.random())  # another state, whatever earlier tests have seeded
        super()._reset(envs, generators)


@mutant("batch", "autoreset")
class SharesGenerator(ToyGame):
    def _step(self, b: int, move: Any, push: Any) -> None:
        self.generators[b] = self.generators[0]
        super()._step(b, move, push)


@mutant("parallel", part="parallel_class")
class DropsDefender(RolesParallelEnv):
    def _moves(self, actions: Any) -> Any:
        return {"attacker": super()._moves(actions)["attacker"]}


@mutant("parallel", "return")
class PaysPerCall(ToyGame):
    """A bonus per call of `advance`: a decision of three steps gets it once, three steps get it three times."""

    def _advance(self, actions: Any, envs: Any, num_steps: int) -> Any:
        return super()._advance(actions, envs, num_steps) + 0.01 * envs


@mutant("held_actions", part="parallel_class")
class TakesEveryAction(RolesParallelEnv):
    def _moves(self, actions: Any) -> Any:
        held = super()._moves(actions)
        return {**held, "attacker": self._readers["attacker"].single(actions["attacker_0"])}


@mutant("swarm", role="defender", part="swarm_class")
class SwarmSkipsSteps(SwarmEnv):
    def step(self, actions: Any) -> Any:
        self._match.step({}, self._envs, 1)
        return super().step(actions)


@mutant("autoreset", part="vector_class")
class FinalAfterReset(ToyAttackVectorEnv):
    def _restart_ended(self) -> Any:
        final = super()._restart_ended()
        for b in np.flatnonzero(final.get("_final_obs", [])):
            final["final_obs"][b] = self.game.observe(self.role)[b]
        return final


@mutant("autoreset", "batch", part="vector_class")
class NoMetricsInFinalInfo(ToyAttackVectorEnv):
    def step(self, actions: Any) -> Any:
        *rest, info = super().step(actions)
        info["_distance_m"] = np.zeros(self.num_envs, np.bool_)
        return (*rest, info)


@mutant("reset_mask", "autoreset", part="vector_class")
class ResetsAll(ToyAttackVectorEnv):
    def _reset_mask(self, options: Any) -> Any:
        super()._reset_mask(options)
        return np.ones(self.num_envs, np.bool_)


@mutant("reset_mask", part="vector_class")
class TakesAnyMask(ToyAttackVectorEnv):
    def _reset_mask(self, options: Any) -> Any:
        mask = (options or {}).get("reset_mask", np.ones(self.num_envs))
        return np.resize(np.asarray(mask, np.bool_), self.num_envs)


@mutant("time_limit", part="vector_class", role="defender")
class NoTimeLimit(ToyDefenseVectorEnv):
    def __init__(self, num_envs: int = 1, *, max_episode_steps: int | None = None, **kwargs: Any) -> None:
        super().__init__(num_envs, reach_m=0.0, **kwargs)


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
    def _moves(self, actions: Any) -> Any:
        due = not hasattr(self, "kept") or self.game.elapsed[0] % 3 == 0
        self.kept = actions if due else self.kept
        super()._moves(actions)
        return {**self._held, "attacker": np.array([self.kept["attacker_0"]])}


@mutant("observations")
class LeavesBounds(ToyGame):
    def observe(self, role: Role) -> Any:
        return super().observe(role) * np.float32(2)


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


class DeadAxes(Axes):
    def observe(self) -> Any:
        return super().observe() * np.array([1, 0], np.float32)


@mutant("live_swarm", role="defender")
class DeadTeam(ToyGame):
    def team(self, role: Role) -> Any:
        return DeadAxes(self)


@mutant("endings")
class ClockTerminates(ToyGame):
    def _step(self, b: int, move: Any, push: Any) -> None:
        super()._step(b, move, push)
        self.terminated[b] |= self.steps[b] >= self.horizon


@mutant("endings")
class OddHorizon(ToyGame):
    def __init__(self, config: Any, num_envs: int) -> None:
        super().__init__(config, num_envs)
        self.horizon = 11


@mutant("endings", part="single_class")
class EndsTwice(ToyAttackEnv):
    def step(self, action: Any) -> Any:
        observation, reward, terminated, truncated, info = super().step(action)
        return observation, reward, terminated or truncated, truncated, info


@mutant("reset_needed", part="single_class")
class GoesOn(ToyAttackEnv):
    def step(self, action: Any) -> Any:
        self._running = True
        return super().step(action)


@mutant("reset_needed", part="vector_class")
class StartsUnasked(ToyAttackVectorEnv):
    def _check_running(self) -> None:
        if not self._generators:
            self.reset()


@mutant("horizon")
class GoesBeyond(ToyGame):
    def _check_end(self, envs: Any, num_steps: int) -> None:
        """Do not look."""


@mutant("horizon")
class RefusesTooLate(ToyGame):
    def _check_end(self, envs: Any, num_steps: int) -> None:
        self._advance({}, envs, num_steps)
        super()._check_end(envs, num_steps)


@mutant("frame_skip", part="single_class")
class SkipsNothing(ToyAttackEnv):
    def __init__(self, *, frame_skip: int = 1, **kwargs: Any) -> None:
        super().__init__(**kwargs)


@mutant("frame_skip", part="vector_class", role="defender")
class BatchSkipsFewer(ToyDefenseVectorEnv):
    def __init__(self, num_envs: int = 1, *, frame_skip: int = 1, **kwargs: Any) -> None:
        super().__init__(num_envs, frame_skip=max(frame_skip - 1, 1), **kwargs)


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


@mutant("return")
class PaysDouble(ToyGame):
    def _advance(self, actions: Any, envs: Any, num_steps: int) -> Any:
        return 2 * super()._advance(actions, envs, num_steps)


@mutant("zero_sum", part="parallel_class")
class PaysBoth(RolesParallelEnv):
    def step(self, actions: Any) -> Any:
        observations, rewards, *rest = super().step(actions)
        return (observations, {**rewards, "defender_0": abs(rewards["attacker_0"])}, *rest)


@mutant("metrics", part="parallel_class")
class MoreInfo(RolesParallelEnv):
    def _infos(self) -> Any:
        return {agent: {**info, "extra": 1.0} for agent, info in super()._infos().items()}


@mutant("metrics", "gymnasium")
class InfiniteMetric(ToyGame):
    def metrics(self) -> Any:
        return {**super().metrics(), "distance_m": np.full(self.num_envs, np.nan)}


@mutant("metrics")
class UnknownPart(ToyGame):
    def __init__(self, config: Any, num_envs: int) -> None:
        super().__init__(config, num_envs)
        self.payoff_parts = ("closeness", "fees")


@mutant("action_masks")
class MaskIgnoresClock(ToyGame):
    def action_mask(self, role: Role) -> Any:
        mask = super().action_mask(role)
        return None if mask is None else np.ones_like(mask)


@mutant("action_masks", part="single_class")
class TwoMasks(ToyAttackEnv):
    def action_masks(self) -> Any:
        return ~super().action_masks()


@mutant("bad_actions", part="single_class", role="defender")
class ForgivesNaN(ToyDefenseEnv):
    def step(self, action: Any) -> Any:
        return super().step(np.nan_to_num(action) if np.shape(action) == (2,) else action)


@mutant("bad_actions", part="single_class")
class ActsBeforeItLooks(ToyAttackEnv):
    def step(self, action: Any) -> Any:
        try:
            return super().step(action)
        except ValueError:
            super().step(0)
            raise


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
