"""An episode goes out as a table and comes back: `record_episode`, and the policy `trace`."""

from __future__ import annotations

import csv
import gzip
import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs import Recording, find_problem, record_episode
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.trace import Trace
from cps_envs.core.types import ROLES
from tests.episodes import spec_of

CASES: Mapping[str, tuple[str, str, Mapping[str, Any], Mapping[str, Any]]] = {
    "hvac": (
        "hvac",
        "learning",
        {"num_steps": 260, "onset_step": 100},
        {"attacker": "random", "defender": "random"},
    ),
    "hvac biases": (
        "hvac",
        "paper",
        {"num_steps": 230, "onset_step": 5, "attack_action": "bias"},
        {"attacker": "always?action=[0.1,-0.2,0,0.7]", "defender": "random"},
    ),
    "rogue": (
        "rogue",
        "learning",
        {"duration_s": 10.0, "attack_share": 1.0, "onset_s": 1.0},
        {"attacker": "random", "defender": "random"},
    ),
    "rogue commands": (
        "rogue",
        "paper",
        {"duration_s": 6.0, "defense_action": "command"},
        {"attacker": "random", "defender": "random"},
    ),
    "fdi": ("fdi", "learning", {}, {"attacker": "random", "defender": "random"}),
    "fdi paper": ("fdi", "paper", {}, {"attacker": "random", "defender": "none"}),
    "disbanding": (
        "disbanding",
        "learning",
        {"duration_s": 8, "num_platoons": 3, "attack_budget": 2, "earliest_attack_s": 1},
        {"attacker": "random", "defender": "random"},
    ),
}


def recorded(case: str, players: Mapping[str, Any] | None = None) -> Recording:
    name, preset, overrides, usual = CASES[case]
    problem = find_problem(name)
    return record_episode(problem, problem.config(preset, overrides), players or usual, seed=4)  # type: ignore[arg-type]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("kind", [".csv", ".csv.gz"])
