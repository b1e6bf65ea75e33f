"""Double oracle: convergence on a finite game, resumption, the command."""

from __future__ import annotations

import json
import shlex
import signal
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy")
pytest.importorskip("matplotlib")

from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError
from cps_agents.league import self_play
from cps_agents.league.bounds import LeagueOutcome, judge, shares
from cps_agents.league.equilibrium import solve
from cps_agents.league.meetings import play_table
from cps_agents.league.oracles import Oracle
from cps_agents.league.response import Budget, Question, Response, Responses
from cps_agents.league.self_play import Iteration, Pool, SelfPlayGame, claim, iterate, play_pool
from cps_agents.league.self_play_report import document, draw, play_line
from cps_agents.league.strategy import mix
from cps_agents.workers import Workers
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.declare.seeds import VALIDATION
from cps_envs.core.documents import DamagedFileError
from cps_envs.core.types import ROLES, SIGN, Role
from tests.agents.command_line import invoke, refusal, succeeded

VENUE = Venue("rogue", "easy", {"duration_s": 12.0})
EVERY: dict[Role, list[str]] = {
    "attacker": ["none", "square", "switching", "duty_square?frequency_hz=0.3", "square?duty=0.2"],
    "defender": ["pd", "sliding", "disband_2", "disband_7"],
}
GAME = SelfPlayGame(
    VENUE,
    {"attacker": ["none"], "defender": ["pd"]},
    {role: [Oracle("exact", ())] for role in ROLES},
    episodes=6,
    seeds=1,
)
BUDGET = Budget(seeds=1, workers=1, command="cps-envs self-play")
Respond = Callable[..., Responses]


def players(names: Sequence[str]) -> list[Contestant]:
    return list(map(Contestant, names))


def exact(cells: Path) -> Respond:
    """In place of oracles: the best of `EVERY`."""

    def respond(oracles: Any, question: Question, folder: Path, budget: Budget, *rest: Any) -> Responses:
        mine = players(EVERY[question.role])
        theirs = players(question.strategy.policies)
        sides = (mine, theirs) if question.role == "attacker" else (theirs, mine)
        seeds = range(1_000_000, 1_000_000 + GAME.episodes)
        with Workers(1) as pool:
            table = Table(VENUE, *sides, len(seeds), first_seed=seeds.start)
            found = play_table(table, Store(cells), pool).means
        means = (found if question.role == "attacker" else found.T) @ np.array(question.strategy.probabilities)
        best = int((SIGN[question.role] * means).argmax())
        return Responses((Response("exact", budget.first_seed, mine[best].reference, 10, 0.5, float(means[best])),))

    return respond


def run(folder: Path, iterations: int, game: SelfPlayGame = GAME) -> LeagueOutcome:
    outcomes: list[LeagueOutcome] = []

    def after(pool: Pool, done: list[Iteration]) -> None:
        outcomes.append(judge(game, pool, done, Store(folder / "meetings"), 1))

    claim(folder, game, resume=True)
    iterate(game, folder, Store(folder / "meetings"), iterations, BUDGET, after)
    return outcomes[-1]


