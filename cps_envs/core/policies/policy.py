"""The policy protocol: stable-baselines3's `predict`, batched, with an optional hook at the start of an episode."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeVar, final, runtime_checkable

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.columns import ActionColumn
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, Generators, Knowledge, Observation, Role, State

if TYPE_CHECKING:  # fields bring the compiler of kernels along
    from cps_envs.core.declare.fields import Fields
    from cps_envs.core.policies.inside import InsidePolicy

Maker = TypeVar("Maker", bound=Callable[..., Any])
PLAYS_IN = "plays_in"  # the attribute of a registered policy that says where it plays


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
    columns: tuple[ActionColumn, ...] = ()  # the entries of an action as names and units
    adapters: Mapping[str, Callable[[RoleSpec], Any]] = field(default_factory=dict)  # for learners, see `adapter_of`


@runtime_checkable
class Policy(Protocol):
    """Anything that maps a batch of observations to a batch of actions; stable-baselines3 models qualify."""

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Actions (B, ...) for observations (B, n), and the state to hand over at the next call.

        `state` is None or a tuple of arrays with a leading axis B; `episode_start` (B,) marks the environments whose
        episode begins with this observation.

        If `predict` has a parameter `action_masks`, as in sb3-contrib's MaskablePPO, it also gets the legal actions
        (B, k). If the policy's attribute `decentralised` is true, it also gets `team_observation` (B, A, m): what each
        agent of its role's team sees.

        A match asks for the most likely action, `deterministic=True`. Only a subclass of `AnalyticPolicy`, which has
        the episodes' own generators, is left to draw.
        """
        ...


def plays_in(setting: str) -> Callable[[Maker], Maker]:
    """Say of a registered policy that cannot play `learning` where it does: "paper", "paper with attack_budget=5"."""

    def mark(policy: Maker) -> Maker:
        setattr(policy, PLAYS_IN, setting)
        return policy

    return mark


def setting_of(policy: Any) -> str:
    """Where a policy's class or function says that it plays; empty if it plays in `learning`."""
    setting: str = getattr(policy, PLAYS_IN, "")
    return setting


def takes_masks(policy: Policy) -> bool:
    """Whether a policy's `predict` wants the legal actions."""
    if isinstance(policy, AnalyticPolicy):
        return policy.masked
    return "action_masks" in inspect.signature(policy.predict).parameters


def members_of(policy: Any) -> Iterator[Any]:
    """A policy that is no mixture, or those that a mixture draws from."""
    parts = getattr(policy, "policies", None)
    if isinstance(parts, tuple):
        for part in parts:
            yield from members_of(part)
    else:
        yield policy


def is_decentralised(policy: Policy) -> bool:
    """Whether a policy's `predict` wants what each agent of its role's team sees."""
    return bool(getattr(policy, "decentralised", False))


def privileged_of(policy: Policy) -> frozenset[str]:
    """What a policy has to be told beyond its observations; empty for one that is no oracle."""
    return frozenset(getattr(policy, "privileged", ()))


def begins(policy: Policy) -> bool:
    """Whether a policy wants to know when episodes start."""
    begin = getattr(type(policy), "begin", None)
    return hasattr(policy, "begin") and begin is not AnalyticPolicy.begin


def ask(policy: Policy, seen: Seen, state: State | None) -> tuple[Array, State | None]:
    """What another policy plays where a policy sees `seen`, and that policy's new state."""
    if isinstance(policy, AnalyticPolicy) and policy.sees(seen):
        return policy.answer(seen, state)
    extras: dict[str, Array] = {}
    if seen.masks is not None and takes_masks(policy):
        extras["action_masks"] = seen.masks
    if seen.team is not None and is_decentralised(policy):
        extras["team_observation"] = seen.team
    return policy.predict(seen.observation, state, seen.start, takes_mode(policy, seen.deterministic), **extras)


def takes_mode(policy: Policy, deterministic: bool) -> bool:
    """Whether a policy is asked for its most likely action: always one whose draws would not be an episode's own."""
    return deterministic or not isinstance(policy, AnalyticPolicy)


