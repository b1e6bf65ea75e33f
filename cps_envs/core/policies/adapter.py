"""What a learner plays a role through: its own observations and actions, and the role's action that follows from them.

The game always takes a role's own action, such as an injection level for each sensor. A learner does better with
actions in which one decision means something, such as how a lie grows. An adapter translates between the two. It
looks only at what the role observes, so a trained policy plays through it anywhere: as an opponent, in a mixture, in a
league.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.fields import Fields
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.errors import UnknownNameError, near, shown
from cps_envs.core.policies.inside import InsideAdapter
from cps_envs.core.policies.lookup import load, policy_entry
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, Observation, State

Maker = TypeVar("Maker", bound=Callable[..., Any])
ADVICE = "adapter"  # the attribute of a registered policy that says where its adapter is


def advises(path: str) -> Callable[[Maker], Maker]:
    """Say of a registered policy that learners can begin as it plays: by the adapter `"module:class"` of its name."""

    def mark(policy: Maker) -> Maker:
        setattr(policy, ADVICE, path)
        return policy

    return mark


def advised_by(policy: Any) -> Callable[[RoleSpec], Adapter] | None:
    """The adapter that belongs to a policy's class or function; None if it has none."""
    module, _, name = getattr(policy, ADVICE, "").partition(":")
    return getattr(import_module(module), name) if module else None


class Adapter(ABC):
    """A agents, one or a team, that together play a role. All have the same fields and actions.

    The methods are pure: what an adapter remembers is in `state`, a tuple of arrays with a leading axis of B
    environments, which is never changed in place.
    """

    agents: tuple[str, ...]  # A names
    fields: Fields  # of one agent's observation
    action_space: spaces.Space[Any]  # of one agent: Discrete, MultiDiscrete or Box [-1, 1]
    neutral_action: Array  # of one agent, of the action space's shape; as good as an action without a thought gets
    masked: bool = False  # whether it hands on which actions are legal, where the role has masks
    pauses: bool = False  # whether an agent that is not active is active again later in the episode
    waits: bool = False  # whether a step ends as soon as something is to be decided again, see `due`
    local: bool = False  # whether it needs `seen.team`, the own sensors of the role's team, see `core.policies.team`

    def __init__(self, spec: RoleSpec) -> None:
        self.spec = spec

    def begin(self, num_envs: int) -> State:
        """The state of episodes that start; none by default."""
        return ()

    @abstractmethod
    def observe(self, seen: Seen, state: State) -> Observation:
        """What each agent sees, (B, A, fields.size), a fresh float32 array in [-1, 1]."""

    def active(self, seen: Seen, state: State) -> BoolArray:
        """The agents (B, A) that are there, and whose action has an effect now; by default all."""
        return np.ones((len(seen), len(self.agents)), np.bool_)

    def due(self, seen: Seen, state: State) -> BoolArray:
        """The episodes (B,) in which the agents decide; in others the interface goes on without asking them."""
        return np.ones(len(seen), np.bool_)

    def masks(self, seen: Seen, state: State) -> BoolArray | None:
        """Legal actions (B, A, k), of a MultiDiscrete space flattened; None where all are legal."""
        return None

    def inside(self) -> InsideAdapter | None:
        """The same as functions of one environment, with which a GPU plays; None where nobody has written them."""
        return None

    @abstractmethod
    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The role's action (B, ...) from the agents' actions (B, A, *action_space.shape), and the next state.

        It is called at every decision of the role, also while the agents hold an action for several of them.
        """


class Native(Adapter):
    """The role as it is: one agent with the role's own observation and actions."""

    masked = True

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.agents = (spec.role,)
        self.fields, self.action_space, self.neutral_action = spec.fields, spec.action_space, spec.neutral_action

    def observe(self, seen: Seen, state: State) -> Observation:
        """The role's observation (B, 1, n)."""
        shown: Observation = seen.observation[:, np.newaxis].copy()
        return shown

    def masks(self, seen: Seen, state: State) -> BoolArray | None:
        """The role's own masks (B, 1, k)."""
        return None if seen.masks is None else seen.masks[:, np.newaxis]

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The action itself."""
        return actions[:, 0], state


def adapter_of(spec: RoleSpec, name: str) -> Adapter:
    """What a learner plays a role through, by name; every role has `native`.

    A policy of the role may have one of its own name, with which learning begins as it plays, see `advises`.

    Raises:
        UnknownNameError: the role has no adapter of this name; the message names those it has.
        ConfigurationError: the adapter does not fit the configuration.
    """
    known = {NATIVE: Native, **spec.adapters}
    entry = None if name in known else policy_entry(spec.problem, spec.role, name)
    found = known.get(name) if entry is None else advised_by(load(entry))
    if found is None:
        raise UnknownNameError(f"the {spec.role} of {spec.problem} has no adapter {shown(name)}. {near(name, known)}")
    adapter: Adapter = found(spec)
    return adapter
