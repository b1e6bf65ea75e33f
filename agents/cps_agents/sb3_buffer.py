"""Rollouts for stable-baselines3 that hold only decisions which had an effect."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.type_aliases import RolloutBufferSamples

from cps_envs.core.types import BoolArray, IntArray

MOST_DEVIATIONS = 4.0  # chosen: of an advantage, so that a few days with a huge pay do not outweigh all others
LEAST_SHARE = 0.25  # chosen: of a batch; what is left over below that is left out, its gradient would be noise


class ActiveBuffer(RolloutBuffer):
    """`RolloutBuffer` without the rows of agents whose action had no effect, for environments of `sb3.make`.

    In HVAC four of five rows of an attacker are such: of honest sensors, or before the onset. They would fill the
    batches, and take up the step that `target_kl` allows. Values still run through them. Advantages are normalised over
    the whole rollout, and limited.
    """

    def reset(self) -> None:
        """Start a new rollout."""
        super().reset()
        self.acting = np.ones((self.buffer_size, self.n_envs), np.bool_)
        self._used: IntArray = np.zeros(0, np.int64)

    def add(self, *args: Any, **kwargs: Any) -> None:
        """See `RolloutBuffer.add`; who acts is read from the observation space, where the environments note it."""
        noted: BoolArray | None = getattr(self.observation_space, "acting", None)
        if noted is not None:
            self.acting[self.pos] = noted
        super().add(*args, **kwargs)

    def get(self, batch_size: int | None = None) -> Generator[RolloutBufferSamples, None, None]:
        """Batches of the rows that acted, in random order; of all rows if none did."""
        if not self.generator_ready:
            self._flatten()
        rows = np.random.permutation(self._used)
        size = batch_size or len(rows)
        for first in range(0, len(rows), size):
            if first == 0 or len(rows) - first >= LEAST_SHARE * size:
                yield self._get_samples(rows[first : first + size])

    def _flatten(self) -> None:
        for name in ("observations", "actions", "values", "log_probs", "advantages", "returns"):
            setattr(self, name, self.swap_and_flatten(getattr(self, name)))
        acted = np.flatnonzero(self.swap_and_flatten(self.acting[..., np.newaxis]))
        self._used = acted if len(acted) else np.arange(len(self.advantages))
        used = self.advantages[self._used]
        normal = (self.advantages - used.mean()) / (used.std() + 1e-8)
        self.advantages = np.clip(normal, -MOST_DEVIATIONS, MOST_DEVIATIONS)
        self.generator_ready = True
