"""Environments travel: through pickle, through JSON specs, and into processes that know only an id."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np

from cps_envs.core.conformance.recording import assert_same, difference, record, replay
from cps_envs.core.conformance.subject import NotApplicableError, Subject

WORKER = """
import json, sys
import gymnasium
job = json.load(sys.stdin)
env = gymnasium.make(job["id"], **job["kwargs"]).unwrapped
frames = [env.reset(seed=job["seed"])[0].tolist()]
for action in job["actions"]:
    observation, reward, *_ = env.step(action)
    frames.append([observation.tolist(), reward])
json.dump(frames, sys.stdout)
"""


def check_pickling(subject: Subject) -> None:
    """A copy by pickle, of a fresh environment or in the middle of an episode, goes on like the original."""
    for name, make in subject.interfaces().items():
        actions, expected = record(make(), seed=91)
        fresh = _copied(make(), name)
        assert_same(
            expected, replay(fresh, actions, seed=91), f"the {name} interface, pickled before its first reset, differs"
        )
        half = len(actions) // 2
        env = make()
        for _ in replay(env, actions[:half], seed=91):
            pass
        clone = _copied(env, name)
        message = f"the {name} interface, pickled in the middle of an episode, goes on differently"
        assert_same(expected[half + 1 :], replay(clone, actions[half:]), message)
        found = difference(env.reset(), clone.reset()) if half == len(actions) else None
        assert found is None, f"{message}: {found}"


def check_pickled_generator(subject: Subject) -> None:
    """The generators travel along: original and copy start the same later episodes."""
    for name, make in subject.interfaces().items():
        env = make()
        env.reset(seed=92)
        clone = _copied(env, name)
        for _ in range(2):
            found = difference(env.reset(), clone.reset())
            assert found is None, f"the {name} interface and its pickled copy start different episodes later: {found}"


def _copied(env: Any, name: str) -> Any:
    try:
        return pickle.loads(pickle.dumps(env))
    except Exception as error:
        raise AssertionError(f"the {name} interface cannot be pickled: {error!r}") from error


def check_spec(subject: Subject) -> None:
    """`gymnasium.make` by id, and from its spec written as JSON and read back, give the same environment.

    Raises:
        NotApplicableError: no id, or arguments that JSON has no form for.
    """
    env_id = _id_and_json(subject)
    made = gymnasium.make(env_id, **subject.kwargs)
    actions, expected = record(made.unwrapped, seed=93)
    assert made.spec is not None
    text = made.spec.to_json()
    again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(text)).unwrapped
    assert_same(expected, replay(again, actions, seed=93), "the environment made from its spec's JSON differs")
    vector = gymnasium.make_vec(env_id, 2, "vector_entry_point", **subject.kwargs)
    found = difference(vector.reset(seed=93)[0][0], expected[0][0])
    assert found is None, f"gymnasium.make_vec starts another episode than gymnasium.make: {found}"


def check_subprocess(subject: Subject) -> None:
    """A new process that only knows "module:id" makes the same environment.

    Raises:
        NotApplicableError: no id, or arguments that JSON has no form for.
    """
    env_id = _id_and_json(subject)
    actions, expected = record(subject.single(), seed=94)
    plain = [np.asarray(action).tolist() for action in actions[:20]]
    job = json.dumps({"id": env_id, "kwargs": dict(subject.kwargs), "seed": 94, "actions": plain})
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    command = [sys.executable, "-c", WORKER]
    done = subprocess.run(command, input=job, capture_output=True, text=True, env=environment, check=False, timeout=300)
    assert done.returncode == 0, f"a new process cannot make {env_id!r}: {done.stderr.strip()[-1500:]}"
    theirs = json.loads(done.stdout.splitlines()[-1])
    mine: list[Any] = [expected[0][0].tolist(), *([o.tolist(), r] for o, r, *_ in expected[1 : len(plain) + 1])]
    assert mine == theirs, f"{env_id!r} gives another trajectory in a new process"


def _id_and_json(subject: Subject) -> str:
    if subject.env_id is None:
        raise NotApplicableError("the environment has no id")
    try:
        json.dumps(dict(subject.kwargs))
    except TypeError as error:
        raise NotApplicableError(f"its arguments have no JSON form: {error}") from error
    return subject.env_id
