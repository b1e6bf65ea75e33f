from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_envs.core.declare.config import IntRange, Range, bounds, configure, parameter_table, quantity, validate
from cps_envs.core.errors import ConfigurationError


@dataclass(frozen=True)
class Tank:
    volume_l: float = quantity(10.0, unit="l", low=1, high=100, source="Table 1")
    valves: IntRange = quantity(2, low=1, high=9, source="chosen", ranged=True)
    inflow: Range = quantity((0.1, 0.2), unit="l/s", low=0, source="chosen", ranged=True)
    leaks: bool = quantity(False, source="chosen")
    shape: str = quantity("round", choices=("round", "square"), source="chosen")
    ports: tuple[int, ...] = quantity((0, 2), low=0, high=5, source="chosen")
    levels_m: tuple[float, ...] = quantity((0.5, 1.0), unit="m", low=0, high=3, source="chosen")
    alarms: tuple[str, ...] = quantity(("low",), choices=("low", "high"), source="chosen")

    def __post_init__(self) -> None:
        validate(self)


def test_overrides_replace_fields() -> None:
    tank = configure(Tank(), {"volume_l": 5, "valves": (1, 3), "leaks": True, "shape": "square"})
    assert (tank.volume_l, tank.valves, tank.leaks, tank.shape) == (5, (1, 3), True, "square")


def test_json_and_numpy_values_become_plain_ones() -> None:
    tank = configure(Tank(), {"valves": [np.int64(1), 3], "volume_l": np.float32(2.5), "leaks": np.bool_(True)})
    assert tank == Tank(volume_l=2.5, valves=(1, 3), leaks=True)
    assert {type(tank.volume_l), type(tank.valves), type(tank.leaks)} == {float, tuple, bool}


def test_tuples_of_any_length_are_taken() -> None:
    overrides = {"ports": [np.int64(5), 0, 0], "levels_m": [1, np.float64(2.5)], "alarms": ["high", "low"]}
    tank = configure(Tank(), overrides)
    assert (tank.ports, tank.levels_m, tank.alarms) == ((5, 0, 0), (1, 2.5), ("high", "low"))
    assert configure(tank, {"ports": [], "levels_m": (), "alarms": []}) == Tank(ports=(), levels_m=(), alarms=())


class Listed(Sequence[Any]):
    """As OmegaConf's ListConfig: a sequence that is no list."""

    def __init__(self, *values: Any) -> None:
        self.values = values

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, place: Any) -> Any:
        return self.values[place]


class Series:
    """As that of pandas or polars: no sequence, with a method that makes a list."""

    def __init__(self, method: str, *values: Any) -> None:
        setattr(self, method, lambda: list(values))


@pytest.mark.parametrize(
    "levels",
    [
        np.array([1.0, 2.5]),
        np.array([1.0, 2.5], np.float32),
        array("d", [1.0, 2.5]),
        deque([1.0, 2.5]),
        Listed(np.float64(1.0), 2.5),
        Series("tolist", 1.0, 2.5),
        Series("to_list", 1.0, np.float64(2.5)),
    ],
    ids=lambda levels: type(levels).__name__,
)
def test_lists_of_every_library_become_tuples(levels: Any) -> None:
    for tank in (configure(Tank(), {"levels_m": levels}), Tank(levels_m=levels), replace(Tank(), levels_m=levels)):
        assert tank == Tank(levels_m=(1.0, 2.5))
        assert [type(level) for level in tank.levels_m] == [float, float]
        assert hash(tank) == hash(Tank(levels_m=(1.0, 2.5)))
    assert Tank(inflow=np.array([0.1, 0.2]), valves=np.array(3)) == Tank(inflow=(0.1, 0.2), valves=3)  # type: ignore[arg-type]


