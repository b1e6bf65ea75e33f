from __future__ import annotations

import copy
import json
import pickle
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pytest

from cps_agents.console import to_json
from cps_envs.core.declare.config import (
    OverTime,
    check_bodies,
    configure,
    over_time,
    quantity,
    series_fields,
    series_in,
    validate,
)
from cps_envs.core.declare.series import Series
from cps_envs.core.errors import ConfigurationError, UnknownOptionError


@dataclass(frozen=True)
class Shed:
    outdoor_c: OverTime = quantity(5.0, unit="C", low=-40, high=60, source="chosen", series="linear")
    heat_w: OverTime = quantity(0.0, unit="W", low=0, high=100, source="chosen", bodies="room", series="hold")
    rooms: int = quantity(2, low=1, high=9, source="chosen")

    def __post_init__(self) -> None:
        validate(self)
        check_bodies(self, {"room": self.rooms})


def test_a_series_is_what_it_holds() -> None:
    hours = Series([1.0, 2.0, 4.0], 3600)
    same = Series(np.array([[1.0], [2.0], [4.0]]), np.float64(3600.0), source="shed.csv")
    assert hours == same
    assert hash(hours) == hash(same)
    assert repr(hours) == repr(same) == f"Series(3 x 1, step_s=3600, sha256={hours.digest})"
    for other in (
        Series([1, 2, 5], 3600),
        Series([1, 2, 4], 60),
        Series([1, 2, 4], 3600, 60),
        Series([1, 2, 4], 3600, 0, True),
    ):
        assert other != hours
    assert hours != "a word"
    assert replace(Shed(), outdoor_c=hours) == replace(Shed(), outdoor_c=same)


