"""Calls of every kind in any order: each is obeyed or refused in a sentence, and what was refused has changed nothing.

`pytest -m slow -s tests/core/interfaces/test_calls.py` makes 20,000 of them, of the four problems as well.
"""

from __future__ import annotations

import copy
import multiprocessing
import os
import pickle
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule, run_state_machine_as_test

from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from tests.core.interfaces.callers import (
    ASKED,
    BAD_CHANGES,
    BAD_OPTIONS,
    BAD_SEEDS,
    SET,
    TOYS,
    Form,
    action,
    asked,
    bad_action,
    check_clear,
    options,
    problems,
    seed,
    told,
)

DRAWS = st.integers(0, 2**32 - 1)
WAYS: tuple[Callable[[Any], Any], ...] = (copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env)))
EVERYWHERE = TOYS | problems()
Call = tuple[str, tuple[Any, ...], dict[str, Any]]


def made(env: Any, call: Call) -> str:
    """Make a call, and the digest of what comes of it."""
    name, arguments, keywords = call
    result = getattr(env if name != "configure" else env.unwrapped, name)(*arguments, **keywords)
    return "" if name == "configure" else told(env, result)


class Calls(RuleBasedStateMachine):
    """An environment, and the calls that it has obeyed since all its episodes were seeded."""

    form: Form
    counts: Counter[str] = Counter()
    elsewhere: Connection | None = None  # a process that was spawned

    @initialize()
    def start(self) -> None:
        self.env = self.form.make()
        self.log: list[tuple[Call, str]] = []
        self.changes: list[tuple[Call, str]] = []
        self.begun = self.unknown = False

    def obeyed(self, call: Call, env: Any = None) -> bool:
        """Make a call; whether it was obeyed. It is kept where it was, and refused in a sentence where not."""
        self.counts[call[0]] += 1
        try:
            found = made(self.env if env is None else env, call)
        except Exception as error:
            check_clear(error, f"{call} of {self.env}")
            self.counts["refused"] += 1
            return False
        if env is None:
            assert call[0] != "step" or self.begun, "there was no reset"
            self.log.append((call, found))
        return True

    @rule(draw=DRAWS)
    def reset(self, draw: int) -> None:
        draws = np.random.default_rng(draw)
        given: dict[str, Any] = {"seed": seed(self.env, draws), "options": options(self.env, self.form, draws)}
        whole = bool(np.all((given["options"] or {}).get("reset_mask", True)))
        if self.obeyed(("reset", (), given)):
            self.follow(given["seed"], whole=whole)

    def follow(self, given: Any, *, whole: bool) -> None:
        """A seed for all episodes makes what was before of no account; a first reset without one cannot be repeated."""
        seeded = given is not None and not (isinstance(given, list) and None in given)
        if seeded and whole:
            self.log, self.unknown = [*self.changes, self.log[-1]], False
        elif not self.begun and not isinstance(self.env, LearningVectorEnv):
            self.unknown = True
        self.begun = True

    @rule(draw=DRAWS)
    def reset_wrongly(self, draw: int) -> None:
        draws = np.random.default_rng(draw)
        wrong_seed, wrong_options = (each[int(draws.integers(len(each)))] for each in (BAD_SEEDS, BAD_OPTIONS))
        kind = draws.integers(3)
        given = {"seed": wrong_seed if kind != 1 else 3, "options": wrong_options if kind != 0 else None}
        if self.obeyed(("reset", (), given)):
            whole = not (isinstance(given["options"], dict) and "reset_mask" in given["options"])
            self.follow(given["seed"], whole=whole)

    @rule(draw=DRAWS)
    def step(self, draw: int) -> None:
        self.obeyed(("step", (action(self.env, np.random.default_rng(draw)),), {}))

    @rule(draw=DRAWS)
    def steps(self, draw: int) -> None:
        draws = np.random.default_rng(draw)
        for _ in range(3):
            self.obeyed(("step", (action(self.env, draws),), {}))

    @rule(draw=DRAWS)
    def step_wrongly(self, draw: int) -> None:
        self.obeyed(("step", (bad_action(self.env, np.random.default_rng(draw)),), {}))

    @rule(name=st.sampled_from(ASKED))
    def ask(self, name: str) -> None:
        self.counts[name] += 1
        try:
            asked(self.env, name)
        except Exception as error:
            check_clear(error, f"{name} of {self.env}")

    @rule(draw=DRAWS)
    def configure(self, draw: int) -> None:
        good = self.form.good
        self.change({**good[draw % len(good)]} | ({"opponent": "none"} if draw % 5 == 0 else {}))

    @rule(draw=DRAWS)
    def configure_wrongly(self, draw: int) -> None:
        self.change(dict(BAD_CHANGES[draw % len(BAD_CHANGES)]))

    def change(self, fields: dict[str, Any]) -> None:
        if self.obeyed(("configure", (), fields)):
            self.changes.append(self.log[-1])

    @rule(place=st.integers(0, len(SET) - 1))
    def set(self, place: int) -> None:
        self.counts["set"] += 1
        with pytest.raises(AttributeError) as raised:
            setattr(self.env.unwrapped, *SET[place])
        check_clear(raised.value, SET[place][0])

    @rule(draw=DRAWS)
    def copy(self, draw: int) -> None:
        """Go on with a copy, after the original or another copy has gone on without it."""
        self.counts["copy"] += 1
        twin = WAYS[draw % 2](self.env)
        one, two = (twin, self.env) if draw % 3 else (self.env, twin)
        for _ in range(2):
            self.obeyed(("step", (action(one, np.random.default_rng(draw)),), {}), env=one)
        self.env = two

    @rule(draw=DRAWS)
    def threads(self, draw: int) -> None:
        """Copies in threads of their own go on as the original does in another."""
        call: Call = ("step", (action(self.env, np.random.default_rng(draw)),), {})
        twins = [copy.deepcopy(self.env) for _ in range(3)]
        with ThreadPoolExecutor(4) as pool:
            results = [pool.submit(self.outcome, call, each) for each in twins]
            mine = pool.submit(self.obeyed, call)
        expected = self.log[-1][1] if mine.result() else "refused"
        assert {each.result() for each in results} == {expected}

    @rule(draw=DRAWS)
    def threads_of_one(self, draw: int) -> None:
        """Threads that share an environment get into each other's way; it does not break, and a reset mends it."""
        one, draws = copy.deepcopy(self.env), np.random.default_rng(draw)
        calls: list[Call] = [("step", (action(one, draws),), {}) for _ in range(3)]
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda call: self.obeyed(call, env=one), [*calls, ("reset", (), {"seed": 1})]))
        twin = copy.deepcopy(self.env)
        assert self.outcome(("reset", (), {"seed": 5}), one) == self.outcome(("reset", (), {"seed": 5}), twin)
        for _ in range(2):
            call: Call = ("step", (action(one, draws),), {})
            assert self.outcome(call, one) == self.outcome(call, twin)

    def outcome(self, call: Call, env: Any) -> str:
        self.counts[call[0]] += 1
        try:
            return made(env, call)
        except Exception as error:
            check_clear(error, f"{call} of {env}")
            return "refused"

    @rule(draw=DRAWS)
    def process(self, draw: int) -> None:
        """A fork goes on as this process does, and so does one that was spawned."""
        call: Call = ("step", (action(self.env, np.random.default_rng(draw)),), {})
        found = []
        if self.elsewhere is not None and draw % 2:
            self.elsewhere.send((self.env, call))
            found.append(self.elsewhere.recv())
        elif hasattr(os, "fork"):
            found.append(self.forked(call))
        expected = self.log[-1][1] if self.obeyed(call) else "refused"
        assert found in ([], [expected])

    def forked(self, call: Call) -> str:
        reader, writer = os.pipe()
        if (child := os.fork()) == 0:
            try:
                os.write(writer, self.outcome(call, self.env).encode())
            finally:
                os._exit(0)
        os.close(writer)
        with os.fdopen(reader) as pipe:
            found = pipe.read()
        os.waitpid(child, 0)
        return found

    def teardown(self) -> None:
        if not hasattr(self, "env"):
            return
        fresh, log = self.form.make(), self.changes if self.unknown or not self.begun else self.log
        for call, found in log:
            assert made(fresh, call) == found, f"{call} of {self.env} after {[each for each, _ in log]}"
        probe, draws = [self.env, fresh], np.random.default_rng(0)
        if self.unknown or not self.begun or len(log) % 2:
            assert len({made(each, ("reset", (), {"seed": 11})) for each in probe}) == 1
        for _ in range(3):
            call: Call = ("step", (action(fresh, draws),), {})
            assert len({self.outcome(call, each) for each in probe}) == 1
        self.env.close()


