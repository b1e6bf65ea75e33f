"""PPO in which every episode is played several times: for roles with few decisions, whose pay depends on what is drawn.

These episodes have the same circumstances. What one is paid more than their mean counts for each of its decisions, so
nothing has to be known of what an episode is worth. It is the advantage of GRPO (Shao et al. 2024).
"""

from __future__ import annotations

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.learning.ppo import Experience, Learner
from cps_agents.learning.recipe import Recipe, changed
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.types import BoolArray, Observation


class Copies(Learner):
    """Plays all episodes from start to end, and learns from how they differ; environments have at least two copies."""

    def __init__(self, envs: LearningVectorEnv, recipe: Recipe, seed: int = 0) -> None:
        """See `Learner`.

        Raises:
            CommandError: environments that play each episode once.
        """
        if envs.copies == 1:
            raise CommandError("this learner needs environments with at least two copies of each episode")
        super().__init__(envs, changed(recipe, {"n_steps": envs.decisions}), seed)

    @property
    def restart_every(self) -> int:
        """All episodes start anew at each update."""
        return 1

    def credit(self, played: Experience) -> tuple[Observation, Observation]:
        """What a row is paid more than the mean of its copies, for each of its decisions (T, N); no values."""
        first: BoolArray = np.cumsum(played.ended, axis=0) - played.ended == 0  # until the first episode's end
        paid = np.where(first, played.rewards, 0.0).sum(axis=0).reshape(self.envs.copies, -1)
        better = (paid - paid.mean(axis=0)).reshape(-1)
        advantages = np.where(first, better, 0.0).astype(np.float32)
        return advantages, np.zeros_like(advantages)
