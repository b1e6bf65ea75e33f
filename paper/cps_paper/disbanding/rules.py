"""The claims of the chapter, which the functions in `claims_*` check, the rules of verdicts, and of judging again.

Nothing in the claims is drawn, so there are no other seeds to look at: what changes is the integration step, and the
rules that the chapter only mentions.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from cps_envs.disbanding.config import PAPER
from cps_paper.claims import Claims
from cps_paper.disbanding.experiments import DisbandingEvidence
from cps_paper.disbanding.scenario import Overrides, Recorded, Scenario
from cps_paper.evidence import Experiment
from cps_paper.recheck import Condition
from cps_paper.verdicts import COMPARISON_RULE, RECOVERY_RULE

CLAIMS: Claims[DisbandingEvidence] = Claims("claims_ch2")
RULES = (
    "Rules. A number: reproduced within 5 % of the paper's, near within 10 %. A velocity error: reproduced within 2.0 "
    "points, near within 4.0. A statement about several cases: reproduced if it holds in all, near in all but one, "
    "partly in some. Otherwise not reproduced. " + COMPARISON_RULE + RECOVERY_RULE
)


def varied(experiment: Experiment[Any], overrides: Overrides) -> Experiment[Any]:
    """The same simulation with other fields of the configuration."""
    if isinstance(experiment, Scenario):
        return replace(experiment, overrides=(*experiment.overrides, *overrides))
    if isinstance(experiment, Recorded):
        scenario = varied(experiment.scenario, overrides)
        assert isinstance(scenario, Scenario)
        return replace(experiment, scenario=scenario)
    raise TypeError(f"no claim needs {experiment.label}")


def halved(experiment: Experiment[Any]) -> Experiment[Any]:
    """The same simulation at half the step of its interpretation."""
    scenario = experiment.scenario if isinstance(experiment, Recorded) else experiment
    step_s = scenario.config.dynamics.dt_s if isinstance(scenario, Scenario) else PAPER.dynamics.dt_s
    return varied(experiment, (("dt_s", step_s / 2),))


CONDITIONS = (
    Condition("at half the step", (halved,)),
    Condition("with the standstill rule", (partial(varied, overrides=(("standstill_rule", True),)),)),
    Condition("with transitional controllers", (partial(varied, overrides=(("transitional_controller", True),)),)),
)
