"""Proximal policy optimization (Schulman et al. 2017), on one page: a network for all agents of a role, side by side.

It learns on the rows of a `LearningVectorEnv`, from reward alone. It looks only at agents that are active, knows no
value beyond an episode's end, and tells its value function what only the simulator knows.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from cps_agents.learning.policy_network import PolicyNetwork
from cps_agents.learning.recipe import Recipe
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.types import BoolArray, FloatArray, Observation

EPISODES_PER_START = 20  # that each environment plays between two starts of all of them, which cost one episode
LEAST_BATCH = 64  # rows; a smaller rest of an epoch is left out
ADVANTAGE_CLIP = 4.0  # deviations, chosen
SLOWEST = 0.002  # gain of the running scale of rewards, after 500 steps; the first steps count equally


class LearningProgress(NamedTuple):
    """The progress of learning after an update."""

    share: float  # of the budget, 0 to 1
    updates: int
    steps: int  # native decisions so far
    cpu_s: float  # of learning so far
    training_return: float  # mean of one whole episode of each environment, see `Returns`; NaN before

    @property
    def steps_per_s(self) -> float:
        """Native decisions in a CPU second."""
        return self.steps / max(self.cpu_s, 1e-9)

    @property
    def left_s(self) -> float:
        """CPU seconds to go."""
        return self.cpu_s * (1 / max(self.share, 1e-9) - 1)


class Learner:
    """A network and what improves it. Runs with a budget of steps are the same bit for bit, in one go or resumed.

    All episodes start anew every `restart_every` updates, with seeds of their own.
    """

    def __init__(self, envs: LearningVectorEnv, recipe: Recipe, seed: int = 0) -> None:
        """`seed` is that of the network and of its draws; the environments have their own."""
        torch.set_num_threads(1)
        self.envs, self.recipe = envs, recipe
        self.generator = torch.Generator().manual_seed(seed)
        self.network = PolicyNetwork(envs, recipe.ppo, self.generator)
        self.optimizer = self.make_optimizer()
        self.rates = [float(group["lr"]) for group in self.optimizer.param_groups]
        self.updates, self.steps, self.cpu_s = 0, 0, 0.0
        self.scale, self.scaled_steps = 0.0, 0  # mean square of discounted returns, and of how many steps
        self.returns = Returns(envs.episodes)
        if self.restart_every > 1:
            envs.keep_past()

    def make_optimizer(self) -> torch.optim.Optimizer:
        """Adam over all that learns."""
        return torch.optim.Adam(self.network.parameters(), self.recipe.ppo.learning_rate, eps=1e-5, fused=True)

    @property
    def restart_every(self) -> int:
        """Updates between two starts of all episodes."""
        return max(round(EPISODES_PER_START * self.envs.decisions / self.recipe.ppo.n_steps), 1)

    @property
    def share(self) -> float:
        """The share of the budget that is used up, 0 to 1."""
        of_steps, most_cpu_s = self.steps / self.recipe.training.total_timesteps, self.recipe.most_cpu_s
        return min(max(of_steps, self.cpu_s / most_cpu_s if most_cpu_s > 0 else 0.0), 1.0)

    def progress(self) -> LearningProgress:
        """How far it is."""
        return LearningProgress(self.share, self.updates, self.steps, self.cpu_s, self.returns.mean)

    @property
    def between_starts(self) -> bool:
        """Whether episodes go on into the next update, and do not start anew with it."""
        return self.updates % self.restart_every > 0

    def learn(self, report: Callable[[LearningProgress], None] = lambda progress: None) -> None:
        """Go on until the budget is used up, and report after each update."""
        final_share = self.recipe.ppo.final_learning_rate / self.recipe.ppo.learning_rate  # of the entropy bonus, too
        while self.share < 1:
            began = time.process_time()
            if not self.between_starts:
                self.start()
            falling = 1 - (1 - final_share) * self.share
            for group, rate in zip(self.optimizer.param_groups, self.rates, strict=True):
                group["lr"] = rate * falling
            self.improve(falling)
            self.updates += 1
            self.cpu_s += time.process_time() - began
            report(self.progress())

    def start(self) -> None:
        """Start all episodes, whose seeds follow from the number of updates."""
        self.rows, _ = self.envs.reset(options={"start": self.updates // self.restart_every})
        self.discounted = np.zeros(self.envs.num_envs)
        self.returns.start(at_once=self.envs.copies > 1)

    def improve(self, falling: float) -> None:
        """Collect decisions of all episodes, and learn from them."""
        played = self.collect()
        active = np.flatnonzero(played.active[:-1])
        if len(active) >= LEAST_BATCH:
            self.update(played, torch.from_numpy(active), falling)

    def collect(self) -> Experience:
        """Play `num_steps` decisions of every row."""
        envs, count = self.envs, self.recipe.ppo.n_steps
        played = Experience.empty(count, envs.num_envs, self.rows.shape[1], envs.privileged_size, self.network.entries)
        for t in range(count):
            self.see(played, t)
            active = played.active[t]
            with torch.inference_mode():
                drawn = self.network.draw(torch.from_numpy(self.rows[active]), self.generator)
            played.actions[t, active], played.log_probability[t, active] = (found.numpy() for found in drawn)
            self.rows, reward, ended, _, info = envs.step(self.spread(played.actions[t]))
            played.rewards[t], played.ended[t] = reward, ended
            self.follow(reward, ended, active)
            self.note_ended(info, ended)
        self.see(played, count)
        self.steps += count * envs.episodes * envs.wired.wiring.frame_skip
        return played

    def spread(self, actions: Observation) -> Observation:
        """Actions (N, entries) in the shape of the action space; those of rows that are not active do not count."""
        return actions.reshape(self.envs.num_envs, *(self.envs.single_action_space.shape or ()))

    def see(self, played: Experience, t: int) -> None:
        """Keep what policy and value function see now, and which rows are active."""
        played.rows[t], played.truth[t], played.active[t] = self.rows, self.envs.privileged(), self.envs.active()

    def follow(self, reward: FloatArray, ended: BoolArray, active: BoolArray) -> None:
        """Measure how large discounted returns are, by which rewards are divided."""
        self.discounted = self.recipe.ppo.gamma * self.discounted + reward
        if active.any():
            self.scaled_steps += 1
            gain = max(1 / self.scaled_steps, SLOWEST)
            self.scale += gain * (float(np.mean(self.discounted[active] ** 2)) - self.scale)
        self.discounted[ended] = 0.0

    def note_ended(self, info: dict[str, Any], ended: BoolArray) -> None:
        """Count the returns of the episodes that have ended."""
        if ended.any():
            own = slice(None, None, self.envs.agents)
            self.returns.add(info["final_info"]["episode"]["r"][own], ended[own])

    def update(self, played: Experience, chosen: Tensor, falling: float) -> None:
        """Clipped policy gradients and value errors over the rows `chosen`, until the policy has moved enough."""
        recipe, network = self.recipe, self.network
        most_moved = recipe.ppo.target_kl or np.inf
        advantages, targets = self.credit(played)
        if len(chosen) > recipe.ppo.rows_per_update:
            chosen = chosen[torch.randperm(len(chosen), generator=self.generator)[: recipe.ppo.rows_per_update]]
        rows, truth, actions, before, advantage, target = (
            torch.from_numpy(array).flatten(0, 1)[chosen]
            for array in (played.rows, played.truth, played.actions, played.log_probability, advantages, targets)
        )
        spread = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        weight = spread.clamp(-ADVANTAGE_CLIP, ADVANTAGE_CLIP)
        parameters = list(network.parameters())
        for epoch in range(recipe.ppo.n_epochs):
            for part in torch.split(torch.randperm(len(rows), generator=self.generator), recipe.ppo.batch_size):
                if len(part) < min(LEAST_BATCH, len(rows)):
                    continue
                log_probability, entropy = network.judge(rows[part], actions[part])
                moved = log_probability - before[part]
                ratio = moved.exp()
                if epoch > 0 and (ratio.detach() - 1 - moved.detach()).mean() > most_moved:
                    return
                clipped = ratio.clamp(1 - recipe.ppo.clip_range, 1 + recipe.ppo.clip_range)
                gain = torch.min(ratio * weight[part], clipped * weight[part]).mean()
                error = (network.values(rows[part], truth[part]) - target[part]).square().mean()
                bonus = recipe.ppo.ent_coef * falling * entropy.mean()
                loss = recipe.ppo.vf_coef * error
                if self.updates >= recipe.ppo.value_warm_up:
                    loss = loss - gain - bonus
                self.optimizer.zero_grad()
                loss.backward()  # type: ignore[no-untyped-call]
                torch.nn.utils.clip_grad_norm_(parameters, recipe.ppo.max_grad_norm)
                self.optimizer.step()

    def credit(self, played: Experience) -> tuple[Observation, Observation]:
        """Advantages and value targets (T, N). Nothing counts beyond an episode's end, or once a row is not active.

        Where agents pause, what is paid until they are active again counts for the decision before.
        """
        recipe = self.recipe
        with torch.inference_mode():
            seen = zip(map(torch.from_numpy, played.rows), map(torch.from_numpy, played.truth), strict=True)
            values = np.stack([self.network.values(rows, truth).numpy() for rows, truth in seen])
        pauses = self.envs.adapter.pauses
        goes_on = recipe.ppo.gamma * ((played.active[1:] | pauses) & ~played.ended)
        rewards, decides = played.rewards / np.sqrt(self.scale + 1e-10), played.active[:-1] | (not pauses)
        advantages, following, later = np.empty_like(rewards, np.float32), np.zeros(rewards.shape[1]), values[-1]
        for t in range(len(rewards) - 1, -1, -1):
            gained = rewards[t] + goes_on[t] * later
            error = np.where(decides[t], gained - values[t], 0.0)
            following = error + np.where(decides[t], recipe.ppo.gae_lambda, 1.0) * goes_on[t] * following
            later = np.where(decides[t], values[t], gained)
            advantages[t] = following
        return advantages, advantages + values[:-1]


class Returns:
    """The mean return of one whole episode of each environment, all of which began within the same time.

    The episodes that end first are the short ones. So a mean is that of all environments, and the next one is of
    episodes that begin when it is known: no environment counts twice, and no network that is long gone.
    """

    def __init__(self, episodes: int) -> None:
        self.mean = float("nan")  # the last one
        self.found: FloatArray = np.zeros(episodes)
        self.begun, self.known = np.zeros((2, episodes), np.bool_)  # whether the episode that counts has begun, ended

    def start(self, *, at_once: bool) -> None:
        """Begin to count anew; with `at_once` the episodes that are there have just begun."""
        self.begun[:], self.known[:] = at_once, False

    def add(self, returns: FloatArray, ended: BoolArray) -> None:
        """What the episodes that have `ended` (B,) have returned (B,); the next ones begin."""
        counts = ended & self.begun & ~self.known
        self.found[counts] = returns[counts]
        self.known |= counts
        if self.known.all():
            self.mean = float(self.found.mean())
            self.start(at_once=False)
        self.begun |= ended


class Experience(NamedTuple):
    """T decisions of N rows; what is seen has one more, after the last decision."""

    rows: Observation  # (T + 1, N, columns)
    truth: Observation  # (T + 1, N, p)
    active: BoolArray  # (T + 1, N)
    actions: Observation  # (T, N, entries)
    log_probability: Observation  # (T, N)
    rewards: FloatArray  # (T, N)
    ended: BoolArray  # (T, N) episodes whose last decision this was

    @classmethod
    def empty(cls, steps: int, rows: int, columns: int, truth: int, entries: int) -> Experience:
        """Arrays to be filled."""
        return cls(
            np.empty((steps + 1, rows, columns), np.float32),
            np.empty((steps + 1, rows, truth), np.float32),
            np.empty((steps + 1, rows), np.bool_),
            np.zeros((steps, rows, entries), np.float32),
            np.zeros((steps, rows), np.float32),
            np.zeros((steps, rows)),
            np.zeros((steps, rows), np.bool_),
        )
