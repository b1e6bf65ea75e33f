"""The three experiments of section 2.5, each over the same seeds, and the mitigation as the robots run it.

What the runs say is ready to be judged, printed and drawn. How the intact robots come back after the attack is told by
their speeds and gaps beside those of the same seeds without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from cps_envs.core.game.game import Game
from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import BoolArray, FloatArray
from cps_paper.evidence import Evidence, Experiment
from cps_paper.testbed.robots.config import BASELINE, MITIGATED, RobotConfig
from cps_paper.testbed.robots.game import RobotGame
from cps_paper.testbed.robots.problem import ATTACK, TESTBED, mitigation
from cps_paper.verdicts import SAME_SHARE, deviation, recovery_s

PERIODS_S = (0.5, 1.0)  # t_s of Figs. 2.5b and c


DAMPING: Mapping[str, Mapping[str, Any]] = {  # readings of what section 2.5 leaves open: fields of the configuration
    "k3": {},
    "k1": {"derivative_gain": 1.0, "measured_for_s": 40.0},  # E_v from the attack to the end of the run
}
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
class CaseOutcome:
    """What S runs of a case ended with, and their courses."""

    metrics: dict[str, FloatArray]  # `cps_paper.testbed.robots.payoff.METRICS`, each (S,)
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
    damping: str = "k3"  # one of `DAMPING`

    @property
    def cost(self) -> float:
        """How long it takes, relative to others."""
        return self.num_seeds * self.duration_s * (1.0 if self.case.period_s is None else 2.0)

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        attack = "" if self.attacked else ", no attack"
        return f"{self.case.name}, {self.num_seeds} seeds, {self.duration_s:g} s{attack}"

    def run(self) -> CaseOutcome:
        """Play all seeds to the end."""
        config = replace(self.case.config, duration_s=self.duration_s, **DAMPING[self.damping])
        ended: list[RobotGame] = []

        def keep(game: Game) -> None:
            if isinstance(game, RobotGame) and game.elapsed[0] == game.horizon:
                ended.append(game)

        players = {"attacker": ATTACK if self.attacked else "none", "defender": self.case.defender}
        metrics = play_episodes(TESTBED, config, players, range(self.num_seeds), on_step=keep)  # type: ignore[arg-type]
        (game,) = ended
        courses = game.robots
        return CaseOutcome(metrics, courses.speeds.copy(), -np.diff(courses.arcs, axis=2), game.step_s)


LATE_S = 10.0  # over which speeds and gaps are averaged, as robots and camera are noisy; chosen
FIRST = BASELINE.vehicles_per_platoon  # the first intact robot, front to rear


@dataclass(frozen=True)
class Recovery:
    """S runs, and the same without an attack; means over the last LATE_S at each of T times."""

    attacked: CaseOutcome
    calm: CaseOutcome

    @cached_property
    def time_s(self) -> FloatArray:
        """The ends (T,) of the averaged intervals."""
        samples = self.attacked.speeds_mps.shape[1]
        time_s: FloatArray = self.attacked.step_s * np.arange(self._window - 1, samples, dtype=np.float64)
        return time_s

    @cached_property
    def speed_deviation(self) -> FloatArray:
        """The largest of an intact robot's speed (S, T), as a share of the desired speed."""
        return deviation(*self._means("speeds_mps", FIRST), BASELINE.desired_speed_mps)

    @cached_property
    def gap_deviation(self) -> FloatArray:
        """The largest of the gap ahead of an intact robot (S, T), as a share of the desired one."""
        leader_m = BASELINE.headway_s * BASELINE.desired_speed_mps
        intact = BASELINE.num_robots - FIRST
        desired = np.where(np.arange(intact) % FIRST == 0, leader_m, BASELINE.desired_gap_m)
        return deviation(*self._means("gaps_m", FIRST - 1), desired)

    def recovered(self, share: float = SAME_SHARE) -> BoolArray:
        """The runs (S,) that have recovered at the end."""
        hold: BoolArray = (self.speed_deviation[:, -1] <= share) & (self.gap_deviation[:, -1] <= share)
        return hold

    def times_s(self, share: float = SAME_SHARE) -> list[float]:
        """The times to recovery of the runs that have recovered at the end, from the attack on."""
        worst = np.maximum(self.speed_deviation, self.gap_deviation)
        found = (recovery_s(self.time_s, row, share) for row in worst)
        return [time_s - BASELINE.measured_from_s for time_s in found if time_s is not None]

    @property
    def shares(self) -> tuple[float, float]:
        """Mean speeds at the end over those without an attack: the robot ahead of the intact ones, and these."""
        attacked, calm = (means[:, -1].mean(axis=0) for means in self._means("speeds_mps", FIRST - 1))
        return float(attacked[0] / calm[0]), float(attacked[1:].mean() / calm[1:].mean())

    def follows(self) -> BoolArray:
        """The runs (S,) in which all intact robots are as fast, relative to the robot ahead of them, as without."""
        attacked, calm = (means[:, -1, 1:] / means[:, -1, :1] for means in self._means("speeds_mps", FIRST - 1))
        return deviation(attacked, calm, 1.0) <= SAME_SHARE

    @property
    def _window(self) -> int:
        return round(LATE_S / self.attacked.step_s)

    def _means(self, name: str, first: int) -> tuple[FloatArray, FloatArray]:
        """A course of each column from `first` on, with and without the attack, averaged."""
        attacked, calm = (
            _running_mean(getattr(each, name)[:, :, first:], self._window) for each in (self.attacked, self.calm)
        )
        return attacked, calm


