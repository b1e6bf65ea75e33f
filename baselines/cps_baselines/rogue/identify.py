"""Extension beyond the paper: an attacker that finds out which defender it faces, and then responds to it."""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from cps_baselines.rogue.switching import Switching, switch
from cps_envs.core.adapter import advises
from cps_envs.core.errors import ConfigurationError, near, shown
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, FloatArray

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
    """Probes for `probe_s`, compares what it sees with known defenders, and answers the nearest one.

    The known defenders, their mean traces and the responses to them are in `contested.json`; `knowledge` are others.
    With `answers` (B,) it takes these rows instead of comparing, as searches do.
    """

    def __init__(self, spec: RoleSpec, knowledge: Known | None = None, answers: Array | None = None) -> None:
        super().__init__(spec)
        self.known = knowledge or known()
        self.searched_numbers = self.known.weights.size + self.known.probe.size
        self.answers = checked_rows("answers", answers, len(self.known.weights))

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The actions (B, 1), each -1 or 1; the state holds signs, onsets in s and the rows in use (B,), -1 first."""
        count, now_s = len(seen), self.spec.config.duration_s - seen["time_left_s"]
        fresh = np.ones(count), now_s + seen["until_onset_s"], np.full(count, -1)
        parts = fresh if state is None else [np.where(seen.start, *pair) for pair in zip(fresh, state, strict=True)]
        sign, onset_s, row = parts
        probed = now_s > onset_s + self.known.probe_s - self.spec.decision_interval_s / 2
        due = (row < 0) & probed
        answers = nearest_traces(trace_of(seen), self.known.traces) if self.answers is None else self.answers
        row = np.where(due, answers, row)
        sets = np.concatenate([self.known.weights, self.known.probe[np.newaxis]])[row]  # the last row is the probe
        sign = switch(seen, self.spec.config.separation_m, sets, sign)
        return sign[:, np.newaxis], (sign, onset_s, row)


def checked_rows(name: str, rows: Array | None, count: int) -> Array | None:
    """Rows (B,) of a table that has `count`, or one for all; None where none were given.

    Raises:
        ConfigurationError: they are no rows of that table.
    """
    if rows is None:
        return None
    found = np.asarray(rows)
    if found.dtype.kind not in "iu" or found.ndim > 1 or not ((found >= 0) & (found < count)).all():
        raise ConfigurationError(f"{name} = {shown(rows)} must be whole numbers from 0 to {count - 1}")
    return found


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
    """Plays `switching` with weights searched against one defender in preset `learning`.

    Raises:
        ConfigurationError: nothing was searched against that defender.
    """
    names = known().against
    if against not in names:
        raise ConfigurationError(f"no response was searched against {against!r}. {near(against, names)}")
    policy = Switching(spec, known().weights[names.index(against)])
    policy.searched_numbers = policy.sets.size
    return policy
