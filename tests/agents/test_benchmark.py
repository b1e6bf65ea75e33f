from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cps_agents.arena import store
from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError
from cps_envs import PROBLEMS
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.game.play import play_episodes
from cps_paper.benchmark.report import agreement, document, entries, markdown, rows_as_csv, tables
from cps_paper.benchmark.schedule import Benchmark, PaperCell
from cps_paper.benchmark.suite import find_benchmark, run_benchmark, select
from cps_paper.disbanding.benchmark import GA_PLANS
from cps_paper.printed.tables import velocity_errors, verdict
from tests.agents.command_line import invoke, succeeded

TINY = Benchmark(
    problem="disbanding",
    tables=(
        Table(
            name="tiny",
            title="Tiny",
            metric="velocity_error_all",
            attackers=(
                Contestant("none"),
                Contestant("random", episodes=3),
                Contestant("plan", policy="plan?events=[[2,1]]"),
            ),
            defenders=(Contestant("none"), Contestant("copy")),
            venue=Venue("disbanding", "paper", {"duration_s": 5, "num_platoons": 2}),
            form="{value:.2f} ({collided:.0f})",
        ),
    ),
    paper=(PaperCell("tiny", "none", "none", 3.0, True, "Table 0"),),
    crash_metric="collided",
)


def test_every_attacker_meets_every_defender(tmp_path: Path) -> None:
    reports: list[tuple[int, int, str]] = []
    outcome = run_benchmark(TINY, Store(tmp_path), workers=1, report=lambda *report: reports.append(report))
    rows = entries(outcome, 0)
    assert [[entry.episodes for entry in row] for row in rows] == [[1, 1], [3, 3], [1, 1]]
    assert rows[0][0].text == "0.00 (0)"
    assert rows[2][0].value > 10
    assert rows[2][0].value != rows[2][1].value
    assert [report[:2] for report in reports] == [(k, 6) for k in range(1, 7)]
    assert len(list(tmp_path.iterdir())) == 6


def test_the_paper_s_number_is_beside_ours(tmp_path: Path) -> None:
    outcome = run_benchmark(TINY, Store(tmp_path), workers=1)
    entry = entries(outcome, 0)[0][0]
    assert entry.difference == pytest.approx(-3.0)
    assert (entry.verdict, entry.crash_agrees) == ("near", False)
    assert entry.paper_lines == ["paper 3.00", "with crash", "-3.00 near"]
    assert agreement(outcome).startswith("1 cell printed in the paper: 0 match, 1 near, 0 miss, 3.00 points")
    assert "crash or not agrees in 0 of 1" in agreement(outcome)


def reused(folder: Path) -> int:
    kept = Store(folder)
    run_benchmark(TINY, kept, workers=1)
    assert kept.asked == 6
    return kept.reused


def test_finished_work_counts_only_for_the_same_code_and_a_whole_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert reused(tmp_path) == 0
    assert reused(tmp_path) == 6
    next(tmp_path.glob("*random-copy*")).write_text('{"job": ')
    assert reused(tmp_path) == 5
    monkeypatch.setattr(store, "fingerprint", lambda problem: "other code")
    assert reused(tmp_path) == 0
    assert len(list(tmp_path.iterdir())) == 6


def test_processes_find_the_same(tmp_path: Path) -> None:
    (part,) = select([TINY], attackers=["none", "random"])
    alone = run_benchmark(part, Store(tmp_path / "alone"), workers=1)
    together = run_benchmark(part, Store(tmp_path / "together"), workers=2)
    assert {key: found["metrics"] for key, (found,) in alone.played.results.items()} == {
        key: found["metrics"] for key, (found,) in together.played.results.items()
    }


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_tells_which_work_had_it(tmp_path: Path, workers: int) -> None:
    wrong = replace(TINY.tables[0], attackers=(Contestant("leed"),), defenders=(Contestant("none"),))
    with pytest.raises(CommandError, match=r"disbanding tiny leed none: .* Did you mean 'lead'"):
        run_benchmark(replace(TINY, tables=(wrong,)), Store(tmp_path), workers=workers)


def test_quick_plays_fewer_episodes(tmp_path: Path) -> None:
    outcome = run_benchmark(*select([TINY], quick=True), Store(tmp_path), workers=1)
    assert len(outcome.result((0, 1, 0))["metrics"]["return"]) == 2


def test_documents_hold_everything(tmp_path: Path) -> None:
    outcome = run_benchmark(TINY, Store(tmp_path), workers=1)
    text = markdown(outcome)
    assert "| none | 0.00 (0)<br>paper 3.00<br>with crash<br>-3.00 near | 0.00 (0) |" in text
    rows = list(csv.DictReader(rows_as_csv([outcome]).splitlines()))
    assert [row["attacker"] for row in rows] == ["none", "none", "random", "random", "plan", "plan"]
    assert (rows[0]["paper"], rows[0]["verdict"], rows[1]["paper"]) == ("3.0", "near", "")
    found = json.loads(json.dumps(document([outcome], {"command": "x"}, 1.0)))
    (table,) = found["problems"][0]["tables"]
    assert table["config"]["duration_s"] == 5
    assert len(table["cells"][2]["metrics"]["return"]) == 3
    assert len(tables(outcome)) == 1


