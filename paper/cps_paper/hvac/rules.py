"""The claims of the chapter, which functions beside its exhibits check; rules of verdicts beside the common ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

from cps_paper.claims import Claim, Claims
from cps_paper.hvac.controllers import HvacEvidence
from cps_paper.hvac.scenario import DayOutcome
from cps_paper.verdicts import COMPARISON_RULE, REPRODUCED, above, of_number

CLAIMS: Claims[HvacEvidence] = Claims("claims_ch4")
CLOSE = 1.2  # "close to or below" a number: up to this many times it
EQUAL = 1.25  # an impact "equals" the attack-free one up to this many times it
PARTICULAR = 2.0  # zones fail "particularly" where their errors are above so many times the others'
SMALL = 99.95  # impacts below it are shown with a decimal
MOSTLY = 0.5  # share of the steps in which a cause has to show
ALWAYS = 0.95  # share of the steps in which something happens "only" so
RULES = (
    "Rules. A number: reproduced within 5 % of the paper's or if equal in the digits that the paper prints, near "
    "within 10 %. An estimation error: the median over our days, as a number. A statement about several cases: "
    "reproduced if it holds in all, near in all but one of three or more, partly in some. Otherwise not reproduced. "
    f"{COMPARISON_RULE}"
    "An error around 1 °C: its largest value of the day rounds to 1 °C, so it lies between 0.5 and 1.5 °C, in every "
    f"zone. An impact equals the attack-free one up to {EQUAL:g} times it. A defence fails "
    "where its mean A_impact exceeds that of an attack-free day without any defence. The share of attacked "
    "sensors at which MTD1 fails is partly reproduced where another line than this one gives the paper's shares of two "
    "attacks at once. Close to or below a number: up to 1.2 times it; well: with errors close to or below 0.5 °C. A "
    "reliable estimate: never off by more than the standard deviation of a reading. Particularly: more than twice. "
    "Only: in 95 % of the steps. Selected: in 1 % of the steps. Because MTD1 ignores how big J is: in more than half "
    "of the steps with an attacked set, its J is above that of every intact set."
)


def of_printed(ours: float, claim: Claim) -> str:
    """A number, by its share of the paper's or by the digits that the paper prints."""
    digits = len(claim.paper.partition(".")[2])
    return REPRODUCED if round(ours, digits) == claim.number else of_number(ours, claim.number)


def rising(values: Sequence[float]) -> list[bool]:
    """Whether each value is clearly above the one before."""
    return [above(later, earlier) for earlier, later in pairwise(values)]


def falling(values: Sequence[float]) -> list[bool]:
    """Whether each value is clearly below the one before."""
    return [above(earlier, later) for earlier, later in pairwise(values)]


def shown_impacts(values: Iterable[float]) -> str:
    """Impacts in C2 separated by slashes, with decimals where they are small."""
    return " / ".join(f"{value:.1f}" if value < SMALL else f"{value:.0f}" for value in values)


def equals(attacked: DayOutcome, free: DayOutcome) -> bool:
    """Whether an attack leaves the impact at that of attack-free days."""
    return bool(attacked.a_impact.mean() <= EQUAL * free.a_impact.mean())
