"""Steps of episodes: both roles' actions, what the vehicles command, where that takes the platoon."""

from __future__ import annotations

from cps_envs.core.compute.kernels import borrowed, clip, copy, fill, inlined, kernel, lend, view
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.fdi.controller import command
from cps_envs.fdi.estimation import command_used, extrapolate, measure, start_filter, substitute, update
from cps_envs.fdi.legality import SLACK, choose_levels, inside, legal_levels, place
from cps_envs.fdi.payoff import open_metrics, settle, watch
from cps_envs.fdi.readings import inject, predict, read_defense, sense
from cps_envs.fdi.state import Batch, Constants, Matrices, Scratch, State, add_product, constants_for, new_scratch


@kernel
def step(
    batch: Batch, attack: IntArray, defense: IntArray, envs: BoolArray, num_steps: int, payoff: FloatArray
) -> None:
    """Move the marked environments by some steps under held actions; episodes that have ended stand still.

    Args:
        batch: the environments; their defenders have no filter.
        attack: (B, S) actions.
        defense: (B, R + n) trust of the readings and correction levels, or (B, 0).
        envs: (B,) the environments to move.
        num_steps: how many.
        payoff: (B,) to which is added what these steps pay the attacker.
    """
    state, metrics, over, tasks, m = batch.state, batch.metrics, batch.over, batch.tasks, batch.matrices
    scratch = new_scratch(state.command.shape[1], state.reading.shape[1], state.legal.shape[1])
    for k in range(num_steps):  # outside the episodes: what a loop inside them could share costs more than it saves
        last = k == num_steps - 1
        for b in range(envs.size):
            if envs[b] and not over[b]:
                episode, s, c = view(state, b), lend(scratch), constants_for(batch, b)
                task, row = tasks[episode.task[0]], metrics[b : b + 1]
                sensors, target = task[: task.size - 1], task[task.size - 1]
                place(sensors, s.slot)
                if not act(episode, c, m, sensors, borrowed(attack)[b], borrowed(defense)[b], s):
                    row[0].illegal, over[b] = 1.0, True
                    continue
                over[b] = settle(episode, c, target, s.correction, row, borrowed(payoff)[b : b + 1])
                if last or over[b]:
                    legal_levels(episode.error, c, sensors, episode.legal, s)
                    close_before(episode, episode.legal)


@kernel
def step_filtered(
    batch: Batch, attack: IntArray, defense: IntArray, envs: BoolArray, num_steps: int, payoff: FloatArray
) -> None:
    """`step` where defenders have a filter: they decide on the readings of now, and those of the next step follow."""
    state, metrics, over, tasks, m = batch.state, batch.metrics, batch.over, batch.tasks, batch.matrices
    scratch = new_scratch(state.command.shape[1], state.reading.shape[1], state.legal.shape[1])
    for k in range(num_steps):
        last = k == num_steps - 1
        for b in range(envs.size):
            if envs[b] and not over[b]:
                episode, s, c = view(state, b), lend(scratch), constants_for(batch, b)
                task, row = tasks[episode.task[0]], metrics[b : b + 1]
                sensors, target = task[: task.size - 1], task[task.size - 1]
                place(sensors, s.slot)
                act_filtered(episode, c, m, borrowed(defense)[b], s)
                over[b] = settle(episode, c, target, s.correction, row, borrowed(payoff)[b : b + 1])
                watch(episode, c, s.slot, row)
                if not over[b]:
                    renew(episode, c, m, sensors, borrowed(attack)[b], s)
                if last or over[b]:
                    legal_levels(episode.error, c, sensors, episode.legal, s)
                    close_before(episode, episode.legal)


@inlined
def act(
    episode: State, c: Constants, m: Matrices, sensors: IntArray, attack: IntArray, defense: IntArray, s: Scratch
) -> bool:
    """Both roles' actions and a step of the platoon; False, and nothing moves, where the injection is illegal."""
    defended = defense.size > 0
    if defended:  # before this step's commands take the place of the last ones
        read_defense(defense, c, s.trust, s.correction)
        predict(episode, c, m, s.trust, s.error)
    choose_levels(attack, episode.error, c, sensors, s)
    inject(episode.injection, c, sensors, s.level)
    for i in range(episode.command.size):
        episode.command[i] = command(episode.error, episode.injection, c, i)
    if not c.clips and not within_limits(episode, c):
        return False
    sense(episode, c, s.trust, s.offset)
    if defended:
        for i in range(episode.command.size):
            episode.command[i] = command(episode.error, s.offset, c, i)
    correct(episode, c, s.correction)
    move(episode, c, m, s.offset, s.error)
    episode.step[0] += 1
    return True


@inlined
def act_filtered(episode: State, c: Constants, m: Matrices, defense: IntArray, s: Scratch) -> None:
    """The defender's action on the readings of now, which the filter takes in, and a step of the platoon."""
    if defense.size > 0:
        read_defense(defense, c, s.trust, s.correction)
    copy(s.trust, episode.trust)
    update(episode, c, s.error)
    substitute(episode, c)
    for i in range(episode.command.size):
        episode.command[i] = command_used(episode, c, i)
    correct(episode, c, s.correction)
    move(episode, c, m, s.offset, s.error)
    episode.step[0] += 1


