"""The HVAC game: B heated buildings, an attacker who forges sensors, a defender who chooses which to believe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from gymnasium import spaces

from cps_envs.core.game import Game
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, Role
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.episode import draw_episode, start
from cps_envs.hvac.fields import attacker_fields, defender_fields
from cps_envs.hvac.metrics import METRICS
from cps_envs.hvac.model import build_model
from cps_envs.hvac.scene import Scene
from cps_envs.hvac.state import State, allocate
from cps_envs.hvac.turn import Account, begin, take_turn

READINGS = 0  # the choice of the raw readings


class HvacGame(Game):
    """A game step is one sample, 120 s; both roles decide at every step k = 0..718, at the same time.

    Attacker: Box (S + 1,), or (S,) with `attack_action="bias"`; it forges the readings of k + 1, see `attack.sense`.
    Defender: Discrete(sets + 2); its choice answers the readings of k: 0 feeds them to the controller as they are,
    1..sets the estimate from that set, sets + 1 the model's prediction. Before the window of N_e samples is full only 0
    and sets + 1 are legal, and all but 0 mean the recursive least squares of all sensors.

    Payoff: |x(k + 1) - x_r|^2 / T_a from the onset on, so that the return is A_impact (4.19).
    """

    name = "hvac"

    def __init__(self, config: HvacConfig, num_envs: int) -> None:
        super().__init__(num_envs)
        self.config: HvacConfig = config
        self.horizon = config.num_steps - 1
        self.step_s = config.step_s
        self.decision_interval = {"attacker": 1, "defender": 1}
        self.fields = {"attacker": attacker_fields(config), "defender": defender_fields(config)}
        self.constants = build_model(config)
        entries = config.num_sensors + self.constants.any_base
        choices = len(self.constants.member) + 2
        self.action_space = {
            "attacker": spaces.Box(-1.0, 1.0, (entries,), np.float32),
            "defender": spaces.Discrete(choices),
        }
        self.neutral_action = {"attacker": np.zeros(entries), "defender": np.array(READINGS)}
        self.payoff_parts = ("a_impact",)
        self.state: State = allocate(num_envs, self.constants)
        self._account = Account(
            payoff=np.zeros(num_envs),
            metrics=np.zeros((num_envs, len(METRICS))),
            attacker=np.zeros((num_envs, self.fields["attacker"].size)),
            defender=np.zeros((num_envs, self.fields["defender"].size)),
        )
        self._board = (tuple(self.constants), tuple(self.state), tuple(self._account))
        self._episodes: IntArray = np.arange(num_envs)
        self._quiet = np.zeros((num_envs, entries))
        self._raw = np.full(num_envs, READINGS)
        self._legal = np.ones((2, choices), np.int8)  # choices before the window is full, and from then on
        self._legal[0, 1:-1] = 0

    def _reset(self, envs: BoolArray, generators: Sequence[np.random.Generator]) -> None:
        self._episodes[envs] += self.num_envs
        for b in np.flatnonzero(envs).tolist():
            start(self.state, b, draw_episode(self.config, generators[b]), self.config)
        begin(*self._board, envs)

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        moves = (actions.get("attacker", self._quiet), actions.get("defender", self._raw))
        take_turn(*self._board, *moves, envs, num_steps)
        return self._account.payoff.copy()

    def observe(self, role: Role) -> Observation:
        """See `fields.attacker_fields` and `fields.defender_fields`."""
        return self.fields[role].encode(self._account.attacker if role == "attacker" else self._account.defender)

    def action_mask(self, role: Role) -> BoolArray | None:
        """Legal choices (B, sets + 2) of the defender; the attacker's actions are always legal."""
        if role == "attacker":
            return None
        ready = self.state.step >= self.config.window_steps
        return self._legal[ready.astype(np.int64)].astype(np.bool_)

    def episode_mask(self, role: Role, b: int) -> Array | None:
        """Legal choices (sets + 2,) of one episode as int8."""
        if role == "attacker":
            return None
        legal: Array = self._legal[int(self.state.step.item(b) >= self.config.window_steps)].copy()
        return legal

    def metrics(self) -> dict[str, Array]:
        """`metrics.METRICS` so far, each (B,)."""
        return dict(zip(METRICS, self._account.metrics.T, strict=True))

    def episode_metrics(self, b: int) -> dict[str, float]:
        """`metrics` of one episode as Python numbers."""
        return dict(zip(METRICS, self._account.metrics[b].tolist()))  # noqa: B905, strict costs a microsecond

    def mean_residuals(self) -> FloatArray:
        """Jm_a(k) of (4.33), (B, sets) C2; 0 until the window is full."""
        samples = self.state.step - self.config.window_steps + 1
        return self.state.residual_sum / np.maximum(samples, 1)[:, np.newaxis]

    def scene(self, b: int) -> Scene:
        """What the viewer draws of an episode."""
        state, k = self.state, int(self.state.step[b])
        return Scene(
            episode=int(self._episodes[b]),
            step=k,
            onset=int(state.onset[b]),
            temperature=state.temperature[b].copy(),
            estimate=state.fed[b].copy(),
            heating=state.heating[b].copy(),
            outdoor_c=float(self.constants.outdoor[k]),
            measured=state.measured[b].copy(),
            reading=state.reading[b].copy(),
            compromised=state.compromised[b].copy(),
            choice=int(state.choice[b]),
            ready=k >= self.config.window_steps,
            residual=state.residual[b].copy(),
            mean_residual=self.mean_residuals()[b],
            metrics=self.episode_metrics(b),
        )
