from __future__ import annotations

import json
from dataclasses import replace
from importlib.resources import files
from typing import Any

import numpy as np
import pytest

from cps_baselines.fdi.replay import replay
from cps_baselines.fdi.sweep import paper_tasks
from cps_envs.fdi.config import CLIP, FIVE, PRESETS, A, B, C, FdiConfig
from cps_envs.fdi.optima import CONSTANTS, INFEASIBLE, PROVED, TIME_LIMIT, Record, from_text, known, to_text
from cps_envs.fdi.task import parse_task

PROVED_ANCHORS = {
    "x1>1": 3.4075,
    "x2>2": 3.8894,
    "x3>3": 4.7306,
    "x3>4": 3.4274,
    "x4>4": 6.5151,
    "v1>1": 3.4022,
    "v4>4": 5.8555,
}
SHIPPED = {"paper": A, "clip": CLIP, "B": B, "C": C, "five": FIVE}


def test_every_constant_is_a_field() -> None:
    assert set(CONSTANTS) <= set(vars(A))


@pytest.mark.parametrize("name", SHIPPED)
def test_the_file_holds_its_preset(name: str) -> None:
    text = (files("cps_envs.fdi") / "optima" / f"{name}.json").read_text(encoding="utf-8")
    values, records = from_text(text)
    assert values == {field: vars(SHIPPED[name])[field] for field in CONSTANTS}
    assert dict(known(SHIPPED[name])) == records
    header = json.loads(text)
    assert all(command.startswith("cps-envs oracle") for command in header["commands"])
    assert "highspy" in header["versions"]
    rows = text[text.index("[") :].splitlines()
    assert len(rows) >= len(records)


@pytest.mark.parametrize("config", SHIPPED.values(), ids=SHIPPED)
def test_shipped_records_are_consistent(config: FdiConfig) -> None:
    records = known(config)
    assert set(records) == set(paper_tasks(config.num_vehicles))
    for record in records.values():
        if record.lp_mps is None:
            assert (record.value_mps, record.bound_mps, record.status) == (None, 0.0, INFEASIBLE)
            continue
        assert 0 <= record.bound_mps <= record.lp_mps
        assert record.feasible == (record.injections is not None)
        assert (record.status == PROVED) <= record.feasible
        if record.injections is not None:
            assert record.value_mps is not None
            assert record.value_mps <= record.bound_mps
            assert record.injections.shape == (config.horizon, record.task.sensors.count)
            assert replay(config, record.task, record.injections) == pytest.approx(record.value_mps, abs=2e-7)


@pytest.mark.parametrize("config", SHIPPED.values(), ids=SHIPPED)
def test_shipped_values_do_not_fall_with_more_sensors(config: FdiConfig) -> None:
    records = known(config).values()
    for part in records:
        for whole in records:
            pairs = [(part.task.sensors.range, whole.task.sensors.range)]
            pairs.append((part.task.sensors.range_rate, whole.task.sensors.range_rate))
            if part.task.target == whole.task.target and all(set(a) <= set(b) for a, b in pairs):
                assert (part.value_mps or 0.0) <= whole.bound_mps + 2e-4
                assert (part.value_mps or 0.0) <= (whole.value_mps or 0.0) + 2e-4


@pytest.mark.parametrize("name", PROVED_ANCHORS)
def test_proved_anchors(name: str) -> None:
    record = known(A)[parse_task(name, 4)]
    assert record.status == PROVED
    assert record.value_mps == pytest.approx(PROVED_ANCHORS[name], abs=6e-5)
    assert record.bound_mps == pytest.approx(PROVED_ANCHORS[name], abs=2e-4)


def test_counts_of_the_specification() -> None:
    """88 of 120 tasks have a feasible relaxation, and at least the 82 found in 4 s each have a known attack."""
    records = known(A).values()
    assert sum(record.lp_mps is not None for record in records) == 88
    assert sum(record.feasible for record in records) >= 82
    assert sum(record.status == PROVED for record in records) >= 20


def test_constants_decide() -> None:
    assert known(PRESETS["easy"]) is known(A)
    assert known(replace(A, attacked="v1", target=1)) is known(A)
    assert not known(replace(A, horizon=19))
    assert not known(replace(A, derivative_gain=2.9))