def test_a_round_trip_is_the_same_trajectory(case: str, kind: str, tmp_path: Path) -> None:
    if kind != ".csv" and case != "fdi":
        pytest.skip("one problem is enough for the other kinds of file")
    first, path = recorded(case), tmp_path / f"episode{kind}"
    first.write(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nothing has to be made legal
        played = {role: who if who == "none" else f"trace?file={path}" for role, who in CASES[case][3].items()}
        again = recorded(case, played)
    assert again.keys() == first.keys()
    np.testing.assert_allclose(again.values, first.values, rtol=1e-9, atol=1e-9)
    assert np.isfinite(first["payoff"][:-1]).all()
    actions = [name for name in first if name.startswith(ROLES)]
    assert any(np.ptp(first[name][:-1]) > 0 for name in actions)


def test_a_recording_has_states_readings_actions_and_rewards_with_units() -> None:
    found = recorded("hvac")
    problem = find_problem("hvac")
    columns = {column.name: column for column in found.columns}
    assert columns["temperature_c_1"].unit == "C"
    assert columns["attacker_bias_c_4"].unit == "C"
    assert len(columns) == len(found.columns)
    assert found["time_s"].tolist() == [120.0 * k for k in range(260)]
    assert found["payoff"][:-1].sum() == pytest.approx(found["a_impact"][-1])
    assert np.isnan(found["payoff"][-1])
    told = found["reading_c_1"] - found["measured_c_1"]
    assert (told[found["compromised_1"] == 0] == 0).all()
    assert found.head["problem"] == problem.name
    assert found.head["seed"] == 4


@pytest.mark.parametrize("case", CASES)
def test_names_of_columns_differ(case: str) -> None:
    names = recorded(case).keys()
    assert sorted(set(names)) == sorted(names)


def test_gaps_and_positions_of_vehicles_are_there() -> None:
    rogue, fdi, road = recorded("rogue"), recorded("fdi"), recorded("disbanding")
    np.testing.assert_allclose(rogue["gap_m_1"], rogue["position_m_2"] - rogue["position_m_1"] - 4.5)
    np.testing.assert_allclose(road["spacing_m_1"], road["position_m_1"] - road["position_m_2"])
    assert {"gap_m_1", "reported_gap_m_1", "believed_gap_m_1", "command_mps2_1"} <= set(fdi.keys())


def test_the_head_says_what_an_episode_was(tmp_path: Path) -> None:
    path = tmp_path / "episode.csv.gz"
    recorded("fdi").write(path)
    lines = gzip.decompress(path.read_bytes()).decode().splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert json.loads(comments[0][2:])["attacker"] == "random"
    assert "# gap_m_1 in m: true, ahead of each vehicle from the last on" in comments
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    assert len(rows) == len(recorded("fdi").values) + 1


def test_parquet_holds_the_same(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    first, path = recorded("fdi"), tmp_path / "episode.parquet"
    first.write(path)
    table = parquet.read_table(path)
    assert table.column_names == first.keys()
    np.testing.assert_array_equal(table["gap_m_1"].to_numpy(), first["gap_m_1"])
    again = recorded("fdi", dict.fromkeys(ROLES, f"trace?file={path}"))
    np.testing.assert_allclose(again.values, first.values, rtol=1e-9, atol=1e-9)


def test_another_kind_of_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"name a file that ends in \.csv, \.csv\.gz, \.parquet"):
        recorded("fdi").write(tmp_path / "episode.xlsx")


def trace(path: Path, text: str, name: str = "hvac", role: str = "attacker", preset: str = "paper") -> Any:

    path.write_text(text, encoding="utf-8")
    return resolve_policy(f"trace?file={path}", spec_of(find_problem(name), role, preset))  # type: ignore[arg-type]


def test_a_log_of_biases_becomes_false_readings_of_that_size(tmp_path: Path) -> None:
    """A bias per sensor over time, as an engineer writes it: two columns, in C, every ten minutes."""
    path = tmp_path / "attack.csv"
    rows = ("time_s,attacker_bias_c_2,attacker_bias_c_1", "1200,-3,-1.5", "1800,2.5,0", "2400,0,0", "")
    path.write_text("\n".join(rows), encoding="utf-8")
    problem = find_problem("hvac")
    config = problem.config("paper", {"num_steps": 230, "onset_step": 0})
    found = record_episode(problem, config, {"attacker": f"trace?file={path}"}, seed=1)
    forged = {place: found[f"reading_c_{place}"] - found[f"measured_c_{place}"] for place in (1, 2, 3, 4)}
    expected = np.zeros(230)
    expected[11:16], expected[16:21] = -3.0, 2.5  # an action at k forges the readings of k + 1
    np.testing.assert_allclose(forged[2], expected, atol=1e-9)
    expected[11:16], expected[16:21] = -1.5, 0.0
    np.testing.assert_allclose(forged[1], expected, atol=1e-9)
    assert not forged[3].any()
    assert not forged[4].any()


def test_what_is_out_of_bounds_is_moved_and_counted(tmp_path: Path) -> None:
    text = "time_s,attacker_bias_c_1\n0,-40\n120,3\n240,99\n"
    with pytest.warns(UserWarning, match="2 of 15 attacker entries are outside what is legal"):
        policy = trace(tmp_path / "attack.csv", text)
    assert policy.illegal == 0


def test_what_is_not_legal_in_an_episode_is_replaced_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "defence.csv"
    path.write_text("time_s,defender_choice\n0,3\n86400,3\n", encoding="utf-8")
    env = gymnasium.make("cps_envs/HvacAttack-v0", preset="paper", num_steps=230, opponent=f"trace?file={path}")
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="choice at 0 s is not legal here"):
        env.step(env.action_space.sample())
    for _ in range(210):
        env.step(env.action_space.sample())
    policy: Any = env.unwrapped._match.players["defender"]  # type: ignore[attr-defined]
    assert policy.illegal == 200  # until the window is full


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("time_s,attacker_bias_c_1\n", "0 line of numbers, but needs at least 2"),
        ("time_s,attacker_bias_c_1\n0,1\n", "1 line of numbers, but needs at least 2"),
        ("t,attacker_bias_c_1\n0,1\n1,1\n", "no column 'time_s'"),
        ("time_s,bias\n0,1\n1,1\n", r"no column of the attacker's actions: name them attacker_bias_c_1 \(C\)"),
        ("time_s,attacker_bias_c_9\n0,1\n1,1\n", "'attacker_bias_c_9', which no action of the attacker has"),
        ("time_s,attacker_bias_f_1\n0,1\n1,1\n", "Did you mean 'attacker_bias_c_1'"),
        ("time_s,attacker_bias_c_1\n0,1\n0,1\n", "line 3, column 'time_s': 0 s comes after 0 s"),
        ("time_s,attacker_bias_c_1\n5,1\n0,1\n", "comes after 5 s; sort the rows"),
        ("time_s,attacker_bias_c_1\n0,1\n60,nan\n120,1\n", "line 3: a number is missing"),
        ("time_s,attacker_bias_c_1\n0,1\n60,\n120,1\n", "line 3, column 'attacker_bias_c_1': is empty"),
        ("time_s,attacker_bias_c_1\n0,warm\n60,1\n", "'warm' is no number"),
        ("time_s,attacker_bias_c_1\n0,inf\n60,1\n", "infinity is no value"),
        ("time_s,attacker_bias_c_1\nnan,1\n60,1\n", "column 'time_s': no number"),
        ("time_s,attacker_bias_c_1\n0,1\n60,1,2\n", "line 3 has 3 columns"),
        ("time_s,attacker_bias_c_1,attacker_bias_c_1\n0,1,1\n60,1,1\n", "'attacker_bias_c_1' twice"),
        ("time_s;attacker_bias_c_1\n0;1\n60;1\n", "separate columns by commas"),
    ],
)
def test_a_broken_log_is_refused_in_a_sentence(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=message) as raised:
        trace(tmp_path / "attack.csv", text)
    assert str(tmp_path / "attack.csv") in str(raised.value)


def test_a_log_that_is_not_there_or_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"save it as \.csv"):
        trace(tmp_path / "attack.mat", "")
    spec = spec_of(find_problem("hvac"), "attacker")
    with pytest.raises(ConfigurationError, match="No such file"):
        Trace(spec, file=str(tmp_path / "nothing.csv"))
