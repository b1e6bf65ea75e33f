"""Extension beyond the paper: an attacker that strikes for a moment and then behaves until it is trusted again."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_baselines.rogue.reading import linear_effort, since_onset
from cps_envs.core.compute.kernels import kernel, pack, unpack
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Observation, State
from cps_envs.rogue.actions import action_for, bodies_of, body_of
from cps_envs.rogue.reading import read

NEVER_AGAIN = 0.0  # the period of a strike that comes once


class Pattern(NamedTuple):
    """When the attacker strikes from the onset on, and how it drives otherwise."""

    strike_s: float
    period_s: float  # from strike to strike
    effort: float  # while striking
    proportional_per_s2: float  # while it drives by the law
    derivative_per_s: float


class Striking(AnalyticPolicy):
    """Base: drives by the linear law (5.15) of its own sensors, held from decision to decision, but for its strikes."""

    def __init__(self, spec: RoleSpec, pattern: Pattern) -> None:
        super().__init__(spec)
        self._pattern, self._bodies = pack(pattern), bodies_of(spec.config)

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The actions (B, seats); the state holds the onsets (B,) in s, which are observed until they have passed."""
        since_s, onset_s = since_onset(seen, state, self.spec.config.duration_s)
        actions = np.empty((len(seen), *self.spec.neutral_action.shape))
        shown = (seen.observation, seen.fields.offsets, seen.fields.scale)
        _strike(*shown, since_s + 0.5 * self.spec.decision_interval_s, self._pattern, self._bodies, actions)
        return actions, (onset_s,)


class Strike(Striking):
    """Strikes with full effort for `strike_s` in every `period_s`, and behaves like an intact vehicle in between.

    `effort` 1 rams the vehicle ahead, -1 brakes in front of the vehicle behind. In between it follows the linear law
    (5.15) of its own sensors, held from decision to decision, so that a defender that looks for disobedience
    finds little.

    Raises:
        ConfigurationError: a strike that is not shorter than its period, or an effort beyond 1.
    """

    def __init__(self, spec: RoleSpec, strike_s: float = 3.0, period_s: float = 12.0, effort: float = 1.0) -> None:
        if not (0 < strike_s < period_s and -1 <= effort <= 1):
            raise ConfigurationError(
                f"strike_s = {strike_s} has to be above 0 and below period_s = {period_s}, and effort = {effort} "
                "within [-1, 1]"
            )
        config = spec.config
        effort = config.max_effort * effort if effort > 0 else -config.min_effort * effort
        super().__init__(spec, Pattern(strike_s, period_s, effort, np.nan, np.nan))


@kernel
def _strike(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    since_s: FloatArray,
    pattern: Array,
    bodies: Array,
    actions: FloatArray,
) -> None:
    """Fill the actions (B, seats) of times `since_s` (B,) after the onset."""
    at, p = offsets[0], unpack(Pattern, pattern, 0)
    for b in range(since_s.size):
        ratio = read(observation, scale, b, at.power_ratio)
        for seat in range(actions.shape[1]):
            e = body_of(bodies, int(read(observation, scale, b, at.attacker_index + seat) - 0.5))
            proportional = e.proportional_gain if np.isnan(p.proportional_per_s2) else p.proportional_per_s2
            derivative = e.derivative_gain if np.isnan(p.derivative_per_s) else p.derivative_per_s
            effort = linear_effort(observation, scale, b, seat, at, (proportional, derivative), e)
            if (since_s[b] % p.period_s if p.period_s > NEVER_AGAIN else since_s[b]) < p.strike_s:
                effort = p.effort
            actions[b, seat] = action_for(effort, read(observation, scale, b, at.speed + seat), ratio, e)
