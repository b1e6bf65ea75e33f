"""A network that plays a role through its wiring: an adapter, held decisions, averages, scaled inputs, a team as rows.

What the network is made with does not matter. `WiredPolicy` plays any function from rows of inputs to outputs.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces

from cps_agents.zoo.card import Card
from cps_agents.zoo.network import Network
from cps_envs.core.declare.actions import choices_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.learning.wiring import Wired, Wiring
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.policies.policy import AnalyticPolicy, Policy, RoleSpec, takes_masks
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, Generators, Knowledge, Observation, State
from cps_envs.registration import PROBLEMS, find_problem

SCALING = ("mean", "deviation")
Outputs: TypeAlias = Callable[[Observation], Array]  # rows (n, columns) -> logits or means (n, k)


@dataclass(frozen=True)
class Head:
    """How the outputs of a network become actions."""

    log_deviation: Array | None = None  # of Gaussian actions, (k,)
    sampled: bool = False  # drawn, and not the most likely ones
    masked: bool = True  # only legal ones, where the inputs tell them


class WiredPolicy(AnalyticPolicy):
    """Plays outputs through a wiring, with draws from each episode's own generator if it is to draw.

    A `memory` decides by itself instead: its `predict` gets rows (n, columns) and the state that it has returned for
    their episodes, arrays (n, ...), None at first; where `episode_start` (n,) is true they are zeros. It draws with
    torch, seeded from each episode's generator.

    Raises:
        ConfigurationError: the wiring is of another problem or role, or does not fit the configuration.
        UnknownNameError: there is no such adapter.
    """

    found_in: tuple[str, Mapping[str, Any]] | None = None  # preset and changed fields that it was trained in, if known

    def __init__(
        self, spec: RoleSpec, wiring: Wiring, outputs: Outputs | None, head: Head, memory: Policy | None = None
    ) -> None:
        super().__init__(spec)
        if (wiring.problem, wiring.role) != (spec.problem, spec.role):
            raise ConfigurationError(
                f"it was trained as the {wiring.role} of {wiring.problem}, not as the {spec.role} of {spec.problem}"
            )
        self.wired = Wired(wiring, adapter_of(spec, wiring.adapter))
        self.masked, self.decentralised = wiring.masked, self.wired.adapter.local
        self._outputs, self._head, self._memory = outputs, head, memory

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The state of each episode: its generator, what is remembered, and the state of the wiring."""
        own, remembered = np.empty((2, len(generators)), object)
        own[:] = generators
        return own, remembered, *self.wired.begin(len(generators))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The role's action; agents decide only where a decision is due, and keep theirs elsewhere."""
        wired, (generators, remembered, *rest) = self.wired, state
        own: State = tuple(rest)
        due = wired.due(seen, own)
        if wired.averages or due.any():
            own = wired.see(seen, own)
        if due.any():
            drawn = self._head.sampled and not seen.deterministic
            actions, asked = own[3].copy(), due
            if self._memory is not None:
                remembered = remembered.copy()
                rows = wired.inputs(seen, own)[due]
                masks = wired.row_masks(seen, own) if takes_masks(self._memory) else None
                masks = None if masks is None else masks.reshape(len(due), wired.rows, -1)[due]
                found = self._recall(self._memory, rows, remembered[due], masks, generators[due] if drawn else None)
                actions[due], remembered[due] = found
            elif (asked := due if drawn else due & wired.active(seen, own).any(axis=1)).any():  # else without effect
                actions[asked] = self._decide(wired.inputs(seen, own)[asked], generators[asked] if drawn else None)
            own = wired.keep(seen, own, actions)
        action, own = wired.act(seen, own)
        return action, (generators, remembered, *own)

    def _recall(
        self,
        memory: Policy,
        rows: Observation,
        remembered: Array,
        masks: BoolArray | None,
        generators: Array | None,
    ) -> tuple[Array, Array]:
        """Actions (b, A, ...) for rows (b, A, columns), and what is remembered now of each episode (b,).

        With generators (b,) they are drawn, episode by episode: so no draw depends on who else decides.
        """
        if generators is not None:
            found = []
            for b, generator in enumerate(generators):
                one = slice(b, b + 1)
                with torch_seeded(generator):
                    found.append(self._asked(memory, rows[one], remembered[one], None if masks is None else masks[one]))
            actions, kept = zip(*found, strict=True)
            return np.concatenate(actions), np.concatenate(kept)
        return self._asked(memory, rows, remembered, masks, mode=True)

    def _asked(
        self, memory: Policy, rows: Observation, remembered: Array, masks: BoolArray | None, *, mode: bool = False
    ) -> tuple[Array, Array]:
        """See `_recall`; `mode`: the most likely actions."""
        wired, starts = self.wired, np.array([each is None for each in remembered])
        state: State | None = None
        if not starts.all():
            known = next(each for each in remembered if each is not None)
            blank = tuple(np.zeros_like(part) for part in known)
            state = tuple(
                map(np.concatenate, zip(*(blank if each is None else each for each in remembered), strict=True))
            )
        flat = rows.reshape(len(rows) * wired.rows, -1)
        extras: Any = {} if masks is None else {"action_masks": masks.reshape(len(flat), -1)}
        actions, after = memory.predict(flat, state, np.repeat(starts, wired.rows), deterministic=mode, **extras)
        fresh = np.empty(len(rows), object)
        by_episode = [part.reshape(len(rows), wired.rows, *part.shape[1:]) for part in after or ()]
        fresh[:] = list(zip(*by_episode, strict=True)) if by_episode else None
        return wired.row_actions(np.asarray(actions)), fresh

    def _decide(self, rows: Observation, generators: Array | None) -> Array:
        """Actions (b, A, entries) for rows (b, A, columns) of the environments that decide."""
        wired = self.wired
        assert self._outputs is not None
        found = np.asarray(self._outputs(rows.reshape(len(rows) * wired.rows, -1)))
        size = (wired.rows, found.shape[1])
        if not wired.choices:
            if generators is not None and self._head.log_deviation is not None:
                noise = np.concatenate([generator.standard_normal(size) for generator in generators])
                found = found + np.exp(self._head.log_deviation) * noise
            return wired.row_actions(np.clip(found, -1.0, 1.0))
        if generators is not None:
            found = found + np.concatenate([generator.gumbel(size=size) for generator in generators])
        if wired.columns.mask and self._head.masked:
            found = np.where(wired.legal(rows), found, -np.inf)
        ends = np.cumsum(choices_of(wired.action_space))
        parts = [part.argmax(axis=1) for part in np.split(found, ends[:-1], axis=1)]
        return wired.row_actions(np.stack(parts, axis=1) if len(parts) > 1 else parts[0])


