"""A turn of the marked environments: both roles' actions, one step, the end of the episode, the account."""

from __future__ import annotations

from typing import NamedTuple

from cps_envs.core.kernels import borrowed, inlined, kernel
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.fdi.account import settle
from cps_envs.fdi.choice import choose_levels
from cps_envs.fdi.dynamics import command, correct, move, predict, sense, within_limits
from cps_envs.fdi.legality import legal_levels, resolution
from cps_envs.fdi.memory import (
    STEP,
    TASK,
    Constants,
    Matrices,
    Memory,
    assign,
    constants_of,
    fill,
    matrices_of,
    memory_of,
    update_law,
)
from cps_envs.fdi.metrics import ILLEGAL, PAYOFF
from cps_envs.fdi.scratch import Scratch, lent, new_scratch


class Episode(NamedTuple):
    """What belongs to an episode of the arrays that `take_turn` gets."""

    memory: Memory
    counts: IntArray
    row: FloatArray
    legal: IntArray
    attack: IntArray
    defense: IntArray
    disturbances: FloatArray
    task: IntArray


@kernel
def take_turn(
    memories: FloatArray,
    counts: IntArray,
    table: FloatArray,
    legal: IntArray,
    attack: IntArray,
    defense: IntArray,
    envs: BoolArray,
    over: BoolArray,
    num_steps: int,
    disturbances: FloatArray,
    packed: FloatArray,
    stacked: FloatArray,
    tasks: IntArray,
) -> None:
    """Move the marked environments by some steps under held actions.

    Args:
        memories: (B, 17 n), see `memory.Memory`.
        counts: (B, NUM_COUNTS), see `memory`.
        table: (metrics + 1, B), see `metrics`; the last row is filled with the payoff of this turn.
        legal: (B, S, 2), filled with the legal levels of the next turn.
        attack: (B, S) actions.
        defense: (B, 3 n) trust of the readings and correction levels, or (B, 0).
        envs: (B,) the environments to move.
        over: (B,) episodes that have ended stand still; filled with those that end now.
        num_steps: how many.
        disturbances: (B, horizon, n) accelerations in m/s2, or (B, 0, 0).
        packed: see `memory.pack_constants`.
        stacked: see `memory.pack_matrices`.
        tasks: (T, S + 1) sensors of each slot, -1 where not attacked, and the target's index.
    """
    c, m = constants_of(packed), matrices_of(borrowed(stacked))
    scratch = new_scratch(stacked.shape[1] // 2, tasks.shape[1] - 1)
    table[PAYOFF] = 0.0
    for step in range(num_steps):  # outside the episodes: what a loop inside them could share costs more than it saves
        for b in range(envs.size):
            if envs[b] and not over[b]:
                count = borrowed(counts)[b]
                episode = Episode(
                    memory_of(borrowed(memories), b),
                    count,
                    borrowed(table)[:, b],
                    borrowed(legal)[b],
                    borrowed(attack)[b],
                    borrowed(defense)[b],
                    borrowed(disturbances)[b],
                    borrowed(tasks)[count[TASK]],
                )
                over[b] = move_episode(episode, c, m, step == num_steps - 1, lent(scratch))


@inlined
def move_episode(episode: Episode, c: Constants, m: Matrices, last: bool, scratch: Scratch) -> bool:
    """One step of an episode, and after the `last` of a turn what is legal next; returns whether the episode ended."""
    memory, count, task = episode.memory, episode.counts, episode.task
    sensors, defended, step = task[: task.size - 1], episode.defense.size > 0, count[STEP]
    if defended:  # before this step's commands take the place of the last ones
        read_defense(episode.defense, c, scratch.trust, scratch.correction)
        predict(memory, c, m, scratch.trust, step == 0, scratch.state)
    choose_levels(episode.attack, memory, c, m, sensors, scratch.interval, scratch.level, scratch.row)
    inject(memory.injection, c, sensors, scratch.level)
    command(memory, m, memory.injection)
    if c.clip == 0 and not within_limits(memory, c):
        episode.row[ILLEGAL] = 1.0
        return True
    sense(memory, c, scratch.trust, step == 0, scratch.offset)
    if defended:
        command(memory, m, scratch.offset)
    correct(memory, c, scratch.correction)
    move(memory, c, m, scratch.offset, episode.disturbances, step, scratch.state)
    update_law(memory, m)
    count[STEP] = step + 1
    collided = settle(memory, c, task[task.size - 1], scratch.correction, count, episode.row)
    if c.by_share == 0 and (last or collided):
        legal_levels(memory, c, m, sensors, scratch.level, 0, episode.legal, scratch.row)
    return collided


@inlined
def inject(injection: FloatArray, c: Constants, sensors: IntArray, level: IntArray) -> None:
    """The injections (2n,) of all readings, m or m/s, from the levels of the attacked sensors."""
    fill(injection, 0.0)
    for s in range(sensors.size):
        if sensors[s] >= 0:
            injection[sensors[s]] = level[s] * resolution(c, sensors[s], injection.size // 2)


@inlined
def read_defense(action: IntArray, c: Constants, trust: FloatArray, correction: FloatArray) -> None:
    """Trust (2n,) and corrections (n,) in m/s2 of a defender's action (3n,)."""
    n = correction.size
    for j in range(2 * n):
        trust[j] = action[j]
    for i in range(n):
        correction[i] = (action[2 * n + i] - c.correction_levels) * c.correction_step_mps2


@kernel
def open_episodes(
    memories: FloatArray,
    counts: IntArray,
    legal: IntArray,
    envs: BoolArray,
    packed: FloatArray,
    stacked: FloatArray,
    tasks: IntArray,
) -> None:
    """Fill what follows from the error and the task of episodes that begin; arguments as for `take_turn`."""
    c, m = constants_of(packed), matrices_of(borrowed(stacked))
    slots = tasks.shape[1] - 1
    scratch = new_scratch(stacked.shape[1] // 2, slots)
    for b in range(envs.size):
        if envs[b]:
            memory, lended = memory_of(borrowed(memories), b), lent(scratch)
            for values in (memory.reading, memory.prediction, memory.used):
                assign(values, memory.error)
            assign(memory.rear, memory.error)
            fill(memory.trust, 1.0)
            update_law(memory, m)
            sensors = borrowed(tasks)[counts[b, TASK], :slots]
            legal_levels(memory, c, m, sensors, lended.level, 0, borrowed(legal)[b], lended.row)
