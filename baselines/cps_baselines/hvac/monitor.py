"""A defender that also watches commands, set-points and whether messages arrive."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.hypotheses import FilterChoices
from cps_baselines.hvac.largest import Largest
from cps_baselines.hvac.replacing import elapsed_steps
from cps_envs.core.declare.config import series_in
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, Knowledge, State
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import build_model, rules_of
from cps_envs.hvac.sensors import sensor_sets, sensors_of_choices

READINGS = 0  # the choice of the raw readings
LEVELS_OFF = 2.0  # levels by which a command may differ from the one that is expected; rounding takes half of one


class Monitor(AnalyticPolicy):
    """Believes sensors as `largest` does, and asks three questions more.

    *Do readings arrive?* If all of them are what they were a step ago, none did. Filters took the old ones for news, so
    it feeds the readings as they are until fresh ones have arrived for `fresh_h`.

    *Do zones get what is commanded?* Where every filter that uses a sensor has raised an alarm, either all sensors
    lie or none does. The Kalman filter of all sensors estimates the heat that nobody commanded. If that has the same
    sign in all zones and is at least `common_w`, commands are attacked.

    *Are commands those that the right set-points ask for?* It computes the gains of (4.18) anew, from the estimate that
    the controller was fed. Where a command is more than two levels off, set-points are attacked.

    From an alarm of the last two on it hands the heating to the thermostats for `hold_h`. Without thermostats it then
    believes the filter of all sensors, which follows heat that nobody commanded.

    Raises:
        ConfigurationError: a configuration without Kalman filters, with another controller than "clip" or with series,
            or numbers that are not positive.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        common_w: float = 60.0,
        hold_h: float = 24.0,
        fresh_h: float = 2.0,
    ) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        if self.config.controller != "clip":
            raise ConfigurationError('monitor computes commands anew by the gains of (4.18): set controller="clip"')
        if series_in(self.config):
            raise ConfigurationError("monitor has to know the weather to come: leave series out")
        if min(common_w, hold_h, fresh_h) <= 0:
            raise ConfigurationError(
                f"common_w = {common_w}, hold_h = {hold_h}, fresh_h = {fresh_h}: all have to be positive"
            )
        self.common_w = common_w
        self._hold_steps, self._fresh_steps = (round(3600.0 * each / self.config.step_s) for each in (hold_h, fresh_h))
        self._sensors, self._m, self._rules = Largest(spec), build_model(self.config), rules_of(self.config)
        size = FilterChoices(self.config).size
        self._all, self._by_model = int(size.argmax()), len(sensor_sets(self.config)) + 1
        self._nobody = self._by_model + 1 + int(size.argmin())  # the choice of the filter of no sensor
        choices = len(sensors_of_choices(self.config))
        self._retreat = choices - 1 if self.config.thermostats else self._by_model + 1 + self._all

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What is known of the loop, (B, ...), and what `largest` remembers.

        Heat (B, n) and integrator (B, n), W; estimates (B, C, n) seen one and two steps ago, and that which the
        controller was fed two steps ago (B, n), C; readings (B, S) seen one step ago, C; for how many steps (B,) an
        alarm goes on, and filters are stale.
        """
        count, n = len(generators), self.config.num_zones
        seen = np.zeros((count, len(sensors_of_choices(self.config)), n))
        heat, timer = np.zeros((count, n)), np.zeros(count, np.int64)
        own = (heat, heat, seen, seen, heat, np.zeros((count, self.config.num_sensors)), timer, timer)
        return (*own, *self._sensors.begin(generators, knowledge))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Choices (B,)."""
        heat_w, integrator_w, newer, older, fed, readings, alarm, stale = state[:8]
        chosen, remembered = self._sensors.act(seen, state[8:])
        innovation = seen["innovation"][:, self._all]
        heat_w = self._rules.filter_memory * heat_w + innovation / self._m.filter_scale[self._all] @ self._heat_gain.T
        right, integrator_w = self._commanded(seen, integrator_w, older, fed)
        common = np.maximum(heat_w.min(axis=1), -heat_w.max(axis=1)) > self.common_w
        attacked = (~right | (common & (chosen == self._nobody))) & (seen["ready"] > 0.5) & (stale == 0)
        alarm = np.where(attacked, self._hold_steps, np.maximum(alarm - 1, 0))
        silent = (seen["reading"] == readings).all(axis=1)
        stale = np.where(silent, self._fresh_steps, np.maximum(stale - 1, 0))
        choice = np.where(stale > 0, READINGS, np.where(alarm > 0, self._retreat, chosen))
        loop = (heat_w, integrator_w, seen["estimate"], newer, seen["last_estimate"], seen["reading"])
        return choice, (*loop, alarm, stale, *remembered)

    @property
    def _heat_gain(self) -> FloatArray:
        """Of the filter of all sensors, (n, S) W/C."""
        gain: FloatArray = self._m.filter_gain[self._all, self.config.num_zones :]
        return gain

    def _commanded(
        self, seen: Seen, integrator_w: FloatArray, older: FloatArray, fed: FloatArray
    ) -> tuple[BoolArray, FloatArray]:
        """Whether the last commands are those of the right set-points, (B,), and the integrator (B, n), W, after them.

        `older` (B, C, n) are the estimates of the step before that of the commands, and `fed` (B, n) what the
        controller got then.
        """
        m, rows, last = self._m, np.arange(len(seen)), elapsed_steps(seen, self.config) - 1
        choice = seen["last_choice"].argmax(axis=1)
        anew = (choice == self._by_model) | ((last == self._rules.window_steps) & (choice != 0))
        before = np.where(anew[:, np.newaxis], fed, older[rows, choice])
        change = np.where((last > 0)[:, np.newaxis], seen["last_estimate"] - before, 0.0)
        error = m.reference[0] - seen["last_estimate"]
        du = error @ m.error_gain.T - change @ m.difference_gain.T - m.feedforward[np.maximum(last, 0)]
        idle = (last < 0) | (self.config.thermostats & (choice == self._retreat))
        asked_w = np.where(idle[:, np.newaxis], integrator_w, np.clip(integrator_w + du, m.least_w, m.most_w))
        off = np.abs(seen["heating"] - asked_w) > (LEVELS_OFF + 0.5) * m.level_w
        right: BoolArray = idle | ~off.any(axis=1)
        return right, np.where(right[:, np.newaxis], asked_w, seen["heating"])