class Recalling:
    """A network with a memory as a policy of rows, whose most likely actions it takes."""

    def __init__(self, network: Network, choices: Sequence[int]) -> None:
        self._network, self._choices = network, choices  # of discrete actions, else empty

    def predict(
        self,
        observation: Observation,
        state: State | None = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = True,
    ) -> tuple[Array, State | None]:
        """See `Policy.predict`; what is remembered is (n, cells, H)."""
        hidden, cells = self._network.blank(len(observation)) if state is None else state
        if state is not None and episode_start is not None:
            going = ~episode_start[:, np.newaxis, np.newaxis]
            hidden, cells = hidden * going, cells * going
        found, after = self._network.recall(observation, (hidden, cells))
        if not self._choices:
            return np.clip(found, -1.0, 1.0), after
        parts = np.split(found, np.cumsum(self._choices)[:-1], axis=1)
        actions = np.stack([part.argmax(axis=1) for part in parts], axis=1)
        return actions if len(parts) > 1 else actions[:, 0], after


@contextmanager
def torch_seeded(generator: np.random.Generator) -> Iterator[None]:
    """While torch, where it is loaded, draws from a seed of the generator's; afterwards it goes on where it was."""
    torch: Any = sys.modules.get("torch")
    seed = int(generator.integers(2**63 - 1))
    if torch is None:
        yield
        return
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        yield


