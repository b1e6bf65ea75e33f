"""Observations are float32 in [-1, 1], and every entry says something."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from cps_envs.core.conformance.actors import Crew
from cps_envs.core.conformance.recording import episode_steps, record
from cps_envs.core.conformance.subject import NotApplicableError, Subject
from cps_envs.core.declare.fields import Fields
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.interfaces.agents_vector_env import AgentsVectorEnv
from cps_envs.core.learning.wiring import CLIP
from cps_envs.core.types import Array, Observation

LIVE_ENVS = 8


def check_observations(subject: Subject) -> None:
    """Every observation of every interface is a float32 array in its space, of the declared shape, without NaN.

    In the native interface that is [-1, 1].
    """
    for name, make in subject.interfaces().items():
        env = make()
        for step, result in enumerate(record(env, seed=51)[1]):
            for key, observation, space in _observed(env, result[0]):
                where = f"the {name} interface's observation{key} at step {step}"
                assert isinstance(observation, np.ndarray), f"{where} is a {type(observation).__name__}, not an array"
                assert observation.dtype == np.float32, f"{where} has dtype {observation.dtype}, not float32"
                shape = (env.num_envs, *space.shape) if isinstance(env, AgentsVectorEnv) else space.shape
                assert observation.shape == shape, f"{where} has shape {observation.shape}, not {shape}"
                assert not np.isnan(observation).any(), f"{where} contains NaN"
                most = 1.0 if subject.interface == NATIVE else CLIP
                assert np.abs(observation).max() <= most, f"{where} leaves [-{most:g}, {most:g}]"


def _observed(env: Any, observation: Any) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(observation, Mapping):
        for agent, value in observation.items():
            yield f" of {agent}", value, env.observation_space(agent)
    else:
        yield "", observation, env.observation_space


def check_live_observations(subject: Subject) -> None:
    """Every observation entry varies in some rollout, over the subject's own arguments and all of its variants.

    An entry that never moves is dead weight for a learner, or a fault: a wrong index, a bound in the wrong unit.
    """
    extremes = Extremes()
    for variant in ({}, *subject.variants):
        batch = subject.batch(LIVE_ENVS, **{**variant, "autoreset": AutoresetMode.NEXT_STEP})
        for rows in _batch_rows(batch):
            extremes.see(batch.game.fields[subject.role], rows)
    extremes.assert_live(subject.role)


def check_live_swarm(subject: Subject) -> None:
    """The same for the agents of the swarm form: each entry varies over agents and time.

    Raises:
        NotApplicableError: the role has no swarm form.
    """
    subject.swarm()
    extremes = Extremes()
    for variant in ({}, *subject.variants):
        with contextlib.suppress(NotApplicableError):
            swarm = subject.swarm(**variant)
            for rows in _swarm_rows(swarm):
                extremes.see(swarm.outside[subject.role].adapter.fields, rows)
    extremes.assert_live("swarm's agents")


class Extremes:
    """The smallest and largest value that each entry of an observation has been seen with, by field name and place."""

    def __init__(self) -> None:
        self._seen: dict[str, tuple[Array, Array]] = {}

    def see(self, fields: Fields, rows: Observation) -> None:
        """Take note of observations (B, size)."""
        lowest, highest = rows.min(axis=0), rows.max(axis=0)
        for name, part in fields.slices.items():
            low, high = lowest[part], highest[part]
            if name in self._seen and self._seen[name][0].shape == low.shape:
                low, high = np.minimum(low, self._seen[name][0]), np.maximum(high, self._seen[name][1])
            self._seen[name] = (low, high)

    def assert_live(self, whose: str) -> None:
        """Raise AssertionError where an entry has never varied."""
        dead = [f"{name}[{i}]" for name, (low, high) in self._seen.items() for i in np.flatnonzero(low == high)]
        assert not dead, (
            f"these entries of the {whose}'s observation never vary: {', '.join(dead[:12])} ({len(dead)} in all). "
            "Remove them, or give variants (presets, opponents, configurations) that bring them to life"
        )


def _batch_rows(batch: Any) -> Iterator[Observation]:
    for seed, boldness in ((52, 0.0), (152, 0.5), (252, 1.0)):
        crew = Crew(batch, seed, boldness)
        result = batch.reset(seed=seed)
        for _ in range(episode_steps(batch)):
            yield result[0]
            result = batch.step(crew.act(result[-1]))


def _swarm_rows(swarm: Any) -> Iterator[Observation]:
    for seed, boldness in ((53, 0.0), (54, 0.7)):
        crew = Crew(swarm, seed, boldness)
        result = swarm.reset(seed=seed)
        while swarm.agents:
            yield np.stack(list(result[0].values()))
            result = swarm.step(crew.act(result[-1]))