def run(form: Form, examples: int, length: int, elsewhere: Connection | None = None, *, derandomize: bool) -> int:
    """Call a form; how often it was called."""
    machine: Any = type("CallsOfForm", (Calls,), {"form": form, "counts": Counter(), "elsewhere": elsewhere})
    given = settings(
        max_examples=examples,
        stateful_step_count=length,
        deadline=None,
        derandomize=derandomize,
        database=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
    )
    run_state_machine_as_test(machine, settings=given)
    return sum(machine.counts.values()) - int(machine.counts["refused"])


def answer(pipe: Connection) -> None:
    """What the spawned process does."""
    machine = Calls.__new__(Calls)
    while (asked_for := pipe.recv()) is not None:
        pipe.send(machine.outcome(asked_for[1], asked_for[0]))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", TOYS)
def test_calls_in_any_order_are_obeyed_or_refused_and_nothing_else(name: str) -> None:
    assert run(TOYS[name], 4, 25, derandomize=True) > 20


@pytest.fixture(scope="module")
def elsewhere() -> Iterator[Connection]:
    """A process that was spawned, at the other end."""
    spawned = multiprocessing.get_context("spawn")
    here, there = spawned.Pipe()
    process = spawned.Process(target=answer, args=(there,), daemon=True)
    process.start()
    yield here
    here.send(None)
    process.join()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", EVERYWHERE)
def test_twenty_thousand_calls_of_all_forms(name: str, elsewhere: Connection) -> None:
    calls = 0
    while calls < 20_000 / len(EVERYWHERE):
        calls += run(EVERYWHERE[name], 3, 40, elsewhere, derandomize=False)
    print(f"{calls} calls", flush=True)
