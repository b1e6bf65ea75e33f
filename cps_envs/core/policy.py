"""The policy protocol: stable-baselines3's `predict`, batched, with an optional hook at the start of an episode."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias, runtime_checkable

import numpy as np
from gymnasium import spaces

from cps_envs.core.fields import Fields
from cps_envs.core.types import Array, BoolArray, Observation, Role

State: TypeAlias = tuple[Array, ...] | None  # arrays with a leading environment axis


@dataclass(frozen=True)
class RoleSpec:
    """What a policy may know before it plays: the public interface of its role and the public configuration."""

    problem: str
    role: Role
    fields: Fields
    action_space: spaces.Space[Any]
    neutral_action: Array  # one environment's action that changes nothing
    decision_interval_s: float
    config: Any


@runtime_checkable
class Policy(Protocol):
    """Anything that maps a batch of observations to a batch of actions; stable-baselines3 models qualify."""

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        """Actions (B, ...) for observations (B, n), and the state to hand over at the next call.

        `state` is None or a tuple of arrays with a leading axis B; `episode_start` (B,) marks the environments whose
        episode begins with this observation. A policy whose `predict` has a parameter `action_masks`, as
        sb3-contrib's MaskablePPO has, is handed the legal actions (B, k) too; one with a true attribute
        `decentralised` is handed as `team_observation` what each agent of its role's team sees (B, A, m), too.
        """
        ...


def takes_masks(policy: Policy) -> bool:
    """Whether a policy's `predict` wants the legal actions."""
    return "action_masks" in inspect.signature(policy.predict).parameters


def is_decentralised(policy: Policy) -> bool:
    """Whether a policy's `predict` wants what each agent of its role's team sees."""
    return bool(getattr(policy, "decentralised", False))


def wanted(policy: Policy, action_masks: BoolArray | None, team_observation: Observation | None) -> dict[str, Array]:
    """Those of the two that a policy's `predict` wants and that are known."""
    extras: dict[str, Array] = {}
    if action_masks is not None and takes_masks(policy):
        extras["action_masks"] = action_masks
    if team_observation is not None and is_decentralised(policy):
        extras["team_observation"] = team_observation
    return extras


class AnalyticPolicy:
    """Base of policies that are computed, not learned: they know their role's interface and start episodes knowingly.

    `privileged` names what the policy needs beyond its observations (an oracle); the match hands it to `begin`, so that
    reports can tell oracles from policies that see only what they observe.
    """

    privileged: frozenset[str] = frozenset()

    def __init__(self, spec: RoleSpec) -> None:
        self.spec = spec

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """The state of episodes that start: one generator and one mapping of privileged values for each."""
        return None

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        """See `Policy.predict`."""
        raise TypeError(
            f"{type(self).__name__} has to define predict(observation, state, episode_start, deterministic)"
        )


class Idle(AnalyticPolicy):
    """Always takes the neutral action: no attack, or no defence. A match does not even ask it."""

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        """The neutral action for every environment."""
        return np.stack([self.spec.neutral_action] * len(observation)), state


PolicyFactory: TypeAlias = Callable[..., Policy]
