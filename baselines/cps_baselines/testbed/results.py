"""What the runs of this reproduction say, ready to be judged, printed and drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cps_baselines.reproduction.evidence import Evidence, Experiment
from cps_baselines.testbed.cases import BASE, CASES, LONG, LONG_S, SEEDS, SHORT, Case, Outcome, Runs
from cps_baselines.testbed.recovery import Recovery
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.testbed.config import BASELINE

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
