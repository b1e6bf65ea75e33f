"""Extension beyond the paper: an attacker that probes, finds out which controller it faces, and plays the answer to it.

The answers depend on the power ratio too, and each controller is answered as soon as it can be told from the others.
`identify` does the same in preset `learning`, with one ratio and one look.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from cps_baselines.rogue.reading import recalled
from cps_baselines.rogue.switching import switch
from cps_envs.core.errors import ConfigurationError, near, shown
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, IntArray, State

LOOKS_S = (0.3, 5.2, 8.8)  # after the onset: `pd`, detectors and disbanders are told apart in this order
ROUNDING = 1e-3  # of a power ratio that is read from an observation
TRACE = ("front_gap_error", "front_gap_rate", "rear_gap_error", "rear_gap_rate", "speed")
SCALE = np.array([9.0, 5.0, 9.0, 5.0, 5.0])  # of the entries of a trace, in which they are compared
FARTHEST = 3.0  # of these, from where on a gap is out of sight


class Answers(NamedTuple):
    """What was searched against K controllers at R power ratios; a ratio's answers hold up to the next one."""

    against: tuple[str, ...]  # (K,)
    ratios: FloatArray  # (R,) rising
    probes: FloatArray  # (R, 7) weights of `Switching`
    weights: FloatArray  # (R, K, 7) played from the look `at` on
    at: IntArray  # (R, K) of `LOOKS_S`
    traces: FloatArray  # (R, K, looks, 5) what the attacker sees in the mean at each look while it probes


@lru_cache(maxsize=1)
def shipped_answers() -> Answers:
    """The answers that come with the package."""
    return answers_of(json.loads(files("cps_baselines.rogue").joinpath("probing.json").read_text(encoding="utf-8")))


def answers_of(document: Mapping[str, Any]) -> Answers:
    """The answers of a file such as `probing.json`."""
    rows = document["found"]
    cells = [row["answers"] for row in rows]

    def table(name: str) -> FloatArray:
        return np.array([[cell[name] for cell in row.values()] for row in cells])

    return Answers(
        tuple(cells[0]),
        np.array([row["power_ratio"] for row in rows]),
        np.array([row["probe"] for row in rows]),
        table("weights"),
        np.searchsorted(LOOKS_S, table("answer_s") - ROUNDING),
        table("traces"),
    )


class Probe(AnalyticPolicy):
    """Probes until it recognises the defender's controller, then plays the answer to that controller.

    It compares what it sees at each of `looks_s` with the mean traces of the controllers, and answers the nearest one
    once that one is known to be recognisable. With `against` it is told the controller, and answers at the same time.
    `row` (B,) are rows of `answers` to answer by instead, as searches do.

    Raises:
        ConfigurationError: nothing was searched against that controller.
    """

    looks_s: tuple[float, ...] = LOOKS_S

    def __init__(
        self, spec: RoleSpec, against: str = "", answers: Answers | None = None, row: IntArray | None = None
    ) -> None:
        super().__init__(spec)
        self.answers = answers or shipped_answers()
        self.searched_numbers = self.answers.weights.size + self.answers.probes.size
        self.row = checked_rows("row", row, self.answers.weights.shape[1])
        if against:
            if against not in self.answers.against:
                raise ConfigurationError(
                    f"no answer was searched against {against!r}. {near(against, self.answers.against)}"
                )
            self.row = np.array([self.answers.against.index(against)])

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The actions (B, 1), each -1 or 1; the state holds onsets in s, signs and the rows in use (B,), -1 first."""
        known, now_s = self.answers, self.spec.config.duration_s - seen["time_left_s"]
        onset_s = recalled(now_s + seen["until_onset_s"], seen, state)
        sign, row = np.ones(len(seen)), np.full(len(seen), -1)
        if state is not None:
            sign, row = np.where(seen.start, sign, state[1]), np.where(seen.start, row, state[2])
        ratio = np.searchsorted(known.ratios - ROUNDING, seen["power_ratio"], side="right").clip(1) - 1
        for look, look_s in enumerate(self.looks_s):
            off_s, half_s = now_s - onset_s - look_s, self.spec.decision_interval_s / 2
            due = (row < 0) & (off_s > -half_s) & ((off_s < half_s) | self._is_last(look))
            if due.any():
                row = np.where(due, self._recognised(seen, ratio, look), row)
        sets = np.where((row < 0)[:, np.newaxis], known.probes[ratio], known.weights[ratio, row])
        sign = switch(seen, self.spec.config.separation_m, sets, sign)
        return sign[:, np.newaxis], (onset_s, sign, row)

    def _recognised(self, seen: Seen, ratio: IntArray, look: int) -> IntArray:
        """The rows (B,) to answer by from this look on, -1 where the probe goes on."""
        known = self.answers
        if self.row is None:
            row = nearest_traces(trace_of(seen), known.traces[ratio, :, look])
        else:
            row = np.resize(self.row, len(seen))
        return np.where((known.at[ratio, row] <= look) | self._is_last(look), row, -1)

    def _is_last(self, look: int) -> bool:
        return look == len(self.looks_s) - 1


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
    """For each trace (B, 5) the row of the nearest of the centres, (K, 5) or (B, K, 5)."""
    nearest: Array = ((traces[:, np.newaxis] - centres) ** 2).sum(axis=2).argmin(axis=1)
    return nearest
