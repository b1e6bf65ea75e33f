"""Gradients through a string of platoons: how the weights of the network of `string` move what episodes end with.

An episode runs forward by the kernels of the game, so its numbers are theirs, and leaves a trace. Then the derivatives
of the same steps run backward along it: the reverse mode by hand, in double precision. Where the game jumps (a vehicle
begins to avoid a collision, or collides) or is limited, the derivative is that of the side where the episode is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from cps_baselines.disbanding.corrections import Layout, Sight, Watch, mark_reasons, sight_for
from cps_baselines.disbanding.residual import COUNT, pull_residual
from cps_baselines.disbanding.string_controller import Gains, Road, StringController, StringLoop, decide, signals
from cps_baselines.family import Differentiated, Slopes
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.fields import encode_row
from cps_envs.core.kernels import borrowed, clip, copy, fill, inlined, kernel, lend, unpack, view
from cps_envs.core.lookup import PolicyReference
from cps_envs.core.play import play_episodes
from cps_envs.core.types import Array, BoolArray, FloatArray, Role
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.controllers import DEAD_BAND, avoidance_margin, has_begun
from cps_envs.disbanding.dynamics import advance_episode, command_by_law, first_mitigable
from cps_envs.disbanding.observation import fill_defender
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.disbanding.state import Constants, State

PERCENT = 100.0


class Trace(NamedTuple):
    """Episodes at the start of each control period, and at the end: (T + 1, B, M), disbanding (T + 1, B, N)."""

    position: FloatArray  # m
    speed: FloatArray  # m/s
    acceleration: FloatArray  # m/s2
    noise_mps2: FloatArray  # m/s2, in the period before
    disbanding_s: FloatArray  # s


class Pulls(NamedTuple):
    """Derivatives of what an episode ends with by its state at some moment, (M,) each."""

    position: FloatArray
    speed: FloatArray
    acceleration: FloatArray


class Room(NamedTuple):
    """Room to work in, (M,) each, but for `steps` (S, 3, M), `signals` (COUNT,) and what is read of an observation."""

    gap: FloatArray
    closing: FloatArray
    law: FloatArray
    correction: FloatArray
    alarms: FloatArray
    by_correction: FloatArray
    by_law: FloatArray
    signals: FloatArray
    steps: FloatArray
    row: FloatArray
    encoded: Array
    reasons: BoolArray


class TracedLoop(StringLoop):
    """`StringLoop` that keeps a trace."""

    def __init__(self, config: DisbandingConfig, num_envs: int, policy: StringController) -> None:
        super().__init__(config, num_envs, policy)
        shapes = [(self.horizon + 1, *getattr(self.state, name).shape) for name in Trace._fields]
        self.trace = Trace(*map(np.empty, shapes))

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        first, paid = int(self.elapsed[0]), np.zeros(self.num_envs)
        for period in range(num_steps):
            self._keep(first + period)
            paid += super()._advance({} if period else actions, envs, 1)
        self._keep(first + num_steps)
        return paid

    def _keep(self, period: int) -> None:
        for name, kept in zip(Trace._fields, self.trace, strict=True):
            kept[period] = getattr(self.state, name)

    def differentiate(self, by_error: FloatArray, by_gap: FloatArray) -> FloatArray:
        """Derivatives (B, W) by the weights after the end, given those (B,) by E_v and by the smallest gap."""
        p, found = self._policy, np.zeros((self.num_envs, self._policy.weights.shape[1]))
        known = (self.state, self.constants, self._metrics, self.trace)
        numbers = (p.table, p.weights, p.limit_mps2)
        per_step = by_error * PERCENT / (self.config.horizon_steps * self.config.desired_speed_mps)
        _differentiate(*known, p.layout, p.watch, p.slow_mps, *numbers, per_step, by_gap, found)
        return found


def differentiate(
    config: DisbandingConfig, policy: StringController, attacker: PolicyReference, seeds: Sequence[int], slopes: Slopes
) -> Differentiated:
    """What episodes end with, and derivatives (B, W) by the weights of a policy with one row of them per episode.

    `slopes` tells the derivatives by `return`, through E_v over all vehicles alone, and by `smallest_gap_m`.

    Raises:
        ConfigurationError: the configuration has what this cannot differentiate.
    """
    check(config)
    games: list[TracedLoop] = []

    def game(config: Any, num_envs: int) -> TracedLoop:
        games.append(TracedLoop(config, num_envs, policy))
        return games[-1]

    outcome = play_episodes(replace(DISBANDING, game=game), config, {"attacker": attacker}, seeds)
    by = slopes(outcome)
    return outcome, games[-1].differentiate(by["return"], by["smallest_gap_m"])


def check(config: DisbandingConfig) -> None:
    """Whether gradients know everything that a configuration has.

    Raises:
        ConfigurationError: they do not.
    """
    c = config.dynamics
    physics = (
        c.exact_integration,
        c.saturate_command,
        c.transitional_controller,
        c.inelastic_contact,
        c.standstill_rule,
    )
    others = (config.is_relayed, config.braking_share > 0, config.on_collision == "end", config.payoff_set != "all")
    if any((*physics, *others)) or config.report == "chapter":
        raise ConfigurationError(
            "gradients need interpretation S0, a perfect broadcast, drivers who do not brake, "
            'on_collision="continue", payoff_set="all" and report="safety"'
        )


@kernel
def _differentiate(
    state: State,
    constants: Array,
    metrics: Array,
    trace: Trace,
    layout: Layout,
    watch: Array,
    slow_mps: FloatArray,
    gains: Array,
    weights: FloatArray,
    limit_mps2: float,
    by_error: FloatArray,
    by_gap: FloatArray,
    gradients: FloatArray,
) -> None:
    """Fill in the gradients (B, W); `state` and `metrics` are room to work in."""
    w, vehicles, width = unpack(Watch, watch, 0), state.speed.shape[1], layout.scale.shape[1]
    sight, rows, periods = sight_for(vehicles), np.empty((13, vehicles)), trace.speed.shape[0] - 1
    steps = np.empty((constants[0].period_steps + 1, 3, vehicles))
    encoded, reasons = np.empty(width, np.float32), np.zeros(vehicles, np.bool_)
    room = Room(
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], np.empty(COUNT), steps, np.empty(width), encoded,
        reasons,
    )  # fmt: skip
    listens = w.heeds_warning
    for b in range(gradients.shape[0]):
        episode, c, seen = view(state, b), unpack(Constants, constants, b), lend(layout)
        mine, slow = 2 * (b % (gains.size // 2)), slow_mps[b % slow_mps.size]
        leader, other = unpack(Gains, gains, mine), unpack(Gains, gains, mine + 1)
        network, road = borrowed(weights)[b], (c.vehicles_per_platoon, c.tau_s, c.desired_speed_mps, limit_mps2)
        fill(room.alarms, 0.0)
        for each in range(7, 13):
            fill(rows[each], 0.0)
        pulls, before = Pulls(rows[7], rows[8], rows[9]), Pulls(rows[10], rows[11], rows[12])
        narrow, behind = narrowest(trace, c, b)
        for period in range(periods, -1, -1):
            if period < periods:
                recall(episode, c, trace, period, b, room)
                fill(room.row, 0.0)
                measured = borrowed(metrics)[b]
                fill_defender(episode, c, room.gap, room.closing, room.law, measured, room.row, seen.offsets[0])
                encode_row(room.row, seen.scale, room.encoded)
                mark_reasons(room.encoded, seen, w, slow, room.alarms, room.reasons)
                decide(
                    room.encoded, seen, room.reasons, sight, leader, other, network, w, c, limit_mps2, room.correction
                )  # fmt: skip
                repeat(episode, c, trace, period, b, room)
                fill(room.by_correction, 0.0)
                for step in range(c.period_steps - 1, -1, -1):
                    for q in range(c.num_vehicles):
                        fast = room.steps[step + 1, 1, q] > c.desired_speed_mps
                        pulls.speed[q] += (by_error[b] if fast else -by_error[b]) / c.num_vehicles
                    place(episode, room.steps[step])
                    episode.step[0] = period * c.period_steps + step
                    command_by_law(episode, c, room.gap, room.closing, room.law)
                    pull_step(episode, c, room, pulls, before)
                    pulls, before = before, pulls
                recall(episode, c, trace, period, b, room)
                pull_decisions(
                    episode, c, room, sight, leader, other, network, road, listens, pulls, borrowed(gradients)[b]
                )  # fmt: skip
            if period == narrow:
                pulls.position[behind - 1] += by_gap[b]
                pulls.position[behind] -= by_gap[b]


@inlined
def narrowest(trace: Trace, c: Constants, b: int) -> tuple[int, int]:
    """The period and the vehicle of the smallest gap ahead of an intact vehicle, as `safety.note_gaps` finds it."""
    smallest, found, vehicle, last = np.inf, 0, 1, trace.speed.shape[0] - 1
    for period in range(last + 1):
        time_s = period * c.period_steps * c.dt_s
        for q in range(1, c.num_vehicles):
            gap = trace.position[period, b, q - 1] - trace.position[period, b, q]
            disbanding_s = trace.disbanding_s[min(period + 1, last), b, q // c.vehicles_per_platoon]
            if gap < smallest and not has_begun(time_s, disbanding_s):
                smallest, found, vehicle = gap, period, q
    return found, vehicle


@inlined
def recall(episode: State, c: Constants, trace: Trace, period: int, b: int, room: Room) -> None:
    """Bring an episode back to the start of a period, with its gaps and the commands of the plain law."""
    copy(trace.position[period, b], episode.position)
    copy(trace.speed[period, b], episode.speed)
    copy(trace.acceleration[period, b], episode.acceleration)
    copy(trace.disbanding_s[period, b], episode.disbanding_s)
    episode.step[0] = period * c.period_steps
    command_by_law(episode, c, room.gap, room.closing, room.law)


@inlined
def repeat(episode: State, c: Constants, trace: Trace, period: int, b: int, room: Room) -> None:
    """Drive an episode through a period again, and note every step."""
    copy(trace.disbanding_s[period + 1, b], episode.disbanding_s)
    copy(trace.noise_mps2[period + 1, b], episode.noise_mps2)
    for step in range(c.period_steps + 1):
        if step > 0:
            advance_episode(episode, c, room.correction, room.closing, 1)
        copy(episode.position, room.steps[step, 0])
        copy(episode.speed, room.steps[step, 1])
        copy(episode.acceleration, room.steps[step, 2])


@inlined
def place(episode: State, moment: FloatArray) -> None:
    """Let the vehicles be and move as noted, (3, M)."""
    copy(moment[0], episode.position)
    copy(moment[1], episode.speed)
    copy(moment[2], episode.acceleration)


@inlined
def pull_step(episode: State, c: Constants, room: Room, after: Pulls, before: Pulls) -> None:
    """The derivatives before an integration step from those after it; adds those by the corrections."""
    low, high, dt, tau = c.min_acceleration_mps2, c.max_acceleration_mps2, c.dt_s, c.tau_s
    v, a, correction, law = episode.speed, episode.acceleration, room.correction, room.law
    first, time_s = first_mitigable(episode, c), episode.step[0] * c.dt_s
    for q in range(c.num_vehicles):
        intact = not has_begun(time_s, episode.disbanding_s[q // c.vehicles_per_platoon])
        corrects, command = q >= first and intact and abs(correction[q]) >= DEAD_BAND, law[q]
        if corrects:
            command = clip(command, low, high) + correction[q] + episode.noise_mps2[q]
        avoids = margin_of(episode, c, q, room.gap[q]) <= 0.0
        speed, acceleration = v[q] + dt * a[q], a[q] + dt * ((low if avoids else command) - a[q]) / tau
        outward = (speed >= c.max_speed_mps and acceleration > 0.0) or (speed <= c.min_speed_mps and acceleration < 0.0)
        by_acceleration = after.acceleration[q] if low < acceleration < high and not outward else 0.0
        by_speed = after.speed[q] if c.min_speed_mps < speed < c.max_speed_mps else 0.0
        before.position[q] = after.position[q]
        before.speed[q] = by_speed + dt * after.position[q]
        before.acceleration[q] = by_acceleration * (1.0 - dt / tau) + by_speed * dt
        by_command = 0.0 if avoids else by_acceleration * dt / tau
        room.by_correction[q] += by_command if corrects else 0.0
        room.by_law[q] = by_command if not corrects or low < law[q] < high else 0.0
    pull_law(episode, c, room, before)


@inlined
def margin_of(episode: State, c: Constants, q: int, gap: float) -> float:
    """Distance (m) of a vehicle to where it avoids a collision."""
    speed, ahead = episode.speed[q], episode.speed[max(q - 1, 0)]
    return avoidance_margin(gap, speed, ahead, c.standstill_gap_m, -c.min_acceleration_mps2, c.one_sided_avoidance)


@inlined
def pull_law(episode: State, c: Constants, room: Room, pulls: Pulls) -> None:
    """Add the derivatives by the state from those by the commands of `command_by_law`."""
    k_p, k_d, size, time_s = c.proportional_gain, c.derivative_gain, c.vehicles_per_platoon, episode.step[0] * c.dt_s
    for q in range(c.num_vehicles):
        pull = room.by_law[q]
        if pull == 0.0:
            continue
        if has_begun(time_s, episode.disbanding_s[q // size] + episode.takeover_delay_s[q]):
            pull_human(episode, c, q, room.gap[q], pull, pulls)
        elif q == 0:
            pulls.speed[0] -= k_d * pull
        else:
            pull_gap(q, k_p * pull, k_d * pull, pulls)
            if q % size == 0:
                pulls.speed[q] -= k_p * c.headway_s * pull
            elif q % size < size - 1:
                pull_gap(q + 1, -k_p * pull, -k_d * pull, pulls)


@inlined
def pull_gap(q: int, by_gap: float, by_closing: float, pulls: Pulls) -> None:
    """Add the derivatives by the state from those by the gap ahead of vehicle `q` and by its change."""
    pulls.position[q - 1] += by_gap
    pulls.position[q] -= by_gap
    pulls.speed[q - 1] += by_closing
    pulls.speed[q] -= by_closing


@inlined
def pull_human(episode: State, c: Constants, q: int, gap: float, pull: float, pulls: Pulls) -> None:
    """Add the derivatives by the state from that by a human driver's command, `controllers.human_command`."""
    if gap <= 0.0:
        return
    speed, ahead, headway = episode.speed[q], episode.speed[max(q - 1, 0)], episode.driver_headway_s[q]
    comfort = 2.0 * np.sqrt(-c.min_acceleration_mps2 * c.max_acceleration_mps2)
    moving, freedom = speed * headway + speed * (speed - ahead) / comfort, speed / c.desired_speed_mps
    crowding = (c.standstill_gap_m + max(0.0, moving)) / gap
    pull *= c.max_acceleration_mps2
    pulls.speed[q] -= pull * 4.0 * freedom * freedom * freedom / c.desired_speed_mps
    by_moving = -2.0 * pull * crowding / gap if moving > 0.0 else 0.0
    pulls.speed[q] += by_moving * (headway + (2.0 * speed - ahead) / comfort)
    if q > 0:
        pulls.speed[q - 1] -= by_moving * speed / comfort
        pull_gap(q, 2.0 * pull * crowding * crowding / gap, 0.0, pulls)


