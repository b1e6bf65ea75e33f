"""Where the zones of any building are drawn: rows of rooms in which linked zones share a wall as far as possible."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.config import HvacConfig

STARTS = 8  # arrangements from which a better one is sought
MOST_COLUMNS = 4  # with space for two sensors in each room; more where zones are many
ASPECT = 1.5  # width to height of a room that looks best
LEAST_SHARED = 0.08  # of the width of the building, for a door between two floors


class HouseLayout(NamedTuple):
    """Rooms (n,): each has a row, counted from the top, and a part from `begin` to `end` of the building's width."""

    row: IntArray
    begin: FloatArray
    end: FloatArray

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return int(self.row.max()) + 1

    def of(self, rooms: IntArray) -> HouseLayout:
        """Some rooms, or all in another order."""
        return HouseLayout(self.row[rooms], self.begin[rooms], self.end[rooms])

    def shared(self) -> FloatArray:
        """Which part of the width two rooms (n, n) have in common."""
        width: FloatArray = np.minimum.outer(self.end, self.end) - np.maximum.outer(self.begin, self.begin)
        return np.maximum(width, 0.0)

    def adjacent(self) -> BoolArray:
        """Which rooms (n, n) share a wall that has space for a door."""
        apart = np.abs(np.subtract.outer(self.row, self.row))
        touching = np.isclose(np.subtract.outer(self.begin, self.end), 0.0)
        beside: BoolArray = (apart == 0) & (touching | touching.T)
        return np.asarray(beside | ((apart == 1) & (self.shared() >= LEAST_SHARED)))


def arrange(config: HvacConfig, aspect: float) -> HouseLayout:
    """The room of every zone, those on the ground at the bottom, in a picture of a given width to height."""
    zones = np.arange(config.num_zones)
    ground = np.isin(zones + 1, config.ground_zones)
    floors = [zones[~ground], zones[ground]]
    sizes = [len(floor) for floor in floors]
    layouts = [_rooms(sizes, columns) for columns in range(1, max(MOST_COLUMNS, math.ceil(math.sqrt(len(zones)))) + 1)]
    rooms = min(layouts, key=lambda layout: _ugliness(layout, aspect))
    links = np.array(config.link_zones, int).reshape(-1, 2) - 1
    return rooms.of(_shortest(_distances(rooms), floors, links))


def _rooms(sizes: Iterable[int], columns: int) -> HouseLayout:
    """Rooms of floors with so many zones each, in rows of nearly the same length and at most so many columns."""
    rows = [len(row) for size in sizes if size for row in np.array_split(np.arange(size), math.ceil(size / columns))]
    places = [(row, place / count, (place + 1) / count) for row, count in enumerate(rows) for place in range(count)]
    row, begin, end = zip(*places, strict=True)
    return HouseLayout(np.array(row), np.array(begin), np.array(end))


def _ugliness(layout: HouseLayout, aspect: float) -> float:
    return float(np.abs(np.log((layout.end - layout.begin) * layout.rows * aspect / ASPECT)).mean())


def _distances(rooms: HouseLayout) -> FloatArray:
    """How far apart (n, n) rooms are; 0 if they share a wall."""
    middle = (rooms.begin + rooms.end) / 2
    apart = np.abs(np.subtract.outer(rooms.row, rooms.row)) + rooms.rows * np.abs(np.subtract.outer(middle, middle))
    return np.where(rooms.adjacent(), 0.0, apart)


def _shortest(distance: FloatArray, floors: list[IntArray], links: IntArray) -> IntArray:
    """The room (n,) of each zone; exchanges from several starts, the first of them in the order of their numbers."""
    generator = np.random.default_rng(0)
    best, least = np.empty(0, np.int64), math.inf
    for start in range(STARTS):
        order = np.concatenate([floor if start == 0 else generator.permutation(floor) for floor in floors])
        room = np.argsort(order)
        length = _exchange(room, distance, floors, links)
        if length < least:
            best, least = room, length
    return best


def _exchange(room: IntArray, distance: FloatArray, floors: list[IntArray], links: IntArray) -> float:
    """Exchange the rooms of two zones of one kind as long as that shortens the links; returns their length."""
    pairs = [(one, two) for floor in floors for place, one in enumerate(floor) for two in floor[place + 1 :]]
    length, better = _length(room, distance, links), True
    while better:
        better = False
        for one, two in pairs:
            room[[one, two]] = room[[two, one]]
            changed = _length(room, distance, links)
            if changed < length - 1e-9:
                length, better = changed, True
            else:
                room[[one, two]] = room[[two, one]]
    return length


def _length(room: IntArray, distance: FloatArray, links: IntArray) -> float:
    return float(distance[room[links[:, 0]], room[links[:, 1]]].sum())