def card_entry(wiring: Wiring, head: Head) -> dict[str, Any]:
    """A wiring as a card has it; the scaling is of a training seed and lies with its weights."""
    entry = {name: value for name, value in asdict(wiring).items() if name not in ("problem", "role", *SCALING)}
    entry |= {name: list(value) for name, value in entry.items() if isinstance(value, tuple)}
    return entry | {"sampled": head.sampled} | ({} if head.masked else {"legal": False})


def with_scaling(network: Network, wiring: Wiring) -> Network:
    """The network with a wiring's scaling, for a file."""
    mean, deviation = network.mean.copy(), network.deviation.copy()
    mean[: len(wiring.mean)], deviation[: len(wiring.mean)] = wiring.mean, wiring.deviation
    return replace(network, mean=mean, deviation=deviation)


def wired_policy(spec: RoleSpec, card: Card, network: Network, *, sampled: bool | None = None) -> WiredPolicy:
    """The policy of a card that has a wiring; `sampled` None: as the card says.

    Raises:
        ConfigurationError: it is of another problem, role, version or configuration.
        UnknownNameError: there is no such adapter.
    """
    check_role(card, spec)
    entry = dict(card.wiring)
    usual, legal = entry.pop("sampled"), entry.pop("legal", True)
    head = Head(network.log_deviation, usual if sampled is None else sampled, legal)
    tuples = {name: tuple(value) for name, value in entry.items() if isinstance(value, (list, tuple))}
    plain = Wiring(spec.problem, spec.role, **{**entry, **tuples})
    inner = Wired(plain, adapter_of(spec, plain.adapter))
    mean, deviation = (tuple(each[: inner.columns.scaled].tolist()) for each in (network.mean, network.deviation))
    unscaled = replace(network, mean=np.zeros_like(network.mean), deviation=np.ones_like(network.deviation))
    wiring = replace(plain, mean=mean, deviation=deviation)
    if network.cells:
        if head.sampled:
            raise ConfigurationError(
                f"{card.name} has a memory and plays its most likely actions only: leave deterministic=false out."
            )
        memory = Recalling(unscaled, choices_of(inner.action_space))
        policy = WiredPolicy(spec, wiring, None, head, memory)
    else:
        policy = WiredPolicy(spec, wiring, unscaled.forward, head)
    space, size = policy.wired.action_space, policy.wired.columns.size * policy.wired.together
    if (count_actions(space), size) != (card.actions, card.observation_size):
        raise ConfigurationError(
            f"{card.name} has actions {card.actions} and {card.observation_size} inputs, adapter {wiring.adapter!r} "
            f"has {space} and {size} here: play it in the configuration of its card, preset {card.preset!r} with "
            f"{dict(card.overrides)}"
        )
    return policy


def check_role(card: Card, spec: RoleSpec) -> None:
    """Check that a card is of this role.

    Raises:
        ConfigurationError: it is of another problem, role or version.
    """
    problem = find_problem(card.problem).name if ":" in card.problem else card.problem
    if (problem, card.role) != (spec.problem, spec.role):
        raise ConfigurationError(
            f"{card.name} was trained as {card.role} of {card.problem}, not as {spec.role} of {spec.problem}"
        )
    known = PROBLEMS.get(spec.problem)
    if known is not None and known.version != card.version:
        raise ConfigurationError(
            f"{card.name} was trained for version {card.version} of {card.problem}; this is {known.version}: train it "
            "again"
        )


def count_actions(space: spaces.Space[Any]) -> tuple[int, ...]:
    """Choices of each discrete entry, or (k,) for k continuous ones."""
    return choices_of(space) or (int(np.prod(space.shape or ())),)
