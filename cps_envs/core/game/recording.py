"""An episode as a table, for pandas and MATLAB, that `trace?file=...` plays again: a row for each game step."""

from __future__ import annotations

import csv
import gzip
import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.fields import Field
from cps_envs.core.declare.traces import KINDS, TIME
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.match import Match
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import ROLES, Array, FloatArray, Role

PAYOFF = "payoff"
MOST_SEEN = 64  # entries of an observed field that is written


@dataclass(frozen=True)
class Column:
    """A quantity of a recording."""

    name: str
    unit: str
    meaning: str


@dataclass(frozen=True)
class Recording:
    """An episode of K game steps: the state before each step, the actions in it, and the attacker's payoff.

    A last row has the state at the end; its actions and payoff are NaN. `recording["time_s"]` is a column (K + 1,), and
    `pandas.DataFrame(dict(recording))` a table of all.
    """

    head: Mapping[str, Any]  # problem, preset, players, seed
    columns: tuple[Column, ...]
    values: FloatArray  # (K + 1, columns)

    def __getitem__(self, name: str) -> FloatArray:
        return self.values[:, [column.name for column in self.columns].index(name)]

    def keys(self) -> list[str]:
        """The names of the columns."""
        return [column.name for column in self.columns]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def write(self, path: str | Path) -> None:
        """Write `.csv`, `.csv.gz` or `.parquet`, with what the episode was and the units in the head.

        In CSV the head is lines that begin with #: `pandas.read_csv(path, comment="#")`.

        Raises:
            ConfigurationError: another kind of file, or pyarrow is not installed.
        """
        Path(path).write_bytes(self.encoded(kind_of(Path(path))))

    def encoded(self, kind: str) -> bytes:
        """The content of a file of a kind, such as ".csv".

        Raises:
            ConfigurationError: pyarrow is not installed, and Parquet needs it.
        """
        if kind == ".parquet":
            return self._parquet()
        data = self.text().encode()
        return gzip.compress(data, mtime=0) if kind == ".csv.gz" else data

    def text(self) -> str:
        """The recording as CSV."""
        page = io.StringIO()
        for line in (json.dumps(dict(self.head), default=str), *(_told(column) for column in self.columns)):
            page.write(f"# {line}\n")
        writer = csv.writer(page, lineterminator="\n")
        writer.writerow(self.keys())
        writer.writerows([[_number(value) for value in row] for row in self.values.tolist()])
        return page.getvalue()

    def _parquet(self) -> bytes:
        try:
            import pyarrow
            from pyarrow import parquet
        except ImportError:
            raise ConfigurationError("Parquet needs the package pyarrow: install it, or write a .csv") from None
        told = {column.name: f"{column.unit}; {column.meaning}" for column in self.columns}
        table: Any = pyarrow.table({name: self[name] for name in self.keys()})
        notes = {"cps_envs": json.dumps(dict(self.head), default=str), "columns": json.dumps(told)}
        sink = pyarrow.BufferOutputStream()
        parquet.write_table(table.replace_schema_metadata(notes), sink)
        data: bytes = sink.getvalue().to_pybytes()
        return data


def kind_of(path: Path) -> str:
    """The kind of file that a recording is written to.

    Raises:
        ConfigurationError: there is no such kind.
    """
    kind = next((kind for kind in KINDS if path.name.lower().endswith(kind)), "")
    if not kind:
        kinds = ", ".join(KINDS)
        raise ConfigurationError(f"a recording cannot be written to {path}: name a file that ends in {kinds}")
    return kind


def record_episode(problem: Problem, config: Any, players: Mapping[Role, PolicyReference], seed: int = 0) -> Recording:
    """Play the episode of a seed and record it, as `play_episodes` plays it.

    Roles that are missing from `players` take their neutral action.
    """
    match = problem.match(config, 1, players)
    match.reset(np.ones(1, np.bool_), seeded([seed]))
    named: dict[str, Any] = {role: str(players.get(role, "none")) for role in ROLES}
    return finish_recorded(problem, match, {"seed": seed, **named})[1]


