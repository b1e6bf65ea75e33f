"""What chapter 2 says in words; each claim is checked by one function in `claims_*`, which `evaluation` calls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from baselines.disbanding.reproduction.evidence import Evidence
from baselines.paper.tables import read_table

SHOWN_UNITS = {"bool": "", "percent": "%", "platoon index": ""}
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
        return f"{self.paper} {SHOWN_UNITS.get(self.unit, self.unit)}".rstrip()


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


def joined(values: list[float] | list[int], form: str = ".0f") -> str:
    """Numbers separated by slashes."""
    return " / ".join(format(value, form) for value in values)
