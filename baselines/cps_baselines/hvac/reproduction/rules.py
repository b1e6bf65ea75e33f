"""The claims of the chapter, which functions beside its exhibits check; rules of verdicts beside the common ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.scenario import Outcome
from cps_baselines.reproduction.claims import Claim, Claims
from cps_baselines.reproduction.verdicts import NEAR, NEAR_SHARE, NOT, REPRODUCED, of_number
from cps_envs.core.types import FloatArray

CLAIMS: Claims[Evidence] = Claims("claims_ch4")
CLOSE = 1.2  # "close to or below" a number: up to this many times it
EQUAL = 2.0  # an impact "equals" the attack-free one up to this many times it
SMALL = 99.95  # impacts below it are shown with a decimal
ALWAYS = 0.95  # share of the steps in which something happens "only" so
RULES = (
    "Rules. A number: reproduced within 5 % of the paper's or if equal in the digits that the paper prints, near "
    "within 10 %. An estimation error: reproduced if the paper's value lies in the range over our days, near within "
    "10 % of that range. A statement about several cases: reproduced if it holds in all, near in all but one of three "
    "or more, partly in some. Otherwise not reproduced. An impact equals the attack-free one up to twice it. A defence "
    "fails where its mean A_impact exceeds that of an attack-free day without any defence. The share of attacked "
    "sensors at which MTD1 fails is partly reproduced where another line than this one gives the paper's shares of two "
    "attacks at once. Close to or below a number: up to 1.2 times it; well: with errors close to or below 0.5 °C. A "
    "reliable estimate: never off by more than the standard deviation of a reading. Only: in 95 % "
    "of the steps. Selected: in 1 % of the steps."
)


def of_printed(ours: float, claim: Claim) -> str:
    """A number, by its share of the paper's or by the digits that the paper prints."""
    digits = len(claim.paper.partition(".")[2])
    return REPRODUCED if round(ours, digits) == claim.number else of_number(ours, claim.number)


def of_range(days: FloatArray, paper: float) -> str:
    """A value that differs from day to day (B,), against the single one of the paper."""
    lowest, highest = float(days.min()), float(days.max())
    if lowest <= paper <= highest:
        return REPRODUCED
    return NEAR if (1.0 - NEAR_SHARE) * lowest <= paper <= (1.0 + NEAR_SHARE) * highest else NOT


def rising(values: Sequence[float]) -> list[bool]:
    """Whether each value is above the one before."""
    return [later > earlier for earlier, later in pairwise(values)]


def falling(values: Sequence[float]) -> list[bool]:
    """Whether each value is below the one before."""
    return [later < earlier for earlier, later in pairwise(values)]


def shown_impacts(values: Iterable[float]) -> str:
    """Impacts in C2 separated by slashes, with decimals where they are small."""
    return " / ".join(f"{value:.1f}" if value < SMALL else f"{value:.0f}" for value in values)


def equals(attacked: Outcome, free: Outcome) -> bool:
    """Whether an attack leaves the impact at that of attack-free days."""
    return bool(attacked.a_impact.mean() <= EQUAL * free.a_impact.mean())
