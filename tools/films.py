"""The films of the documentation: which episode each of them shows, and what its caption says of it.

$ python -m tools.films            # all of them, to docs/images
$ python -m tools.films fdi
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

IMAGES = Path("docs/images")


@dataclass(frozen=True)
class Film:
    """An episode of a problem, and what has to come out of it so that the caption is true."""

    caption: str
    attacker: str
    defender: str
    preset: str = "learning"
    seed: int = 0
    speed: float = 10.0  # game seconds per second
    changes: Sequence[str] = ()  # FIELD=VALUE
    holds: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # a metric of its end: least and most

    def command(self, problem: str) -> list[str]:
        """The command that plays it."""
        sides = ["--attacker", self.attacker, "--defender", self.defender, "--preset", self.preset]
        changes = [part for change in self.changes for part in ("--set", change)]
        return ["cps-envs", "play", problem, *sides, "--seed", str(self.seed), "--speed", f"{self.speed:g}", *changes]


MANY = 1e9
FILMS = {
    "disbanding": Film(
        "An attacker disbands the lead platoon; the wave runs through the traffic behind",
        "lead",
        "none",
        preset="paper",
        changes=("duration_s=60",),
        holds={"disbanded_platoons": (1, 1), "velocity_error_intact": (50, 100), "stopped_share": (50, 100)},
    ),
    "fdi": Film(
        "Falsified sensors make a vehicle hit the one ahead",
        "tracker",
        "none",
        seed=9,
        speed=1.0,
        holds={"collided_target": (1, 1), "impact_speed_mps": (4, MANY), "injected_share": (0.01, 1)},
    ),
    "hvac": Film(
        "Three of four sensors drift away, and the controller overheats the rooms",
        "root_ramp",
        "mtd1",
        seed=7,
        holds={"num_compromised": (3, 3), "a_impact": (100, MANY)},
    ),
    "rogue": Film(
        "An attacker rocks back and forth between the vehicles of a platoon",
        "duty_square",
        "sliding",
        preset="easy",
        holds={"collisions": (2, MANY)},
    ),
}


def main(problems: Sequence[str]) -> int:
    """Film these, or all."""
    for problem in problems or list(FILMS):
        target = str(IMAGES / f"{problem}.gif")
        subprocess.run([*FILMS[problem].command(problem), "--render", target], check=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
