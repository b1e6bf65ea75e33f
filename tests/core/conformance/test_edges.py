"""The edges of configurations that `check_configurations` tries."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from cps_envs.core.conformance import check_configurations
from cps_envs.core.conformance.configurations import edges
from cps_envs.core.declare.config import Range, quantity, validate
from cps_envs.core.errors import ConfigurationError
from tests.core.mutants import MUTANTS, of


@dataclass(frozen=True)
class Tank:
    """A tank whose overflow has to be below its rim, and whose valves are few."""

    rim_m: float = quantity(2.0, unit="m", low=1, high=4, source="chosen")
    overflow_m: float = quantity(1.0, unit="m", low=0.5, high=9, source="chosen")
    valves: int = quantity(3, low=1, high=100, source="chosen")
    leak: Range = quantity(0.0, low=0, high=1, source="chosen", ranged=True)
    sizes: tuple[int, ...] = quantity((2, 3), low=1, high=9, source="chosen")
    kind: str = quantity("round", choices=("round", "square"), source="chosen")
    parts: tuple[str, ...] = quantity((), choices=("lid", "pump"), source="chosen")
    open: bool = quantity(False, source="chosen")
    name: str = quantity("", source="chosen")
    free: float = quantity(0.0, source="chosen: no bounds")

    def __post_init__(self) -> None:
        validate(self)
        if self.overflow_m > self.rim_m:
            raise ConfigurationError("overflow_m is above rim_m")
        if self.valves > 60:
            raise ConfigurationError("valves are too many")


@dataclass(frozen=True)
class Careless:
    """Divides before it looks."""

    share: float = quantity(0.5, low=0, high=1, source="chosen")

    def __post_init__(self) -> None:
        validate(self)
        _ = 1 / self.share


def tried(name: str) -> list[object]:
    return [change[name] for change in edges(Tank()) if name in change]


def test_every_field_goes_to_its_ends_and_choices() -> None:
    assert tried("leak") == [1.0, (0.0, 1.0)]  # 0 is its own value
    assert tried("sizes") == [(1, 1), (9, 9), ()]
    assert tried("kind") == ["square"]
    assert tried("parts") == [("lid",), ("pump",), ("lid", "pump")]
    assert tried("open") == [True]
    assert tried("name") == tried("free") == []


def test_where_an_end_is_refused_the_last_accepted_value_is_tried_too() -> None:
    low, high, limit = tried("overflow_m")
    assert (low, high) == (0.5, 9.0)
    assert limit == pytest.approx(2.0, abs=1e-9)
    assert limit <= 2.0
    assert tried("rim_m") == [1.0, 4.0]  # both accepted: the rim may be as low as the overflow
    assert tried("valves") == [1, 100, 60]


def test_a_field_that_may_not_move_at_all_has_no_limit() -> None:
    assert [change for change in edges(Tank(overflow_m=2.0)) if "rim_m" in change] == [{"rim_m": 1.0}, {"rim_m": 4.0}]


def test_another_error_than_a_refusal_is_a_fault() -> None:
    with pytest.raises(AssertionError, match=r"\{'share': 0.0\} is refused by ZeroDivisionError"):
        list(edges(Careless()))


@pytest.mark.parametrize(
    ("number", "message"),
    [
        (0, r"\{'catch_fee': 0.0\} is accepted, but after reset .* gets \{'caught': nan\}"),
        (1, r"\{'mood': 'brisk'\} is accepted, but after reset the observation of .* is not finite"),
        (2, r"\{'guard_speed': 0.0, 'drift': 0.0\} is accepted, but cannot be played: ZeroDivisionError"),
    ],
)
def test_a_failure_names_the_fields_and_what_went_wrong(number: int, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_configurations(MUTANTS["check_configurations"][number](), pairs=1000)


def test_some_faults_need_two_fields_at_once() -> None:
    mutant = MUTANTS["check_configurations"][2]
    check_configurations(mutant(), pairs=0)
    with pytest.raises(AssertionError, match="ZeroDivisionError"):
        check_configurations(mutant())


def test_a_sound_problem_passes_with_every_pair() -> None:
    check_configurations(of(), pairs=10_000, steps=3)