def test_unknown_field_names_the_near_one() -> None:
    with pytest.raises(
        ConfigurationError,
        match=r"Tank has no field 'volume' \(unexpected keyword argument 'volume'\). Did you mean 'volume_l' or",
    ):
        configure(Tank(), {"volume": 3})


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("volume_l", 0.5, r"outside \[1, 100\] l; the default is 10.0"),
        ("volume_l", "3", "must be a number in l"),
        ("volume_l", True, "must be a number"),
        ("volume_l", float("nan"), "must be a number"),
        ("volume_l", float("inf"), "must be a number"),
        ("volume_l", 10**400, "outside"),
        ("volume_l", (1, 2), "must be a number"),
        ("volume_l", None, "must be a number"),
        ("valves", 2.0, "must be a whole number or a pair"),
        ("valves", (1, 2, 3), "must be a whole number or a pair"),
        ("valves", (3, 1), "the lower end comes first"),
        ("valves", (0, 3), "outside"),
        ("leaks", 1, "must be True or False"),
        ("shape", "rond", "Did you mean 'round'"),
        ("shape", ["round"], "is not one of round, square"),
        ("ports", 3, r"ports = 3 must be a tuple of whole numbers\.$"),
        ("ports", [1, 2.0], r"ports = \(1, 2.0\) must be a tuple of whole numbers"),
        ("ports", [True], "must be a tuple of whole numbers"),
        ("ports", [[1]], "must be a tuple of whole numbers"),
        ("ports", [1, 6], r"ports = \(1, 6\) is outside \[0, 5\]; the default is \(0, 2\)"),
        ("levels_m", "12", "must be a tuple of numbers in m"),
        ("levels_m", [1.0, None], "must be a tuple of numbers in m"),
        ("levels_m", [float("nan")], "must be a tuple of numbers in m"),
        ("levels_m", [3.5, 1.0], r"outside \[0, 3\] m"),
        ("alarms", "low", "alarms = 'low' must be a tuple of words from low, high"),
        ("alarms", ["low", "hihg"], r"alarms = \('low', 'hihg'\): 'hihg' is not one of low, high. Did you mean 'high'"),
        ("alarms", [1], "1 is not one of low, high"),
        (
            "volume_l",
            "5e0",
            r"'5e0' is text here, not a number: write 5 without .* as in 5.0e\+5, which YAML needs",
        ),
        ("volume_l", "2.5", "must be a number in l. '2.5' is text here, not a number: write 2.5 without quotes"),
        ("levels_m", [1.0, "1e-3"], "'1e-3' is text here, not a number: write 0.001 without quotes"),
        ("volume_l", "many", r"must be a number in l\.$"),
        ("valves", 2.0, r"of whole numbers\. Write 2 without a point"),
        ("leaks", "true", "'true' is text here: write it without quotes"),
        ("shape", False, "Known: round, square. YAML reads yes, no, on and off as False: put the word into quotes"),
    ],
)
def test_impossible_values_are_refused(name: str, value: Any, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        configure(Tank(), {name: value})


anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.tuples(inner, inner),
    max_leaves=4,
)


@given(st.sampled_from([field.name for field in fields(Tank)]), anything)
def test_any_value_is_taken_whole_or_refused_by_name(name: str, value: Any) -> None:
    try:
        tank, message = configure(Tank(), {name: value}), ""
    except ConfigurationError as error:
        tank, message = Tank(), str(error)
    assert name in message or not message
    assert replace(tank) == tank


def test_bounds_of_exact_and_ranged_values() -> None:
    assert bounds(2.0) == (2.0, 2.0)
    assert bounds((1, 3)) == (1, 3)


def test_table_has_a_row_per_field() -> None:
    lines = parameter_table(Tank()).splitlines()
    assert len(lines) == 2 + len(fields(Tank))
    assert lines[2] == "| `volume_l` | 10.0 | l | 1 to 100 | Table 1 |"
    assert lines[4] == "| `inflow` | (0.1, 0.2) | l/s | 0 to inf | chosen |"
    assert lines[6] == "| `shape` | round | - | round, square | chosen |"
    assert lines[7] == "| `ports` | 0, 2 | - | each 0 to 5 | chosen |"
    assert lines[9] == "| `alarms` | low | - | any of low, high | chosen |"
    assert "| `alarms` | none |" in parameter_table(Tank(alarms=()))
