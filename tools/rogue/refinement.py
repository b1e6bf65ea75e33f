"""What half the step changes: `python -m tools.rogue.refinement` prints the table in docs/details/rogue.md.

The attackers do not look at gaps: the noise of a sensor is numbered by integration steps, so that half the step is
other noise, and an attacker that looks at it would play another episode.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from cps_envs.core.declare.config import configure
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import FloatArray, Role
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.problem import ROGUE

SETTINGS: dict[str, dict[str, Any]] = {
    "paper": {"contact": "solid", "duration_s": 60.0},
    "easy": {},
    "learning": {"attack_share": 1.0},
}
ATTACKERS = ("square", "duty_square", "random")
DEFENDERS = ("pd", "sliding", "sliding_detection")
EPISODES = 20


@dataclass(frozen=True)
class Change:
    """Damages (E,) of the same episodes at the step of a preset and at half of it, m/s."""

    coarse: FloatArray
    fine: FloatArray

    @property
    def mean(self) -> float:
        """Of the mean, relative; the damage is at least 1 m/s for this."""
        return float(self.fine.mean() - self.coarse.mean()) / max(float(self.coarse.mean()), 1.0)

    @property
    def largest(self) -> float:
        """Of a single episode, m/s."""
        return float(np.abs(self.fine - self.coarse).max())


def change(preset: str, attacker: str, defender: str, episodes: int = EPISODES) -> Change:
    """What half the step changes in the episodes of the seeds 0, 1, ..."""
    config: RogueConfig = ROGUE.config(preset, SETTINGS[preset])
    players: dict[Role, PolicyReference] = {"attacker": attacker, "defender": defender}
    configs = (config, configure(config, {"dt_s": config.dt_s / 2}))
    return Change(*(play_episodes(ROGUE, each, players, list(range(episodes)))["damage"] for each in configs))


def table() -> Iterator[str]:
    """The lines of the table."""
    yield "| preset, step | defender | damage, m/s | mean changes by | largest change of an episode, m/s |"
    yield "|---|---|---|---|---|"
    for preset, defender in product(SETTINGS, DEFENDERS):
        found = [change(preset, attacker, defender) for attacker in ATTACKERS]
        damage = np.mean([each.coarse.mean() for each in found])
        means, largest = max((each.mean for each in found), key=abs), max(each.largest for each in found)
        step_ms = 1e3 * ROGUE.config(preset, {}).dt_s
        yield f"| `{preset}`, {step_ms:g} ms | `{defender}` | {damage:.1f} | {means:+.1%} | {largest:.2f} |"


if __name__ == "__main__":
    for line in table():
        print(line)
