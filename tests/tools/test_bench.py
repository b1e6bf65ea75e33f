from __future__ import annotations

import json
import time
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs import PROBLEMS, find_problem
from cps_envs.core.policies.lookup import policy_names
from cps_envs.core.types import ROLES
from tests.agents import command_line
from tests.core.toy import TOY, ToyGame
from tools.bench import __main__ as command
from tools.bench import interfaces, measuring, opponents, sizes
from tools.bench.__main__ import bench
from tools.bench.interfaces import ADDED, added_items, items, measure_yardsticks, short
from tools.bench.measuring import Findings, measure
from tools.bench.row import Measurement, Row, Values, Yardsticks, calls_per_s, microseconds
from tools.bench.sizes import SIZES, Size, episode_kb
from tools.bench.suite import MACHINE, judge, plan
from tools.command import program

PROBLEM = find_problem("rogue")
YARDSTICKS = Yardsticks(cartpole_us=10.0, updates_per_s=1e9, divisions_per_s=1e9)


def quiet(done: int, total: int, note: str) -> None:
    pass


def names(part: str) -> set[str]:
    return {item.name for item in plan([PROBLEM], [part])}


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interfaces, "NUM_ENVS", (1, 2))
    known = (Size("rogue", "5 vehicles", reached=1e-9, operations=1.0), Size("rogue", "hit", attack="square"))
    monkeypatch.setattr(sizes, "SIZES", known)
    monkeypatch.setattr(opponents, "policy_names", lambda problem, role: ["none", "square", "pd"])
    monkeypatch.setattr(opponents, "shipped_names", lambda: [])


