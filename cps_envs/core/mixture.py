"""An opponent drawn from several at the start of each episode."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.lookup import PolicyReference, resolve_policy
from cps_envs.core.policy import AnalyticPolicy, Policy, RoleSpec, State, is_decentralised, wanted
from cps_envs.core.types import Array, BoolArray, Observation


class Mixture(AnalyticPolicy):
    """Plays each episode by one of `policies`, drawn with probabilities proportional to `weights` (equal if left out).

    By name: `mixture?policies=["none","random"]&weights=[1,3]`. The players of a mixed strategy in the sense of game
    theory: nobody but the player knows which one was drawn.

    Raises:
        ConfigurationError: no policies, or weights that do not fit them.
    """

    def __init__(
        self, spec: RoleSpec, policies: Sequence[PolicyReference] = (), weights: Sequence[float] | None = None
    ) -> None:
        super().__init__(spec)
        if not policies:
            raise ConfigurationError('a mixture needs policies, such as mixture?policies=["none","random"]')
        shares = np.ones(len(policies)) if weights is None else np.asarray(weights, np.float64)
        if shares.shape != (len(policies),) or not (shares >= 0).all() or not 0 < shares.sum() < np.inf:
            raise ConfigurationError(
                f"weights = {weights} must be {len(policies)} numbers, none negative, some positive"
            )
        self.policies: tuple[Policy, ...] = tuple(resolve_policy(reference, spec) for reference in policies)
        self.probabilities = shares / shares.sum()
        wanted: list[frozenset[str]] = [getattr(policy, "privileged", frozenset()) for policy in self.policies]
        self.privileged = frozenset().union(*wanted)
        self.decentralised = any(map(is_decentralised, self.policies))

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """Draw a policy for each episode and let it begin; the state holds its index and its own state."""
        drawn = np.array([generator.choice(len(self.policies), p=self.probabilities) for generator in generators])
        own = np.full(len(generators), None, object)
        for index, policy in enumerate(self.policies):
            envs = np.flatnonzero(drawn == index).tolist()
            if envs and hasattr(policy, "begin"):
                theirs = [generators[b] for b in envs]
                _scatter(own, envs, policy.begin(theirs, [knowledge[b] for b in envs]))
        return drawn, own

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
        action_masks: BoolArray | None = None,
        team_observation: Observation | None = None,
    ) -> tuple[Array, State]:
        """The actions of each environment's policy."""
        if state is None:
            raise TypeError("a mixture draws at the start of an episode: call begin() before predict()")
        drawn, own = state[0], state[1].copy()
        actions = np.stack([self.spec.neutral_action] * len(observation))
        for index in np.unique(drawn).tolist():
            envs = np.flatnonzero(drawn == index).tolist()
            policy = self.policies[index]
            extra = wanted(
                policy,
                None if action_masks is None else action_masks[envs],
                None if team_observation is None else team_observation[envs],
            )
            start = None if episode_start is None else episode_start[envs]
            actions[envs], part = policy.predict(observation[envs], _gather(own, envs), start, deterministic, **extra)
            _scatter(own, envs, part)
        return actions, (drawn, own)


def _gather(own: Array, envs: Sequence[int]) -> State:
    """The states of some environments as one batch, zeros where there is none yet; None where all have none."""
    rows = own[envs]
    known = next((row for row in rows if row is not None), None)
    if known is None:
        return None
    blank = tuple(np.zeros_like(array) for array in known)
    return tuple(np.concatenate(parts) for parts in zip(*(blank if row is None else row for row in rows), strict=True))


def _scatter(own: Array, envs: Sequence[int], state: State) -> None:
    """Put away a batch of states, environment by environment."""
    for row, b in enumerate(envs):
        own[b] = None if state is None else tuple(array[row : row + 1] for array in state)
