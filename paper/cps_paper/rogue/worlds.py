"""The worlds in which the searched attacker `switching` is judged: 60 s of the paper with solid bodies.

Drive and drag differ by up to 0.3 % between worlds, and the step may be halved: damage that comes from the chatter of
an integration step does not last there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_baselines.rogue.switching import Switching
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import FloatArray, Role
from cps_envs.rogue.config import PAPER, RogueConfig
from cps_envs.rogue.problem import ROGUE

ALL = "all"  # the defenders of chapter 5 at once
RATIOS = (1.0, 1.3)
SETTING = {"contact": "solid", "duration_s": 60.0}
SPREAD = 0.003  # relative, of drive and drag between worlds
REPORTED = 30_000_000  # first seed of the worlds that no search has seen


def switching_damages(
    weights: FloatArray,
    defenders: Sequence[str],
    power_ratio: float,
    seeds: Sequence[int],
    *,
    spread: float = SPREAD,
    refined: bool = False,
) -> FloatArray:
    """Damages (P, defenders, worlds) in m/s of candidates (P, 7), all played at once against each defender."""
    config = world_config(power_ratio, spread, refined=refined)
    attacker = Switching(ROGUE.game(config, 1).spec("attacker"), np.repeat(weights, len(seeds), axis=0))
    damages = np.empty((len(weights), len(defenders), len(seeds)))
    for k, defender in enumerate(defenders):
        players: dict[Role, PolicyReference] = {"attacker": attacker, "defender": defender}
        outcome = play_episodes(ROGUE, config, players, list(seeds) * len(weights))
        damages[:, k] = outcome["damage"].reshape(len(weights), len(seeds))
    return damages


def world_config(
    power_ratio: float | tuple[float, float], spread: float = SPREAD, *, refined: bool = False
) -> RogueConfig:
    """The learning problem's contact and duration; each seed draws drive and drag within +-`spread`, relative.

    `power_ratio` may be a range, of which each seed draws one too.
    """
    ends = np.array([1 - spread, 1 + spread])
    drawn = {name: (getattr(PAPER, name) * ends).tolist() for name in ("drive_mps2", "drag_per_s")} if spread else {}
    step = {"dt_s": PAPER.dt_s / 2} if refined else {}
    config: RogueConfig = ROGUE.config("paper", {**SETTING, "power_ratio": power_ratio, **drawn, **step})
    return config