def test_plans_are_read_only() -> None:
    injections = known(A)[parse_task("x4>4", 4)].injections
    assert injections is not None
    with pytest.raises(ValueError, match="read-only"):
        injections[0, 0] = 1


def test_text_and_back() -> None:
    first, second = parse_task("xv1,2>3", 4), parse_task("v2>1", 4)
    plan = np.arange(80).reshape(20, 4) - 40  # levels that the constants allow
    records = [Record(first, 3.0, 1.25, 2.5, TIME_LIMIT, 1.0, plan), Record(second, None, None, 0.0, INFEASIBLE, 0.0)]
    text = to_text({"commands": ["cps-envs oracle"]}, A, records)
    values, found = from_text(text)
    assert values["horizon"] == 20
    assert list(found.values()) == records[::-1]  # sorted: fewer sensors first
    np.testing.assert_array_equal(found[first].injections, plan)
    assert found[first].gap == pytest.approx(0.5)
    assert len([line for line in text.splitlines() if "attacked" in line]) == 2


def test_what_is_written_stays_true() -> None:
    task = parse_task("x4>4", 4)
    record = Record(task, 3.00000001, 1.00000009, 2.00000001, TIME_LIMIT, 0.0, np.zeros((20, 1), np.int64))
    found = from_text(to_text({}, A, [record]))[1][task]
    assert found.value_mps == 1.0
    assert (found.bound_mps, found.lp_mps) == (2.0000001, 3.0000001)


def test_what_is_written_again_stays_the_same() -> None:
    task = parse_task("x4>4", 4)
    record = Record(task, 5.0970377, 5.0484822, 5.084312, TIME_LIMIT, 0.0, np.zeros((20, 1), np.int64))
    assert 5.0484822 * 1e7 < 50484822  # why a plain rounding down would lose a digit each time
    assert from_text(to_text({}, A, [record]))[1][task] == record


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"constants": {"num_vehicles": 4}, "rows": [{}]}'])
def test_other_files(text: str) -> None:
    with pytest.raises(ValueError, match="cps-envs oracle"):
        from_text(text)


def changed(**changes: Any) -> str:
    """A file with one row, some of whose entries, or of whose constants, are others."""
    record = Record(parse_task("x4>4", 4), 5.1, 5.0, 5.05, TIME_LIMIT, 0.0, np.zeros((20, 1), np.int64))
    document = json.loads(to_text({}, A, [record]))
    for target in (document["rows"][0], document["constants"]):
        target |= {name: value for name, value in changes.items() if name in target}
    return json.dumps(document)


def test_an_unchanged_file_is_taken() -> None:
    assert len(from_text(changed())[1]) == 1


@pytest.mark.parametrize(
    "changes",
    [
        {"bound_mps": float("nan")},
        {"bound_mps": None},
        {"bound_mps": 4.0},  # below the value
        {"bound_mps": "5"},
        {"value_mps": -1.0},
        {"lp_mps": [1]},
        {"status": "certified"},
        {"wall_s": -1},
        {"target": 5},
        {"target": 1.5},
        {"attacked": "y4"},
        {"attacked": 4},
        {"attacked": "x9"},
        {"injections": [[1e30]]},
        {"injections": [[10**30]]},
        {"injections": [[101]]},  # 50 m in steps of 0.5 m are 100 levels
        {"injections": [[1], [1, 2]]},
        {"injections": [[1, 2]]},
        {"injections": [[1]] * 21},  # a horizon of 20 steps
        {"injections": [["a"]]},
        {"injections": []},
        {"num_vehicles": 10**9},
        {"num_vehicles": 4.0},
        {"horizon": "20"},
        {"range_resolution_m": 0},
    ],
    ids=str,
)
def test_numbers_that_cannot_be_are_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"mine\.json is no file of optima .*Name another file with --out"):
        from_text(changed(**changes), "mine.json")


def test_a_deep_file_is_refused() -> None:
    with pytest.raises(ValueError, match="nested too deeply"):
        from_text('{"rows": ' + "[" * 200_000)