@inlined
def pull_decisions(
    episode: State,
    c: Constants,
    room: Room,
    sight: Sight,
    leader: Gains,
    other: Gains,
    network: FloatArray,
    road: Road,
    listens: bool,
    pulls: Pulls,
    gradient: FloatArray,
) -> None:
    """Add the derivatives by the state and by the weights from those by the corrections; see `follow_all`."""
    size, law, by_correction = c.vehicles_per_platoon, sight.law_command, room.by_correction
    low, high = c.min_acceleration_mps2, c.max_acceleration_mps2
    fill(room.by_law, 0.0)
    for q in range(c.num_vehicles - 1, 0, -1):
        pull = by_correction[q]
        if not sight.mitigable[q] or abs(room.correction[q]) >= road[3] or pull == 0.0:
            continue
        own, by = leader if q % size == 0 else other, room.signals
        command = law[q - 1] + room.correction[q - 1]
        fill(by, 0.0)
        by[5] = pull * own.predecessor_command
        pull_follow(sight, q, own, road, listens, pull, by)
        pull_residual(signals(sight, q, own, command, road, listens), network, pull, gradient, by)
        pull_gap(q, by[0], by[1], pulls)
        pulls.speed[q] += by[2] - own.headway_s * by[0] - by[8]
        pulls.acceleration[q] += by[3]
        pulls.acceleration[q - 1] += by[4]
        by_correction[q - 1] += by[5]
        room.by_law[q - 1] += by[5] if low < room.law[q - 1] < high else 0.0
        room.by_law[q] -= pull * (1.0 + own.law) if low < room.law[q] < high else 0.0
        if listens and sight.age_s[q] < np.inf:
            d = disbanded_ahead(episode, c, q)
            pulls.speed[d] += by[8]
            pulls.acceleration[d] += by[9]
            room.by_law[d] += by[10] if margin_of(episode, c, d, room.gap[d]) > 0.0 else 0.0
    pull_law(episode, c, room, pulls)


