"""An attack that works out from the true temperatures whom it faces, before it lies."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.replacing import attack_age, elapsed_steps
from cps_baselines.hvac.tracker import Tracker
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, Knowledge, State
from cps_envs.hvac.attack import absolute_action
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import build_model

MOST_W = 60.0  # of a change of heat: drifting heat comes in steps that would outweigh the rest
FEW = 100  # steps that tell how much the heat changes anyway, before any evidence counts


class Listener(AnalyticPolicy):
    """Lies boldly, unless the temperatures before the onset show that the defender uses Kalman filters.

    The heat that a zone got follows from its temperatures by the model (4.5), u + d = (x(k + 1) - A x(k) - G w) / B.
    Its change has the unmeasured heat's in it, and the controller's answer du = -K_d dxh to what is new in the
    estimate that it follows: the change of the readings, or the correction by the filter of all sensors. Both are
    known to a white-box attacker. The evidence for one of them against neither is the logarithm of the ratio of
    likelihoods, with the changes' own variance in each zone, summed since the window is full. If at the onset it is at
    least `evidence` for the filter, and more than for the readings, the attack is that of `tracker`; else every
    compromised sensor shows `reading_c`.

    Raises:
        ConfigurationError: a reading outside the sensor range, or evidence that is not positive, besides what
            `tracker` refuses.
    """

    def __init__(self, spec: RoleSpec, *, reading_c: float = 10.0, evidence: float = 6.0, warmer: bool = False) -> None:
        super().__init__(spec)
        self.config: HvacConfig = spec.config
        if evidence <= 0:
            raise ConfigurationError(f"evidence = {evidence} has to be positive")
        self.evidence = evidence
        self._tracker = Tracker(spec, warmer=warmer)
        self._bold = absolute_action(self.config, np.array([[reading_c]]))
        self._model = build_model(self.config)
        self._all = int(self._model.filter_member.sum(axis=1).argmax())
        zones = np.eye(self.config.num_zones)[self._model.zone]
        self._mean = zones / zones.sum(axis=0)  # (S, n) of the readings in each zone
        scale = self._model.filter_scale[self._all]
        correction = self._model.filter_gain[self._all, : self.config.num_zones] / scale  # (n, S) C
        self._answer = -self._model.difference_gain @ correction  # (n, S) W

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What it remembers, then the state of `tracker`.

        That is the last temperatures (B, n), C, heat (B, n), W, and readings (B, n), C; what either estimate should
        have made of the last step (B, 2, n), W; the sum of squares of the changes (B, n), W2; the evidence (B, 2).
        """
        envs, n = len(generators), self.config.num_zones
        tracking = self._tracker.begin(generators, knowledge)
        assert tracking is not None
        remembered = (*np.zeros((3, envs, n)), np.zeros((envs, 2, n)), np.zeros((envs, n)), np.zeros((envs, 2)))
        return (*remembered, *tracking)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, S + 1)."""
        *remembered, bias_c, noise_c = state
        tracked, following = self._tracker.act(seen, (bias_c, noise_c))
        assert following is not None
        remembered = self._listen(seen, *remembered)
        raw, filtered = remembered[-1].T
        careful = (filtered >= self.evidence) & (filtered > raw)
        return np.where(careful[:, np.newaxis], tracked, self._bold), (*remembered, *following)

    def _listen(
        self,
        seen: Seen,
        before_c: FloatArray,
        before_w: FloatArray,
        readings_c: FloatArray,
        expected_w: FloatArray,
        squares_w2: FloatArray,
        evidence: FloatArray,
    ) -> list[FloatArray]:
        """What `begin` says, one step later; nothing more is learned from the onset on."""
        k, model = elapsed_steps(seen, self.config), self._model
        now_c, now_readings_c = seen["temperature"], seen["reading"] @ self._mean
        heat_w = (now_c - before_c @ model.A.T - model.G * model.weather[k - 1]) / model.B
        change_w = np.clip(heat_w - before_w, -MOST_W, MOST_W)
        quiet = attack_age(seen, self.config) == 0
        squares_w2 = squares_w2 + np.where((quiet & (k > 2))[:, np.newaxis], change_w**2, 0.0)
        samples = np.maximum(k - 2, 1)[:, np.newaxis]
        likelier = expected_w * (change_w[:, np.newaxis] - 0.5 * expected_w)
        gained = (likelier / np.maximum(squares_w2 / samples, 1e-9)[:, np.newaxis]).sum(axis=2)
        counts = quiet & (k > max(self.config.window_steps + 2, FEW))
        evidence = evidence + np.where(counts[:, np.newaxis], gained, 0.0)
        by_readings = -(now_readings_c - readings_c) @ model.difference_gain.T
        by_filter = seen["innovation"][:, self._all] @ self._answer.T
        return [now_c, heat_w, now_readings_c, np.stack([by_readings, by_filter], axis=1), squares_w2, evidence]
