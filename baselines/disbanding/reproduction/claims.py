"""What chapter 2 says in words, each claim checked by one function; the functions are in the modules `claims_*`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from baselines.disbanding.reproduction.evidence import Evidence, NotRunError
from baselines.disbanding.reproduction.verdicts import UNKNOWN
from baselines.paper.tables import read_table

MODULES = ("claims_2_1", "claims_2_3", "claims_2_4")
Value = float | bool | None


@dataclass(frozen=True)
class Claim:
    """A claim as the paper makes it."""

    id: str  # "P01"
    figure: str  # figure or section, "2.1b"
    text: str
    paper: str  # a number or "yes"
    unit: str

    @property
    def number(self) -> float:
        """The paper's value where it is a number."""
        return float(self.paper)

    @property
    def paper_shown(self) -> str:
        """The paper's value with its unit."""
        return self.paper if self.unit == "bool" else f"{self.paper} {self.unit}"


@dataclass(frozen=True)
class Finding:
    """What our code finds about a claim."""

    value: Value  # the number or answer beside the paper's; None where there is none
    shown: str  # the same with its unit and what else is worth knowing, for readers
    verdict: str  # one of verdicts.VERDICTS


Judge = Callable[[Evidence, Claim], Finding]
JUDGES: dict[str, Judge] = {}


def judges(*ids: str) -> Callable[[Judge], Judge]:
    """Register the function that checks these claims."""

    def register(judge: Judge) -> Judge:
        for name in ids:
            if name in JUDGES:
                raise ValueError(f"claim {name} is checked twice")
            JUDGES[name] = judge
        return judge

    return register


def paper_claims() -> list[Claim]:
    """All claims of the chapter."""
    return [
        Claim(row["id"], row["figure"], row["claim"], row["paper_value"], row["unit"])
        for row in read_table("claims_ch2")
    ]


def evaluate(evidence: Evidence, only: tuple[str, ...] = ()) -> list[tuple[Claim, Finding]]:
    """Every claim, or those named, with what we find; what was not simulated in this run stays open."""
    for module in MODULES:
        import_module(f"baselines.disbanding.reproduction.{module}")
    return [(claim, _judged(evidence, claim)) for claim in paper_claims() if not only or claim.id in only]


def _judged(evidence: Evidence, claim: Claim) -> Finding:
    try:
        return JUDGES[claim.id](evidence, claim)
    except NotRunError as missing:
        return Finding(None, f"needs a simulation left out of this run: {missing}", UNKNOWN)


def joined(values: list[float] | list[int], form: str = ".0f") -> str:
    """Numbers separated by slashes."""
    return " / ".join(format(value, form) for value in values)
