"""The networks of `ppo`: a policy that all agents of a role share, and a value function that is told the truth."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor, nn

from cps_agents.learning.recipe import Ppo
from cps_agents.zoo.network import Network, unscaled
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.types import Array

ILLEGAL = -1e9  # logit of an action that is not legal; finite, so that entropies are
NORMAL = 0.5 * math.log(2 * math.pi)


class PolicyNetwork(nn.Module):
    """Two hidden layers each, for actions and for values. It starts near the neutral action, or not, see `Ppo`.

    Rows are those of a `LearningVectorEnv`: their last columns are the last action and what is legal.
    """

    def __init__(self, envs: LearningVectorEnv, ppo: Ppo, generator: torch.Generator) -> None:
        super().__init__()
        columns, hidden = envs.wired.columns, ppo.hidden[0]
        self.choices, self.masked = envs.wired.choices, columns.mask
        self.inputs = columns.size
        self.entries = len(self.choices) or columns.last_action
        self.policy = _layers(columns.size, hidden, columns.last_action, 0.0, generator)
        self.value = _layers(columns.size + envs.privileged_size, hidden, 1, 1.0, generator)
        neutral = np.ravel(envs.adapter.neutral_action)
        bias = _logits(self.choices, neutral, ppo.neutral_bias) if self.choices else neutral
        with torch.no_grad():
            self.last_bias.copy_(torch.from_numpy(np.asarray(bias, np.float32)))
        self.log_deviation: nn.Parameter | None = None
        if not self.choices:
            self.log_deviation = nn.Parameter(torch.full((self.entries,), math.log(ppo.initial_deviation)))

    @property
    def last_bias(self) -> nn.Parameter:
        """The bias of the policy's last layer: how the policy plays whatever it sees."""
        bias: nn.Parameter = self.policy[-1].bias  # type: ignore[assignment]
        return bias

    def outputs(self, rows: Tensor) -> Tensor:
        """Logits or means (n, k) for rows (n, columns)."""
        found: Tensor = self.policy(rows)
        if self.masked:
            found = found.masked_fill(rows[:, -self.masked :] <= 0, ILLEGAL)
        return found

    def values(self, rows: Tensor, truth: Tensor) -> Tensor:
        """What the rest of the episode is worth (n,), of rows and what only the simulator knows (n, p)."""
        found: Tensor = self.value(torch.cat([rows, truth], 1) if truth.shape[1] else rows)
        return found[:, 0]

    def draw(self, rows: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """Actions (n, entries) and the logarithms of their probabilities (n,)."""
        found = self.outputs(rows)
        if self.log_deviation is not None:
            noise = torch.empty_like(found).normal_(generator=generator)
            densities = -0.5 * noise * noise - self.log_deviation - NORMAL
            return found + noise * self.log_deviation.exp(), densities.sum(1)
        noise = torch.empty_like(found).exponential_(generator=generator).log_()  # minus Gumbel's
        actions, total = [], torch.zeros(len(rows))
        for logits, disturbed in zip(self._parts(found), self._parts(found - noise), strict=True):
            action = disturbed.argmax(1, keepdim=True)
            total += (logits.gather(1, action) - logits.logsumexp(1, keepdim=True))[:, 0]
            actions.append(action)
        return torch.cat(actions, 1).float(), total

    def judge(self, rows: Tensor, actions: Tensor) -> tuple[Tensor, Tensor]:
        """Logarithms of the probabilities of actions (n, entries), and the entropies, (n,) each."""
        found = self.outputs(rows)
        if self.log_deviation is not None:
            away = (actions - found) * (-self.log_deviation).exp()
            entropy = (self.log_deviation + NORMAL + 0.5).sum()
            return (-0.5 * away * away - self.log_deviation - NORMAL).sum(1), entropy.expand(len(rows))
        log_probability, entropy = torch.zeros(len(rows)), torch.zeros(len(rows))
        for entry, logits in enumerate(self._parts(found)):
            logs = torch.log_softmax(logits, 1)
            log_probability = log_probability + logs.gather(1, actions[:, entry : entry + 1].long())[:, 0]
            entropy = entropy - (logs.exp() * logs).sum(1)
        return log_probability, entropy

    def _parts(self, outputs: Tensor) -> tuple[Tensor, ...]:
        """The columns of each discrete entry."""
        return torch.split(outputs, list(self.choices), 1)

    def exported(self) -> Network:
        """The policy without torch; what is legal is the wiring's."""
        layers = [(_array(each.weight), _array(each.bias)) for each in self.policy if isinstance(each, nn.Linear)]
        spread = None if self.log_deviation is None else _array(self.log_deviation)
        return unscaled(self.inputs, layers, "tanh", spread)


def _layers(inputs: int, hidden: int, outputs: int, gain: float, generator: torch.Generator) -> nn.Sequential:
    """Orthogonal weights, the last ones times `gain`, and no bias."""
    sizes = ((inputs, hidden, math.sqrt(2)), (hidden, hidden, math.sqrt(2)), (hidden, outputs, gain))
    layers: list[nn.Module] = []
    for before, after, scale in sizes:
        layer: nn.Linear = nn.utils.skip_init(nn.Linear, before, after)  # type: ignore[no-untyped-call]
        nn.init.orthogonal_(layer.weight, scale, generator=generator)
        nn.init.zeros_(layer.bias)
        layers += [layer, nn.Tanh()]
    return nn.Sequential(*layers[:-1])


def _logits(choices: tuple[int, ...], neutral: Array, bonus: float) -> Array:
    """Logits (k,) that are `bonus` for the neutral value of each entry, and zero else."""
    parts = [bonus * (np.arange(count) == value) for count, value in zip(choices, neutral, strict=True)]
    return np.concatenate(parts)


def _array(tensor: Tensor) -> Array:
    return tensor.detach().numpy()
