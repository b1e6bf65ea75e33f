"""How fast somebody drove, as series: drive cycles, and what SUMO recorded of a vehicle."""

from __future__ import annotations

import functools
import io
from pathlib import Path

import numpy as np

from cps_envs.core.declare.series import Series
from cps_envs.core.declare.traces import SHIPPED, TIME, Table, even_times, read_table
from cps_envs.core.documents import MOST_BYTES, check_count, read_bytes
from cps_envs.core.errors import ConfigurationError, near

SPEEDS = {"m/s": 1.0, "mps": 1.0, "km/h": 1 / 3.6, "kmh": 1 / 3.6, "kph": 1 / 3.6, "mph": 0.44704}  # in m/s
DEEPEST = 8  # elements inside one another; SUMO writes three
TIMES = ("time_s", "time", "time_seconds", "seconds", "t", "t_s", "cycsecs", "sec", "test time, secs")
SPEED_NAMES = ("speed", "velocity", "v", "target speed", "vehicle_speed", "cyc")


def read_drive_cycle(path: str | Path, unit: str = "") -> Series:
    """A drive cycle: a table with a column of even times in s, named `time`, and one of speeds, named `speed`.

    The names may say the unit, as `speed_mph`, `speed [km/h]` or `cycMps`; else `unit` has to be m/s, km/h or mph. The
    values of the series (K,) are in m/s. CSV, gzipped CSV and Parquet are read; other columns are left alone.

    Raises:
        ConfigurationError: the file cannot be read, lacks a column or a unit, or a line in it cannot be right.
    """
    path = Path(path)
    if unit and unit not in SPEEDS:
        raise ConfigurationError(f"unit = {unit!r} is none of speed: choose m/s, km/h or mph. {near(unit, SPEEDS)}")
    table = read_table(path)
    names = [name.lower() for name in table.names]
    time = next((names.index(name) for name in TIMES if name in names), None)
    if time is None:
        raise ConfigurationError(f"{path} has no column of times in s: name it 'time_s'; it has {_listed(table)}.")
    for place, name in enumerate(names):
        stem, own = _split(name)
        if place != time and stem in SPEED_NAMES:
            if not (own or unit):
                raise ConfigurationError(
                    f"{path} does not say the unit of its column {table.names[place]!r}: "
                    "give unit='mph', 'km/h' or 'm/s'."
                )
            if own and unit and SPEEDS[own] != SPEEDS[unit]:
                raise ConfigurationError(f"{path} has speeds in {own}, but unit = {unit!r}: leave the unit out.")
            return _speeds(path, table, time, place, SPEEDS[own or unit])
    raise ConfigurationError(f"{path} has no column of speeds: name it 'speed_mps'; it has {_listed(table)}.")


def read_fcd(path: str | Path, vehicle: str = "") -> Series:
    """The speed (K,) in m/s of a vehicle in a file that SUMO wrote with `--fcd-output`; no name means the only one.

    Raises:
        ConfigurationError: it is no such file, the vehicle is not in it, or its times have gaps.
    """
    path = Path(path)
    times, speeds = _recorded(path, vehicle)
    numbers = np.array([times, speeds], np.float64).T
    table = Table(("time", "speed"), numbers, np.arange(1, len(times) + 1), "timestep")
    return _speeds(path, table, 0, 1, 1.0)


@functools.cache
def shipped_cycle(name: str) -> Series:
    """A drive cycle that comes along: udds (city), hwfet (highway) or us06 (aggressive), of the United States' EPA."""
    return read_drive_cycle(SHIPPED / f"{name}.csv")


def _split(name: str) -> tuple[str, str]:
    """What a column shows, and its unit, if its name says that."""
    plain = name.replace("[", " ").replace("]", "").replace("(", " ").replace(")", "").replace("_", " ").strip()
    for unit in SPEEDS:
        if plain.endswith(unit) and plain != unit:
            return plain[: -len(unit)].strip().rstrip(",").strip(), unit
    return plain.replace(" ", "_") if plain.replace(" ", "_") in SPEED_NAMES else plain, ""


def _speeds(path: Path, table: Table, time: int, place: int, factor: float) -> Series:
    both = table._replace(names=(TIME, "speed"), numbers=table.numbers[:, [time, place]])
    step_s, begin_s = even_times(path, both)
    values = factor * table.numbers[:, place]
    if (values < 0).any():
        row = int(np.flatnonzero(values < 0)[0])
        raise ConfigurationError(f"{path}, {table.word} {table.lines[row]}: nobody drives at {values[row]:g} m/s.")
    return Series(values, step_s, begin_s, source=path.name, lines=table.lines)


def _recorded(path: Path, vehicle: str) -> tuple[list[float], list[float]]:
    """The times and speeds of one vehicle."""
    from xml.etree import ElementTree

    found: dict[str, tuple[list[float], list[float]]] = {}
    try:
        text = read_bytes(path, MOST_BYTES).decode("utf-8-sig")
        check_count(text, "<", "tags")
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            raise ValueError("it declares a document type, which SUMO does not write")
        depth, data = 0, io.BytesIO(text.encode())
        for event, step in ElementTree.iterparse(data, ("start", "end")):
            depth += 1 if event == "start" else -1
            if depth > DEEPEST:
                raise ValueError("it is nested too deeply")
            if event == "end" and step.tag == "timestep":
                for each in step.iter("vehicle"):
                    times, speeds = found.setdefault(each.attrib["id"], ([], []))
                    times.append(float(step.attrib["time"]))
                    speeds.append(float(each.attrib["speed"]))
                step.clear()
    except (OSError, ValueError, LookupError, ElementTree.ParseError) as error:
        raise ConfigurationError(f"{path} cannot be read as SUMO's fcd-output: {error}.") from None
    if not found:
        raise ConfigurationError(f"{path} has no vehicle in it: SUMO writes them with --fcd-output.")
    if not vehicle and len(found) > 1:
        raise ConfigurationError(f"{path} has {len(found)} vehicles: name one, such as vehicle={min(found)!r}.")
    if vehicle and vehicle not in found:
        raise ConfigurationError(f"{path} has no vehicle {vehicle!r}. {near(vehicle, found)}")
    return found[vehicle or next(iter(found))]


def _listed(table: Table) -> str:
    return ", ".join(repr(name) for name in table.names)
