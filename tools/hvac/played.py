"""Playing a course of biases that was found ahead."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_baselines.hvac.replacing import elapsed_steps
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.policies.policy import AnalyticPolicy
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, State
from cps_envs.hvac.attack import bias_action
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC


class OpenLoop(AnalyticPolicy):
    """Shows the forged sensors (numbers from 1, (m,)) colder by `bias_c` (K, m), C, at each step."""

    def __init__(self, config: HvacConfig, sensors: Sequence[int], bias_c: FloatArray) -> None:
        super().__init__(HvacGame(config, 1).spec("attacker"))
        self.config = config
        self._bias_c = np.zeros((config.num_steps, config.num_sensors))
        self._bias_c[:, np.array(sensors) - 1] = bias_c

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """Actions (B, S + 1), which forge the readings of the next step."""
        following = np.minimum(elapsed_steps(seen, self.config) + 1, self.config.num_steps - 1)
        return bias_action(self.config, self._bias_c[following]), state


def impact_played(config: HvacConfig, attacker: PolicyReference, days: int) -> float:
    """Mean A_impact, C2, of an attacker against MTD2 on seeds 0, 1, ..."""
    outcome = play_episodes(HVAC, config, {"attacker": attacker, "defender": "mtd2"}, range(days))
    return float(outcome["a_impact"].mean())
