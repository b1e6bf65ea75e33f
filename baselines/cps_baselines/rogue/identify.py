"""Extension beyond the paper: an attacker that finds out which defender it faces, and then responds to it."""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from cps_baselines.rogue.reading import require_one, since_onset
from cps_baselines.rogue.switching import Switching, switch
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.policies.adapter import advises
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, State

TRACE = ("front_gap_error", "front_gap_rate", "rear_gap_error", "rear_gap_rate", "speed")
SCALE = np.array([9.0, 5.0, 9.0, 5.0, 5.0])  # of the entries of a trace, in which they are compared
FARTHEST = 3.0  # of these, from where on a gap is out of sight


class Known(NamedTuple):
    """The answers to K known defenders that were searched in preset `learning`, and how to recognise each."""

    against: tuple[str, ...]
    weights: FloatArray  # (K, 7) of `Switching`, found against each of them
    traces: FloatArray  # (K, 5) what the attacker sees of them, in the mean, after the probe
    probe: FloatArray  # (7,) weights of the probe
    probe_s: float


@lru_cache(maxsize=1)
def known() -> Known:
    """The searched responses that come with the package."""
    found = json.loads(files("cps_baselines.rogue").joinpath("contested.json").read_text(encoding="utf-8"))
    rows = found["found"]
    weights, traces = (np.array([row[name] for row in rows]) for name in ("weights", "trace"))
    return Known(tuple(row["against"] for row in rows), weights, traces, np.array(found["probe"]), found["probe_s"])


class Identify(AnalyticPolicy):
    """Probes for `probe_s`, compares what it sees with known defenders, and plays its response to the nearest one.

    The known defenders, their mean traces and the responses to them are in `contested.json`.

    Raises:
        ConfigurationError: several vehicles attack together.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        require_one(spec, self)
        self.known = known()
        self.searched_numbers = self.known.weights.size + self.known.probe.size

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State]:
        """The actions (B, 1), each -1 or 1; the state holds onsets in s, signs and the rows in use (B,), -1 first."""
        since_s, onset_s = since_onset(seen, state, self.spec.config.duration_s)
        sign, row = np.ones(len(seen)), np.full(len(seen), -1)
        if state is not None:
            sign, row = np.where(seen.start, sign, state[1]), np.where(seen.start, row, state[2])
        due = (row < 0) & (since_s - self.known.probe_s > -self.spec.decision_interval_s / 2)
        if due.any():
            row = np.where(due, nearest_traces(trace_of(seen), self.known.traces), row)
        sets = np.where((row < 0)[:, np.newaxis], self.known.probe, self.known.weights[row])
        sign = switch(seen, self.spec.config.separation_m, sets, sign)
        return sign[:, np.newaxis], (onset_s, sign, row)


def trace_of(seen: Seen) -> FloatArray:
    """What tells defenders apart (B, 5): gap errors and rates, and the own speed beyond the reference."""
    values = np.stack([seen[name] for name in TRACE], axis=1)
    values[:, -1] -= seen["reference_speed"]
    trace: FloatArray = np.clip(values / SCALE, -FARTHEST, FARTHEST)
    return trace


def nearest_traces(traces: FloatArray, centres: FloatArray) -> Array:
    """For each trace (B, 5) the row of the nearest of the centres (K, 5)."""
    nearest: Array = ((traces[:, np.newaxis] - centres) ** 2).sum(axis=2).argmin(axis=1)
    return nearest


@advises("cps_baselines.rogue.advised:Contesting")
def contested(spec: RoleSpec, against: str = "monitor") -> Switching:
    """Plays `switching` with weights tuned by search against one defender in preset `learning`.

    Raises:
        ConfigurationError: nothing was searched against that defender.
    """
    names = known().against
    if against not in names:
        raise ConfigurationError(f"no response was searched against {against!r}. {near(against, names)}")
    policy = Switching(spec, known().weights[names.index(against)])
    policy.searched_numbers = policy.sets.size
    return policy
