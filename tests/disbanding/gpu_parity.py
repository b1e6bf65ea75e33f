"""Run by test_gpu with NUMBA_ENABLE_CUDASIM=1, which numba reads when it is imported: one GPU thread per environment.

The thread calls the very functions that the CPU's kernels are made of. Prints the fields of the state that differ.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numba import cuda

from cps_envs.core.compute.kernels import unpack, view
from cps_envs.disbanding.dynamics import advance, advance_episode
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.disbanding.state import Constants, State

NUM_ENVS, STEPS = 3, 120
SIZES: dict[str, Any] = {"num_platoons": (3, 4), "vehicles_per_platoon": 3, "takeover_delay_s": (0.0, 0.3)}


@cuda.jit
def launch(state: Any, constants: Any, correction: Any, closing: Any, num_steps: int) -> None:
    b = cuda.grid(1)
    if b < state.step.size:
        advance_episode(view(state, b), unpack(Constants, constants, b), correction[b], closing[b], num_steps)


def difference(interpretation: str) -> list[str]:
    """The fields of the state that differ between the two targets, in any bit."""
    overrides = SIZES | {"interpretation": interpretation, "on_collision": "end", "control_period_s": 0.1}
    game = DISBANDING.game(DISBANDING.config("easy", overrides), NUM_ENVS)
    every = np.ones(NUM_ENVS, np.bool_)
    game.reset(every, [np.random.default_rng(b) for b in range(NUM_ENVS)])
    game.state.disbanding_s[:, 0] = 0.0
    game.state.disbanding_s[1, 2] = 0.3
    position = game.state.position[2]
    position[4:] += position[3] - position[4] + 0.1  # vehicle 4 overlaps vehicle 3, which ends this episode
    here, there = (State(*(array.copy() for array in game.state)) for _ in range(2))
    correction = np.random.default_rng(1).uniform(-2.0, 2.0, here.position.shape)
    for _ in range(2):
        advance(here, game.constants, correction, every, STEPS)
        launch[1, NUM_ENVS](there, game.constants, correction, np.empty_like(correction), STEPS)
    assert here.collided.any()
    assert here.step.min() < here.step.max() == 2 * STEPS
    return [name for name in State._fields if getattr(here, name).tobytes() != getattr(there, name).tobytes()]


if __name__ == "__main__":
    print({name: found for name in sys.argv[1:] if (found := difference(name))})
