"""What an environment returns belongs to the caller, and what the caller hands over stays the caller's."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from cps_envs.core.conformance.recording import assert_same, difference, record, replay
from cps_envs.core.conformance.subject import Subject
from cps_envs.core.types import Array


def check_aliasing(subject: Subject) -> None:
    """Returned arrays and dictionaries are fresh: later steps do not change them, and changing them changes nothing."""
    for name, make in subject.interfaces().items():
        actions, expected = record(make(), seed=41)
        kept = list(replay(make(), actions, seed=41))
        assert_same(expected, kept, f"the {name} interface overwrites what it returned earlier")
        env = make()
        scribbled = (_scribble(result, env) for result in replay(env, actions, seed=41))
        assert_same(expected, scribbled, f"the {name} interface works on with the arrays that it returned")


def _scribble(result: tuple[Any, ...], env: Any) -> tuple[Any, ...]:
    """A copy of a result, whose own arrays and dictionaries, and the environment's masks, are then spoilt."""
    taken = copy.deepcopy(result)
    masks = [env.action_masks()] if hasattr(env, "action_masks") else []
    for array in (*_arrays(result), *masks):
        if array.flags.writeable and array.dtype != object:
            array[...] = ~array if array.dtype == np.bool_ else 55
    for part in result:
        if isinstance(part, dict):
            part.clear()
    return taken


def _arrays(value: Any) -> Iterator[Array]:
    if isinstance(value, np.ndarray):
        yield value
        if value.dtype == object:
            yield from _arrays(list(value))
    elif isinstance(value, Mapping):
        yield from _arrays(list(value.values()))
    elif isinstance(value, (tuple, list)):
        for part in value:
            yield from _arrays(part)


def check_actions_untouched(subject: Subject) -> None:
    """An action is not changed, and may be changed by the caller after the step, even where it holds for several."""
    for name, make in subject.interfaces().items():
        actions, expected = record(make(), seed=42)
        env = make()
        run = [env.reset(seed=42)]
        for action in actions:
            sent = copy.deepcopy(action)
            run.append(env.step(sent))
            assert difference(sent, action) is None, f"the {name} interface changes the action that it is handed"
            for array in _arrays(sent):
                array[...] = 0
        assert_same(expected, run, f"the {name} interface holds on to the action array that it is handed")
