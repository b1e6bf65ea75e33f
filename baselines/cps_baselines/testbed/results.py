"""What the runs of this reproduction say, ready to be judged, printed and drawn.

How the intact robots come back after the attack is told by their speeds and gaps beside those of the same seeds without
it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cps_baselines.reproduction.evidence import Evidence, Experiment
from cps_baselines.reproduction.verdicts import SAME_SHARE, deviation, recovery_s
from cps_baselines.testbed.cases import BASE, CASES, LONG, LONG_S, SEEDS, SHORT, Case, Outcome, Runs
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.testbed.config import BASELINE

LATE_S = 10.0  # over which speeds and gaps are averaged, as robots and camera are noisy; chosen
FIRST = BASELINE.vehicles_per_platoon  # the first intact robot, front to rear


@dataclass(frozen=True)
class Recovery:
    """S runs, and the same without an attack; means over the last LATE_S at each of T times."""

    attacked: Outcome
    calm: Outcome

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

    def follows(self, share: float = SAME_SHARE) -> BoolArray:
        """The runs (S,) in which all intact robots are as fast, relative to the robot ahead of them, as without."""
        attacked, calm = (means[:, -1, 1:] / means[:, -1, :1] for means in self._means("speeds_mps", FIRST - 1))
        return deviation(attacked, calm, 1.0) <= share

    @property
    def _window(self) -> int:
        return round(LATE_S / self.attacked.step_s)

    def _means(self, name: str, first: int) -> tuple[FloatArray, FloatArray]:
        """A course of each column from `first` on, with and without the attack, averaged."""
        attacked, calm = (_running_mean(getattr(each, name)[:, :, first:], self._window) for each in self._both)
        return attacked, calm

    @property
    def _both(self) -> tuple[Outcome, Outcome]:
        return self.attacked, self.calm


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

    def of(self, case: Case) -> Outcome:
        """The runs of a case."""
        return self[Runs(case, self.num_seeds)]

    def recovery(self, case: Case, duration_s: float = BASELINE.duration_s) -> Recovery:
        """How the runs of a case come back to those of the same seeds without an attack.

        Raises:
            NotRunError: runs of this duration were left out.
        """
        calm = self[Runs(BASE, self.num_seeds, duration_s, attacked=False)]
        return Recovery(self[Runs(case, self.num_seeds, duration_s)], calm)

    def errors(self, case: Case) -> FloatArray:
        """E_v in percent of every seed, (S,)."""
        return self.of(case).metrics["velocity_error"]

    @property
    def ordered(self) -> BoolArray:
        """The seeds (S,) in which E_v falls from the baseline to t_s = 0.5 s and on to 1 s."""
        base, short, long = (self.errors(case) for case in CASES)
        ordered: BoolArray = (base > short) & (short > long)
        return ordered

    @property
    def in_order(self) -> bool:
        """Whether that holds in enough seeds."""
        return bool(self.ordered.mean() >= ORDERED_SHARE)

    def gains(self) -> tuple[float, float]:
        """Relative reductions of the mean E_v in percent, at t_s = 0.5 s and 1 s."""
        base = float(self.errors(BASE).mean())
        short, long = (100.0 * (1.0 - float(self.errors(case).mean()) / base) for case in (SHORT, LONG))
        return short, long


def needed(results: Results) -> list[Experiment[Any]]:
    """Everything that is judged; `quick` leaves out the long runs."""
    seeds = results.num_seeds
    usual: list[Experiment[Any]] = [Runs(BASE, seeds, attacked=False), *(Runs(case, seeds) for case in CASES)]
    long = [Runs(BASE, seeds, LONG_S, attacked=False), *(Runs(case, seeds, LONG_S) for case in MITIGATED_CASES)]
    return usual if results.quick else [*usual, *long]
