"""The same seed gives the same episode, and only the seed: no generator but the environment's own is touched."""

from __future__ import annotations

import random

import numpy as np

from cps_envs.core.conformance.recording import assert_same, difference, record, replay
from cps_envs.core.conformance.subject import Subject


def check_determinism(subject: Subject) -> None:
    """A whole episode repeats bit for bit, in a new environment and in one that has been played before."""
    for name, make in subject.interfaces().items():
        used = make()
        actions, expected = record(used, seed=11)
        assert_same(expected, replay(make(), actions, seed=11), f"the {name} interface does not repeat an episode")
        again = replay(used, actions, seed=11)
        assert_same(expected, again, f"the {name} interface carries something over from one episode to the next")


def check_seeding(subject: Subject) -> None:
    """A reset without seed goes on with the generator: two environments seeded alike stay alike in later episodes."""
    for name, make in subject.interfaces().items():
        one, two = make(), make()
        for seed in (3, None, None):
            found = difference(one.reset(seed=seed), two.reset(seed=seed))
            assert found is None, (
                f"the {name} interface: two environments seeded alike part after reset(seed={seed}): {found}"
            )


def check_global_random_state(subject: Subject) -> None:
    """Neither `random` nor `numpy.random` is drawn from or seeded."""
    for name, make in subject.interfaces().items():
        before = (random.getstate(), np.random.get_state(legacy=False))
        record(make(), seed=12)
        after = (random.getstate(), np.random.get_state(legacy=False))
        assert before[0] == after[0], f"the {name} interface changes the state of Python's global `random`"
        found = difference(before[1], after[1])
        assert found is None, (
            f"the {name} interface changes the state of the global numpy.random: use the environment's generator"
        )
