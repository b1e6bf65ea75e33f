"""Learning by noise that is held for an episode: for roles in which only what lasts shows.

Every episode is played twice, with opposite noise on all actions of all agents, the same from start to end. The two
returns say which was better, and that counts for each of their decisions: rewards to come would count late seconds
many times over. It is the policy gradient of evolution strategies (Salimans et al. 2017), through a network.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from torch import Tensor

from cps_agents.errors import CommandError
from cps_agents.learning.ppo import Learner
from cps_agents.learning.recipe import Recipe
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.types import FloatArray

BETAS = (0.9, 0.98)  # of Adam, chosen: few steps
ADVANTAGE_CLIP = 3.0  # deviations, chosen


class EpisodeNoise(Learner):
    """Plays all episodes from start to end, then takes one step; it needs two copies of each and a Box."""

    def __init__(self, envs: LearningVectorEnv, recipe: Recipe, seed: int = 0) -> None:
        """See `Learner`.

        Raises:
            CommandError: environments without two copies of each episode, or actions that are not continuous.
        """
        if envs.copies != 2 or not isinstance(envs.single_action_space, spaces.Box):
            raise CommandError("noise that is held for an episode needs two copies of each and continuous actions")
        super().__init__(envs, recipe, seed)

    def make_optimizer(self) -> torch.optim.Optimizer:
        """Adam over the policy, with a rate of its own for what it plays whatever it sees; the noise stays as it is."""
        bias = self.network.last_bias
        rest = [each for each in self.network.policy.parameters() if each is not bias]
        groups: list[dict[str, Any]] = [{"params": rest}, {"params": [bias], "lr": self.recipe.ppo.bias_learning_rate}]
        return torch.optim.Adam(groups, self.recipe.ppo.learning_rate, betas=BETAS)

    @property
    def restart_every(self) -> int:
        """All episodes start anew at each update."""
        return 1

    def improve(self, falling: float) -> None:
        """One step towards what was better in each pair of episodes."""
        half = torch.empty(self.envs.episodes // 2, 1, self.network.entries).normal_(generator=self.generator)
        noise = torch.cat([half, -half]).expand(-1, self.envs.agents, -1).flatten(0, 1)
        rows, places, returns = self.play(noise)
        assert self.network.log_deviation is not None
        spread = self.network.log_deviation.detach().exp()
        pairs = returns.reshape(2, -1)
        better = (pairs - pairs.mean(axis=0)).reshape(-1)
        weight = np.clip(better / (better.std() + 1e-8), -ADVANTAGE_CLIP, ADVANTAGE_CLIP)
        credit = torch.from_numpy(np.repeat(weight, self.envs.agents).astype(np.float32))[places]
        played = noise[places]
        means = self.network.outputs(rows)
        with torch.no_grad():
            actions = means + played * spread
        likelihood = -0.5 * ((actions - means) / spread).square().sum(1)
        self.optimizer.zero_grad()
        (-(credit * likelihood).mean()).backward()  # type: ignore[no-untyped-call]
        self.optimizer.step()

    def play(self, noise: Tensor) -> tuple[Tensor, Tensor, FloatArray]:
        """Rows (n, columns) of all decisions, whose they were (n,) of N, and the episodes' returns (B,)."""
        envs, own = self.envs, slice(None, None, self.envs.agents)
        assert self.network.log_deviation is not None
        disturbance = (noise * self.network.log_deviation.detach().exp()).numpy()
        going, returns = np.ones(envs.num_envs, np.bool_), np.zeros(envs.episodes)
        seen, places = [], []
        for _ in range(envs.decisions):
            active = np.flatnonzero(going & envs.active())
            rows, actions = torch.from_numpy(self.rows[active]), np.zeros(disturbance.shape, np.float32)
            with torch.inference_mode():
                actions[active] = self.network.outputs(rows).numpy() + disturbance[active]
            seen.append(rows)
            places.append(torch.from_numpy(active))
            self.rows, reward, ended, _, info = envs.step(self.spread(actions))
            returns += np.where(going[own], reward.reshape(envs.episodes, -1).sum(axis=1), 0.0)
            self.note_ended(info, ended & going)
            self.steps += int(going[own].sum()) * envs.wired.wiring.frame_skip
            going &= ~ended
            if not going.any():
                break
        return torch.cat(seen), torch.cat(places), returns
