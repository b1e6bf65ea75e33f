"""PPO in which every episode is played twice: for roles with few decisions, whose pay depends most on what is drawn.

Both episodes have the same circumstances. What one is paid more than the other counts for each of its decisions, so
nothing has to be known of what an episode is worth. It is the advantage of GRPO (Shao et al. 2024) in groups of two.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.learning.ppo import Experience, Learner
from cps_agents.learning.recipe import Recipe
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.types import BoolArray, Observation


class Twins(Learner):
    """Plays all episodes from start to end, and learns from each pair's difference; it needs `paired` environments."""

    def __init__(self, envs: LearningVectorEnv, recipe: Recipe, seed: int = 0) -> None:
        """See `Learner`.

        Raises:
            CommandError: environments that are not paired.
        """
        if not envs.paired:
            raise CommandError("twins need paired environments")
        super().__init__(envs, replace(recipe, steps_per_update=envs.decisions), seed)

    @property
    def restart_every(self) -> int:
        """All episodes start anew at each update."""
        return 1

    def credit(self, played: Experience) -> tuple[Observation, Observation]:
        """Half of what a row is paid more than its twin, for each of its decisions (T, N); no values."""
        first: BoolArray = np.cumsum(played.ended, axis=0) - played.ended == 0  # until the first episode's end
        pairs = np.where(first, played.rewards, 0.0).sum(axis=0).reshape(2, -1)
        better = (pairs - pairs.mean(axis=0)).reshape(-1)
        advantages = np.where(first, better, 0.0).astype(np.float32)
        return advantages, np.zeros_like(advantages)
