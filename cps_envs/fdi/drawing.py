"""What resets draw: the task, starts, gains, disturbances, the noise of the sensors, and when the attack begins."""

from __future__ import annotations

import numpy as np

from cps_envs.core.config import Range, bounds
from cps_envs.core.types import Array
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.state import State

GAINS = ("proportional_gain", "derivative_gain")


class Drawing:
    """Draws for one configuration. What a configuration leaves out is not drawn, so that it shifts nothing else."""

    def __init__(self, config: FdiConfig, num_tasks: int) -> None:
        self.config, self.num_tasks = config, num_tasks
        self.own_constants = config.gain_spread > 0 or isinstance(config.disturbance_mps2, tuple)
        spread = config.gap_spread_m > 0 or config.speed_spread_mps > 0
        filters = config.estimator == "kalman"
        self.needed = bool(config.tasks) or spread or config.disturbed or self.own_constants or filters

    def draw(self, state: State, constants: Array, b: int, generator: np.random.Generator) -> None:
        """Fill the task of episode b, and numbers that `dynamics.begin` makes errors and disturbances of."""
        config = self.config
        state.task[b] = generator.integers(self.num_tasks)
        generator.random(out=state.error[b])
        if state.disturbance.shape[1]:
            generator.standard_normal(out=state.disturbance[b])
            if config.own_phases:
                state.phase[b] = generator.integers(config.hold_steps, size=config.num_vehicles)
        if config.estimator == "kalman":
            generator.standard_normal(out=state.noise[b])
            attacked, onset_s = generator.random() < config.attack_share, drawn(config.onset_s, generator)
            state.onset[b] = round(onset_s / config.dt_s) if attacked else config.horizon
        if self.own_constants:
            row = constants[b]
            for name in GAINS:
                row[name] = getattr(config, name) * (1 + config.gain_spread * generator.uniform(-1, 1))
            row["disturbance_mps2"] = drawn(config.disturbance_mps2, generator)


def drawn(value: Range, generator: np.random.Generator) -> float:
    """A value, or one between two bounds."""
    low, high = bounds(value)
    return low + (high - low) * generator.random()
