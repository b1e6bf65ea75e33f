"""Certified optima of the reachability oracle that are shipped with the package: `optima/*.json`.

A file holds one configuration and horizon, and a row for each task. `cps-envs certify` writes them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import numpy as np

from cps_envs.core.documents import Entry, Source, entry_of
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.task import Task, make_task

PROVED, INFEASIBLE, GAP_REACHED, TIME_LIMIT = "proved", "infeasible", "gap reached", "time limit"
STATUSES = (PROVED, INFEASIBLE, GAP_REACHED, TIME_LIMIT)
CLOSED = (PROVED, INFEASIBLE)
KIND = "file of optima as `cps-envs certify` writes them"
REMEDY = "Name another file with --out, or delete it."
MOST_VEHICLES, MOST_HORIZON, MOST_LEVELS = 1000, 10**6, 10**6  # in a file
FASTEST_MPS = 1e6
ROUNDING_MPS = 1e-6  # by which a value may exceed a bound
CONSTANTS = (  # of a configuration: all that the integer program depends on, besides the task
    "num_vehicles",
    "horizon",
    "desired_gap_m",
    "proportional_gain",
    "derivative_gain",
    "min_acceleration_mps2",
    "max_acceleration_mps2",
    "limit_commands",
    "limit_readings",
    "dt_s",
    "discretisation",
    "range_resolution_m",
    "rate_resolution_mps",
    "max_range_injection_m",
    "max_rate_injection_mps",
)


@dataclass(frozen=True)
class Record:
    """What is known about the highest impact speed of a task, (spec of `cross`): value <= optimum <= bound <= LP.

    All speeds are in m/s and positive; an unreachable target has the bound 0.
    """

    task: Task
    lp_mps: float | None  # with continuous injections; None: infeasible, which proves the target unreachable
    value_mps: float | None  # of `injections`; None: no integer solution is known
    bound_mps: float  # no attack is faster
    status: str  # "proved", "infeasible", "gap reached" or "time limit"
    wall_s: float
    injections: IntArray | None = field(default=None, compare=False)  # (m, q) levels, ranges first; read only

    @property
    def feasible(self) -> bool:
        """Whether an integer solution is known."""
        return self.value_mps is not None

    @property
    def closed(self) -> bool:
        """Whether nothing is left to find out."""
        return self.status in CLOSED

    @property
    def gap(self) -> float | None:
        """The part of the bound that the value falls short of, 0 to 1; None without a value."""
        if self.value_mps is None:
            return None
        return 1 - self.value_mps / self.bound_mps if self.bound_mps > 0 else 0.0


def constants(config: FdiConfig) -> dict[str, Any]:
    """What the optima of a configuration depend on; two configurations with the same constants share them."""
    return {name: getattr(config, name) for name in CONSTANTS}


def known(config: FdiConfig) -> Mapping[Task, Record]:
    """The shipped optima of a configuration and its horizon, by task; empty where no file has them."""
    return _shipped().get(tuple(constants(config).values()), MappingProxyType({}))


def known_within(config: FdiConfig) -> Mapping[Task, Record]:
    """The shipped optima of the longest horizon that is not longer than the configuration's; empty if there are none.

    Their plans are legal under the longer horizon too, after waiting or with time left; their bounds do not hold there.
    """
    for horizon in range(config.horizon, config.fewest_steps - 1, -1):
        found = _shipped().get(tuple({**constants(config), "horizon": horizon}.values()))
        if found:
            return found
    return MappingProxyType({})


def to_text(header: Mapping[str, Any], config: FdiConfig, records: Iterable[Record]) -> str:
    """A file of optima: the header's entries, the constants, then a row for each record, sorted by task."""
    entries = {**header, "constants": constants(config)}
    lines = [f"{json.dumps(name)}: {json.dumps(value)}" for name, value in entries.items()]
    rows = [json.dumps(_row(record)) for record in sorted(records, key=_order)]
    return "{\n" + "".join(f"{line},\n" for line in lines) + '"rows": [\n' + ",\n".join(rows) + "\n]\n}\n"


def from_text(text: str, name: str = "the text") -> tuple[dict[str, Any], dict[Task, Record]]:
    """The constants and the records of a file of optima.

    Raises:
        DamagedFileError: not such a file, or numbers that cannot be: a bound below its value, an injection that the
            constants do not allow.
    """
    return from_entry(entry_of(text, Source(name, KIND, REMEDY)))


