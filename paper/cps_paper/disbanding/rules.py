"""The claims of the chapter, which the functions in `claims_*` check, the rules of verdicts, and of judging again.

Nothing in the claims is drawn, so there are no other seeds to look at: what changes is the integration step, and the
rules that the chapter only mentions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from cps_paper.claims import Claims
from cps_paper.disbanding.experiments import DisbandingEvidence
from cps_paper.disbanding.scenario import Scenario
from cps_paper.recheck import Condition, varying
from cps_paper.verdicts import COMPARISON_RULE, RECOVERY_RULE

CLAIMS: Claims[DisbandingEvidence] = Claims("claims_ch2")
RULES = (
    "Rules. A number: reproduced within 5 % of the paper's, near within 10 %. A velocity error: reproduced within 2.0 "
    "points, near within 4.0. A statement about several cases: reproduced if it holds in all, near in all but one, "
    "partly in some. Otherwise not reproduced. " + COMPARISON_RULE + RECOVERY_RULE
)


def _changed(name: str, field: str, value: Callable[[Scenario], Any]) -> Condition:
    def vary(scenario: Scenario) -> Scenario:
        return replace(scenario, overrides=(*scenario.overrides, (field, value(scenario))))

    return Condition(name, (varying(Scenario, vary),))


CONDITIONS = (
    _changed("at half the step", "dt_s", lambda scenario: scenario.config.dynamics.dt_s / 2),  # of its interpretation
    _changed("with the standstill rule", "standstill_rule", lambda scenario: True),
    _changed("with transitional controllers", "transitional_controller", lambda scenario: True),
)
