"""The attacker of section 5.2.3: it keeps to the linear law (5.15) but changes the gains, so that the platoon sways."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_baselines.rogue.reading import linear_effort, read, since_onset
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.kernels import kernel, pack, unpack
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, FloatArray, Observation
from cps_envs.rogue.actions import Engine, action_for, engine_of


class Law(NamedTuple):
    """The gains with which the seized vehicle drives by (5.15), and how long its first kick lasts."""

    proportional_per_s2: float
    derivative_per_s: float
    kick_s: float


class ChangedGains(AnalyticPolicy):
    """Drives by the linear law (5.15), but with its own gains. By default they feed every oscillation.

    Without options only the sign of k_d is reversed: every oscillation is fed and not damped. An attack begins in the
    steady state, where any gains ask for nothing, so the attacker first drives at full effort for `kick_s`. The
    dissertation names the idea and no gains; these were chosen.

    Raises:
        ConfigurationError: a kick of negative duration.
    """

    def __init__(
        self, spec: RoleSpec, proportional: float = 1.0, derivative: float = -3.0, kick_s: float = 1.0
    ) -> None:
        super().__init__(spec)
        if kick_s < 0:
            raise ConfigurationError(f"kick_s = {kick_s} has to be at least 0")
        self._law = pack(Law(proportional, derivative, kick_s))
        self._engine = pack(engine_of(spec.config))

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The actions (B, 1); the state holds the onsets (B,) in s, which are observed until they have passed."""
        since_s, onset_s = since_onset(seen, state, self.spec.config.duration_s)
        actions = np.empty((len(seen), 1))
        shown = (seen.observation, seen.fields.offsets, seen.fields.scale)
        _drive(*shown, since_s + 0.5 * self.spec.decision_interval_s, self._law, self._engine, actions)
        return actions, (onset_s,)


@kernel
def _drive(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    since_s: FloatArray,
    law: Array,
    engine: Array,
    actions: FloatArray,
) -> None:
    """Fill the actions (B, 1) of times `since_s` (B,) after the onset."""
    at, p, e = offsets[0], unpack(Law, law, 0), unpack(Engine, engine, 0)
    for b in range(since_s.size):
        speed, ratio = read(observation, scale, b, at.speed), read(observation, scale, b, at.power_ratio)
        effort = linear_effort(observation, scale, b, at, (p.proportional_per_s2, p.derivative_per_s), e)
        if since_s[b] < p.kick_s:
            effort = e.max_effort
        actions[b, 0] = action_for(effort, speed, ratio, e)
