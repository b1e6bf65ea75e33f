"""The rows of the defender's agents: how each sensor compares with the filters and observers of the others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import Record, borrowed, inlined, kernel, room
from cps_envs.core.declare.config import of_bodies
from cps_envs.core.declare.fields import encode_row
from cps_envs.core.declare.series import Series
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation
from cps_envs.hvac.columns import SMALL
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.neighbours import Neighbours
from cps_envs.hvac.sensors import sensors_of_choices, zones_of_sensors

SMALL_C, SMALL_STD = SMALL["C"], SMALL["std"]


class Tables(NamedTuple):
    """Lookup tables for the rows of S sensors, with C choices; sets and filters as in `neighbours`."""

    reference_c: FloatArray  # (n,) set-points, where they stay
    scheduled: bool  # set-points change: they are observed
    duration_h: float
    zones: int
    everybody: int  # the filter of all sensors
    nobody: int  # the filter of none
    zone: IntArray  # (S,) of each sensor
    alone: IntArray  # (S,) the smallest set with the sensor
    without: IntArray  # (S,) the largest set without it
    used: BoolArray  # (C, S) which sensors each choice uses
    alike: IntArray  # (C,) the filter with the sensors of each choice


def tables(config: HvacConfig) -> Tables:
    """The tables of a configuration.

    Raises:
        ConfigurationError: see `Neighbours`.
    """
    near, used = Neighbours(config), sensors_of_choices(config)
    given = config.reference_c
    scheduled = isinstance(given, Series)
    return Tables(
        reference_c=of_bodies(0.0 if isinstance(given, Series) else given, config.num_zones),
        scheduled=scheduled,
        duration_h=config.duration_h,
        zones=config.num_zones,
        everybody=near.everybody,
        nobody=near.nobody,
        zone=zones_of_sensors(config),
        alone=near.alone,
        without=near.without,
        used=used,
        alike=(used[:, np.newaxis] == near.member).all(axis=2).argmax(axis=1),
    )


@kernel
def fill_rows(
    tables: Tables,
    observation: Observation,
    scale: FloatArray,
    offsets: Array,
    rows: Observation,
    row_scale: FloatArray,
    row_offsets: Array,
) -> None:
    """Fill `rows` (B, S, size) from what the defender observes (B, n); scales and offsets are those of the fields."""
    at, to = offsets[0], row_offsets[0]
    seen, row = room(observation.shape[1]), room(rows.shape[2])
    for b in range(len(observation)):
        for entry in range(seen.size):
            seen[entry] = observation[b, entry] * scale[1, entry] + scale[0, entry]
        last = 0
        for choice in range(len(tables.used)):
            if seen[at.last_choice + choice] > 0.5:
                last = choice
        for s in range(len(tables.zone)):
            show_innovations(tables, seen, at, last, s, row, to)
            show_others(tables, seen, at, last, s, row, to)
            show_estimates(tables, seen, at, s, row, to)
            show_residuals(tables, seen, at, s, row, to)
            row[to.left_h] = tables.duration_h - seen[at.elapsed_h]
            row[to.time_of_day] = seen[at.time_of_day]
            row[to.time_of_day + 1] = seen[at.time_of_day + 1]
            row[to.outdoor_c] = seen[at.outdoor_c]
            encode_row(row, row_scale, borrowed(rows)[b, s])


@inlined
def show_innovations(
    tables: Tables, seen: FloatArray, at: Record, last: int, s: int, row: FloatArray, to: Record
) -> None:
    """Innovations of sensor `s` by four filters, now and in the mean."""
    sensors = len(tables.zone)
    everybody, nobody = tables.everybody * sensors + s, tables.nobody * sensors + s
    without, chosen = tables.without[s] * sensors + s, tables.alike[last] * sensors + s
    row[to.i_all] = seen[at.innovation + everybody]
    row[to.i_model] = np.arcsinh(seen[at.innovation + nobody] / SMALL_STD)
    row[to.i_without] = np.arcsinh(seen[at.innovation + without] / SMALL_STD)
    row[to.i_chosen] = seen[at.innovation + chosen]
    m_all, m_model = seen[at.innovation_mean + everybody], seen[at.innovation_mean + nobody]
    m_without = seen[at.innovation_mean + without]
    row[to.m_all] = m_all
    row[to.m_model] = np.arcsinh(m_model / SMALL_STD)
    row[to.m_without] = np.arcsinh(m_without / SMALL_STD)
    row[to.m_chosen] = seen[at.innovation_mean + chosen]
    row[to.size_m_all], row[to.size_m_model], row[to.size_m_without] = abs(m_all), abs(m_model), abs(m_without)


@inlined
def show_others(tables: Tables, seen: FloatArray, at: Record, last: int, s: int, row: FloatArray, to: Record) -> None:
    """Means and largest sizes over all sensors but `s`, and which of them the last choice used."""
    sensors = len(tables.zone)
    total_all, total_model, most_all, most_model, most_without, believed = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for other in range(sensors):
        if other != s:
            m_all = seen[at.innovation_mean + tables.everybody * sensors + other]
            m_model = seen[at.innovation_mean + tables.nobody * sensors + other]
            m_without = seen[at.innovation_mean + tables.without[other] * sensors + other]
            total_all, total_model = total_all + m_all, total_model + m_model
            most_all, most_model = max(most_all, abs(m_all)), max(most_model, abs(m_model))
            most_without = max(most_without, abs(m_without))
            believed += tables.used[last, other]
    row[to.others_m_all] = total_all / (sensors - 1)
    row[to.others_m_model] = np.arcsinh(total_model / (sensors - 1) / SMALL_STD)
    row[to.most_m_all], row[to.most_m_model], row[to.most_m_without] = most_all, most_model, most_without
    row[to.believed] = tables.used[last, s]
    row[to.others_believed] = believed / (sensors - 1)


@inlined
def show_estimates(tables: Tables, seen: FloatArray, at: Record, s: int, row: FloatArray, to: Record) -> None:
    """Estimates of the zone of sensor `s`; those of set a are at row 1 + a, of filter f at `filters` + f."""
    zones, zone = tables.zones, tables.zone[s]
    filters = 1 + tables.nobody
    by_all = seen[at.estimate + (filters + tables.everybody) * zones + zone]
    by_none = seen[at.estimate + (filters + tables.nobody) * zones + zone]
    by_filter = seen[at.estimate + (filters + tables.without[s]) * zones + zone]
    observer = seen[at.estimate + (1 + tables.without[s]) * zones + zone]
    alone = seen[at.estimate + (1 + tables.alone[s]) * zones + zone]
    wanted = seen[at.reference_c + zone] if tables.scheduled else tables.reference_c[zone]
    row[to.x_all] = np.arcsinh((by_all - wanted) / SMALL_C)
    row[to.x_observer] = np.arcsinh((observer - wanted) / SMALL_C)
    row[to.observer_filter] = np.arcsinh((observer - by_all) / SMALL_C)
    row[to.alone_observer] = np.arcsinh((alone - observer) / SMALL_C)
    row[to.without_all] = np.arcsinh((by_filter - by_all) / SMALL_C)
    row[to.without_model] = np.arcsinh((by_filter - by_none) / SMALL_C)


@inlined
def show_residuals(tables: Tables, seen: FloatArray, at: Record, s: int, row: FloatArray, to: Record) -> None:
    """Residuals of the observers with and without sensor `s`, and the least of all."""
    row[to.j_without] = seen[at.residual + tables.without[s]]
    row[to.jm_without] = seen[at.mean_residual + tables.without[s]]
    row[to.j_alone] = seen[at.residual + tables.alone[s]]
    row[to.jm_alone] = seen[at.mean_residual + tables.alone[s]]
    least = seen[at.mean_residual]
    for a in range(tables.everybody):
        least = min(least, seen[at.mean_residual + a])
    row[to.jm_least] = least
