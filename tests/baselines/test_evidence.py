from __future__ import annotations

from dataclasses import dataclass

import pytest

from cps_baselines.reproduction.evidence import Evidence, NotRunError, compute


@dataclass(frozen=True)
class Root:
    """A square root; the time it takes is that of its number."""

    number: float

    @property
    def cost(self) -> float:
        return abs(self.number)

    @property
    def label(self) -> str:
        return f"root of {self.number:g}"

    def run(self) -> float:
        if self.number < 0:
            raise ValueError(f"{self.number:g} has no root")
        return self.number**0.5


@pytest.mark.parametrize("jobs", [1, 2])
def test_distinct_experiments_run_once_and_report(jobs: int) -> None:
    reports: list[tuple[float, str]] = []
    numbers = (1.0, 9.0, 4.0, 9.0, 2.0)
    results = compute([Root(number) for number in numbers], jobs, lambda *report: reports.append(report))
    assert results == {Root(number): number**0.5 for number in (1.0, 2.0, 4.0, 9.0)}
    assert sorted(label for _, label in reports) == ["root of 1", "root of 2", "root of 4", "root of 9"]
    shares = [share for share, _ in reports]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_the_long_ones_come_first() -> None:
    assert list(compute([Root(1.0), Root(9.0), Root(4.0)])) == [Root(9.0), Root(4.0), Root(1.0)]
    assert compute([]) == {}


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_reaches_the_caller(jobs: int) -> None:
    with pytest.raises(ValueError, match="-3 has no root"):
        compute([Root(-3.0), Root(1.0)], jobs)


def test_results_that_were_left_out_are_named() -> None:
    evidence = Evidence({Root(4.0): 2.0})
    assert evidence[Root(4.0)] == 2.0
    with pytest.raises(NotRunError, match="root of 5"):
        evidence[Root(5.0)]
