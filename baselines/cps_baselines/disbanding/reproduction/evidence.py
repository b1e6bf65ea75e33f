"""The results of the chapter's experiments, read under one interpretation of what it leaves open."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cps_baselines.disbanding.reproduction.experiments import Experiments
from cps_baselines.reproduction import evidence


class Evidence(evidence.Evidence):
    """Results by experiment; `experiments` names them under the interpretation."""

    def __init__(self, results: Mapping[evidence.Experiment[Any], Any], interpretation: str = "S0") -> None:
        super().__init__(results)
        self.experiments = Experiments(interpretation)

    def under(self, interpretation: str) -> Evidence:
        """The same results, read under another interpretation."""
        return Evidence(self._results, interpretation)
