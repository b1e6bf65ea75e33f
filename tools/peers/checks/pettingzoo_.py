"""PettingZoo's tests of interfaces, and supersuit's wrappers."""

from __future__ import annotations

from functools import partial
from importlib import import_module

import supersuit
from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test, seed_test
from trying import DUELS, attempt, each


class Module:
    """A duel's module in preset `learning`, in which no episode ends at once."""

    def __init__(self, name: str) -> None:
        module = import_module(f"cps_envs.{name}_v0")
        self.parallel_env = partial(module.parallel_env, preset="learning")
        self.env = partial(module.env, preset="learning")


def suits(name: str) -> None:
    env = supersuit.clip_reward_v0(supersuit.frame_stack_v1(Module(name).parallel_env()))
    env.reset(seed=0)
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})


if __name__ == "__main__":
    attempt("api_test", each(lambda name: api_test(Module(name).env(), num_cycles=20), DUELS))
    attempt("parallel_api_test", each(lambda name: parallel_api_test(Module(name).parallel_env(), 20), DUELS))
    attempt("seed_test", each(lambda name: seed_test(partial(Module(name).env, max_cycles=5), 5), DUELS))
    attempt("parallel_seed_test", each(lambda name: parallel_seed_test(Module(name).parallel_env), DUELS))
    attempt("max_cycles_test", each(lambda name: max_cycles_test(Module(name)), DUELS))
    attempt("supersuit: frame_stack, clip_reward", each(suits, DUELS))