def test_a_series_cannot_be_changed_and_travels_whole() -> None:
    given = np.array([1.0, 2.0])
    series = Series(given, 60, 120, True, source="x.csv", lines=np.array([2, 3]))
    given[0] = 9.0
    assert series.values[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        series.values[0, 0] = 3.0
    with pytest.raises(AttributeError, match="'step_s'"):
        series.step_s = 1.0  # type: ignore[misc]
    with pytest.raises(AttributeError, match="'step_s'"):
        del series.step_s
    again = pickle.loads(pickle.dumps(series))
    assert again == series == copy.deepcopy(series) == copy.copy(series)
    assert (again.source, again.begin_s, again.repeats, again.place(1)) == ("x.csv", 120.0, True, "line 3 of x.csv")


def test_documents_show_what_it_is_and_its_digest() -> None:
    series = Series([1, 2], 60)
    plain = json.loads(to_json(asdict(Shed(outdoor_c=series))))
    expected = {"series": [2, 1], "step_s": 60.0, "begin_s": 0.0, "repeats": False, "sha256": series.digest}
    assert plain == {"outdoor_c": expected, "heat_w": 0.0, "rooms": 2}
    assert series.digest in repr(Shed(outdoor_c=series))


def test_resampling_goes_straight_or_holds() -> None:
    series = Series([0.0, 10.0, 30.0], 10.0, 100.0)
    times = np.array([90.0, 100.0, 105.0, 109.999999, 110.0, 119.0, 120.0, 500.0])
    assert series.at(times, "linear")[:, 0] == pytest.approx([0, 0, 5, 10, 10, 28, 30, 30], abs=1e-5)
    assert series.at(times, "hold")[:, 0].tolist() == [0, 0, 0, 10, 10, 10, 30, 30]


def test_a_repeating_series_has_no_end() -> None:
    day = Series([0.0, 10.0], 10.0, 5.0, repeats=True)
    times = np.array([-15.0, 0.0, 5.0, 10.0, 20.0, 25.0])
    assert day.at(times, "linear")[:, 0].tolist() == [0, 5, 0, 5, 5, 0]
    assert day.at(times, "hold")[:, 0].tolist() == [0, 10, 0, 0, 10, 0]
    assert day.end_s == float("inf")
    assert Series([1, 2, 3], 10, 5).end_s == 25.0


def test_fields_take_numbers_one_for_each_body_or_a_series() -> None:
    times = np.array([0.0, 5.0])
    assert over_time(Shed(), "outdoor_c", times, 1).tolist() == [[5], [5]]
    assert over_time(configure(Shed(), {"heat_w": [1, 2]}), "heat_w", times, 2).tolist() == [[1, 2], [1, 2]]
    two = Series([[0, 1], [10, 2]], 10)
    assert over_time(Shed(heat_w=two), "heat_w", times, 2).tolist() == [[0, 1], [0, 1]]
    assert over_time(Shed(outdoor_c=Series([0, 10], 10)), "outdoor_c", times, 2).tolist() == [[0, 0], [5, 5]]
    assert series_fields(Shed) == {"outdoor_c": "C", "heat_w": "W"}
    assert series_in(Shed(heat_w=two)) == {"heat_w": two}


def test_json_and_toml_write_a_series_as_an_object() -> None:
    written = {"values": [17, 21], "step_s": 3600, "repeats": True}
    assert configure(Shed(), {"outdoor_c": written}).outdoor_c == Series([17, 21], 3600, repeats=True)
    assert configure(Shed(), {"heat_w": np.array([1.0, 2.0])}).heat_w == (1.0, 2.0)


@pytest.mark.parametrize(
    ("values", "step_s", "more", "said"),
    [
        ([1.0], 60, {}, "at least 2 rows"),
        ([], 60, {}, "at least 2 rows"),
        (np.zeros((2, 2, 2)), 60, {}, r"\(2, 2, 2\)"),
        (["a", "b"], 60, {}, "must be numbers"),
        ([[1, 2], [3]], 60, {}, "must be numbers"),
        ([1.0, float("nan")], 60, {}, "sample 1, column 0 is nan"),
        ([1.0, 2.0], 0, {}, "above 0 s"),
        ([1.0, 2.0], "60", {}, "step_s = '60'"),
        ([1.0, 2.0], 60, {"begin_s": float("inf")}, "begin_s = inf"),
        ([1.0, 2.0], 60, {"repeats": 1}, "repeats = 1"),
    ],
)
def test_impossible_series_are_refused(values: Any, step_s: Any, more: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        Series(values, step_s, **more)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"outdoor_c": Series([1, 99], 60, source="a.csv", lines=[4, 7])}, r"_c, line 7 of a.csv: 99 is outside"),
        ({"heat_w": Series([[1, 2], [3, -4]], 60)}, r"heat_w_2, sample 1: -4 is outside \[0, 100\] W"),
        ({"heat_w": Series(np.ones((2, 3)), 60)}, "heat_w has 3 values for 2 rooms"),
        ({"heat_w": (1, 2, 3)}, "heat_w has 3 values for 2 rooms"),
        ({"heat_w": (1, "a")}, "one for each room or a series"),
        ({"heat_w": ()}, "must be a number or a tuple with one for each room"),
        ({"outdoor_c": (1, 2)}, "must be a number or a series"),
        ({"rooms": Series([1, 2], 60)}, "must be a whole number"),
        ({"outdoor_c": {"values": [1, 2]}}, "lacks values or step_s"),
        ({"outdoor_c": {"values": [1, 2], "step_s": 1, "unit": "F"}}, "has the entry 'unit'"),
        ({"outdoor_c": {"values": [1], "step_s": 1}}, "outdoor_c: values of a series"),
        ({"rooms": {"values": [1, 2], "step_s": 1}}, "must be a whole number"),
    ],
)  # fmt: skip
def test_fields_refuse_what_they_cannot_be(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        configure(Shed(), change)


def test_traces_are_known_where_something_takes_a_series() -> None:
    with pytest.raises(UnknownOptionError, match="'traces'"):
        configure(Shed(), {"trace": "x.csv"})
    with pytest.raises(ConfigurationError, match="must be the path"):
        configure(Shed(), {"traces": 3})
