"""Any attacker behind a shield, by name: `shielded?policy="random"&kind="sound"`."""

from __future__ import annotations

import numpy as np

from cps_baselines.fdi.continuation import screen
from cps_baselines.fdi.injection import new_views, task_of
from cps_baselines.fdi.shields import make_shield
from cps_envs.core.policies.lookup import PolicyReference, resolve_policy
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, ask, begun
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, State


class Shielded(AnalyticPolicy):
    """Plays another policy's injections, corrected by a shield ("lp" or "sound", see `shields`).

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

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Expected errors (B, 2n), the plans kept (B, k, S), their lengths (B,), then the policy's own state."""
        envs, config = len(generators), self.spec.config
        steps = config.horizon if self.shield.plans else 0
        plans = np.zeros((envs, steps, len(self.shield.form.sensors)), np.int64)
        own = (np.zeros((envs, 2 * config.num_vehicles)), plans, np.zeros(envs, np.int64))
        return (*own, *(begun(self.policy, generators, knowledge) or ()))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S)."""
        actions, inner = ask(self.policy, seen, state[3:] or None)
        form, (expected, plans, lengths) = self.shield.form, state[:3]
        views, wishes = new_views(form, len(seen)), np.asarray(actions, np.int64)
        levels, said, passed = np.empty_like(wishes), np.empty_like(wishes), np.empty(len(seen), np.bool_)
        by_example = self.shield.by_example
        screen(form.held, seen.observation, expected, wishes, by_example, views, levels, passed, said)
        refused = np.flatnonzero(~passed).tolist()
        if refused:
            plans, lengths = plans.copy(), np.where(passed, 0, lengths)
            for b in refused:
                task, kept = task_of(self.spec.config, views, b), plans[b, : lengths[b]]
                levels[b], plan = self.shield.allow(task, views.error[b], int(views.step[b]), levels[b], kept)
                lengths[b] = len(plan)
                plans[b, : len(plan)] = plan.copy()
            said, levels = form.to_actions(views.error, views.attacked, levels)
        else:
            lengths = np.zeros_like(lengths)
        expected = form.errors_after(views.error, levels)
        return said, (expected, plans, lengths, *(inner or ()))