def finish_recorded(problem: Problem, match: Match, head: Mapping[str, Any]) -> tuple[FloatArray, Recording]:
    """Play a match that has been reset to its end, recording its first episode; the payoffs (B,) and the recording."""
    game, payoff, rows = match.game, np.zeros(match.game.num_envs), []
    columns = _columns(problem, match)
    while (active := (game.elapsed < game.horizon) & ~game.terminated).any():
        state = _state(problem, match) if active[0] else None
        paid = match.step({}, active, 1)
        payoff += paid
        if state is not None:
            rows.append([*state, *_actions(match), float(paid[0])])
    width = len(columns) - len(_state(problem, match))
    rows.append([*_state(problem, match), *[np.nan] * width])
    told = {"problem": problem.name, "version": problem.version, "step_s": game.step_s, **head}
    return payoff, Recording(told, columns, np.array(rows, np.float64))


def _columns(problem: Problem, match: Match) -> tuple[Column, ...]:
    """The columns of a match's first episode."""
    game, scene = match.game, _scene(problem, match)
    found = [Column(TIME, "s", "at the begin of the step")]
    for attribute, (stem, unit, meaning) in problem.recorded.items():
        value = np.asarray(getattr(scene, attribute), np.float64)
        found += [Column(name, unit, meaning) for name in _numbered(stem, value.shape)]
    for role in ROLES:
        for field in _observed(match, role):
            names = _numbered(f"seen_by_{role}_{field.name}", field.shape)
            found += [Column(name, field.unit, f"observed by the {role}; {field.description}") for name in names]
    found += [Column(name, "-", "metric so far") for name in _metrics(match)]
    for role in ROLES:
        spoken = game.columns(role)
        found += [Column(f"{role}_{each.name}", each.unit, f"action; {each.meaning}") for each in spoken]
    return (*found, Column(PAYOFF, "-", "the attacker's payoff in the step"))


def _numbered(stem: str, shape: tuple[int, ...]) -> list[str]:
    return ["_".join((stem, *(str(place + 1) for place in index))) for index in np.ndindex(shape)]


def _scene(problem: Problem, match: Match) -> Any:
    return match.game.scene(0) if problem.recorded else None


def _observed(match: Match, role: Role) -> list[Field]:
    """What is written of a role's observation: all fields but the largest, which would be most of a file."""
    return [field for field in match.game.fields[role] if 0 < field.size <= MOST_SEEN]


def _metrics(match: Match) -> dict[str, Array]:
    """The metrics, but for the time, which is a column already."""
    return {name: values for name, values in match.game.metrics().items() if name != TIME}


def _state(problem: Problem, match: Match) -> list[float]:
    """What there is before a step."""
    game, scene = match.game, _scene(problem, match)
    row = [float(game.elapsed[0]) * game.step_s]
    for attribute in problem.recorded:
        row += np.asarray(getattr(scene, attribute), np.float64).ravel().tolist()
    for role in ROLES:
        decoded = game.fields[role].decode(game.observe(role)[0])
        row += [value for field in _observed(match, role) for value in decoded[field.name].ravel().tolist()]
    return [*row, *(float(values[0]) for values in _metrics(match).values())]


def _actions(match: Match) -> list[float]:
    """What both roles have just done, in units."""
    found = []
    for role in ROLES:
        entries = np.ravel(match.action(role)[0]).astype(np.float64)
        for column, entry in zip(match.game.columns(role), entries, strict=True):
            found.append(float(column.values(np.array([entry]))[0]))
    return found


def _told(column: Column) -> str:
    unit = "" if column.unit == "-" else f" in {column.unit}"
    return f"{column.name}{unit}: {column.meaning}".rstrip(": ")


def _number(value: float) -> str:
    return "nan" if value != value else repr(value)
