"""What is known to be possible: the shipped optima, their files, and certificates of single episodes."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import replace
from functools import cache
from importlib.resources import files
from typing import Any

import gymnasium
import numpy as np
import pytest
import typer

from cps_agents.commands.certify import certify as certify_command
from cps_agents.commands.certify import tasks_named
from cps_agents.console import assignments
from cps_agents.workers import Workers
from cps_baselines.fdi.cross import cross
from cps_baselines.fdi.replay import replay
from cps_baselines.fdi.sweep import Certificate, certify, certify_all, instance_of, own_config, paper_tasks
from cps_envs.core.errors import ConfigurationError
from cps_envs.fdi.config import PRESETS, A, FdiConfig
from cps_envs.fdi.optima import CONSTANTS, INFEASIBLE, PROVED, TIME_LIMIT, Record, from_text, known, to_text
from cps_envs.fdi.problem import FDI
from cps_envs.fdi.task import parse_task
from cps_paper.fdi.interpretations import CLIP, B, C
from tests.fdi.episodes import play
from tests.fdi.reference import ANCHORS

SHIPPED = {"paper": A, "clip": CLIP, "B": B, "C": C, "five": replace(PRESETS["easy"], num_vehicles=5)}
SHORT = {"horizon": 22, "tasks": "v4>4 x4>4"}
CONFIG = FDI.config("drawn", SHORT)


def test_every_constant_is_a_field() -> None:
    assert set(CONSTANTS) <= set(vars(A))


def parsed(options: list[str]) -> dict[str, Any]:
    """The options of `cps-envs certify`, as its command line reads them."""
    app = typer.Typer()
    app.command()(certify_command)
    return typer.main.get_command(app).make_context("certify", options).params


def test_everything_open_has_a_gap_or_a_bound() -> None:
    for config in SHIPPED.values():
        for record in known(config).values():
            assert record.closed or record.gap is not None or 0 < record.bound_mps < np.inf


@pytest.mark.parametrize("name", SHIPPED)
def test_the_file_holds_its_preset(name: str) -> None:
    text = (files("cps_envs.fdi") / "optima" / f"{name}.json").read_text(encoding="utf-8")
    values, records = from_text(text)
    assert values == {field: vars(SHIPPED[name])[field] for field in CONSTANTS}
    assert dict(known(SHIPPED[name])) == records
    header = json.loads(text)
    assert re.search(r"commit [0-9a-f]{12}\)$", header["before"])
    for command in header["commands"]:  # each runs: it parses, and its configuration is that of the file
        program, command_name, *options = shlex.split(command)
        assert (program, command_name) == ("cps-envs", "certify")
        chosen = parsed(options)
        config = FDI.config(chosen["preset"], assignments(chosen["settings"]))
        assert {field: vars(config)[field] for field in CONSTANTS} == values
        tasks_named(chosen["task"], config.num_vehicles)
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


@pytest.mark.parametrize("name", ANCHORS)
def test_proved_anchors(name: str) -> None:
    record = known(A)[parse_task(name, 4)]
    assert record.status == PROVED
    assert record.value_mps == pytest.approx(ANCHORS[name].optimum, abs=6e-5)
    assert record.bound_mps == pytest.approx(ANCHORS[name].optimum, abs=2e-4)


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
    text = to_text({"commands": ["cps-envs certify"]}, A, records)
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
    with pytest.raises(ValueError, match="cps-envs certify"):
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


def test_an_instance_is_what_its_seed_draws() -> None:
    env = gymnasium.make("cps_envs:cps_envs/FdiAttack-v0", preset="drawn", opponent="none", **SHORT).unwrapped
    for seed in range(5):
        observation, _ = env.reset(seed=seed)
        shown, found = env.game.fields["attacker"].decode(observation), instance_of(CONFIG, seed)
        np.testing.assert_allclose(
            np.concatenate([shown["gap_error"], shown["relative_speed"]]), found.start, atol=1e-5
        )
        np.testing.assert_allclose(shown["gain"] * [1, 3], found.gains, atol=1e-5)
        assert env.game.task(0) == str(found.task)
        assert 0.8 <= found.gains[0] <= 1.2
    assert instance_of(CONFIG, 0) != instance_of(CONFIG, 1)


@cache
def certificate_of(seed: int) -> Certificate:
    return certify(CONFIG, instance_of(CONFIG, seed), time_limit_s=1.0)


@pytest.mark.parametrize("seed", [3, 4])
def test_the_game_pays_the_value_of_a_certificate(seed: int) -> None:
    certificate = certificate_of(seed)
    record = certificate.record
    assert record.injections is not None
    assert 0 < record.value_mps <= record.bound_mps <= record.lp_mps + 1e-9
    env = gymnasium.make("cps_envs:cps_envs/FdiAttack-v0", preset="drawn", opponent="none", **SHORT).unwrapped
    env.reset(seed=seed)
    slots = np.flatnonzero(certificate.instance.task.sensors.flags(4))
    paid, terminated = 0.0, False
    for level in record.injections:
        assert not terminated
        action = env.game.neutral_action["attacker"].copy()
        action[slots] += level
        _, reward, terminated, _, info = env.step(action)
        paid += reward
    assert terminated
    assert info["illegal"] == 0
    assert paid == pytest.approx(record.value_mps, abs=1e-6)


def test_nobody_exceeds_a_bound() -> None:
    seeds = (3, 4)
    bounds = [certificate_of(seed).record.bound_mps for seed in seeds]
    for attacker in ("random", "bang_bang", "bang_bang?stickiness=0.95", "swing?swing_s=0.5"):
        assert (play(attacker, seeds=seeds, preset="drawn", **SHORT)["return"] <= np.array(bounds) + 1e-5).all()


def test_from_rest_the_optimum_is_that_of_the_oracle() -> None:
    still = FDI.config("drawn", {"horizon": 19, "tasks": "v4>4", "gap_spread_m": 0.0, "speed_spread_mps": 0.0})
    instance = instance_of(still, 0)
    own = own_config(still, instance)
    found, expected = certify(still, instance, time_limit_s=20.0).record, cross(own, instance.task, 20.0)
    assert found.status == expected.status == "proved"
    assert found.bound_mps == pytest.approx(expected.bound_mps, abs=1e-3)


def test_several_are_certified_at_a_time() -> None:
    with Workers(2) as pool:
        found = {one.instance.seed: one for one in certify_all(CONFIG, [3, 4], time_limit_s=0.3, run=pool.run)}
    assert set(found) == {3, 4}
    assert found[3].instance == instance_of(CONFIG, 3)


def test_what_cannot_be_certified_is_refused() -> None:
    with pytest.raises(ConfigurationError, match='preset "drawn"'):
        instance_of(FDI.config("learning", {}), 0)
