"""The readings of (4.17), and results under one: the controller, how far it looks and how it weighs moves.

`python -m cps_paper.hvac.weighing` finds horizon N and weight R, by the same rule for each.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from cps_envs.core.errors import ConfigurationError, near
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.problem import HVAC
from cps_paper.evidence import Evidence, Experiment
from cps_paper.hvac.scenario import DayScenario, Settings


@dataclass(frozen=True)
class Controller:
    """A reading of (4.17)."""

    name: str  # of the configuration's field `controller`
    reading: str  # in words
    settings: Settings = ()  # fields of the configuration that differ from the preset "paper"

    @property
    def config(self) -> HvacConfig:
        """The configuration of the chapter's first day."""
        config: HvacConfig = HVAC.config("paper", dict(self.settings))
        return config

    def under(self, experiment: Experiment[Any]) -> Experiment[Any]:
        """The day that stands in for one of the chapter."""
        assert isinstance(experiment, DayScenario)
        return replace(experiment, settings=tuple(sorted({**dict(self.settings), **dict(experiment.settings)}.items())))


def planning(name: str, reading: str) -> Controller:
    """A controller that plans, with N and R found by `weighing`."""
    return Controller(name, reading, (("controller", name), ("move_weight", 0.067), ("prediction_steps", 25)))


CLIP = Controller("clip", "gains, then limits")
CONTROLLERS = {
    each.name: each
    for each in (CLIP, planning("qp", "limits in the program"), planning("levels", "from level to level"))
}


def controller_named(name: str) -> Controller:
    """The reading with this name.

    Raises:
        ConfigurationError: there is none.
    """
    if name not in CONTROLLERS:
        known = ", ".join(CONTROLLERS)
        raise ConfigurationError(f"chapter 4 has no controller {name!r}. {near(name, CONTROLLERS)} Known: {known}.")
    return CONTROLLERS[name]


@dataclass(frozen=True)
class HvacEvidence(Evidence):
    """Results by experiment, computed with a controller."""

    controller: Controller = CLIP


def evidence_under(*, quick: bool = False, controller: str = CLIP.name) -> HvacEvidence:
    """Where the experiments with this controller stand in for those of the chapter.

    Raises:
        ConfigurationError: there is no such controller.
    """
    reading = controller_named(controller)
    return HvacEvidence(quick=quick, vary=reading.under, controller=reading)
