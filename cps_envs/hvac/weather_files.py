"""Files of a typical weather year as series: EnergyPlus EPW and NREL TMY3."""

from __future__ import annotations

import csv
import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cps_envs.core.declare.series import Series
from cps_envs.core.declare.traces import SHIPPED, read_traces
from cps_envs.core.documents import MOST_BYTES, check_count, read_bytes
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import FloatArray

HOUR_S, DAY_S = 3600.0, 86_400.0
MONTH_DAYS = (31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)
EPW_HEADS, EPW_DRY_BULB, EPW_SUN = 8, 6, 13  # lines of the head, and columns of numbers from 0
DRY_BULB_C, SUN_W_PER_M2 = (
    (-90.0, 70.0),
    (0.0, 1500.0),
)  # what a measured value can be; codes of missing ones are beyond


class Weather(NamedTuple):
    """What a file says; times count from its first midnight, and its days follow each other as they stand."""

    outdoor_c: Series  # dry bulb, at the end of each hour
    ground_c: Series | None  # monthly means at the middle of each month, for a year that repeats; TMY3 has none
    sun_w_per_m2: Series  # global horizontal, the mean of each hour from its begin on

    def heat_w(self, window_m2: Sequence[float]) -> Series:
        """The heat of the sun for `internal_heat_w`, one window area (n,), m2, for each zone.

        All that falls on a horizontal m2 passes it: give an area that glass, shade and direction are in.
        """
        sun = self.sun_w_per_m2
        return Series(sun.values * np.array(window_m2, np.float64), sun.step_s, sun.begin_s, source=sun.source)


@functools.cache
def shipped_weather() -> Series:
    """The outdoor temperature of a typical year that comes along: hourly, C, Sand Point in Alaska, from NREL's TMY3."""
    return read_traces(SHIPPED / "sand_point.csv", {"outdoor_c": "C"})["outdoor_c"]


def read_epw(path: str | Path, depth: int = 0) -> Weather:
    """Dry bulb, ground at one of the depths that the head lists (the first by default), and sun of an EPW.

    Raises:
        ConfigurationError: the file cannot be read, or a line in it cannot be right.
    """
    rows = _rows(Path(path))
    if len(rows) <= EPW_HEADS or rows[0][:1] != ["LOCATION"]:
        raise ConfigurationError(f"{path} is no EPW: it begins with {EPW_HEADS} lines of which the first is LOCATION.")
    body = rows[EPW_HEADS:]
    hours = [_number(path, EPW_HEADS + k + 1, "hour", row, 3, (1, 24)) for k, row in enumerate(body)]
    _check_hours(path, EPW_HEADS + 1, hours)

    def column(name: str, at: int, limits: tuple[float, float]) -> FloatArray:
        return np.array([_number(path, EPW_HEADS + k + 1, name, row, at, limits) for k, row in enumerate(body)])

    return _weather(Path(path), _ground(path, rows, depth), column, (EPW_DRY_BULB, EPW_SUN))


def read_tmy3(path: str | Path) -> Weather:
    """Dry bulb and sun of a TMY3; it has no ground temperature.

    Raises:
        ConfigurationError: the file cannot be read, or a line in it cannot be right.
    """
    rows = _rows(Path(path))
    names = [name.strip() for name in rows[1]] if len(rows) > 2 else []
    wanted = ("Dry-bulb (C)", "GHI (W/m^2)")
    missing = [name for name in (*wanted, "Time (HH:MM)") if name not in names]
    if missing:
        raise ConfigurationError(f"{path} is no TMY3: its second line lacks the column {missing[0]!r}.")
    body, clock = rows[2:], names.index("Time (HH:MM)")
    times = [[row[clock].partition(":")[0]] if len(row) > clock else [] for row in body]
    _check_hours(path, 3, [_number(path, k + 3, "Time (HH:MM)", row, 0, (1, 24)) for k, row in enumerate(times)])

    def column(name: str, at: int, limits: tuple[float, float]) -> FloatArray:
        return np.array([_number(path, k + 3, name, row, at, limits) for k, row in enumerate(body)])

    return _weather(Path(path), None, column, (names.index(wanted[0]), names.index(wanted[1])))


Column = Callable[[str, int, tuple[float, float]], FloatArray]


def _weather(path: Path, ground: Series | None, column: Column, at: tuple[int, int]) -> Weather:
    return Weather(
        Series(column("dry bulb", at[0], DRY_BULB_C), HOUR_S, HOUR_S, source=path.name),
        ground,
        Series(column("global horizontal radiation", at[1], SUN_W_PER_M2), HOUR_S, source=path.name),
    )


def _rows(path: Path) -> list[list[str]]:
    try:
        text = read_bytes(path, MOST_BYTES).decode("latin-1")
        check_count(text, ",\r\n", "cells")
        return list(csv.reader(text.splitlines()))
    except (OSError, ValueError, csv.Error) as error:
        raise ConfigurationError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}.") from None


def _number(path: object, line: int, name: str, row: list[str], at: int, limits: tuple[float, float]) -> float:
    """A number of a line within its limits."""
    try:
        value = float(row[at])
    except (IndexError, ValueError):
        raise ConfigurationError(f"{path}, line {line}: the {name} is missing or no number.") from None
    if not limits[0] <= value <= limits[1]:
        raise ConfigurationError(f"{path}, line {line}: the {name} is {value:g}, which is no measured value.")
    return value


def _check_hours(path: object, first_line: int, hours: list[float]) -> None:
    """Raise ConfigurationError unless hours go from 1 to 24 again and again, to the end of a day."""
    for k, hour in enumerate(hours):
        if hour != k % 24 + 1:
            raise ConfigurationError(f"{path}, line {first_line + k}: hour {hour:g} where {k % 24 + 1} should follow.")
    if not hours or len(hours) % 24:
        raise ConfigurationError(f"{path} ends with hour {len(hours) % 24}, within a day: complete it or cut it off.")


def _ground(path: object, rows: list[list[str]], depth: int) -> Series | None:
    """Daily temperatures of a year that repeats; None where the head lists no depth."""
    line, row = next(
        ((k, row) for k, row in enumerate(rows[:EPW_HEADS], 1) if row[:1] == ["GROUND TEMPERATURES"]), (0, [])
    )
    if not row or row[1:2] in ([], ["0"], [""]):
        return None
    depths = int(_number(path, line, "number of depths", row, 1, (1, 99)))
    if not 0 <= depth < depths:
        raise ConfigurationError(f"{path} has ground temperatures of {depths} depths: depth = {depth} is none of them.")
    begin = 2 + 16 * depth + 4
    months = [_number(path, line, "ground temperature", row, begin + month, DRY_BULB_C) for month in range(12)]
    middles = np.cumsum(MONTH_DAYS) - np.array(MONTH_DAYS) / 2
    daily = np.interp(np.arange(365.0), middles, months, period=365.0)
    return Series(daily, DAY_S, repeats=True, source=Path(str(path)).name)
