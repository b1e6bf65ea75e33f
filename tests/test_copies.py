"""Every registered policy as an opponent: a copy in the middle of an episode goes on as the episode does."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.conformance import check_copies_against, find_subject
from cps_envs.core.declare.panel import mixture
from cps_envs.core.types import Role, other
from tests.settings import tests_of as settings_of
from tests.test_policies import OPTIONS, SHORT, cases
from tests.turns import in_turn

WAYS = (copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env)))
ATTACKED_DAY = {"onset_step": 200, "num_compromised": 2, "compromised_weights": ()}


def copies(problem: str, role: Role, reference: str, preset: str, settings: dict[str, Any]) -> bool:
    """Whether a policy plays a role here; if it does, its episodes' copies have been found to be the same."""
    env_id = f"cps_envs:{PROBLEMS[problem].env_id(other(role))}"
    return check_copies_against(find_subject(env_id, {"preset": preset, **settings}), reference)


@pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
@pytest.mark.parametrize(("problem", "role", "name"), in_turn(cases(), 3))
def test_a_copy_is_the_episode_against_every_registered_policy(problem: str, role: Role, name: str) -> None:
    presets = sorted(PROBLEMS[problem].presets, key=lambda preset: preset != "learning")
    fits = (
        copies(problem, role, OPTIONS.get(name, name), preset, short)
        for preset in presets
        for short in SHORT.get(problem, [settings_of(problem).short])
    )
    assert any(fits), "it fits no preset"


def test_a_copy_is_the_episode_against_a_mixture_of_the_told() -> None:
    told = mixture(["truth", "lookahead", "informed"])
    assert copies("hvac", "defender", told, "learning", {**ATTACKED_DAY, "num_steps": 300})


@pytest.mark.parametrize("interface", ["native", "learning"])
@pytest.mark.parametrize("opponent", ["truth", "lookahead"])
@pytest.mark.parametrize("how", WAYS)
def test_a_copied_day_goes_on_against_who_is_told_or_plans(
    how: Callable[..., Any], opponent: str, interface: str
) -> None:
    options = {"opponent": opponent, "interface": interface, "frame_skip": 20, **ATTACKED_DAY}
    env = gymnasium.make("cps_envs:cps_envs/HvacAttack-v0", preset="learning", **options)
    env.reset(seed=5)
    neutral = env.unwrapped.neutral_action  # type: ignore[attr-defined]

    def rest(which: Any, steps: int) -> list[Any]:
        return [which.step(neutral)[1] for _ in range(steps)]

    rest(env, 13)
    twin = how(env)
    rest(twin, 1)  # which the original knows nothing of
    twin = how(env)
    assert rest(env, 3) == rest(twin, 3)
