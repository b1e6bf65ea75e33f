"""Public checks that any environment built on the core can be put through, ours or a user's.

    from cps_envs.core.conformance import check_environment
    print(check_environment("my_package:me/TanksAttack-v0", preset="paper", duration_s=10.0))

Each `check_*` function in `CHECKS` takes a `Subject` and raises AssertionError with a sentence about what is wrong.
`check_refinement` is about policies: it tells whether what they achieve depends on the integration step.
"""

from cps_envs.core.conformance.aliasing import check_actions_untouched, check_aliasing
from cps_envs.core.conformance.autoreset import check_autoreset, check_reset_mask, check_time_limit
from cps_envs.core.conformance.blocks import check_frame_skip, check_threads
from cps_envs.core.conformance.configurations import check_configurations
from cps_envs.core.conformance.copies import check_copies, check_copies_against
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
from cps_envs.core.conformance.refinement import Refinement, check_refinement, refine
from cps_envs.core.conformance.replay import Scripted
from cps_envs.core.conformance.subject import NotApplicableError, Subject, find_subject
from cps_envs.core.conformance.suite import (
    CHECKS,
    LEARNING_CHECKS,
    Check,
    Outcome,
    Outcomes,
    check_environment,
    check_problem,
    run_check,
)
from cps_envs.core.conformance.teams import check_agents_batch, check_rows, check_swarm
from cps_envs.core.conformance.transport import check_pickled_generator, check_pickling, check_spec, check_subprocess

__all__ = [
    "CHECKS",
    "LEARNING_CHECKS",
    "Check",
    "NotApplicableError",
    "Outcome",
    "Outcomes",
    "Refinement",
    "Scripted",
    "Subject",
    "check_action_masks",
    "check_actions_untouched",
    "check_agents_batch",
    "check_aliasing",
    "check_autoreset",
    "check_bad_actions",
    "check_batch",
    "check_configurations",
    "check_copies",
    "check_copies_against",
    "check_cost",
    "check_declaration",
    "check_determinism",
    "check_endings",
    "check_environment",
    "check_flat",
    "check_frame_skip",
    "check_global_random_state",
    "check_gymnasium",
    "check_held_actions",
    "check_horizon",
    "check_live_observations",
    "check_live_swarm",
    "check_metrics",
    "check_observations",
    "check_parallel",
    "check_pettingzoo",
    "check_pickled_generator",
    "check_pickling",
    "check_problem",
    "check_refinement",
    "check_rendering",
    "check_reset_mask",
    "check_reset_needed",
    "check_return",
    "check_rows",
    "check_seeding",
    "check_spec",
    "check_stable_baselines3",
    "check_subprocess",
    "check_swarm",
    "check_threads",
    "check_time_limit",
    "check_training",
    "check_zero_sum",
    "find_subject",
    "refine",
    "run_check",
]
