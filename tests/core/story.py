"""What a learner of the tank's pumps meets in an episode, computed again with plain numbers, one episode at a time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tests.core.tank import DUE, FULL, GAIN, HIGH, PRICE, PUMPS, STEP_S

CLIP = 5.0


class Story:
    """Episodes of one place of a batch, one after the other, against a valve that is half open all the time."""

    def __init__(
        self,
        generator: Any,
        *,
        steps: int = 24,
        frame_skip: int = 1,
        recent_s: tuple[float, ...] = (),
        rough_s: float = 0.0,
        mean: Any = 0.0,
        deviation: Any = 1.0,
    ) -> None:
        self.generator, self.steps, self.frame_skip = generator, steps, frame_skip
        interval_s = DUE["defender"] * STEP_S
        self.gains = [1 - math.exp(-interval_s / time_s) for time_s in recent_s]
        self.rough_gain = 1 - math.exp(-interval_s / rough_s) if rough_s else 0.0
        self.mean, self.deviation = np.asarray(mean), np.asarray(deviation)

    def start(self) -> Story:
        self.level, self.inflow = self.generator.uniform(1, 3), self.generator.uniform(0.1, 0.6)
        self.begun, self.time, self.acts, self.age, self.energy = self.level, 0, 0, 0, 0.0
        self.kept = [1] * PUMPS
        self.look()
        return self

    @property
    def over(self) -> bool:
        return bool(self.level >= FULL or self.time >= self.steps)

    def look(self) -> None:
        """What every pump sees: the level, 0.1 m higher for each before it, and how often they have acted."""
        row = np.array([[(self.level + 0.1 * pump) / 10, self.acts / 50 - 1] for pump in range(PUMPS)], np.float32)
        if self.age == 0:
            self.averages = [row.copy() for _ in self.gains]
            self.rough = np.zeros_like(row)
        else:
            self.averages = [
                old + np.float32(gain) * (row - old) for gain, old in zip(self.gains, self.averages, strict=True)
            ]
            self.rough = self.rough + np.float32(self.rough_gain) * (abs(row - self.row) - self.rough)
        self.row, self.looked = row, self.level

    def inputs(self) -> Any:
        """The rows (4, n) of a network."""
        parts = [self.row, *self.averages, *([self.rough] if self.rough_gain else [])]
        scaled = np.clip((np.concatenate(parts, axis=1) - self.mean) / self.deviation, -CLIP, CLIP)
        last = np.zeros((PUMPS, 3)) if self.age == 0 else np.eye(3)[self.kept]
        return np.concatenate([scaled, last, self.masks()], axis=1)

    def masks(self) -> Any:
        return np.array([[pump != 3, True, self.level <= HIGH] for pump in range(PUMPS)])

    def active(self) -> list[bool]:
        return [self.looked <= 3.0 + 0.5 * pump for pump in range(PUMPS)]

    def step(self, actions: Any) -> Any:
        """The pumps' rewards (4,)."""
        self.kept = [int(action) if there else 1 for action, there in zip(actions, self.active(), strict=True)]
        rewards = np.zeros(PUMPS)
        for decision in range(self.frame_skip):
            if decision > 0:
                if self.over:
                    break
                self.look()
            for _ in range(DUE["defender"]):
                rewards += self.flow() if self.level < FULL else 0.0
            self.age, self.acts = self.age + 1, self.acts + 1
        self.look()
        return rewards

    def flow(self) -> Any:
        """A game step, and what it pays the pumps."""
        pushes = np.array(self.kept) - 1.0
        rise, used = self.inflow + GAIN * pushes.sum(), PRICE * np.arange(1, PUMPS + 1) * pushes**2
        self.level, self.energy, self.time = self.level + rise, self.energy + used.sum(), self.time + 1
        return -(rise / PUMPS + used)