def from_entry(document: Entry) -> tuple[dict[str, Any], dict[Task, Record]]:
    """See `from_text`."""
    values = document["constants"]
    num_vehicles = values["num_vehicles"].whole(2, MOST_VEHICLES)
    values["horizon"].whole(1, MOST_HORIZON)
    records = [_record(row, values, num_vehicles) for row in document["rows"].rows()]
    return values.plain(), {record.task: record for record in records}


@lru_cache(maxsize=1)
def _shipped() -> Mapping[tuple[Any, ...], Mapping[Task, Record]]:
    found = {}
    for entry in (files("cps_envs.fdi") / "optima").iterdir():
        if entry.name.endswith(".json"):
            values, records = from_text(entry.read_text(encoding="utf-8"), entry.name)
            found[tuple(values[name] for name in CONSTANTS)] = MappingProxyType(records)
    return found


def _order(record: Record) -> tuple[Any, ...]:
    sensors = record.task.sensors
    kind = (bool(sensors.range), bool(sensors.range_rate))
    return (sensors.count, kind, sensors.range, sensors.range_rate, record.task.target)


def _row(record: Record) -> dict[str, Any]:
    return {
        "attacked": str(record.task.sensors),
        "target": record.task.target,
        "lp_mps": _rounded(record.lp_mps, math.ceil),
        "value_mps": _rounded(record.value_mps, math.floor),
        "bound_mps": _rounded(record.bound_mps, math.ceil),
        "gap": _rounded(record.gap, math.ceil),
        "status": record.status,
        "wall_s": round(record.wall_s, 2),
        "injections": None if record.injections is None else record.injections.tolist(),
    }


def _rounded(value: float | None, direction: Any) -> float | None:
    """To seven digits after the point, bounds upwards and values downwards, so that what is written stays true.

    What has been written before stays as it is: digits beyond the tenth are rounding errors.
    """
    return None if value is None else direction(round(value * 1e7, 3)) / 1e7


def _record(row: Entry, values: Entry, num_vehicles: int) -> Record:
    target = row["target"].whole(1, num_vehicles)
    try:
        task = make_task(row["attacked"].text(), target, num_vehicles)
    except ConfigurationError as error:
        raise row["attacked"].error(f"attacked sensors: {error}") from error
    lp, value = row["lp_mps"], row["value_mps"]
    bound_mps = row["bound_mps"].number(0, FASTEST_MPS)
    return Record(
        task,
        None if lp.value is None else lp.number(0, FASTEST_MPS),
        None if value.value is None else value.number(0, bound_mps + ROUNDING_MPS),
        bound_mps,
        row["status"].text(STATUSES),
        row["wall_s"].number(0),
        _injections(row["injections"], task, values),
    )


def _injections(plan: Entry, task: Task, values: Entry) -> IntArray | None:
    """Levels (m, q) of the attacked sensors, ranges first, that the constants allow."""
    if plan.value is None:
        return None
    most_range, most_rate = _levels(values, "range", "m"), _levels(values, "rate", "mps")
    sensors = task.sensors
    most = np.array(
        [most_range] * (len(sensors.range) + len(sensors.rear_range))
        + [most_rate] * (len(sensors.range_rate) + len(sensors.rear_rate))
    )
    try:
        levels = np.array(plan.value)
    except ValueError:  # rows of different lengths
        levels = np.empty(0)
    if levels.dtype != np.int64 or levels.ndim != 2 or levels.shape[1] != most.size:
        raise plan.error(f"a list of steps, each with {most.size} whole numbers")
    if len(levels) > values["horizon"].whole(1, MOST_HORIZON) or (np.abs(levels) > most).any():
        raise plan.error("a plan of the horizon and the largest injections that the constants allow")
    levels.setflags(write=False)
    return levels


def _levels(values: Entry, kind: str, unit: str) -> int:
    """How many levels of a kind of sensor the constants allow in each direction, as `FdiConfig` counts them."""
    bound = values[f"max_{kind}_injection_{unit}"].number(0, FASTEST_MPS)
    resolution = values[f"{kind}_resolution_{unit}"].number(1e-9, FASTEST_MPS)
    return min(int(bound / resolution + 1e-9), MOST_LEVELS)
