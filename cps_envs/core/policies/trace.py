"""A policy that does what was recorded."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.actions import choices_of
from cps_envs.core.declare.columns import ActionColumn, limits
from cps_envs.core.declare.traces import TIME, Table, read_table
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, repeat
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Knowledge, State

EVEN = 1e-6  # of a decision interval, by which times may be rounded


class Trace(AnalyticPolicy):
    """Replays the actions of a file: `trace?file=attack.csv`. `cps-envs play --record FILE` writes such files.

    The file has a column `time_s` and columns named by the role, such as `attacker_bias_c_1`; other columns are not
    read. At each decision the latest row counts. An entry without a column is neutral, and so is everything before the
    first row and from a step after the last one on. What lies outside the action space is moved to its edge, which a
    warning counts when the policy is made. What is not legal in an episode becomes the nearest legal entry, or of a
    single choice the neutral one; `illegal` counts these, and the first one warns.

    Raises:
        ConfigurationError: the file cannot be read, has no column of this role, or one that nobody knows, or a gap.
    """

    masked = True

    def __init__(self, spec: RoleSpec, *, file: str) -> None:
        super().__init__(spec)
        self.file, self.illegal = Path(file), 0
        table = read_table(self.file)
        self._times_s = _times(self.file, table)
        space = spec.action_space
        low, high = limits(space)
        entries = np.tile(np.ravel(spec.neutral_action).astype(np.float64), (len(self._times_s), 1))
        given = _given(self.file, table, spec)
        for place, column in given.items():
            entries[:, place] = spec.columns[place].entries(column)
        last: BoolArray = np.asarray(np.isnan(entries).any(axis=1))
        self._check_gaps(table, last, list(given))
        self._end_s = self._times_s[-1] if last[-1] else 2 * self._times_s[-1] - self._times_s[-2]
        entries, self._times_s = entries[: len(entries) - int(last[-1])], self._times_s[: len(entries) - int(last[-1])]
        whole = entries if isinstance(space, spaces.Box) else np.rint(entries)
        within = np.clip(whole, low, high)
        count, share = int((within != entries).sum()), entries.size
        if count:
            warnings.warn(
                f"{self.file}: {count} of {share} {spec.role} entries are outside what is legal, or between whole "
                "numbers, and have been moved to the nearest legal value",
                stacklevel=2,
            )
        kind = np.float64 if isinstance(space, spaces.Box) else np.int64
        self._actions: Array = within.astype(kind).reshape(-1, *(space.shape or ()))
        self._choices = choices_of(space) if not isinstance(space, spaces.Box) else ()

    def _check_gaps(self, table: Table, gaps: BoolArray, given: list[int]) -> None:
        """Raise ConfigurationError for a missing number anywhere but in the last row, where an episode has ended."""
        if gaps[:-1].any():
            row = int(np.flatnonzero(gaps)[0])
            names = ", ".join(f"{self.spec.role}_{self.spec.columns[place].name}" for place in given)
            raise ConfigurationError(
                f"{self.file}, {table.word} {table.lines[row]}: a number is missing in one of {names[:200]}; fill "
                "the gap"
            )
        if len(gaps) - int(gaps[-1]) < 1:
            raise ConfigurationError(f"{self.file} has no row with an action")

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """How many decisions have been made."""
        return (np.zeros(len(generators), np.int64),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """What the file says for now."""
        decisions: IntArray = state[0]
        now_s: FloatArray = np.asarray(decisions * self.spec.decision_interval_s, np.float64)
        slack = EVEN * self.spec.decision_interval_s
        rows = np.searchsorted(self._times_s, now_s + slack, side="right") - 1
        idle = (rows < 0) | (now_s + slack >= self._end_s)
        actions = repeat(self.spec.neutral_action, len(seen)).astype(self._actions.dtype)
        actions[~idle] = self._actions[rows[~idle]]
        if seen.masks is not None and self._choices:
            actions = self._legal(actions, np.asarray(seen.masks, np.bool_), now_s)
        return actions, (decisions + 1,)

    def _legal(self, actions: Array, masks: BoolArray, now_s: FloatArray) -> Array:
        """The actions (B, ...) with what the masks (B, sum of choices) forbid replaced."""
        flat = actions.reshape(len(actions), -1).copy()
        neutral = np.ravel(self.spec.neutral_action)
        for place, mask in enumerate(np.split(masks, np.cumsum(self._choices)[:-1], axis=1)):
            for b in np.flatnonzero(~mask[np.arange(len(flat)), flat[:, place]] & mask.any(axis=1)).tolist():
                if self.illegal == 0:
                    warnings.warn(
                        f"{self.file}: the {self.spec.role}'s {self.spec.columns[place].name} at {now_s[b]:g} s is not "
                        "legal here; `illegal` of the policy counts such entries",
                        stacklevel=2,
                    )
                self.illegal += 1
                legal = np.flatnonzero(mask[b])
                nearest = legal[np.abs(legal - flat[b, place]).argmin()]
                flat[b, place] = nearest if flat.shape[1] > 1 else neutral[place]
        return flat.reshape(actions.shape)


def _times(path: Path, table: Table) -> FloatArray:
    if TIME not in table.names:
        raise ConfigurationError(f"{path} has no column {TIME!r}: name the times so, in seconds")
    times = table.numbers[:, table.names.index(TIME)]
    if len(times) < 2:
        raise ConfigurationError(f"{path} has {len(times)} {table.word} of numbers, but needs at least 2")
    wrong = np.flatnonzero(~np.isfinite(times))
    if len(wrong):
        raise ConfigurationError(f"{path}, {table.word} {table.lines[wrong[0]]}, column {TIME!r}: no number")
    falls = np.flatnonzero(np.diff(times) <= 0)
    if len(falls):
        row = int(falls[0])
        raise ConfigurationError(
            f"{path}, {table.word} {table.lines[row + 1]}, column {TIME!r}: {times[row + 1]:g} s comes after "
            f"{times[row]:g} s; sort the rows, and give each time once"
        )
    return times


def _given(path: Path, table: Table, spec: RoleSpec) -> dict[int, FloatArray]:
    """The values of the columns that are there, by their place in an action.

    Raises:
        ConfigurationError: none is of the role, or one has a name that the role's action does not have.
    """
    prefix = f"{spec.role}_"
    known = {prefix + column.name: place for place, column in enumerate(spec.columns)}
    mine = [name for name in table.names if name.startswith(prefix)]
    for name in mine:
        if name not in known:
            raise ConfigurationError(
                f"{path} has the column {name!r}, which no action of the {spec.role} has in this configuration of "
                f"{spec.problem}. {near(name, known)}"
            )
    if not mine:
        raise ConfigurationError(
            f"{path} has no column of the {spec.role}'s actions: name them {_some(spec.columns, prefix)}"
        )
    found = {known[name]: table.numbers[:, table.names.index(name)] for name in mine}
    for place, column in found.items():
        odd = np.flatnonzero(np.isinf(column))
        if len(odd):
            where = f"{table.word} {table.lines[odd[0]]}, column {prefix}{spec.columns[place].name}"
            raise ConfigurationError(f"{path}, {where}: infinity is no value")
    return found


def _some(columns: tuple[ActionColumn, ...], prefix: str, most: int = 6) -> str:
    names = [f"{prefix}{column.name}" + f" ({column.unit})" * (column.unit != "-") for column in columns[:most]]
    return ", ".join(names) + ", ..." * (len(columns) > most)


def report(policy: Any) -> str:
    """What a trace that has played has to say; empty if nothing, or if it is no trace."""
    if not isinstance(policy, Trace) or policy.illegal == 0:
        return ""
    return f"{policy.file}: {policy.illegal} entries were not legal and became the nearest legal ones"
