"""What the text says of more sensors: a bigger reachable set, and greater speeds; checked on the shipped optima.

The certificates decide: a target is reached where an attack is known, out of reach where none exists. A task that
nobody has settled decides nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from cps_envs.fdi.config import A
from cps_envs.fdi.optima import INFEASIBLE, Record, known
from cps_envs.fdi.sensors import Sensors
from cps_envs.fdi.task import Task
from cps_paper.exhibit import Column, ExhibitTable, with_properties
from cps_paper.verdicts import OPEN, above, of_cases


@dataclass(frozen=True)
class MoreSensors:
    """Attacks on two vehicles against those on one of them with the same kind of sensor, target by target."""

    kind: str  # "x" or "v"
    gained: int  # (pair of vehicles, target) that neither vehicle alone reaches
    pairs: int  # pairs of vehicles
    larger: int  # of these, with a target that neither reaches alone
    faster: int  # of the targets that both the pair and the better of its vehicles reach: clearly faster
    reached: int  # these targets
    unsettled: int  # tasks of pairs, and comparisons of speeds, that the certificates leave open

    @property
    def claim(self) -> str:
        """As the table of claims names it."""
        sensors = {"x": "range", "v": "range-rate"}[self.kind]
        return f"two {sensors} sensors reach more, and faster"

    @property
    def verdict(self) -> str:
        """Over all pairs of vehicles, and all targets that they share; open where what is unsettled could change it."""
        hold = [True] * (self.larger + self.faster)
        hold += [False] * (self.pairs - self.larger + self.reached - self.faster)
        doubtful = {of_cases([*hold, *[answer] * self.unsettled]) for answer in (True, False)}
        return of_cases(hold) if len(doubtful) == 1 else OPEN


def compare_sensors(kind: str, records: Mapping[Task, Record]) -> MoreSensors:
    """One kind of sensor."""
    alone = {
        (vehicle, task.target): record
        for task, record in records.items()
        for vehicle in _vehicles(task.sensors, kind, 1)
    }
    gained = faster = reached = unsettled = 0
    larger: dict[Sequence[int], bool] = {}
    for task, record in records.items():
        if not (vehicles := _vehicles(task.sensors, kind, 2)):
            continue
        singles = [alone[vehicle, task.target] for vehicle in vehicles]
        more = record.feasible and not any(single.feasible for single in singles)
        gained += more
        larger[vehicles] = larger.get(vehicles, False) or more
        unsettled += not record.feasible and record.status != INFEASIBLE
        best_mps = max((single.value_mps or 0.0 for single in singles), default=0.0)
        if record.value_mps is not None and any(single.feasible for single in singles):
            reached += 1
            faster += above(record.value_mps, best_mps)
            unsettled += above(record.bound_mps, best_mps) != above(record.value_mps, best_mps)
    return MoreSensors(kind, gained, len(larger), sum(larger.values()), faster, reached, unsettled)


def _vehicles(sensors: Sensors, kind: str, count: int) -> tuple[int, ...]:
    """The vehicles whose sensors of this kind, and no others, are attacked; empty unless they are so many."""
    own, other = (sensors.range, sensors.range_rate) if kind == "x" else (sensors.range_rate, sensors.range)
    return tuple(own) if len(own) == count and not other else ()


@lru_cache(maxsize=1)
def compared_sensors() -> list[MoreSensors]:
    """Set A: Tables 3.3 against 3.1, and 3.4 against 3.2."""
    return [compare_sensors(kind, known(A)) for kind in ("x", "v")]


def sensors_table() -> ExhibitTable:
    """Two vehicles against one."""
    return ExhibitTable("Two sensors on two vehicles against one of them, set A", COLUMNS, compared_sensors(), (NOTE,))


def sensors_data() -> Iterable[dict[str, Any]]:
    """The same for JSON."""
    return list(map(with_properties("claim", "verdict"), compared_sensors()))


COLUMNS = (
    Column("sensors", "kind"),
    Column("pairs of vehicles", "pairs"),
    Column("with a new target", "larger"),
    Column("new targets", "gained"),
    Column("shared targets", "reached"),
    Column("hit faster", "faster"),
    Column("open", "unsettled"),
    Column("verdict", "verdict"),
)
NOTE = (
    "A new target is one that neither vehicle reaches alone. Shared targets are hit faster where the best known attack "
    "of the pair is more than 5 % faster than the best of one vehicle. Optima of `cps-envs certify`."
)