@inlined
def renew(episode: State, c: Constants, m: Matrices, sensors: IntArray, attack: IntArray, s: Scratch) -> None:
    """Predict the step that begins, and take its readings with the attacker's injections, if they work already."""
    extrapolate(episode, c, m, s.error)
    choose_levels(attack, episode.error, c, sensors, s)
    if episode.step[0] < episode.onset[0]:
        fill(s.level, 0)
    inject(episode.injection, c, sensors, s.level)
    measure(episode, c)


@inlined
def close_before(episode: State, interval: IntArray) -> None:
    """Leave no level but 0 while an injection of now cannot work yet."""
    if episode.step[0] + 1 < episode.onset[0]:
        for slot in range(interval.shape[0]):
            interval[slot, 0] = interval[slot, 1] = 0


@inlined
def within_limits(episode: State, c: Constants) -> bool:
    """Whether injection and command satisfy (3.49) for every vehicle and (3.50); (3.48) holds by construction."""
    lowest = -c.desired_gap_m - SLACK
    for i in range(episode.command.size):
        if c.limit_commands and not inside(episode.command[i], c):
            return False
        injection = episode.injection[i]
        if c.limit_readings and injection != 0 and episode.error[i] + injection < lowest:
            return False
    return True


@inlined
def correct(episode: State, c: Constants, correction: FloatArray) -> None:
    """Add the defender's corrections (n,) in m/s2 as far as the limits leave room, and clip where limits clip."""
    for i in range(episode.command.size):
        wanted = episode.command[i] + correction[i]
        episode.command[i], episode.correction[i] = wanted, correction[i]
        if c.limit_commands and (c.clips or correction[i] != 0):
            episode.command[i] = clip(wanted, c.min_acceleration_mps2, c.max_acceleration_mps2)
            if not c.clips:
                episode.correction[i] += episode.command[i] - wanted


@inlined
def move(episode: State, c: Constants, m: Matrices, offset: FloatArray, before: FloatArray) -> None:
    """One step of the errors: the closed loop (3.16), or with clipped limits held commands; plus disturbances.

    `offset` (2n,) is what is used from the true values; `before` (2n,) is scratch.
    """
    n = episode.command.size
    copy(episode.error, before)
    fill(episode.error, 0.0)
    if c.holds:
        add_product(m.hold, 0, before, episode.error)
        add_product(m.hold, 2 * n, episode.command, episode.error)
    else:
        add_product(m.step, 0, before, episode.error)
        add_product(m.step, 2 * n, offset, episode.error)
        add_product(m.step, 4 * n, episode.correction, episode.error)
    if episode.disturbance.shape[0] > 0:
        for i in range(n):
            before[i] = episode.disturbance[(episode.step[0] + episode.phase[i]) // c.hold_steps, i]
        add_product(m.hold, 2 * n, before[:n], episode.error)


@kernel
def begin(batch: Batch, openings: Array, numbers: IntArray, envs: BoolArray) -> None:
    """Start episodes in the marked environments (B,); `openings` (T,) are the metrics of each task at the start.

    `numbers` (B,) number the episodes: of environment b they are b + B, b + 2B and so on.

    `task` is drawn already, and so are the numbers that `scatter` makes `error` and `disturbance` of.
    """
    state = batch.state
    scratch = new_scratch(state.command.shape[1], state.reading.shape[1], state.legal.shape[1])
    for b in range(envs.size):
        if envs[b]:
            episode, s, c = view(state, b), lend(scratch), constants_for(batch, b)
            numbers[b] += envs.size
            batch.metrics[b] = openings[episode.task[0]]
            clear(episode)
            scatter(episode, c)
            if c.filters:
                start_filter(episode, c)
                measure(episode, c)
                copy(episode.reading, episode.used)
            else:
                for values in (episode.reading, episode.prediction, episode.used):
                    copy(episode.error, values)
            copy(episode.error[: episode.rear.size], episode.rear)
            task = batch.tasks[episode.task[0]]
            sensors, target = task[: task.size - 1], task[task.size - 1]
            open_metrics(episode, c, target, batch.metrics[b : b + 1])
            place(sensors, s.slot)
            legal_levels(episode.error, c, sensors, episode.legal, s)
            close_before(episode, episode.legal)


@inlined
def clear(episode: State) -> None:
    """Forget the last step of an episode, and its counts."""
    fill(episode.injection, 0.0)
    fill(episode.trust, 1.0)
    fill(episode.doubted, 0)
    for values in (episode.command, episode.correction, episode.residual):
        fill(values, 0.0)
    episode.step[0] = 0
    tally = episode.tally[0]
    tally.injected = tally.replaced = tally.replaced_in_vain = 0


@inlined
def scatter(episode: State, c: Constants) -> None:
    """Initial errors from uniform draws in [0, 1), and disturbances in m/s2 from standard normal ones, in place."""
    n = episode.command.size
    for j in range(2 * n):
        spread = c.gap_spread_m if j < n else c.speed_spread_mps
        episode.error[j] = -spread + 2 * spread * episode.error[j] if spread > 0 else 0.0
    for k in range(episode.disturbance.shape[0]):
        for i in range(n):
            episode.disturbance[k, i] = 0.0 + c.disturbance_mps2 * episode.disturbance[k, i]
