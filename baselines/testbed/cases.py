"""The three experiments of section 2.5, each over the same seeds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from baselines.testbed.mitigation import PERIODS_S, mitigation
from cps_envs.core.game import Game
from cps_envs.core.play import play_episodes
from cps_envs.core.types import FloatArray
from cps_envs.testbed.config import BASELINE, MITIGATED, RobotConfig
from cps_envs.testbed.game import RobotGame
from cps_envs.testbed.picture.scene import desired_arcs
from cps_envs.testbed.problem import ATTACK, TESTBED

LATE_S = 10.0  # the end of an episode in which recovery is judged
LONG_S = 140.0  # an episode that is long enough for it
SEEDS, QUICK_SEEDS = 10, 3


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
    """What S runs of a case ended with, and the first of them in full."""

    metrics: dict[str, FloatArray]  # `cps_envs.testbed.payoff.METRICS`, each (S,)
    late_speed_mps: FloatArray  # (S,) mean of the intact robots in the last LATE_S
    late_gap_error_m: FloatArray  # (S,) mean distance of their gaps from the wanted ones, likewise
    speeds_mps: FloatArray  # (k, M) of the first run, front to rear
    step_s: float


@dataclass(frozen=True)
class Runs:
    """A case under the seeds 0, 1, ..., played as one batch."""

    case: Case
    num_seeds: int
    duration_s: float = BASELINE.duration_s

    @property
    def cost(self) -> float:
        """How long it takes, relative to others."""
        return self.num_seeds * self.duration_s * (1.0 if self.case.period_s is None else 2.0)

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{self.case.name}, {self.num_seeds} seeds, {self.duration_s:g} s"

    def run(self) -> Outcome:
        """Play all seeds to the end."""
        config = replace(self.case.config, duration_s=self.duration_s)
        ended: list[RobotGame] = []

        def keep(game: Game) -> None:
            if isinstance(game, RobotGame) and game.elapsed[0] == game.horizon:
                ended.append(game)

        players = {"attacker": ATTACK, "defender": self.case.defender}
        metrics = play_episodes(TESTBED, config, players, range(self.num_seeds), on_step=keep)  # type: ignore[arg-type]
        (game,) = ended
        late = [_late(game, b) for b in range(self.num_seeds)]
        speeds, errors = np.array(late).T
        return Outcome(metrics, speeds, errors, game.robots.speeds[0].copy(), game.step_s)


def _late(game: RobotGame, b: int) -> tuple[float, float]:
    """Mean speed and mean gap error of the intact robots at the end of a run."""
    config, disbanding_s = game.config, game.string.disbanding_s[b]
    periods = range(game.horizon - round(LATE_S / game.step_s), game.horizon + 1)
    intact = game.intact[b]
    arcs, speeds = game.robots.arcs[b], game.robots.speeds[b]
    errors = [arcs[k] - desired_arcs(arcs[k], speeds[k], disbanding_s, config) for k in periods]
    return float(speeds[list(periods)][:, intact].mean()), float(np.abs(np.array(errors)[:, intact]).mean())
