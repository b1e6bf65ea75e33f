"""The three experiments of section 2.5, each over the same seeds, and the mitigation as the robots run it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cps_envs.core.game import Game
from cps_envs.core.play import play_episodes
from cps_envs.core.types import FloatArray
from cps_envs.testbed.config import BASELINE, MITIGATED, RobotConfig
from cps_envs.testbed.game import RobotGame
from cps_envs.testbed.problem import ATTACK, TESTBED

DECREMENT_MPS2 = 0.02  # in the robots' metres; chosen

PERIODS_S = (0.5, 1.0)  # t_s of Figs. 2.5b and c


def mitigation(period_s: float, config: RobotConfig) -> str:
    """The name of the heuristic with t_s = `period_s`, samples of a control period, and bodies that have a length."""
    options = {
        "horizon_s": period_s,
        "sample_s": config.control_period_s,
        "decrement_mps2": config.scale * DECREMENT_MPS2,
        "clearance_m": config.scale * config.body_length_m,
        "avoidance": str(config.avoidance == "always").lower(),
    }
    return "heuristic?" + "&".join(f"{name}={value}" for name, value in options.items())


LONG_S = 140.0  # an episode that shows how long recovery takes
SEEDS, QUICK_SEEDS = 20, 3


@dataclass(frozen=True)
class Case:
    """One of the experiments."""

    name: str
    figure: str  # "2.5a"
    claim: str  # id of the claim about its E_v
    period_s: float | None  # t_s of the mitigation; None = the baseline

    @property
    def config(self) -> RobotConfig:
        """Collision avoidance all the time, or until the mitigation takes over."""
        return BASELINE if self.period_s is None else MITIGATED

    @property
    def defender(self) -> str:
        """The name of the policy."""
        return "none" if self.period_s is None else mitigation(self.period_s, self.config)


BASE = Case("baseline", "2.5a", "T01", None)
SHORT, LONG = (
    Case(f"t_s = {period_s:g} s", figure, claim, period_s)
    for period_s, figure, claim in zip(PERIODS_S, ("2.5b", "2.5c"), ("T02", "T03"), strict=True)
)
CASES = (BASE, SHORT, LONG)


@dataclass(frozen=True)
class Outcome:
    """What S runs of a case ended with, and their courses."""

    metrics: dict[str, FloatArray]  # `cps_envs.testbed.payoff.METRICS`, each (S,)
    speeds_mps: FloatArray  # (S, k, M) front to rear
    gaps_m: FloatArray  # (S, k, M - 1) ahead of all robots but the front one
    step_s: float


@dataclass(frozen=True)
class Runs:
    """A case under the seeds 0, 1, ..., played as one batch."""

    case: Case
    num_seeds: int
    duration_s: float = BASELINE.duration_s
    attacked: bool = True

    @property
    def cost(self) -> float:
        """How long it takes, relative to others."""
        return self.num_seeds * self.duration_s * (1.0 if self.case.period_s is None else 2.0)

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        attack = "" if self.attacked else ", no attack"
        return f"{self.case.name}, {self.num_seeds} seeds, {self.duration_s:g} s{attack}"

    def run(self) -> Outcome:
        """Play all seeds to the end."""
        config = replace(self.case.config, duration_s=self.duration_s)
        ended: list[RobotGame] = []

        def keep(game: Game) -> None:
            if isinstance(game, RobotGame) and game.elapsed[0] == game.horizon:
                ended.append(game)

        players = {"attacker": ATTACK if self.attacked else "none", "defender": self.case.defender}
        metrics = play_episodes(TESTBED, config, players, range(self.num_seeds), on_step=keep)  # type: ignore[arg-type]
        (game,) = ended
        courses = game.robots
        return Outcome(metrics, courses.speeds.copy(), -np.diff(courses.arcs, axis=2), game.step_s)
