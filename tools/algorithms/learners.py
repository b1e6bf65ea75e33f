"""The algorithms of the table: each trains on a role for so many CPU seconds and leaves a policy that can be scored.

Settings are each library's defaults plus the few named here, the same for all tracks. Rows are those of
`cps_envs.learning_env`: an agent of a team is a row, and one network plays all of them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

Curve = list[tuple[float, float]]  # CPU seconds, mean return of the episodes that ended since the last point
POINTS = 12  # of a curve
WIDE: Mapping[str, Any] = {"n_steps": 32, "batch_size": 1024, "learning_rate": 1e-3, "gae_lambda": 0.95}
LSTM: Mapping[str, Any] = {"lstm_hidden_size": 64}
REPLAY: Mapping[str, Any] = {
    "learning_rate": 1e-3,
    "batch_size": 256,
    "buffer_size": 200_000,
    "learning_starts": 5_000,
    "train_freq": 1,
    "gradient_steps": 4,
    "target_update_interval": 500,
    "exploration_fraction": 0.3,
    "exploration_final_eps": 0.02,
}


@dataclass(frozen=True)
class Job:
    """A cell of the table."""

    role: str  # such as RogueAttack
    seed: int
    cpu_s: float
    folder: Path


@dataclass(frozen=True)
class Algorithm:
    """How to train, and what the table says of it."""

    train: Callable[[Job], tuple[str, Curve]]  # the policy's reference, and what episodes returned
    words: str  # what it is, with its settings


class Clock:
    """CPU seconds since it was made, and the curve so far."""

    def __init__(self, job: Job) -> None:
        self._begun, self._job, self._recent = time.process_time(), job, list[float]()
        self.curve: Curve = []

    @property
    def spent(self) -> float:
        """CPU seconds."""
        return time.process_time() - self._begun

    def over(self, returns: list[float]) -> bool:
        """Note the returns of episodes that have ended; whether the time is up."""
        self._recent += returns
        if self._recent and self.spent >= len(self.curve) * self._job.cpu_s / POINTS:
            self.curve.append((round(self.spent, 1), round(float(np.mean(self._recent)), 4)))
            self._recent = []
        return self.spent >= self._job.cpu_s


def with_sb3(algorithm: str, policy: str, *, flat: bool = False, **settings: Any) -> Callable[[Job], tuple[str, Curve]]:
    """Training with a class of stable-baselines3 or sb3-contrib."""

    def train(job: Job) -> tuple[str, Curve]:
        import sb3_contrib
        import stable_baselines3
        import torch
        from stable_baselines3.common.callbacks import BaseCallback

        from cps_agents.sb3 import make

        torch.set_num_threads(1)
        envs, clock = make(job.role, 64, flat=flat), Clock(job)
        batch: Any = envs.venv
        agents = batch.env.agents

        class Stop(BaseCallback):
            def _on_step(self) -> bool:
                ended = [info["episode"]["r"] for info in self.locals["infos"][::agents] if "episode" in info]
                return not clock.over(ended)

        known: Any = getattr(stable_baselines3, algorithm, None) or getattr(sb3_contrib, algorithm)
        model = known(policy, envs, seed=job.seed, device="cpu", **settings)
        model.learn(2**40, callback=Stop())
        job.folder.mkdir(parents=True, exist_ok=True)
        model.save(job.folder / "model")
        return f"sb3:{job.folder / 'model.zip'}?algorithm={algorithm}", clock.curve

    return train


def own(job: Job) -> tuple[str, Curve]:
    """Our own PPO with its recipe, which ends by CPU time."""
    from dataclasses import replace

    from cps_agents.learning.learner import learn
    from cps_agents.learning.run import TrainingJob
    from cps_agents.recipes.learning import learning_recipe
    from cps_envs.registration import find_role

    problem, role = find_role(job.role)
    recipe = replace(learning_recipe(problem, role), most_cpu_s=job.cpu_s)
    done = TrainingJob(recipe, job.seed, job.folder, command="")
    learn(done)
    rows = [(row["cpu_s"], row["validation"]) for row in done.evaluations()]
    return f"zoo:{job.folder}", [(float(cpu_s), float(value)) for cpu_s, value in rows]


def plain(job: Job) -> tuple[str, Curve]:
    """The PPO of `examples/cleanrl_ppo.py`, through `gymnasium.make_vec` alone; it prints its curve, and keeps none."""
    from cps_agents import save_network
    from examples.cleanrl_ppo import train

    return save_network(job.folder, *train(job.role, job.cpu_s, job.seed)), []


def evolution(job: Job, hidden: int = 16, deviation: float = 0.1, rate: float = 0.05) -> tuple[str, Curve]:
    """An evolution strategy (Salimans et al. 2017) on the weights of a network with one hidden layer.

    Each generation 32 pairs of opposite disturbances play the same episode each, and returns count by rank.
    """
    from cps_agents import save_network
    from cps_envs import learning_env

    pairs, draws, clock = 32, np.random.default_rng(job.seed), Clock(job)
    envs: Any = learning_env(job.role, 2 * pairs, seed=job.seed, copies=2)
    choices = np.ravel(getattr(envs.single_action_space, "nvec", getattr(envs.single_action_space, "n", 0))).tolist()
    inputs, outputs = envs.single_observation_space.shape[0], sum(choices)
    shapes = ((hidden, inputs), (hidden,), (outputs, hidden), (outputs,))
    sizes = np.cumsum([int(np.prod(shape)) for shape in shapes])
    mean, first, second, generation = draws.normal(0, 1, sizes[-1]) * 0.1, 0.0, 0.0, 0
    mean[: sizes[0]] = draws.normal(0, inputs**-0.5, sizes[0])
    over = False
    while not over:
        noise = draws.standard_normal((pairs, sizes[-1]))
        candidates = mean + deviation * np.concatenate([noise, -noise])
        weights = [
            part.reshape(2 * pairs, *shape)
            for part, shape in zip(np.split(candidates, sizes[:-1], axis=1), shapes, strict=True)
        ]
        returns = _episodes(envs, weights, choices, generation)
        worth = returns.argsort().argsort() / (2 * pairs - 1) - 0.5
        gradient = (worth[:pairs] - worth[pairs:]) @ noise / pairs
        generation += 1
        first, second = 0.9 * first + 0.1 * gradient, 0.999 * second + 0.001 * gradient**2
        step = first / (1 - 0.9**generation) / (np.sqrt(second / (1 - 0.999**generation)) + 1e-8)
        mean = mean + rate * step - 0.002 * rate * mean
        over = clock.over(returns.tolist())
    parts = [part.reshape(shape) for part, shape in zip(np.split(mean, sizes[:-1]), shapes, strict=True)]
    return save_network(job.folder, envs, [(parts[0], parts[1]), (parts[2], parts[3])]), clock.curve


def _episodes(envs: Any, weights: list[Any], choices: list[int], start: int) -> Any:
    """What an episode returns to each candidate (B,): candidates b and b + B / 2 play the same one."""
    count, ends = envs.episodes, np.cumsum(choices)[:-1]
    rows, _ = envs.reset(options={"start": start, "staggered": False})
    returns, going = np.zeros(count), np.ones(count, np.bool_)
    w0, b0, w1, b1 = weights
    while going.any():
        seen = rows.reshape(count, envs.agents, -1)
        hidden = np.tanh(np.einsum("bai,bhi->bah", seen, w0) + b0[:, np.newaxis])
        logits = np.einsum("bah,boh->bao", hidden, w1) + b1[:, np.newaxis]
        parts = [part.argmax(axis=2) for part in np.split(logits, ends, axis=2)]
        rows, _, done, cut, info = envs.step(np.stack(parts, axis=2).reshape(envs.action_space.shape))
        ended = (done | cut)[:: envs.agents] & going
        if ended.any():
            returns[ended] = info["final_info"]["episode"]["r"][:: envs.agents][ended]
        going &= ~ended
    return returns


ALGORITHMS: Mapping[str, Algorithm] = {
    "PPO": Algorithm(
        with_sb3("PPO", "MlpPolicy", n_epochs=4, ent_coef=0.003, **WIDE),
        "stable-baselines3; n_steps 32, batch_size 1024, n_epochs 4, learning_rate 1e-3, ent_coef .003",
    ),
    "PPO, 100 lines": Algorithm(plain, "`examples/cleanrl_ppo.py`"),
    "A2C": Algorithm(with_sb3("A2C", "MlpPolicy"), "stable-baselines3, its defaults"),
    "RecurrentPPO": Algorithm(
        with_sb3(
            "RecurrentPPO", "MlpLstmPolicy", n_epochs=4, ent_coef=0.003, policy_kwargs={"lstm_hidden_size": 64}, **WIDE
        ),
        "sb3-contrib, an LSTM of 64; else as PPO",
    ),
    "TRPO": Algorithm(
        with_sb3("TRPO", "MlpPolicy", **WIDE), "sb3-contrib; n_steps 32, batch_size 1024, learning_rate 1e-3"
    ),
    "DQN": Algorithm(
        with_sb3("DQN", "MlpPolicy", flat=True, **REPLAY),
        "stable-baselines3, actions flat; batch 256, 4 gradient steps for 64 rows, epsilon .02 after 30 %",
    ),
    "QR-DQN": Algorithm(with_sb3("QRDQN", "MlpPolicy", flat=True, **REPLAY), "sb3-contrib, else as DQN"),
    "Evolution": Algorithm(evolution, "Salimans et al.: 32 pairs, deviation .1, rate .05, one hidden layer of 16"),
    "Our PPO": Algorithm(own, "`cps-envs train`, its recipe; in a team a critic told the truth, so MAPPO"),
}
