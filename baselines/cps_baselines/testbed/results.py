"""What the runs of this reproduction say, ready to be judged, printed and drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cps_baselines.reproduction.evidence import Evidence, Experiment
from cps_baselines.testbed.cases import BASE, CASES, LONG, LONG_S, SHORT, Case, Outcome, Runs
from cps_baselines.testbed.recovery import Recovery
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.testbed.config import BASELINE

MITIGATED_CASES = (SHORT, LONG)
ORDERED_SHARE = 0.9  # of the seeds in which E_v has to fall from case to case


class Results(Evidence):
    """Results by experiment, and what follows from them."""

    def __init__(self, results: Mapping[Experiment[Any], Any], num_seeds: int) -> None:
        super().__init__(results)
        self.num_seeds = num_seeds

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


def needed(num_seeds: int, *, quick: bool) -> list[Experiment[Any]]:
    """All experiments; `quick` leaves out the long ones."""
    calm = Runs(BASE, num_seeds, attacked=False)
    usual: list[Experiment[Any]] = [calm, *(Runs(case, num_seeds) for case in CASES)]
    long = [replace(calm, duration_s=LONG_S), *(Runs(case, num_seeds, LONG_S) for case in MITIGATED_CASES)]
    return usual if quick else [*usual, *long]
