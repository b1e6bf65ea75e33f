"""A trained network as a policy that needs nothing but NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from cps_agents.zoo.bounds import rescaling
from cps_agents.zoo.card import Card
from cps_agents.zoo.network import Network, Tensor
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.kernels import kernel
from cps_envs.core.policy import AnalyticPolicy, Generators, Knowledge, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, BoolArray, IntArray
from cps_envs.registration import find_problem


class TrainedPolicy(AnalyticPolicy):
    """Plays a network by its card: the mode of its action distribution, or a draw with `deterministic=False`.

    Raises:
        ConfigurationError: the network was trained for another problem, role, version or action space.
    """

    masked = True

    def __init__(
        self, spec: RoleSpec, card: Card, network: Network, *, deterministic: bool = True, version: int | None = None
    ) -> None:
        super().__init__(spec)
        self.card, self.network, self._mode = card, network, deterministic
        self.decentralised = card.decentralised
        self._shape: tuple[int, ...] = spec.action_space.shape or ()
        self._dtype = np.float64 if isinstance(spec.action_space, spaces.Box) else np.int64
        self._check(version)
        self._rescaled = rescaling(card, spec)
        self._sizes = np.array(card.actions)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Of each environment: generator, the network's memory, the held action, and how many decisions it has held."""
        envs = len(generators)
        own = np.empty(envs, object)
        own[:] = generators
        hidden, cell = np.zeros((2, envs, self._num_agents(), self.network.units), np.float32)
        return own, hidden, cell, np.zeros((envs, *self._shape), self._dtype), np.zeros(envs, np.int64)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """What the network says; a decentralised one looks at what each agent of the team sees instead.

        Raises:
            ValueError: observations of another size than the network was trained with.
        """
        generators, hidden, cell, held, age = state
        due = age % self.card.hold == 0
        if due.any():
            inputs, masks = self._inputs(seen), seen.masks
            if due.all():
                held, hidden, cell = self._decide(inputs, masks, generators, hidden, cell, seen.deterministic)
            else:
                mask = None if masks is None else masks[due]
                part = (generators[due], hidden[due], cell[due])
                fresh = self._decide(inputs[due], mask, *part, seen.deterministic)
                held, hidden, cell = held.copy(), hidden.copy(), cell.copy()
                held[due], hidden[due], cell[due] = fresh
        return held, (generators, hidden, cell, held, age + 1)

    def _decide(
        self,
        seen: Array,
        action_masks: BoolArray | None,
        generators: Array,
        hidden: Tensor,
        cell: Tensor,
        deterministic: bool,
    ) -> tuple[Array, Tensor, Tensor]:
        """Actions (B, ...) and the memory's state (B, A, units) for what the agents see (B, A, n)."""
        envs, agents = seen.shape[:2]
        flat = [array.reshape(envs * agents, -1) for array in (seen, hidden, cell)]
        outputs, *memory = self.network.forward(*flat)
        mode = self._mode or deterministic
        if self.card.head == "discrete":
            chosen = self._choose(outputs, action_masks, None if mode else generators)
        else:
            chosen = self._act(outputs.reshape(envs, -1), None if mode else generators)
        actions = chosen.reshape(envs, *self._shape)
        return actions, memory[0].reshape(hidden.shape), memory[1].reshape(cell.shape)

    def _choose(self, logits: Tensor, action_masks: BoolArray | None, generators: Array | None) -> Array:
        """Indices (environments x agents, entries) of the best or drawn legal choices."""
        if generators is not None:
            shape = (len(logits) // len(generators), logits.shape[1])
            draws = [generator.gumbel(size=shape) for generator in generators]
            logits = logits + np.concatenate(draws)
        legal = np.ones(logits.shape, np.bool_) if action_masks is None else action_masks.reshape(logits.shape)
        chosen = np.zeros((len(logits), len(self._sizes)), np.int64)
        _best(logits, legal, self._sizes, chosen)
        return chosen

    def _act(self, outputs: Tensor, generators: Array | None) -> Array:
        """Continuous actions in [-1, 1]."""
        if generators is not None and self.network.log_deviation is not None:
            noise = np.stack([generator.standard_normal(outputs.shape[1]) for generator in generators])
            outputs = outputs + noise * np.exp(np.resize(self.network.log_deviation, outputs.shape[1]))
        return np.tanh(outputs) if self.card.head == "squashed" else np.clip(outputs, -1.0, 1.0)

    def _inputs(self, seen: Seen) -> Array:
        """What each agent sees (B, A, n); a centralised policy is one agent."""
        if self.decentralised and seen.team is None:
            raise ValueError(f"{self.card.name} plays a team: hand over team_observation, what each agent sees")
        inputs: Array | None = seen.team if self.decentralised else seen.observation[:, np.newaxis]
        assert inputs is not None
        if inputs.shape[-1] != self.card.observation_size:
            raise ValueError(
                f"{self.card.name} was trained with observations of {self.card.observation_size} entries and got "
                f"{inputs.shape[-1]}: play it in the configuration of its card, preset {self.card.preset!r} with "
                f"{dict(self.card.overrides)}, or train one for this configuration"
            )
        return inputs if self._rescaled is None else self._rescaled(inputs)

    def _num_agents(self) -> int:
        if not self.decentralised:
            return 1
        space = self.spec.action_space
        entries = len(self.card.actions) if isinstance(space, spaces.MultiDiscrete) else sum(self.card.actions)
        return int(np.prod(self._shape)) // entries

    def _check(self, version: int | None) -> None:
        card, spec = self.card, self.spec
        check_role(card, spec, version)
        if (card.head == "discrete") == isinstance(spec.action_space, spaces.Box):
            raise ConfigurationError(
                f"{card.name} was trained with another action space than {spec.action_space}: play it with the options "
                f"of its card, {dict(card.overrides)}"
            )
        choices = count_actions(spec.action_space)
        if not self.decentralised and choices != card.actions:
            raise ConfigurationError(
                f"{card.name} has actions {card.actions}, the configuration {choices}: play it with the options of its "
                f"card, preset {card.preset!r} with {dict(card.overrides)}"
            )


def check_role(card: Card, spec: RoleSpec, version: int | None) -> None:
    """That a card is of this role; `version` is that of the problem, None where it does not matter.

    Raises:
        ConfigurationError: it is of another problem, role or version.
    """
    problem = find_problem(card.problem).name if ":" in card.problem else card.problem
    if (problem, card.role) != (spec.problem, spec.role):
        raise ConfigurationError(
            f"{card.name} was trained as {card.role} of {card.problem}, not as {spec.role} of {spec.problem}"
        )
    if version is not None and version != card.version:
        raise ConfigurationError(
            f"{card.name} was trained for version {card.version} of {card.problem}; this is {version}: train it again"
        )


@kernel
def _best(logits: Array, legal: BoolArray, sizes: IntArray, chosen: IntArray) -> None:
    """The first legal choice with the largest logit in each part of a row; 0 where none is legal."""
    for row in range(logits.shape[0]):
        start = 0
        for part in range(sizes.size):
            largest = -np.inf
            for choice in range(sizes[part]):
                if legal[row, start + choice] and logits[row, start + choice] > largest:
                    largest, chosen[row, part] = logits[row, start + choice], choice
            start += sizes[part]


def count_actions(space: spaces.Space[Any]) -> tuple[int, ...]:
    """Choices of each discrete entry, or (k,) for k continuous ones.

    Raises:
        TypeError: a space that policies of this package cannot play.
    """
    if isinstance(space, spaces.Discrete):
        return (int(space.n),)
    if isinstance(space, spaces.MultiDiscrete):
        return tuple(int(count) for count in np.ravel(space.nvec))
    if isinstance(space, spaces.Box):
        return (int(np.prod(space.shape)),)
    raise TypeError(f"no policy of this package plays {space}")
