"""Extension beyond the paper: a coordinator that looks for the vehicle that does not do what its law asks for.

Once somebody in a platoon is suspected, the platoon divides the laws.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_baselines.family import as_records
from cps_baselines.rogue.assignment import laws_of
from cps_baselines.rogue.controllers import require_modes
from cps_envs.core.compute.kernels import Record, clip, inlined, kernel, unpack
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import advises
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, Observation, State
from cps_envs.rogue.actions import bodies_of, body_of
from cps_envs.rogue.obedience import disobedience, strength
from cps_envs.rogue.reading import commanded, read, vehicles
from cps_envs.rogue.state import Rules, rules_of

NOBODY = -1  # no vehicle is suspected
FAR_BEHIND, BEHIND, AHEAD, FAR_AHEAD, LEADER = range(5)  # the suspect


class Division(NamedTuple):
    """Laws (k, 2) before anybody is suspected and around a suspect, and when its neighbours are in danger."""

    before: IntArray  # (1, 2) of all
    apart: IntArray  # (5, 2): far behind, just behind, just ahead, far ahead of the suspect, and of the leader
    evade: IntArray  # (5, 2) the same, on the side on which the suspect is about to collide
    near_m: float  # a gap error below this is danger
    horizon_s: float  # and one that will be below it so soon


def division_of(before: str, apart: str, evade: str, near_m: float, horizon_s: float) -> Division:
    """The laws that three options name.

    Raises:
        ConfigurationError: unknown letters, or another number of them.
    """
    letters = {"before": (before, 1), "apart": (apart, 5), "evade": (evade, 5)}
    for option, (given, count) in letters.items():
        if len(given) != count:
            raise ConfigurationError(
                f"{option} = {given!r} has to have {count} of the letters. Of five, they are the laws far behind the "
                "suspect, just behind, just ahead, far ahead, and of the leader"
            )
    laws = {option: laws_of(given, option) for option, (given, _) in letters.items()}
    return Division(**laws, near_m=float(near_m), horizon_s=float(horizon_s))


@inlined
def divide(laws: Division, suspect: int, values: FloatArray, at: Record, count: int, orders: IntArray) -> None:
    """Fill the orders (2 N,) of a platoon of `count`; `suspect` is from the rear (0) or `NOBODY`, `values` is seen."""
    behind, ahead = in_danger(laws, suspect - 1, values, at, count), in_danger(laws, suspect, values, at, count)
    for i in range(count):
        if i < suspect:
            place = FAR_BEHIND if i < suspect - 1 else BEHIND
        elif i < count - 1:
            place = AHEAD if i <= suspect + 1 else FAR_AHEAD
        else:
            place = LEADER
        law = laws.evade[place] if (behind if i < suspect else ahead) else laws.apart[place]
        if suspect == NOBODY:
            law = laws.before[0]
        orders[2 * i], orders[2 * i + 1] = law[0], law[1]


@inlined
def in_danger(laws: Division, pair: int, values: FloatArray, at: Record, count: int) -> bool:
    """Whether the gap error of a pair is small, or will be soon."""
    if pair < 0 or pair >= count - 1:
        return False
    closing = min(values[at.gap_rate + pair], 0.0)
    return bool(values[at.gap_error + pair] + laws.horizon_s * closing < laws.near_m)


MEMORY_S = 3.0  # chosen: of the mean strength


class Knobs(NamedTuple):
    """When the monitor suspects somebody, and when the neighbors of a suspect are in danger."""

    period_s: float  # between two looks
    margin_mps: float
    slack_mps2: float
    threshold_mps: float
    ceiling_mps: float  # of the sums; from there a suspect is released after `release_s`
    strong_mps2: float
    near_m: float
    near_strong_m: float
    horizon_s: float


@advises("cps_baselines.rogue.advised:Monitored")
class Monitor(AnalyticPolicy):
    """Uses the law `before`. While a vehicle is suspected the others use `apart`, and in danger `evade`.

    A suspect whose acceleration was once, in the mean of some seconds, more than `strong_mps2` beyond that of an intact
    engine is strong: then `evade_strong` and `near_strong_m` hold.

    Each vehicle has a one-sided CUSUM: its acceleration beyond what it was commanded, or beyond what its law could ask
    for, were its gap rates wrong by up to `margin_mps`, less `slack_mps2`, added up over time. Whoever has the largest
    sum above `threshold_mps` is the suspect, until its sum, which falls by the slack, has come down to zero: at the
    latest `release_s` after it last disobeyed. The rate of false alarms is set by the threshold. Each number may be an
    array (B,), one for each episode.

    Raises:
        ConfigurationError: unknown letters, knobs that are not above zero, or an environment that marks the seized
            vehicle or takes accelerations.
    """

    def __init__(
        self,
        spec: RoleSpec,
        before: str = "f",
        apart: str = "fffff",
        evade: str = "sslll",
        evade_strong: str = "ssssl",
        near_m: float | FloatArray = 20.0,
        near_strong_m: float | FloatArray = 40.0,
        strong_mps2: float | FloatArray = 0.75,
        horizon_s: float | FloatArray = 1.0,
        margin_mps: float | FloatArray = 1.0,
        slack_mps2: float | FloatArray = 3.0,
        threshold_mps: float | FloatArray = 4.0,
        release_s: float | FloatArray = 10.0,
    ) -> None:
        super().__init__(spec)
        require_modes(spec, self)
        if not spec.config.hidden:
            raise ConfigurationError('the monitor gives orders to the seized vehicle too; it needs orders="all"')
        if min(np.min(each) for each in (margin_mps, slack_mps2, threshold_mps, release_s)) <= 0:
            raise ConfigurationError(
                f"margin_mps = {margin_mps}, slack_mps2 = {slack_mps2}, threshold_mps = {threshold_mps} and release_s "
                f"= {release_s} have to be above 0"
            )
        ceiling_mps = np.maximum(threshold_mps, np.multiply(slack_mps2, release_s))
        self.divisions = (  # with numbers from the knobs
            division_of(before, apart, evade, 0.0, 0.0),
            division_of(before, apart, evade_strong, 0.0, 0.0),
        )
        suspicion = (margin_mps, slack_mps2, threshold_mps, ceiling_mps, strong_mps2)
        knobs = (spec.decision_interval_s, *suspicion, near_m, near_strong_m, horizon_s)
        self._knobs = as_records(Knobs, np.transpose(np.broadcast_arrays(*map(np.atleast_1d, knobs))))
        self._rules, self._bodies = rules_of(spec.config), bodies_of(spec.config)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The sums (B, n) in m/s, the suspects (B,), nobody at first, their strengths (B,) in m/s2, and `commanded`."""
        count, shape = len(generators), (len(generators), self.spec.config.num_orders)
        return np.zeros(shape), np.full(count, NOBODY), np.zeros(count), np.full(shape, np.nan)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The controllers (B, 2 n) of all vehicles."""
        sums, suspects, strengths = (part.copy() for part in state[:3])
        actions = np.zeros((len(seen), 2 * sums.shape[1]), np.int64)
        given = (seen.observation, seen.fields.offsets, seen.fields.scale, state[3], self._knobs)
        _watch(*given, self._rules, self._bodies, self.divisions, sums, suspects, strengths, actions)
        return actions, (sums, suspects, strengths, np.full(sums.shape, np.nan))

    def told(self, orders: IntArray, state: State) -> State:
        """What is remembered where vehicles get the orders (B, 2 n), those of `act` or others."""
        return *state[:3], commanded(orders, self.spec.config), *state[4:]

    def beliefs(self, state: State) -> dict[str, Array]:
        """Disobedience of each vehicle, m/s, and the number of the suspect, 0 for nobody."""
        return {"Disobedience (m/s)": state[0], "Suspect (0: nobody)": state[1] - NOBODY}


@kernel
def _watch(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    commanded_mps2: FloatArray,
    knobs: Array,
    rules: Array,
    bodies: Array,
    divisions: tuple[Division, Division],
    sums: FloatArray,
    suspects: IntArray,
    strengths: FloatArray,
    actions: IntArray,
) -> None:
    """Bring the sums (B, n), the suspects (B,) and their strengths (B,) up to date; fill the actions (B, 2 n).

    Accelerations (B, n) were commanded, NaN where a vehicle drives by a law.
    """
    weak, strong = divisions
    at, r, values = offsets[0], unpack(Rules, rules, 0), np.empty(observation.shape[1])
    for b in range(suspects.size):
        for entry in range(values.size):
            values[entry] = read(observation, scale, b, entry)
        count, loudest, k = vehicles(values, at, sums.shape[1]), 0, unpack(Knobs, knobs, b % knobs.size)
        for i in range(count):
            excess = disobedience(values, at, i, count, commanded_mps2[b, i], k.margin_mps, r, bodies) - k.slack_mps2
            sums[b, i] = clip(sums[b, i] + k.period_s * excess, 0.0, k.ceiling_mps)
            loudest = i if sums[b, i] > sums[b, loudest] else loudest
        before = suspects[b]
        if before != NOBODY and sums[b, before] == 0.0:
            suspects[b] = NOBODY
        if sums[b, loudest] > k.threshold_mps and (suspects[b] == NOBODY or sums[b, loudest] > sums[b, suspects[b]]):
            suspects[b] = loudest
        if suspects[b] == NOBODY or suspects[b] != before:
            strengths[b] = 0.0
        elif strengths[b] <= k.strong_mps2:  # a strong one stays strong
            beyond = strength(values[at.speed + before], values[at.acceleration + before], body_of(bodies, before))
            strengths[b] += k.period_s / MEMORY_S * (beyond - strengths[b])
        if strengths[b] > k.strong_mps2:
            laws = Division(strong.before, strong.apart, strong.evade, k.near_strong_m, k.horizon_s)
        else:
            laws = Division(weak.before, weak.apart, weak.evade, k.near_m, k.horizon_s)
        divide(laws, suspects[b], values, at, count, actions[b])