@inlined
def pull_follow(sight: Sight, q: int, g: Gains, road: Road, listens: bool, pull: float, by: FloatArray) -> None:
    """Add the derivatives by the signals from that by `follow`."""
    _, tau_s, desired_speed_mps, _ = road
    speed, closing, told = sight.speed[q], g.closing + g.closing_lag * tau_s, listens and sight.age_s[q] < np.inf
    excess, predecessor = sight.gap[q] - g.wanted_m - g.headway_s * speed, g.predecessor + g.predecessor_lag * tau_s
    u = g.gap * clip(excess, -g.reach_m, g.reach_m) + closing * sight.relative_speed[q]
    u += predecessor * sight.acceleration[q - 1] + g.own * sight.acceleration[q]
    if told:
        u += g.ahead_closing * (sight.ahead_speed[q] - speed) + g.ahead_acceleration * sight.ahead_acceleration[q]
        u += g.ahead_command * sight.ahead_command[q]
    if u >= g.cap * (desired_speed_mps + g.excess_mps - speed):
        by[2] -= pull * g.cap
        return
    by[0] += pull * g.gap if abs(excess) < g.reach_m else 0.0
    by[1] += pull * closing
    by[3] += pull * g.own
    by[4] += pull * predecessor
    if told:
        by[8] += pull * g.ahead_closing
        by[9] += pull * g.ahead_acceleration
        by[10] += pull * g.ahead_command


@inlined
def disbanded_ahead(episode: State, c: Constants, q: int) -> int:
    """The last vehicle of the nearest disbanded platoon ahead of vehicle `q`, which has to be there."""
    size, time_s = c.vehicles_per_platoon, episode.step[0] * c.dt_s
    platoon = q // size - 1
    while not has_begun(time_s, episode.disbanding_s[platoon]):
        platoon -= 1
    return platoon * size + size - 1