def test_the_command_writes_its_files(tmp_path: Path, meetings: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    (part,) = select([TINY], attackers=["none"])
    monkeypatch.setattr("cps_paper.commands.benchmark.find_benchmark", lambda name: part)
    arguments = ["reproduce", "benchmark", "disbanding", "--out", str(tmp_path / "out"), "--jobs", "1"]
    first = succeeded(*arguments)
    assert "0.00 (0)" in first.stdout
    names = {"benchmark.json", "benchmark.csv", "benchmark.md", "disbanding-tiny.png", ".lock"}
    assert {file.name for file in (tmp_path / "out").iterdir()} == names
    assert len(list(meetings.iterdir())) == 2
    second = invoke(*arguments, "--json")
    assert "Reused 2 of 2 meetings" in second.stderr
    assert json.loads(second.stdout)["problems"][0]["problem"] == "disbanding"
    succeeded(*arguments, "--html", str(tmp_path / "page"))
    page = (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    assert '"The paper beside ours"' in page
    assert "0.00 (0)\\npaper 3.00\\nwith crash\\n-3.00 near" in page


def test_the_disbanding_benchmark_covers_the_printed_cells() -> None:
    benchmark = find_benchmark("disbanding")
    meetings = {
        (table.name, attacker.name, defender.name)
        for table in benchmark.tables
        for attacker in table.attackers
        for defender in table.defenders
    }
    assert len(benchmark.paper) == 18
    assert {(cell.table, cell.attacker, cell.defender) for cell in benchmark.paper} <= meetings


@pytest.mark.slow
@pytest.mark.parametrize("tau_s", GA_PLANS)
def test_the_genetic_algorithm_finds_the_plan_of_the_table(tau_s: float) -> None:
    pytest.importorskip("pymoo")
    table = next(each for each in find_benchmark("disbanding").tables if each.name == f"tau-{tau_s}")
    config, players = table.venue.config, ({"attacker": each} for each in ("ga", GA_PLANS[tau_s]))
    searched, planned = (play_episodes(PROBLEMS["disbanding"], config, each, [0]) for each in players)
    assert searched["velocity_error_all"] == planned["velocity_error_all"]


def test_tables_of_the_paper() -> None:
    assert [len(velocity_errors(name)) for name in ("table_2_2", "table_2_3")] == [18, 18]
    first = velocity_errors("table_2_2")[0]
    assert (first.tau_s, first.controller, first.velocity_error_percent, first.crash) == (0.1, "baseline", 29.57, False)


@pytest.mark.parametrize(("difference", "word"), [(2.0, "match"), (-2.1, "near"), (4.0, "near"), (-4.1, "miss")])
def test_verdicts(difference: float, word: str) -> None:
    assert verdict(difference) == word


def test_what_is_chosen() -> None:
    every = [find_benchmark(name) for name in PROBLEMS]

    def chosen(**choice: Any) -> dict[str, list[str]]:
        return {each.problem: [table.name for table in each.tables] for each in select(every, **choice)}

    main, full = chosen(full=False), chosen()
    assert set(main) == set(full) == set(PROBLEMS)
    assert all(set(main[name]) <= set(full[name]) for name in PROBLEMS)
    assert sum(map(len, main.values())) < sum(map(len, full.values())) == sum(len(each.tables) for each in every)
    assert chosen(tables=["tau-0.1"], full=False) == {"disbanding": ["tau-0.1"]}  # named, so played
    assert set(chosen(defenders=["mtd2"])) == {"hvac"}
    with pytest.raises(CommandError, match=r"has no table 'task'\. Did you mean 'tasks'"):
        chosen(tables=["task"])


def test_tables_are_listed() -> None:
    result = succeeded("reproduce", "benchmark", "rogue", "--list")
    assert {"paper-1", "solid-1", "easy"} <= set(result.stdout.split())


def test_several_problems_are_played_side_by_side(tmp_path: Path, meetings: Path) -> None:
    pytest.importorskip("matplotlib")
    defenders = ["--defender", "none", "--defender", "pd", "--defender", "x4-4"]
    few = ["--attacker", "none", *defenders, "--quick", "--jobs", "1"]
    tables = ["--table", "tasks", "--table", "sensor-1", "--table", "attack-free", "--table", "solid-1"]
    result = succeeded("reproduce", "benchmark", *few, *tables, "--out", str(tmp_path / "out"), "--json")
    assert [each["problem"] for each in json.loads(result.stdout)["problems"]] == ["fdi", "hvac", "rogue"]
    assert len(list(meetings.glob("*.json"))) == 3
