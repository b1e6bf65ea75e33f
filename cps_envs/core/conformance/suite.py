"""All checks in a row."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import gymnasium

from cps_envs.core.conformance.aliasing import check_actions_untouched, check_aliasing
from cps_envs.core.conformance.autoreset import check_autoreset, check_reset_mask, check_time_limit
from cps_envs.core.conformance.blocks import check_frame_skip, check_threads
from cps_envs.core.conformance.configurations import check_configurations
from cps_envs.core.conformance.copies import check_copies
from cps_envs.core.conformance.declaration import check_declaration
from cps_envs.core.conformance.determinism import check_determinism, check_global_random_state, check_seeding
from cps_envs.core.conformance.endings import check_endings, check_horizon, check_reset_needed
from cps_envs.core.conformance.foreign import check_gymnasium, check_pettingzoo, check_stable_baselines3
from cps_envs.core.conformance.interfaces import check_batch, check_held_actions, check_parallel
from cps_envs.core.conformance.learned import check_flat, check_training
from cps_envs.core.conformance.legality import check_action_masks, check_bad_actions
from cps_envs.core.conformance.observations import check_live_observations, check_live_swarm, check_observations
from cps_envs.core.conformance.payoff import check_cost, check_metrics, check_return, check_zero_sum
from cps_envs.core.conformance.pictures import check_rendering
from cps_envs.core.conformance.subject import NotApplicableError, Subject, find_subject
from cps_envs.core.conformance.teams import check_agents_batch, check_rows, check_swarm
from cps_envs.core.conformance.transport import check_pickled_generator, check_pickling, check_spec, check_subprocess
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.game.problem import LEARNING, Problem
from cps_envs.core.interfaces.env import RoleEnv
from cps_envs.core.types import ROLES, Role

Check = Callable[[Subject], None]

CHECKS: tuple[Check, ...] = (
    check_declaration,
    check_gymnasium,
    check_pettingzoo,
    check_stable_baselines3,
    check_determinism,
    check_seeding,
    check_global_random_state,
    check_batch,
    check_parallel,
    check_held_actions,
    check_frame_skip,
    check_threads,
    check_swarm,
    check_agents_batch,
    check_flat,
    check_autoreset,
    check_reset_mask,
    check_time_limit,
    check_aliasing,
    check_actions_untouched,
    check_observations,
    check_live_observations,
    check_live_swarm,
    check_endings,
    check_reset_needed,
    check_horizon,
    check_return,
    check_zero_sum,
    check_metrics,
    check_cost,
    check_action_masks,
    check_bad_actions,
    check_configurations,
    check_pickling,
    check_pickled_generator,
    check_copies,
    check_spec,
    check_subprocess,
    check_rendering,
)
LEARNING_CHECKS: tuple[Check, ...] = (  # of the interface for learners
    check_gymnasium,
    check_pettingzoo,
    check_stable_baselines3,
    check_determinism,
    check_seeding,
    check_global_random_state,
    check_batch,
    check_rows,
    check_training,
    check_parallel,
    check_held_actions,
    check_frame_skip,
    check_swarm,
    check_agents_batch,
    check_flat,
    check_autoreset,
    check_reset_mask,
    check_time_limit,
    check_aliasing,
    check_actions_untouched,
    check_observations,
    check_endings,
    check_reset_needed,
    check_return,
    check_metrics,
    check_cost,
    check_action_masks,
    check_bad_actions,
    check_pickling,
    check_pickled_generator,
    check_copies,
    check_spec,
    check_subprocess,
)


@dataclass(frozen=True)
class Outcome:
    """What became of one check."""

    check: str
    subject: str
    status: Literal["passed", "skipped"]
    seconds: float
    reason: str = ""  # of being skipped

    def __str__(self) -> str:
        reason = f" ({self.reason})" if self.reason else ""
        return f"{self.status:8}{self.seconds:6.2f} s  {self.check}: {self.subject}{reason}"


class Outcomes(list[Outcome]):
    """What became of several checks; as text, how many passed, and how many were skipped for which reason."""

    def __str__(self) -> str:
        reasons = Counter(each.reason for each in self if each.status == "skipped")
        passed = f"{len(self) - reasons.total()} passed"
        return "\n".join([passed, *(f"{count} skipped: {reason}" for reason, count in reasons.most_common())])


def run_check(check: Check, subject: Subject) -> Outcome:
    """Put a subject through one check.

    Raises:
        AssertionError: it fails; the message names the check and the subject.
    """
    start = time.perf_counter()
    try:
        check(subject)
    except NotApplicableError as reason:
        return Outcome(check.__name__, str(subject), "skipped", time.perf_counter() - start, str(reason))
    except AssertionError as error:
        raise AssertionError(f"{check.__name__} of {subject}: {error}") from error
    except Exception as error:  # of the problem's own code
        raise AssertionError(f"{check.__name__} of {subject}: {type(error).__name__}: {error}") from error
    return Outcome(check.__name__, str(subject), "passed", time.perf_counter() - start)


def check_environment(
    target: str | type[RoleEnv],
    *,
    variants: Sequence[Mapping[str, Any]] = (),
    checks: Sequence[Check] = CHECKS,
    learning_checks: Sequence[Check] = LEARNING_CHECKS,
    **kwargs: Any,
) -> Outcomes:
    """Put an environment through the checks: an id such as "package:namespace/Name-v0", or a class.

    Its native interface goes through `checks`. Where its problem says how the role is learned, the interface for
    learners goes through `learning_checks`. `kwargs` go to its constructor; with `interface` among them only that one
    is checked. `variants` are further keyword arguments, each merged over them, under which
    together every observation entry has to come alive.

    Raises:
        AssertionError: at the first check that fails.
    """
    return _run(find_subject(target, kwargs, variants), checks, learning_checks)


def _run(subject: Subject, checks: Sequence[Check], learning_checks: Sequence[Check]) -> Outcomes:
    outcomes = Outcomes()
    if subject.interface == NATIVE:
        outcomes += [run_check(check, subject) for check in checks]
    if subject.interface == LEARNING or ("interface" not in subject.kwargs and subject.is_learned):
        learned = replace(subject, kwargs={**subject.kwargs, "interface": LEARNING})
        outcomes += [run_check(check, learned) for check in learning_checks]
    return outcomes


def check_problem(
    problem: Problem,
    *,
    presets: Sequence[str] | None = None,
    settings: Mapping[str, Any] | None = None,
    variants: Mapping[Role, Sequence[Mapping[str, Any]]] | None = None,
    checks: Sequence[Check] = CHECKS,
    learning_checks: Sequence[Check] = LEARNING_CHECKS,
) -> Outcomes:
    """Put both roles of a problem whose ids are registered through the checks, under each preset (default: all).

    The interfaces are those of `check_environment`, and so is `variants`. `settings` are further constructor arguments,
    for example a short duration.

    Raises:
        AssertionError: at the first check that fails.
    """
    outcomes = Outcomes()
    for preset in problem.presets if presets is None else presets:
        for role in ROLES:
            name = problem.env_id(role)
            assert name in gymnasium.registry, (
                f"{name} is not registered: its module has to run register(PROBLEM, __name__)"
            )
            subject = find_subject(name, {"preset": preset, **(settings or {})}, (variants or {}).get(role, ()))
            outcomes += _run(subject, checks, learning_checks)
    return outcomes
