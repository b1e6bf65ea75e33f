"""Any attacker behind a shield, by name: `shielded?policy="random"&kind="sound"`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from baselines.fdi.injection import task_of, view_of
from baselines.fdi.shields import make_shield
from cps_envs.core.lookup import PolicyReference, resolve_policy
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State, ask
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, FloatArray

SEEN = 1e-4  # m and m/s; how far a float32 observation may be off the state that the model gives


class Shielded(AnalyticPolicy):
    """Plays a policy's injections, or what a shield ("lp" or "sound", see `shields`) makes of them.

    It follows the state by the model and corrects it by the observations, which are of single precision.

    Raises:
        ConfigurationError: no such shield, or clipped limits, which need none.
    """

    def __init__(
        self, spec: RoleSpec, policy: PolicyReference = "random", kind: str = "lp", time_limit_s: float = 1.0
    ) -> None:
        super().__init__(spec)
        self.shield = make_shield(kind, spec.config, time_limit_s)
        self.policy = resolve_policy(policy, spec)
        self.privileged = getattr(self.policy, "privileged", frozenset())

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """Expected errors (B, 2n), the plans kept (B, horizon, S), their lengths (B,), then the policy's own state."""
        envs, config = len(generators), self.spec.config
        plans = np.zeros((envs, config.horizon, len(self.shield.form.sensors)), np.int64)
        own = (np.zeros((envs, 2 * config.num_vehicles)), plans, np.zeros(envs, np.int64))
        begin = getattr(self.policy, "begin", None)
        inner = begin(generators, knowledge) if begin is not None else None
        return (*own, *(inner or ()))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S)."""
        assert state is not None
        actions, inner = ask(self.policy, seen, state[3:] or None)
        expected, plans, lengths = state[0], state[1].copy(), state[2].copy()
        view, form = view_of(self.shield.form, seen), self.shield.form
        view = view._replace(error=_corrected(view.error, expected))
        levels = form.to_levels(view.error, view.attacked, np.asarray(actions))
        _, nearest = form.to_actions(view.error, view.attacked, levels)
        passes = self.shield.passes(view.error, view.attacked, view.step, nearest)
        levels[passes], lengths[passes] = nearest[passes], 0
        for b in np.flatnonzero(~passes).tolist():
            task, kept = task_of(self.spec.config, view, b), plans[b, : lengths[b]]
            levels[b], plan = self.shield.allow(task, view.error[b], int(view.step[b]), levels[b], kept)
            lengths[b] = len(plan)
            plans[b, : len(plan)] = plan.copy()
        actions, levels = form.to_actions(view.error, view.attacked, levels)
        expected = form.errors_after(view.error, levels)
        return actions, (expected, plans, lengths, *(inner or ()))


def _corrected(seen: FloatArray, expected: FloatArray) -> FloatArray:
    """The expected errors (B, 2n) where observations bear them out, else what was observed."""
    near = np.all(np.abs(seen - expected) < SEEN, axis=1, keepdims=True)
    return np.where(near, expected, seen)