def _running_mean(values: FloatArray, window: int) -> FloatArray:
    """Over so many samples, (S, k, M) to (S, k - window + 1, M)."""
    total = np.cumsum(np.pad(values, ((0, 0), (1, 0), (0, 0))), axis=1)
    mean: FloatArray = (total[:, window:] - total[:, :-window]) / window
    return mean


MITIGATED_CASES = (SHORT, LONG)
ORDERED_SHARE = 0.9  # of the seeds in which E_v has to fall from case to case


@dataclass(frozen=True)
class Results(Evidence):
    """Results by experiment, and what follows from them."""

    num_seeds: int = SEEDS
    damping: str = "k3"  # one of `DAMPING`

    def runs(self, case: Case, duration_s: float = BASELINE.duration_s, *, attacked: bool = True) -> Runs:
        """A case under this reading."""
        return Runs(case, self.num_seeds, duration_s, attacked, self.damping)

    @property
    def window_s(self) -> tuple[float, float]:
        """Between what times E_v is measured."""
        config = replace(BASELINE, **DAMPING[self.damping])
        return config.measured_from_s, config.measured_from_s + config.measured_for_s

    def of(self, case: Case) -> CaseOutcome:
        """The runs of a case."""
        return self[self.runs(case)]

    def recovery(self, case: Case, duration_s: float = BASELINE.duration_s) -> Recovery:
        """How the runs of a case come back to those of the same seeds without an attack.

        Raises:
            NotRunError: runs of this duration were left out.
        """
        return Recovery(self[self.runs(case, duration_s)], self[self.runs(BASE, duration_s, attacked=False)])

    def errors(self, case: Case) -> FloatArray:
        """E_v in percent of every seed, (S,)."""
        return self.of(case).metrics["velocity_error"]

    @property
    def ordered(self) -> BoolArray:
        """The seeds (S,) in which E_v falls from the baseline to t_s = 0.5 s and on to 1 s."""
        base, short, long = (self.errors(case) for case in CASES)
        ordered: BoolArray = (base > short) & (short > long)
        return ordered

    def gains(self) -> tuple[float, float]:
        """Relative reductions of the mean E_v in percent, at t_s = 0.5 s and 1 s."""
        base = float(self.errors(BASE).mean())
        short, long = (100.0 * (1.0 - float(self.errors(case).mean()) / base) for case in (SHORT, LONG))
        return short, long


def needed(results: Results) -> list[Experiment[Any]]:
    """Everything that is judged; `quick` leaves out the long runs."""
    runs = results.runs
    usual: list[Experiment[Any]] = [runs(BASE, attacked=False), *map(runs, CASES)]
    long = [runs(BASE, LONG_S, attacked=False), *(runs(case, LONG_S) for case in MITIGATED_CASES)]
    return usual if results.quick else [*usual, *long]