def test_calls_are_counted_by_cpu_time(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []
    assert 100 < calls_per_s(lambda: calls.append(sum(range(20_000))), 0.03) < 1e6
    assert len(calls) > 3
    spent = [0.0]  # CPU seconds

    def spend(seconds: float) -> None:
        spent[0] += seconds

    monkeypatch.setattr(time, "process_time", lambda: spent[0])
    assert calls_per_s(lambda: spend(250e-6), 0.03) == pytest.approx(4000)
    monkeypatch.setattr(time, "process_time_ns", lambda: spent[0] * 1e9)
    assert microseconds(lambda: spend(1.0), lambda: spend(250e-6), 5) == pytest.approx(250)  # without the start


def test_an_episode_that_physics_ends_early_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = ToyGame._step

    def step(game: ToyGame, b: int, *moves: Any) -> None:
        whole(game, b, *moves)
        game.terminated[b] = game.steps[b] >= 4

    monkeypatch.setattr(ToyGame, "_step", step)
    for item in added_items([TOY]):
        assert item.measure(0.001, YARDSTICKS)["game_us"] > 0


def test_the_simplest_vehicle_is_faster_than_any_problem() -> None:
    found = measure_yardsticks(0.02)
    assert 1 < found.cartpole_us < 1000
    assert found.updates_per_s > 1e8


def test_everything_is_planned() -> None:
    assert names("sizes") >= {"rogue 5 vehicles", "rogue 30 vehicles"}
    assert names("interfaces") >= {
        "CartPole vector 64",
        "RogueAttack paper single",
        "RogueDefense learning vector 1024",
    }
    assert {"rogue paper parallel", "rogue learning parallel"} <= names("interfaces")
    assert names("resets") == {"rogue paper", "rogue learning"}
    assert names("added") == {"RogueAttack", "RogueDefense"}
    asked = names("opponents")
    for role in ROLES:
        policies = {f"rogue.{role}.{name}" for name in policy_names("rogue", role)}
        assert {name for name in policies if not name.endswith((".none", ".always", ".mixture", ".trace"))} <= asked
    assert any("zoo:" in name for name in asked)
    assert short("cps_envs/RogueAttack-v0") == "RogueAttack"


def test_the_table_of_sizes_names_problems_and_is_valid() -> None:
    assert {size.problem for size in SIZES} == set(PROBLEMS)
    assert len({(size.problem, size.name) for size in SIZES}) == len(SIZES)
    for size in SIZES:
        find_problem(size.problem).config("paper", size.overrides)
        than = size.cheaper[0]
        assert not than or any((other.problem, other.name) == (size.problem, than) for other in SIZES)


def _slower_than_none(policy: str) -> bool:
    """Measured for longer, three times at most."""
    plans = plan([PROBLEM], ["opponents"])
    found = (measure(plans, 0.1, lambda *_: None) for _ in range(3))
    return any(row.values["times_none_1"] > 1 for each in found for row in each.rows if row.name == policy)


@pytest.mark.usefixtures("few")
def test_everything_is_measured() -> None:
    reports: list[tuple[int, int]] = []
    plans = plan([PROBLEM], ["sizes", "interfaces", "resets", "added", "opponents"])
    found = measure(plans, 0.01, lambda done, total, note: reports.append((done, total)))
    assert reports[-1] == (len(plans), len(plans))
    assert not found.interrupted
    assert len(found.yardsticks) == 5
    rows = {(row.part, row.name): row for row in found.rows}
    single, batch = (
        rows["interfaces", "RogueAttack paper single"].values,
        rows["interfaces", "RogueAttack learning vector 2"].values,
    )
    assert single["steps_per_s"] == pytest.approx(1e6 / single["step_us"])
    assert batch["step_us"] > 0
    assert rows["resets", "rogue learning"].values["reset_us"] > 0
    paper, hit = rows["sizes", "rogue 5 vehicles"].values, rows["sizes", "rogue hit"].values
    assert paper["work_per_s"] == pytest.approx(500 * 1e6 / paper["step_us"])
    assert paper["episode_kb"] > 0.5
    assert "episode_kb" not in hit
    assert hit["substep_ns"] > 0
    added = rows[ADDED, "RogueDefense"].values
    assert added["game_us"] > 1
    assert added["vector_us"] > 0
    square = rows["opponents", "rogue.attacker.square"].values
    assert square["times_none_1"] > 1 or _slower_than_none("rogue.attacker.square")  # ten milliseconds may mislead
    assert rows["opponents", "rogue.defender.pd"].values.keys() >= {"us_1", "us_64", "times_none_64"}
    wanting = rows["opponents", "rogue.attacker.pd"]
    assert (wanting.values, "no attacker policy 'pd'" in wanting.note) == ({}, True)


def test_each_environment_of_a_row_acts_by_itself() -> None:
    made: list[Any] = []

    class Noting:
        def __init__(self, env: Any) -> None:
            self.env = env

        def __getattr__(self, name: str) -> Any:
            return getattr(self.env, name)

        def step(self, actions: Any) -> None:
            made.append(actions)

    with pytest.MonkeyPatch.context() as patched:
        make = gymnasium.make_vec
        patched.setattr(gymnasium, "make_vec", lambda *args, **options: Noting(make(*args, **options)))
        step = interfaces.vector(PROBLEM.env_id("attacker"), 8, preset="paper", opponent="none")
    for _ in range(interfaces.HELD + 1):
        step()
    assert len(np.unique(made[0])) == 8
    np.testing.assert_array_equal(made[0], made[interfaces.HELD - 1])
    assert (made[0] != made[-1]).all()


def test_memory_grows_with_the_size() -> None:
    small, large = (episode_kb(PROBLEM, {"num_vehicles": count, "dt_s": 1e-4}) for count in (5, 30))
    assert 0 < small < large


def row(part: str, name: str, note: str = "", **values: float) -> Row:
    return Row(part, name, values, note)


def test_rates_and_microseconds_follow_the_speed_of_the_machine() -> None:
    rows = [
        row("sizes", "disbanding 100 vehicles", work_per_s=1.1e8, reached=0.5, step_us=200.0),
        row("added", "FdiAttack", single_us=15.0, vector_us=15.0),
    ]
    half = Yardsticks(MACHINE.cartpole_us * 2, MACHINE.updates_per_s / 2, MACHINE.divisions_per_s)
    assert [target.met for target in judge(rows)] == [False, True, False, True]
    assert [target.met for target in judge(rows, [half])] == [True, True, True, True]
    assert judge([], []) == []


def test_a_kernel_whose_cost_does_not_fall_with_the_size_misses_its_target() -> None:
    slow = [
        row("sizes", "disbanding 100 vehicles", work_per_s=3e8, reached=0.5, step_us=200.0),
        row("sizes", "disbanding 4 vehicles", work_per_s=1e7, reached=0.02, step_us=150.0),
    ]
    met = {target.what: target.met for target in judge(slow)}
    assert met["disbanding 4 vehicles: cost over 100 vehicles"] is False
    assert met["disbanding 100 vehicles: of its limit"] is met["disbanding 100 vehicles: substeps/s"] is True


def test_targets_are_the_costliest_opponent_that_is_no_solver() -> None:
    measured = [
        row("opponents", "fdi.attacker.usual in cheap", times_none_64=1.5),
        row("opponents", "fdi.attacker.usual in dear", times_none_64=4.5),
        row("opponents", "fdi.attacker.random", times_none_64=9.0),
        row("opponents", "fdi.attacker.usual in exact", note="solver", times_none_64=99.0),
        row("opponents", "fdi.attacker.absent", note="needs options"),
        row("added", "FdiAttack", single_us=3.0, vector_us=30.0),
        row("resets", "fdi learning", reset_us=21.0),
        row("resets", "hvac learning", reset_us=21.0),
        row("resets", "hvac paper", reset_us=19.0),
        row("interfaces", "FdiAttack learning single", cartpoles=1.0, steps_per_s=1e5),
    ]
    met = {target.what: target.met for target in judge(measured)}
    assert met == {
        "FdiAttack learning single: CartPoles": True,
        "fdi learning: us of a reset": False,
        "hvac learning: us of a reset": True,
        "hvac paper: us of a reset": True,
        "FdiAttack: us that single adds": True,
        "FdiAttack: us that vector adds": False,
        "fdi attacker, costliest: usual in dear, x none": False,
    }


def test_ctrl_c_keeps_what_was_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    def pressed(seconds: float, yardsticks: Yardsticks) -> Values:
        raise KeyboardInterrupt

    plans = [Measurement("added", "first", lambda *_: {"game_us": 1.0}), Measurement("added", "second", pressed)]
    monkeypatch.setattr(measuring, "measure_yardsticks", lambda seconds: YARDSTICKS)
    found = measure(plans, 0.01, quiet)
    assert found.interrupted
    assert [each.name for each in found.rows] == ["first"]


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> Findings:
    """What the command finds, without measuring."""
    found = Findings(
        [
            row("sizes", "disbanding 1,000 vehicles", work_per_s=2e8, substep_ns=5.0, reached=0.3, step_us=500.0),
            row("interfaces", "DisbandingDefense vector 1024", steps_per_s=1e9, step_us=0.001, cartpoles=0.0001),
            row("added", "DisbandingDefense", game_us=20.0, single_us=4.0, vector_us=20.0),
            row("opponents", "disbanding.defender.zoo:disbanding-defense", us_1=1e4, times_none_1=999.0),
            row("opponents", "disbanding.attacker.plan", note="needs events"),
        ],
        [YARDSTICKS],
    )
    monkeypatch.setattr(command, "measure", lambda items, seconds, report: found)
    return found


invoke = partial(command_line.invoke, columns=80, program=program(bench))


def test_the_command_prints_tables_that_fit_a_terminal(measured: Findings) -> None:
    result = command_line.succeeded("--problem", "disbanding", columns=80, program=program(bench))
    assert max(map(len, result.stdout.splitlines())) <= 80
    for text in ("defender zoo:disbanding-defense", "attacker plan: needs events", "not met", "1.00e9"):
        assert text in result.stdout


def test_the_command_prints_json(measured: Findings) -> None:
    found = json.loads(invoke("--json", "--quick").stdout)
    assert set(found) == {"machine", "yardsticks", "rows", "targets", "interrupted"}
    assert found["rows"][0]["values"]["substep_ns"] == 5.0
    assert {target["met"] for target in found["targets"]} == {True, False}


def test_an_interrupted_command_prints_and_says_so(measured: Findings) -> None:
    measured.interrupted = 130
    result = invoke("--problem", "disbanding")
    assert result.exit_code == 130
    assert "DisbandingDefense vector 1024" in result.stdout
    assert "Interrupted: 5 of" in result.stderr


def test_unknown_problems_and_parts_are_refused() -> None:
    refusal = partial(command_line.refusal, program=program(bench))
    assert "Did you mean 'disbanding'?" in refusal("--problem", "disbandin")
    assert "Did you mean 'sizes'?" in refusal("--part", "size")


def test_help_begins_with_verbs() -> None:
    assert (bench.__doc__ or "").startswith("Measure")
    assert "face" not in invoke("--help").stdout.lower().replace("interface", "")


def test_cartpole_comes_first() -> None:
    assert next(iter(items([PROBLEM]))).name == "CartPole single"
