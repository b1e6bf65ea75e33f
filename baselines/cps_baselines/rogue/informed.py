"""Extension beyond the paper: a defender that is told who is seized, from when on, and which attacker drives."""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np

from cps_baselines.rogue.controllers import require_modes
from cps_baselines.rogue.monitor import NOBODY, Division, divide, division_of
from cps_baselines.rogue.reading import require_one
from cps_envs.core.compute.kernels import kernel
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.policy import AnalyticPolicy, Policy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Knowledge, Observation, State
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.reading import read, vehicles

NEUTRAL = "none"  # the attacker that a match does not even ask


@lru_cache(maxsize=1)
def responses() -> dict[str, dict[str, Any]]:
    """The laws that were searched against each attacker of preset `learning`, by its reference."""
    text = files("cps_baselines.rogue").joinpath("responses.json").read_text(encoding="utf-8")
    return {row.pop("against"): row for row in json.loads(text)["found"]}


class Informed(AnalyticPolicy):
    """Knows the attack: `delay_s` after the onset it switches to the laws that were tuned against it.

    It knows the seat, the onset and the attacker; its laws are in `responses.json`. Against an attacker that is not
    in there, and where `apart` is given, it takes those of `Monitor` or the given ones.
    With a delay it shows what a detection that takes so long could reach at best.

    Raises:
        ConfigurationError: unknown letters, or an environment that takes accelerations, or several attack together.
    """

    privileged = frozenset({"truth", "opponent"})

    def __init__(
        self,
        spec: RoleSpec,
        before: str = "f",
        apart: str = "",
        evade: str = "ssssl",
        near_m: float = 20.0,
        horizon_s: float = 1.0,
        delay_s: float = 0.0,
    ) -> None:
        super().__init__(spec)
        require_modes(spec, self)
        require_one(spec, self)
        self.delay_s = delay_s
        other = division_of(before, apart or "fffff", evade, near_m, horizon_s)
        rows = {} if apart else responses()
        self.known = [_opponent(reference, spec) for reference in rows]
        self.divisions = [division_of(**row) for row in rows.values()] + [other]

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The seats (B,), the onsets (B,) in s, and which of the divisions to use (B,)."""
        truths = [known["truth"] for known in knowledge]
        seats, onsets_s = ([truth[name] for truth in truths] for name in ("seat", "onset_s"))
        rows = [self._row(known["opponent"]) for known in knowledge]
        return np.array(seats, np.int64), np.array(onsets_s, np.float64), np.array(rows, np.int64)

    def _row(self, opponent: Policy | None) -> int:
        found = (k for k, known in enumerate(self.known) if _alike(known, opponent))
        return next(found, len(self.known))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The controllers (B, 2 k) of the k vehicles that get orders."""
        seats, onsets_s, rows = state
        now_s = self.spec.config.duration_s - seen["time_left_s"]
        suspects = np.where(now_s > onsets_s + self.delay_s - self.spec.decision_interval_s / 2, seats, NOBODY)
        actions = np.zeros((len(seen), 2 * self.spec.config.num_orders), np.int64)
        shown = (seen.observation, seen.fields.offsets, seen.fields.scale)
        for row in np.unique(rows):
            _divide_all(*shown, self.divisions[row], rows == row, suspects, actions)
        return actions, state


@kernel
def _divide_all(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    laws: Division,
    marked: BoolArray,
    suspects: IntArray,
    orders: IntArray,
) -> None:
    """Fill the orders (B, 2 k) of the marked environments, see `division.divide`."""
    at, values = offsets[0], np.empty(observation.shape[1])
    for b in range(suspects.size):
        if marked[b]:
            for entry in range(values.size):
                values[entry] = read(observation, scale, b, entry)
            divide(laws, suspects[b], values, at, vehicles(values, at, orders.shape[1] // 2), orders[b])


def _opponent(reference: str, spec: RoleSpec) -> Policy | None:
    """The attacker of a reference; None for the neutral one."""
    return None if reference == NEUTRAL else resolve_policy(reference, ROGUE.game(spec.config, 1).spec("attacker"))


def _alike(one: Policy | None, other: Policy | None) -> bool:
    """Whether two policies are built from the same class with the same numbers."""
    if one is None or other is None:
        return one is other
    mine, theirs = ({key: value for key, value in vars(each).items() if key != "spec"} for each in (one, other))
    same = type(one) is type(other) and mine.keys() == theirs.keys()
    return same and all(_equal(mine[key], theirs[key]) for key in mine)


def _equal(one: Any, other: Any) -> bool:
    """Whether two attributes are the same numbers; NaN is equal to NaN in records."""
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray) and one.dtype.names:
        return one.tobytes() == other.tobytes()
    return one is other or np.array_equal(one, other)
