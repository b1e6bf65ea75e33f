"""The whole closed loop of the defender `string` in one kernel, for searches that play it thousands of times.

Physics, observation and controller are the functions of the game and of the policy, in the order of a match, so that
the episodes are those of a match. What is saved is the way through Python at every decision.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cps_baselines.disbanding.corrections import Layout, Sight, Watch, decoded, look, mark_reasons, sight_for
from cps_baselines.disbanding.string_controller import Gains, StringController, follow_all
from cps_envs.core.fields import encode_row
from cps_envs.core.kernels import borrowed, clip, fill, inlined, kernel, lend, unpack, view
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, Role
from cps_envs.disbanding.attack import disband
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.dynamics import advance_episode, command_by_law
from cps_envs.disbanding.events import advance_eventfully
from cps_envs.disbanding.game import DisbandingGame
from cps_envs.disbanding.observation import fill_defender
from cps_envs.disbanding.payoff import Rules
from cps_envs.disbanding.state import Constants, State
from cps_envs.disbanding.turn import Account, settle


class StringLoop(DisbandingGame):
    """The disbanding game in which `string` is the defender by itself; let a match play the attacker alone.

    `table` and `slow_mps` of the policy have one set of numbers for all episodes, or one per episode.
    """

    def __init__(self, config: DisbandingConfig, num_envs: int, policy: StringController) -> None:
        super().__init__(config, num_envs)
        self._alarms = np.zeros((num_envs, config.max_vehicles))
        self._policy = policy

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        super()._reset(envs, generators)
        self._alarms[envs] = 0.0

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        targets, before = actions.get("attacker", self._waiting), self._account.total.copy()
        p = self._policy
        seen, numbers = (p.layout, p.watch, p.slow_mps), (p.table, p.limit_mps2)
        drive(*self._known, targets, *seen, *numbers, self._alarms, envs, num_steps)
        if self.config.on_collision == "end":
            self.terminated |= self.state.collided_intact.any(axis=1)
        return self._account.total - before


@kernel
def drive(
    state: State,
    constants: Array,
    account: Account,
    metrics: Array,
    rules: Array,
    targets: IntArray,
    layout: Layout,
    watch: Array,
    slow_mps: FloatArray,
    gains: Array,
    limit_mps2: float,
    alarms: FloatArray,
    envs: BoolArray,
    num_periods: int,
) -> None:
    """Disband `targets` (B,) where legal, and drive marked environments through control periods, see `turn.step`.

    The defender decides before it can know of an attack of the same moment, as in a match.
    """
    r, w, vehicles = unpack(Rules, rules, 0), unpack(Watch, watch, 0), alarms.shape[1]
    sight, reasons, room = sight_for(vehicles), np.zeros(vehicles, np.bool_), np.empty((4, vehicles))
    row, encoded = np.empty(layout.scale.shape[1]), np.empty(layout.scale.shape[1], np.float32)
    for b in range(envs.size):
        if envs[b]:
            episode, c, own = view(state, b), unpack(Constants, constants, b), view(account, b)
            mine, slow, seen = 2 * (b % (gains.size // 2)), slow_mps[b % slow_mps.size], lend(layout)
            leader, other = unpack(Gains, gains, mine), unpack(Gains, gains, mine + 1)
            gap, closing, law, correction = room[0], room[1], room[2], room[3]
            for period in range(num_periods):
                command_by_law(episode, c, gap, closing, law)
                fill(row, 0.0)
                fill_defender(episode, c, gap, closing, law, borrowed(metrics)[b], row, seen.offsets[0])
                encode_row(row, seen.scale, encoded)
                mark_reasons(encoded, seen, w, slow, borrowed(alarms)[b], reasons)
                decide(encoded, seen, reasons, sight, leader, other, w, c, limit_mps2, correction)
                if period == 0:
                    disband(episode, c, targets[b], own.budget, own.legal)
                if r.eventful:
                    advance_eventfully(episode, c, correction, closing, c.period_steps)
                else:
                    advance_episode(episode, c, correction, closing, c.period_steps)
            settle(episode, c, own, borrowed(metrics)[b], r)


@inlined
def decide(
    encoded: Observation,
    layout: Layout,
    reasons: BoolArray,
    sight: Sight,
    leader: Gains,
    other: Gains,
    w: Watch,
    c: Constants,
    limit_mps2: float,
    correction: FloatArray,
) -> None:
    """Fill the corrections (M,) in m/s2 that the policy's actions stand for, given its observation."""
    fill(correction, 0.0)
    look(encoded, layout, reasons, sight)
    tau_s = decoded(encoded, layout.scale, layout.offsets[0].tau_s)
    road = (c.vehicles_per_platoon, tau_s, c.desired_speed_mps, limit_mps2)
    follow_all(sight, leader, other, road, w.heeds_warning, correction)
    for q in range(correction.size):
        correction[q] = limit_mps2 * clip(correction[q] / limit_mps2, -1.0, 1.0)
