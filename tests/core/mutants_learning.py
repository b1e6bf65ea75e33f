"""Faulty versions of the interface for learners of the toy problem."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from cps_envs.core.conformance import Subject
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv
from cps_envs.core.types import Role
from tests.core.learned_toy import (
    BATCH,
    SINGLE,
    LearnedAttackEnv,
    LearnedAttackVectorEnv,
    LearnedDefenseEnv,
    LearnedDefenseVectorEnv,
)

MUTANTS: dict[str, list[Callable[[], Subject]]] = {}


def learned(role: Role = "defender", **parts: Any) -> Subject:
    """The healthy toy in its interface for learners, with some of its classes replaced."""
    classes = {"single_class": SINGLE[role], "vector_class": BATCH[role], **parts}
    return Subject(**classes, kwargs={"preset": "learning", "interface": "learning"})


def mutant(check: str, part: str, role: Role = "defender") -> Callable[[type], type]:
    """Register a class as a mutant that this check has to find."""

    def add(cls: type) -> type:
        MUTANTS.setdefault(f"check_{check}", []).append(lambda: learned(role, **{part: cls}))
        return cls

    return add


@mutant("rows", "vector_class")
class PaysAgentsMore(LearnedDefenseVectorEnv):
    def step(self, actions: Any) -> Any:
        observation, reward, *rest = super().step(actions)
        return (observation, reward + 0.1 * (self.agents > 1), *rest)


@mutant("rows", "vector_class")
class SwapsAgents(LearnedDefenseVectorEnv):
    def step(self, actions: Any) -> Any:
        return super().step(actions[:, ::-1] if self.agents == 1 else actions)


@mutant("training", "vector_class")
class OtherSeeds(LearnedDefenseVectorEnv):
    def reset(self, *, seed: Any = None, options: Any = None) -> Any:
        return super().reset(seed=None if seed is None else [each + 1 for each in seed], options=options)


@mutant("parallel", "parallel_class")
class LooksTwice(RolesParallelEnv):
    """What is averaged is seen twice."""

    def step(self, actions: Any) -> Any:
        result = super().step(actions)
        for hand in self._batch.hands.values():
            hand.player.look()
        return (self._observations(), *result[1:])


@mutant("parallel", "parallel_class", "attacker")
class LooksAtEveryGameStep(RolesParallelEnv):
    """Also between two decisions of a role."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._batch._base = self._batch.stride = 1
        vars(self)["interval"] = 1

    def step(self, actions: Any) -> Any:
        result = super().step(actions)
        if self.game.elapsed[0] % 3:
            self._batch.hands["attacker"].player.look()
        return (self._observations(), *result[1:])


@mutant("held_actions", "parallel_class")
class DecidesAllTheTime(RolesParallelEnv):
    def step(self, actions: Any) -> Any:
        wired = self._batch.hands["defender"].player.wired
        wired.wiring = replace(wired.wiring, frame_skip=1)
        return super().step(actions)


@mutant("frame_skip", "single_class")
class LooksOnceMore(LearnedDefenseEnv):
    def step(self, action: Any) -> Any:
        _, *rest = super().step(action)
        self._side.player.look()  # type: ignore[attr-defined]
        return (self._side.observe()[0], *rest)


@mutant("swarm", "swarm_class")
class SharesPay(SwarmEnv):
    def step(self, actions: Any) -> Any:
        observations, rewards, *rest = super().step(actions)
        return (observations, dict.fromkeys(rewards, sum(rewards.values())), *rest)


@mutant("autoreset", "vector_class")
class StepsWhatItResets(LearnedDefenseVectorEnv):
    def _advance(self, actions: Any, live: Any) -> Any:
        return super()._advance(actions, np.ones_like(live))


@mutant("autoreset", "vector_class", "attacker")
class ForgetsTheLastAction(LearnedAttackVectorEnv):
    """In all episodes when one begins."""

    def _begin(self, envs: Any) -> None:
        super()._begin(envs)
        row, averages, rough, kept, *rest = self._side.player.state  # type: ignore[attr-defined]
        self._side.player.state = (row, averages, rough, np.zeros_like(kept), *rest)  # type: ignore[attr-defined]


@mutant("pickling", "single_class", "attacker")
class LosesAverages(LearnedAttackEnv):
    def __getstate__(self) -> Any:
        row, averages, *rest = self._side.player.state  # type: ignore[attr-defined]
        self._side.player.state = (row, 0 * averages, *rest)  # type: ignore[attr-defined]
        return dict(vars(self))
