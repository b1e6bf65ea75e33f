"""Algorithm 2 with the corrected condition (3.39) to (3.41): the least false data that destabilise one vehicle."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import kernel
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.sensors import KINDS

CORRECTED, PRINTED = -1.0, 1.0  # signs of e_x in (3.39) to (3.41)
AT_REST = 1e-5  # m and m/s; what a float32 observation of a platoon at rest may be off


class SearchTables(NamedTuple):
    """What the search needs to know, ready for its kernel. q sensors (range first) with up to c candidates each."""

    own: FloatArray  # (2n,) row of A_2: u_i = own @ e
    ahead: FloatArray  # (2n,) the same of vehicle i + 1; zeros for the lead's reference
    transition: FloatArray  # A (2n, 2n)
    effect: FloatArray  # (2n, q) columns of B
    readings: IntArray  # (q,) the attacked readings in e
    gains: FloatArray  # (q,) c of the condition
    lowest: FloatArray  # (q,) smallest reading error that the sensor can show, s_min; -inf where unlimited
    levels: IntArray  # (q, c) candidates in units of the resolution, smallest first, negative before positive
    values: FloatArray  # (q, c) the same in m and m/s; NaN, which no condition accepts, fills the shorter row
    moves: IntArray  # (k, q) joint candidates, as places in `levels`, cheapest first
    costs: FloatArray  # (k,) their d'd
    vehicle: int  # i - 1
    gap_sign: float
    steps: int  # N_h + 1
    width: int  # candidates kept per sensor and step; all where 0, which is exact


class Injections(NamedTuple):
    """Sequences for B platoons."""

    levels: IntArray  # (B, N_h + 1, q) in units of the resolution; zeros where no sequence exists
    found: BoolArray  # (B,)
    costs: FloatArray  # (B,) sum of d'd; inf where no sequence exists
    nodes: IntArray  # (B,) steps that the search has looked at


@lru_cache(maxsize=64)
def make_search(
    config: FdiConfig,
    vehicle: int,
    kind: str,
    steps_ahead: int = 0,
    *,
    width: int = 0,
    gap_sign: float = CORRECTED,
) -> SearchTables:
    """Algorithm 2 against sensors of vehicle i, kind "x" (range), "v" (range-rate) or "xv" (both).

    `steps_ahead` is N_h: a sequence of N_h + 1 injections is found, to be applied as a whole. `width` keeps only so
    many accepted candidates per sensor and step, a heuristic; 0 keeps all and is exact. `gap_sign` PRINTED gives the
    condition as the paper prints it. Readings are bounded where `limit_readings` says so.

    Raises:
        ConfigurationError: no such vehicle or kind, or a negative number.
    """
    n = config.num_vehicles
    if not 1 <= vehicle <= n or kind not in KINDS or steps_ahead < 0 or width < 0:
        raise ConfigurationError(
            f"branch and bound needs a vehicle from 1 to {n}, a kind of {', '.join(KINDS)}, steps_ahead >= 0 and "
            f"width >= 0; got {vehicle}, {kind!r}, {steps_ahead}, {width}."
        )
    model = config.model
    range_wanted, rate_wanted = "x" in kind, "v" in kind
    wanted = np.array([range_wanted, rate_wanted])
    readings = np.array([vehicle - 1, n + vehicle - 1])[wanted]
    bounds = np.array([config.range_levels, config.rate_levels])[wanted]
    resolution = np.array([config.range_resolution_m, config.rate_resolution_mps])[wanted]
    gains = len(readings) * np.array([config.proportional_gain, config.derivative_gain])[wanted]
    lowest = np.array([-config.desired_gap_m if config.limit_readings else -np.inf, -np.inf])[wanted]
    levels, values = _candidates(bounds, resolution)
    moves, costs = _joint(values)
    return SearchTables(
        own=model.feedback[vehicle - 1],
        ahead=model.feedback[vehicle] if vehicle < n else np.zeros(2 * n),
        transition=model.transition,
        effect=np.ascontiguousarray(model.injection[:, readings]),
        readings=readings,
        gains=gains,
        lowest=lowest,
        levels=levels,
        values=values,
        moves=moves,
        costs=costs,
        vehicle=vehicle - 1,
        gap_sign=gap_sign,
        steps=steps_ahead + 1,
        width=width,
    )


def find_injections(search: SearchTables, errors: FloatArray) -> Injections:
    """The cheapest sequence for each of B true states e (B, 2n)."""
    envs = len(errors)
    path = np.empty((envs, search.steps, errors.shape[1]))
    path[:, 0] = errors
    chosen = np.full((envs, search.steps), -1)
    costs, nodes = np.full(envs, np.inf), np.ones(envs, np.int64)
    _search_all(search, path, chosen, costs, nodes)
    found = costs < np.inf
    levels = search.levels[np.arange(len(search.readings)), search.moves[chosen]]
    return Injections(np.where(found[:, np.newaxis, np.newaxis], levels, 0), found, costs, nodes)


@kernel
def fill_sequences(
    search: SearchTables, errors: FloatArray, envs: BoolArray, slots: IntArray, sequences: IntArray
) -> int:
    """Write the cheapest sequences of the marked episodes (B,) into `sequences` (B, N_h + 1, S), at the slots (q,).

    They are zeros where there is none; returns how many these are. `errors` (B, 2n) are true states.
    """
    path, chosen = np.empty((1, search.steps, errors.shape[1])), np.empty((1, search.steps), np.int64)
    costs, nodes, missing = np.empty(1), np.empty(1, np.int64), 0
    for b in range(envs.size):
        if envs[b]:
            path[0, 0], costs[0], nodes[0] = errors[b], np.inf, 1
            _search_all(search, path, chosen, costs, nodes)
            found = costs[0] < np.inf
            missing += not found
            for step in range(search.steps):
                for sensor in range(slots.size):
                    level = search.levels[sensor, search.moves[chosen[0, step], sensor]] if found else 0
                    sequences[b, step, slots[sensor]] = level
    return missing


def _candidates(bounds: IntArray, resolution: FloatArray) -> tuple[IntArray, FloatArray]:
    """The levels and values (q, c) of each sensor, by size, negative first."""
    levels = np.zeros((len(bounds), 2 * int(bounds.max()) + 1), np.int64)
    values = np.full(levels.shape, np.nan)
    for sensor, bound in enumerate(bounds):
        every = np.arange(-bound, bound + 1)
        every = every[np.argsort(np.abs(every), kind="stable")]
        levels[sensor, : len(every)] = every
        values[sensor, : len(every)] = every * resolution[sensor]
    return levels, values


def _joint(values: FloatArray) -> tuple[IntArray, FloatArray]:
    """Combinations of one candidate per sensor (k, q) and their costs (k,), cheapest first."""
    places = [np.flatnonzero(~np.isnan(row)) for row in values]
    moves = np.stack([grid.ravel() for grid in np.meshgrid(*places, indexing="ij")], axis=1)
    costs = sum(row[moves[:, sensor]] ** 2 for sensor, row in enumerate(values))
    order = np.argsort(costs, kind="stable")
    return np.ascontiguousarray(moves[order]), costs[order]


@kernel
def _search_all(search: SearchTables, path: FloatArray, chosen: IntArray, costs: FloatArray, nodes: IntArray) -> None:
    """Depth first, cheapest first. `path` (B, N_h + 1, 2n) begins with e; `chosen` (B, N_h + 1) are rows of `moves`."""
    places = np.empty((search.steps, 2), np.int64)  # joint candidate taken at each step, and the one to try next
    spent = np.empty(search.steps)
    allowed = np.empty((search.steps, search.values.shape[0], search.values.shape[1]), np.bool_)
    for b in range(len(path)):
        depth, spent[0] = 0, 0.0
        places[0, 1] = 0 if _accept(search, path[b, 0], allowed[0]) else len(search.costs)
        while depth >= 0:
            move = _next_allowed(search, allowed[depth], places[depth, 1], spent[depth], costs[b])
            if move < 0:
                depth -= 1
                continue
            places[depth, 0], places[depth, 1] = move, move + 1
            cost = spent[depth] + search.costs[move]
            if depth == search.steps - 1:
                costs[b] = cost
                for step in range(search.steps):
                    chosen[b, step] = places[step, 0]
                continue
            _propagate(search, path[b, depth], move, path[b, depth + 1])
            depth += 1
            spent[depth] = cost
            places[depth, 1] = 0 if _accept(search, path[b, depth], allowed[depth]) else len(search.costs)
            nodes[b] += 1


@kernel
def _accept(search: SearchTables, error: FloatArray, allowed: BoolArray) -> bool:
    """Mark the candidates (q, c) of each sensor that satisfy (3.39), or (3.40) and (3.41), and the sensor's bounds.

    Returns whether every sensor has one.
    """
    i, n = search.vehicle, error.size // 2
    own, ahead = 0.0, 0.0
    for state in range(error.size):
        own += search.own[state] * error[state]
        ahead += search.ahead[state] * error[state]
    rest = own - ahead + search.gap_sign * error[i]
    speed, possible = error[n + i] + 0.0, True  # the sum so that -0 is +0
    for sensor in range(allowed.shape[0]):
        kept = 0
        for place in range(allowed.shape[1]):
            value = search.values[sensor, place]
            gain = -(search.gains[sensor] * value + rest) / speed  # h_2; at rest NaN, +inf or -inf by IEEE 754
            fits = gain >= 0.0 and error[search.readings[sensor]] + value >= search.lowest[sensor]
            allowed[sensor, place] = fits and (search.width == 0 or kept < search.width)
            kept += fits
        possible &= kept > 0
    return possible


@kernel
def _next_allowed(search: SearchTables, allowed: BoolArray, first: int, spent: float, best: float) -> int:
    """The first joint candidate from `first` on that is allowed and keeps the cost below `best`; -1: there is none."""
    for move in range(first, len(search.costs)):
        if not spent + search.costs[move] < best:
            return -1
        fits = True
        for sensor in range(allowed.shape[0]):
            fits = fits and allowed[sensor, search.moves[move, sensor]]
        if fits:
            return move
    return -1


@kernel
def _propagate(search: SearchTables, error: FloatArray, move: int, after: FloatArray) -> None:
    """The full model (3.16): A e + B d."""
    for row in range(error.size):
        total = 0.0
        for state in range(error.size):
            total += search.transition[row, state] * error[state]
        for sensor in range(search.effect.shape[1]):
            total += search.effect[row, sensor] * search.values[sensor, search.moves[move, sensor]]
        after[row] = total
