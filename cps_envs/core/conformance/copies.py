"""A copy of an episode is that episode, whoever plays the other role."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

from cps_envs.core.conformance.recording import assert_same, record, replay
from cps_envs.core.conformance.subject import NotApplicableError, Subject
from cps_envs.core.declare.panel import mixture
from cps_envs.core.errors import ConfigurationError, MissingExtraError
from cps_envs.core.policies.lookup import NEED_OPTIONS, PolicyReference, policy_names
from cps_envs.core.types import other

WAYS: dict[str, Callable[[Any], Any]] = {
    "copy.deepcopy": copy.deepcopy,
    "pickle": lambda env: pickle.loads(pickle.dumps(env)),
}


def check_copies(subject: Subject) -> None:
    """Copies in the middle of an episode go on like it, against every registered opponent that can play here.

    They also do against a mixture of these.

    Raises:
        NotApplicableError: the arguments name an opponent, whom the other checks meet.
    """
    if "opponent" in subject.kwargs:
        raise NotApplicableError("the arguments name the opponent")
    names = policy_names(subject.problem.name, other(subject.role))
    able = [name for name in names if name not in NEED_OPTIONS and check_copies_against(subject, name)]
    assert check_copies_against(subject, mixture(able)), f"the opponents {able} play alone and not in a mixture"


def check_copies_against(subject: Subject, opponent: PolicyReference) -> bool:
    """Check the copies of a batch against one opponent; False if it cannot play under these arguments.

    Raises:
        AssertionError: a copy goes on differently, or there is none.
    """
    try:
        actions, expected = record(subject.batch(opponent=opponent), seed=95)
    except (ConfigurationError, MissingExtraError, TypeError):
        return False
    half = len(actions) // 2
    env = subject.batch(opponent=opponent)
    for _ in replay(env, actions[:half], seed=95):
        pass
    for way, copied in WAYS.items():
        try:
            twin = copied(env)
        except Exception as error:
            raise AssertionError(f"an episode against {opponent!r} cannot be copied by {way}: {error!r}") from error
        message = f"a copy by {way} in the middle of an episode against {opponent!r} goes on differently"
        assert_same(expected[half + 1 :], replay(twin, actions[half:]), message)
    return True