def begun(policy: Policy, generators: Generators, knowledge: Knowledge) -> State | None:
    """The state in which another policy begins episodes; None if nothing has to be handed to its first `predict`."""
    begin = getattr(policy, "begin", None)
    state: State | None = None if begin is None else begin(generators, knowledge)
    return state


def told_of(knowledge: Knowledge) -> Array:
    """What tells of each episode, as an array (B,) for a policy's state."""
    told = np.empty(len(knowledge), object)
    for b, known in enumerate(knowledge):
        told[b] = known
    return told


def repeat(action: Array, num_envs: int) -> Array:
    """One environment's action for every environment, (B, ...)."""
    return np.full((num_envs, *action.shape), action)


class AnalyticPolicy(ABC):
    """Base of policies that are computed, not learned. A subclass defines `act`, and `begin` if it has a state.

    `privileged` names what the policy needs beyond its observations; such a policy is an oracle, and reports mark it.
    `begin` gets for each episode what tells these values when it is asked. Keep that in the state and ask it at each
    decision, so that a copy of an episode is asked for its own. A `masked` policy also sees the legal actions. A
    `decentralised` one also sees what each agent of its role's team sees.
    """

    privileged: frozenset[str] = frozenset()
    masked: bool = False
    decentralised: bool = False

    def __init__(self, spec: RoleSpec) -> None:
        self.spec = spec

    def begin(self, generators: Generators, knowledge: Knowledge) -> State | None:
        """The state of episodes that start: one generator for each, and what tells its privileged values by name."""
        return None

    @abstractmethod
    def act(self, seen: Seen, state: Any) -> tuple[Array, State | None]:
        """Actions (B, ...) for what B environments show, and the state for the next call.

        `state` is what `begin` or the last call returned, of a policy without `begin` at first None; it must not be
        changed in place.
        """

    def inside(self) -> InsidePolicy | None:
        """The same as functions of one environment, with which a GPU plays; None where nobody has written them."""
        return None

    @final
    def predict(
        self,
        observation: Observation,
        state: State | None = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
        action_masks: BoolArray | None = None,
        team_observation: Observation | None = None,
    ) -> tuple[Array, State | None]:
        """See `Policy.predict`. Without a state the episodes begin here, with generators seeded 0.

        Raises:
            TypeError: a privileged policy is asked without `begin`.
        """
        seen = Seen(self.spec.fields, observation, episode_start, deterministic, action_masks, team_observation)
        return self.answer(seen, state)

    def sees(self, seen: Seen) -> bool:
        """Whether `seen` is as `predict` would make it: in these fields, and with nothing that is not asked for."""
        extra = (seen.masks is not None and not self.masked) or (seen.team is not None and not self.decentralised)
        return seen.fields is self.spec.fields and not extra

    @final
    def answer(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """What `predict` returns, for what is decoded already."""
        if state is None and begins(self):
            state = self._begin_alone(len(seen))
        return self.act(seen, state)

    def _begin_alone(self, num_envs: int) -> State | None:
        if self.privileged:
            needs = " and ".join(sorted(self.privileged))
            raise TypeError(
                f"{type(self).__name__} is privileged: it needs {needs} of each episode. Let a match play it, or call "
                "begin(generators, knowledge) and hand its state to predict"
            )
        return self.begin(np.random.default_rng(0).spawn(num_envs), [{}] * num_envs)


class Idle(AnalyticPolicy):
    """Always takes the neutral action: no attack, or no defence."""

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The neutral action for every environment."""
        return repeat(self.spec.neutral_action, len(seen)), state

    def inside(self) -> InsidePolicy:
        """Alone to do: the action stays as it is at the start."""
        from cps_envs.core.policies import inside

        nothing = inside.Alone(np.zeros(1))
        return inside.InsidePolicy(nothing, lambda _: nothing, inside.begin_blank, inside.stay)


PolicyFactory: TypeAlias = Callable[..., Policy]
