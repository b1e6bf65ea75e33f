"""The paper's mitigation on robots as a policy reference."""

from __future__ import annotations

from baselines.testbed.mitigation import mitigation as name_of
from cps_envs.core.lookup import resolve_policy
from cps_envs.core.policy import Policy, RoleSpec
from cps_envs.testbed.problem import TESTBED


def mitigation(spec: RoleSpec, period_s: float) -> Policy:
    """The heuristic with t_s = `period_s`, as the test bed's preset `mitigated` runs it."""
    return resolve_policy(name_of(period_s, TESTBED.config("mitigated", {})), spec)
