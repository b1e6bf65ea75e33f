"""The paper's mitigation on robots as a policy reference."""

from __future__ import annotations

from typing import Any

from cps_baselines.testbed.cases import mitigation as name_of
from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.lookup import resolve_policy
from cps_envs.core.policy import Policy, RoleSpec
from cps_envs.testbed.problem import TESTBED


def mitigation(spec: RoleSpec, period_s: float) -> Policy:
    """The heuristic with t_s = `period_s`, as the test bed's preset `mitigated` runs it."""
    return resolve_policy(name_of(period_s, TESTBED.config("mitigated", {})), spec)


def find(name: str, spec: RoleSpec, **options: Any) -> Policy:
    """A policy of this module, for references such as `cps_agents.results.robots:mitigation?period_s=0.05`.

    Raises:
        UnknownNameError: there is none of this name.
    """
    if name != mitigation.__name__:
        raise UnknownNameError(f"there is no policy of robots {name!r}. {near(name, [mitigation.__name__])}")
    return mitigation(spec, **options)
