"""The results of the chapter's experiments, read under one interpretation of what it leaves open."""

from __future__ import annotations

from dataclasses import dataclass, replace

from cps_baselines.disbanding.reproduction.experiments import Experiments
from cps_baselines.reproduction import evidence


@dataclass(frozen=True)
class Evidence(evidence.Evidence):
    """Results by experiment; `experiments` names them under the interpretation."""

    interpretation: str = "S0"
    all_interpretations: bool = False  # of the baseline

    @property
    def experiments(self) -> Experiments:
        """The chapter's experiments under the interpretation."""
        return Experiments(self.interpretation)

    def under(self, interpretation: str) -> Evidence:
        """The same results, read under another interpretation."""
        return replace(self, interpretation=interpretation)
