"""Where the zones of any building are drawn: a grid in which linked zones are neighbours as far as possible."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cps_envs.core.types import Array, IntArray
from cps_envs.hvac.config import HvacConfig

STARTS = 8  # arrangements from which a better one is sought
ASPECT = 1.5  # width to height of a room that looks best
EMPTY = 0.4  # how much worse a grid is for every cell without a zone


class Layout(NamedTuple):
    """Cells (n, 2), row and column from the upper left, of a grid with so many rows and columns."""

    cells: IntArray
    rows: int
    columns: int

    def adjacent(self, zone: int, other: int) -> bool:
        """Whether two zones, counted from 0, are side by side or one above the other."""
        return int(np.abs(self.cells[zone] - self.cells[other]).sum()) == 1


def arrange(config: HvacConfig, aspect: float) -> Layout:
    """Zones on the ground at the bottom, the others above, for a picture of a given width to height."""
    ground = np.isin(np.arange(1, config.num_zones + 1), config.ground_zones)
    on_ground, above = int(ground.sum()), int((~ground).sum())
    columns = min(range(1, config.num_zones + 1), key=lambda count: _ugliness(on_ground, above, count, aspect))
    upper = math.ceil(above / columns)
    rows = upper + math.ceil(on_ground / columns)
    grid = np.array([(row, column) for row in range(rows) for column in range(columns)])
    links = np.array(config.link_zones, int).reshape(-1, 2) - 1
    places = [np.flatnonzero(grid[:, 0] < upper), np.flatnonzero(grid[:, 0] >= upper)]
    zones = [np.flatnonzero(~ground), np.flatnonzero(ground)]
    return Layout(grid[_shortest(grid, places, zones, links)], rows, columns)


def _ugliness(on_ground: int, above: int, columns: int, aspect: float) -> float:
    rows = math.ceil(on_ground / columns) + math.ceil(above / columns)
    empty = rows * columns - on_ground - above
    return abs(math.log(aspect * rows / columns / ASPECT)) + EMPTY * empty


def _shortest(grid: Array, places: list[IntArray], zones: list[IntArray], links: IntArray) -> IntArray:
    """The cell (n,) of each zone; exchanges from several starts, the first of them in reading order."""
    generator, count = np.random.default_rng(0), sum(map(len, zones))
    apart = np.abs(grid[:, np.newaxis] - grid).sum(axis=2)
    length = np.where(apart > 1, apart, 0)
    best, least = np.zeros(count, np.int64), math.inf
    for start in range(STARTS):
        occupant = np.full(len(grid), -1)
        for cells, group in zip(places, zones, strict=True):
            occupant[cells[: len(group)]] = group if start == 0 else generator.permutation(group)
        total = _exchange(occupant, places, links, length)
        if total < least:
            best, least = _cells(occupant, count), total
    return best


def _exchange(occupant: IntArray, places: list[IntArray], links: IntArray, length: IntArray) -> float:
    """Exchange the contents of two cells of one kind as long as that shortens links; returns their length."""
    pairs = [(one, two) for cells in places for i, one in enumerate(cells) for two in cells[i + 1 :]]
    count, total, better = int(occupant.max()) + 1, math.inf, True
    total = _total(occupant, count, links, length)
    while better and total > 0:
        better = False
        for one, two in pairs:
            occupant[[one, two]] = occupant[[two, one]]
            changed = _total(occupant, count, links, length)
            if changed < total:
                total, better = changed, True
            else:
                occupant[[one, two]] = occupant[[two, one]]
    return total


def _total(occupant: IntArray, count: int, links: IntArray, length: IntArray) -> float:
    cells = _cells(occupant, count)
    return float(length[cells[links[:, 0]], cells[links[:, 1]]].sum())


def _cells(occupant: IntArray, count: int) -> IntArray:
    """The cell (count,) of each zone, by the zone in each cell or -1."""
    cells = np.zeros(count, np.int64)
    taken = np.flatnonzero(occupant >= 0)
    cells[occupant[taken]] = taken
    return cells