@pytest.fixture(name="oracle")
def _oracle(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Respond:
    respond = exact(tmp_path_factory.mktemp("cells"))
    monkeypatch.setattr(self_play, "respond", respond)
    return respond


def test_exact_responses_reach_the_equilibrium_of_the_whole_game(tmp_path: Path, oracle: Respond) -> None:
    outcome = run(tmp_path, 6)
    everybody = {role: players(EVERY[role]) for role in ROLES}
    whole = play_pool(GAME, everybody, VALIDATION, Store(tmp_path / "meetings"), 1).means
    attacking, defending = (shares(outcome.final[role], everybody[role]) for role in ROLES)
    value = solve(whole).value
    assert (whole @ defending).max() == pytest.approx(value, abs=1e-4 * np.ptp(whole))
    assert (attacking @ whole).min() == pytest.approx(value, abs=1e-4 * np.ptp(whole))
    assert 1 < len(outcome.pool["attacker"]) <= len(EVERY["attacker"])
    assert len({player.reference for player in outcome.pool["defender"]}) == len(outcome.pool["defender"])
    assert outcome.bounds[0].exploitability.mean > 0  # the start is far from it
    assert outcome.steps == 6 * 2 * 10


def test_bounds_are_those_of_the_evaluation_seeds(tmp_path: Path, oracle: Respond) -> None:
    outcome = run(tmp_path, 1)
    first = outcome.bounds[0]
    with Workers(1) as pool:
        sides = (outcome.pool["attacker"], outcome.pool["defender"])
        matrix = play_table(Table(VENUE, *sides, GAME.episodes), Store(tmp_path / "meetings"), pool).means
    names = {role: [player.name for player in outcome.pool[role]] for role in ROLES}
    row, column = names["attacker"].index(first.best_attacker), names["defender"].index(first.best_defender)
    assert first.conceded.mean == pytest.approx(matrix[row, 0])
    assert first.secured.mean == pytest.approx(matrix[0, column])
    assert first.value.mean == pytest.approx(matrix[0, 0])
    assert first.attacker_gain.mean == pytest.approx(matrix[row, 0] - matrix[0, 0])
    assert first.defender_gain.mean == pytest.approx(matrix[0, 0] - matrix[0, column])
    assert first.exploitability.mean == pytest.approx(first.attacker_gain.mean + first.defender_gain.mean)


def test_interrupted_anywhere_it_goes_on_to_the_same_end(
    tmp_path: Path, oracle: Respond, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = run(tmp_path / "whole", 3)
    asked: list[str] = []

    def interrupted(*arguments: Any) -> Responses:
        asked.append(arguments[-2])
        if len(asked) % 2:
            raise KeyboardInterrupt
        return oracle(*arguments)

    monkeypatch.setattr(self_play, "respond", interrupted)
    interruptions = 0
    while True:
        try:
            resumed = run(tmp_path / "parts", 3)
            break
        except KeyboardInterrupt:
            interruptions += 1
            monkeypatch.setattr(self_play, "respond", oracle if interruptions > 2 else interrupted)
    assert interruptions == 3
    assert resumed.bounds == whole.bounds
    assert resumed.final == whole.final
    again = run(tmp_path / "parts", 4)
    assert [each.profile for each in again.iterations[:3]] == [each.profile for each in whole.iterations]


def test_another_game_and_damage_are_told(tmp_path: Path, oracle: Respond) -> None:
    run(tmp_path, 1)
    with pytest.raises(CommandError, match="--resume"):
        claim(tmp_path, GAME, resume=False)
    with pytest.raises(CommandError, match=r"another game \(other: episodes, venue\)"):
        claim(tmp_path, replace(GAME, episodes=7, venue=replace(VENUE, preset="paper")), resume=True)
    (tmp_path / "iteration-1" / "result.json").write_text("{")
    with pytest.raises(DamagedFileError, match=r"result\.json is no file of self-play .*go on with --resume"):
        run(tmp_path, 1)


def test_a_plan_stays_once_it_is_made(tmp_path: Path, oracle: Respond) -> None:
    plan: dict[str, Any] = {
        "attacker": {"policies": ["none", "square"], "probabilities": [0.5, 0.5]},
        "defender": {"policies": ["pd"], "probabilities": [1.0]},
    }
    (tmp_path / "iteration-1").mkdir()
    (tmp_path / "iteration-1" / "plan.json").write_text(json.dumps(plan))
    known = replace(GAME, start={"attacker": ["none", "square"], "defender": ["pd"]})
    outcome = run(tmp_path, 1, known)
    assert outcome.iterations[0].profile["attacker"] == mix(["none", "square"])


def test_the_report_holds_everything(tmp_path: Path, oracle: Respond) -> None:
    outcome = run(tmp_path, 2)
    found = json.loads(json.dumps(document(outcome, {"command": "x"}), allow_nan=False))
    assert [each["iteration"] for each in found["iterations"]] == [1, 2]
    assert found["budget"] == {"iterations": 2, "steps": 40, "cpu_s": 2.0}
    assert mix([found["final"]["profile"]["defender"]["reference"]]).policies == outcome.final["defender"].policies
    *_, option, reference = shlex.split(play_line(outcome, "defender"))
    assert (option, mix([reference]).policies) == ("--defender", outcome.final["defender"].policies)
    left, right = draw(outcome).axes
    assert len(left.get_xticks()) == 3
    assert {text.get_text() for text in right.get_legend().get_texts()} == {
        "defender concedes at least",
        "both play the profile",
        "attacker secures at most",
    }


ARMS = ("--trust", "self-play", "tests.agents.arms:ARMS", "--attacker", "none", "--defender", "none", "--jobs", "1")
TINY = (
    *("--steps", "6400", "--episodes", "4", "--knob", "hidden=[16,16]", "--knob", "evaluations=1"),
    *("--knob", "evaluation_episodes=4"),
)


@pytest.mark.slow
def test_the_command_learns_is_interrupted_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("torch")
    from cps_agents.learning import learner

    counting, jobs = learner._counting, []

    def interrupting(progress: Any, job: Any, before: Any) -> Any:
        jobs.append(job)
        if len(jobs) == 2:  # the defender of the first iteration
            return lambda steps, note: signal.raise_signal(signal.SIGINT) if steps else None
        return counting(progress, job, before)

    monkeypatch.setattr(learner, "_counting", interrupting)
    base = (*ARMS, *TINY, "--out", str(tmp_path), "--meetings", str(tmp_path / "meetings"))
    stopped = invoke(*base, "--iterations", "2")
    assert (stopped.exit_code, "Interrupted" in stopped.stderr) == (130, True)
    runs = [f"iteration-{k + 1}/{role}/shared-ppo/seed-{k}" for k in range(2) for role in ROLES]
    states = [json.loads((tmp_path / run / "run.json").read_text())["status"] for run in runs[:2]]
    assert states == ["finished", "interrupted"]
    assert not (tmp_path / "iteration-1" / "result.json").exists()
    assert "--resume" in refusal(*base)
    resumed = succeeded(*base, "--iterations", "2", "--resume", "--json")
    found = json.loads(resumed.stdout)
    assert list(found["pool"]["attacker"]) == ["none", "response 1", "response 2"]
    assert "Round 1: the attacker's return is 5" in resumed.stderr
    assert "Round 2: the attacker's return is" in resumed.stderr
    first, second = (each["bounds"] for each in found["iterations"])
    assert first["attacker_gain"]["mean"] > 10  # 15 hits, found from reward alone
    assert first["defender_gain"]["mean"] > 4  # of 5 that idle dials are charged
    assert second["exploitability"]["mean"] < 1
    assert (tmp_path / "self-play.png").stat().st_size > 1000
    assert [job.folder.relative_to(tmp_path.resolve()).as_posix() for job in jobs[2:]] == runs
    starts = [Path(job.recipe.start.removeprefix("zoo:")) for job in jobs[4:]]
    assert starts == [(tmp_path / run).resolve() for run in runs[:2]]  # it goes on with the network of before
