"""The best episodes that a learner has come upon itself, and their imitation in the course of training.

For deterministic problems that begin in a few situations and pay at the end: what a noisy policy hits once by luck is
not forgotten. After Oh et al., Self-imitation learning (ICML 2018), with one episode for each start.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback

from cps_agents.learning.demonstrations import Demonstrations
from cps_agents.learning.imitation import likelihood_loss

LEAST_GAIN = 1e-6  # of the return, to take the place of the best so far


class BestEpisodes:
    """The episode with the highest return, of the rewards learned from, for each first observation."""

    def __init__(self) -> None:
        self._episodes: dict[bytes, tuple[float, Demonstrations]] = {}

    def keep(self, total: float, episode: Demonstrations) -> None:
        """Take an episode if it is the best of its start."""
        key = episode.observations[0].tobytes()
        if key not in self._episodes or total > self._episodes[key][0] + LEAST_GAIN:
            self._episodes[key] = total, episode

    def mean_return(self) -> float:
        """Over the starts; not a number if there is none."""
        return float(np.mean([total for total, _ in self._episodes.values()])) if self._episodes else float("nan")

    def demonstrations(self) -> Demonstrations | None:
        """All decisions, start by start."""
        episodes = [episode for _, episode in self._episodes.values()]
        if not episodes:
            return None
        masks = [episode.masks for episode in episodes if episode.masks is not None]
        return Demonstrations(
            np.concatenate([episode.observations for episode in episodes]),
            np.concatenate([episode.actions for episode in episodes]),
            np.concatenate(masks) if masks else None,
        )


class SelfImitation(BaseCallback):
    """Looks for better episodes in all that is played, and imitates the best ones for some steps before each update.

    They are not part of checkpoints: a resumed run begins to collect anew.
    """

    def __init__(self, best: BestEpisodes, steps: int, batch_size: int, seed: int) -> None:
        super().__init__()
        self._best, self._steps, self._batch_size = best, steps, batch_size
        self._generator = np.random.default_rng(seed)
        self._running: list[list[tuple[Any, ...]]] = []

    def _on_training_start(self) -> None:
        self._running = [[] for _ in range(self.training_env.num_envs)]

    def _on_step(self) -> bool:
        model: Any = self.model
        seen, actions, masks = model._last_obs, self.locals["actions"], self.locals.get("action_masks")
        for b, episode in enumerate(self._running):
            mask = None if masks is None else masks[b]
            episode.append((seen[b], actions[b], mask, float(self.locals["rewards"][b])))
        for b in np.flatnonzero(self.locals["dones"]).tolist():
            observations, played, legal, rewards = zip(*self._running[b], strict=True)
            known = None if legal[0] is None else np.stack(legal) > 0
            self._best.keep(sum(rewards), Demonstrations(np.stack(observations), np.stack(played), known))
            self._running[b] = []
        return True

    def _on_rollout_end(self) -> None:
        shown = self._best.demonstrations()
        if shown is None:
            return
        self.logger.record("best_episodes/return", self._best.mean_return())
        model: Any = self.model
        policy = model.policy
        policy.set_training_mode(True)
        for _ in range(self._steps):
            rows = self._generator.permutation(len(shown.actions))[: self._batch_size]
            policy.optimizer.zero_grad()
            torch.autograd.backward(likelihood_loss(policy, shown, rows))
            torch.nn.utils.clip_grad_norm_(policy.parameters(), model.max_grad_norm)
            policy.optimizer.step()
