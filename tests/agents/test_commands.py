"""What every command has in common: help, refusals that name the remedy, JSON, plain text in pipes, missing extras."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from cps_agents.cli import COMMANDS as ENTRIES
from cps_agents.cli import whole
from tests.agents.command_line import invoke, refusal, succeeded

SHORT = ("--set", "duration_s=2")
ALONE = ("--jobs", "1")  # what is refused at the first meeting need not start processes
NARROWEST = 80


def every_command(group: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """The words of each command, those of groups first."""
    yield path
    for name, command in getattr(group, "commands", {}).items():
        yield from every_command(command, (*path, name))


COMMANDS = list(every_command(whole()))
REFUSED = [
    (("list", "hvca"), "Did you mean 'hvac'?"),
    (("list", "testbed"), "Known: disbanding, fdi, hvac, rogue. One of your own is written MODULE:PROBLEM, behind"),
    (("play", "disbandin"), "Did you mean 'disbanding'?"),
    (("play", "disbanding", "--attacker", "leed"), "Did you mean 'lead'?"),
    (("play", "disbanding", "--preset", "papr"), "Did you mean 'paper'?"),
    (("play", "disbanding", "--set", "tau=1"), "Did you mean 'tau_s'?"),
    (("play", "disbanding", "--set", "tau_s"), "field=value"),
    (("play", "disbanding", "--set", "tau_s=9"), "[0.01, 2] s; the default is 0.1"),
    (("play", "disbanding", "--attacker", "plan"), "events"),
    (("play", "disbanding", "--attacker", "lead?when=3"), "when"),
    (("play", "disbanding", "--attacker", "every_other"), "attack_budget=5"),
    (("play", "disbanding", "--defender", "nowhere:Policy"), "nowhere"),
    (("play", "disbanding", "--render", "film.avi"), "FILE.mp4"),
    (("play", "disbanding", "--render", "film.gif", "--at", "3"), "--render FILE.png"),
    (("play", "disbanding", "--render", "film.png", "--at", "999"), "180 s"),
    (("play", "disbanding", "--render", "film.mp4", "--fps", "0"), "above 0"),
    (("play", "disbanding", "--episodes", "0"), "greater than or equal to 1"),
    (("reproduce", "benchmark", "disbandin"), "Did you mean 'disbanding'?"),
    (("reproduce", "benchmark", "--table", "tau-0.4"), "tau-0."),
    (("reproduce", "benchmark", "disbanding", "--attacker", "leed"), "Did you mean 'lead'?"),
    (("reproduce", "benchmark", "--defender", "heuristics"), "Did you mean 'heuristic'?"),
    (("warm", "--problem", "rouge"), "Did you mean 'rogue'?"),
    (("league", "hvac", "--preset", "learnin"), "learnin"),
    (("train", "hvac-attack", "--algo", "cma-e"), "cma-e"),
    *(
        (("certify", "--preset", "paper", "--out", "none.json", *wrong), remedy)
        for *wrong, remedy in (
            ("--preset", "papr", "Did you mean 'paper'?"),
            ("--set", "horizn=3", "Did you mean 'horizon'?"),
            ("--task", "y4>4", "names no sensors"),
            ("--task", "x4", "must read like x4>4"),
        )
    ),
    *(
        (("play", "cps_paper.testbed.robots.problem:TESTBED", *wrong), remedy)
        for *wrong, remedy in (
            ("--preset", "mitigated", "--defender", "heuristic?horizon_s=0.52&sample_s=0.1", "multiple of sample_s"),
            ("--defender", "heuristics", "heuristic"),
            ("--set", "radius_m=0.4", "larger radius_m"),
        )
    ),
    *(
        (("play", "rogue", *wrong), remedy)  # deep and odd texts
        for *wrong, remedy in (
            ("--set", f"duration_s={'[' * 100_000}", "--set duration_s=...: it is nested too deeply"),
            ("--set", "duration_s=NaN", "--set duration_s=...: NaN is no number of JSON"),
            ("--attacker", f"square?duty={'[' * 5000}", "an option of a policy makes no sense"),
            ("--attacker", f"mixture?policies={'[' * 5000}", "an option of a policy makes no sense"),
        )
    ),
    *(
        (("reproduce", *wrong), remedy)
        for *wrong, remedy in (
            ("ch2", "--table", "2.4", "2.1fig"),
            ("ch2", "--table", "2.2", "--interpretation", "S9", "S0, S1, S2"),
            ("ch2", "--table", "2.2", "--recheck", "add --table claims"),
            ("ch3", "--table", "3.9", "3.7"),
            ("ch3", "--preset-set", "C", "A, B"),
            ("ch3", "--acceptance", "0", "above 0"),
            ("ch3", "--acceptance", "-1", "above 0"),
            ("ch4", "--table", "4.9", "4.8fig"),
            ("ch4", "--table", "4.1", "--recheck", "add --table claims"),
            ("ch4", "--controller", "pq", "Known: clip, qp, levels"),
            ("ch5", "--part", "5.9", "Known: 5.2, 5.3, 5.4, 5.5, maps"),
            ("ch5", "--part", "5.3", "--recheck", "add --part claims"),
            ("ch5", "--jobs", "0", "greater than or equal to 1"),
            ("testbed", "--seeds", "0", "greater than or equal to 1"),
        )
    ),
    *(
        (("evaluate", "rogue", "attacker", "--defender", "pd", *ALONE, "--attacker", *wrong), remedy)
        for *wrong, remedy in (
            ("sqare", "Did you mean"),
            ("zoo:nobody", "no trained policy 'nobody'"),
            ("square", "--metric", "damge", "Did you mean 'damage'"),
            ("square", "--set", "duration=3", "duration_s"),
            ("square", "--preset", "papr", "paper"),
        )
    ),
    (("evaluate", "rogue", "attackers", "--attacker", "square"), "write attacker or defender"),
    (("evaluate", "rouge", "attacker", "--attacker", "square"), "Did you mean 'rogue'"),
    (("league", "rogue", *ALONE, "--defender", "slidin"), "Did you mean 'sliding'"),
    (("self-play", "rogue", *ALONE, "--defender", "pdd"), "Did you mean 'pd'"),
    *(
        (("best-response", "rogue", "attacker", "--defender", "pd", *wrong), remedy)
        for *wrong, remedy in (
            ("--weights", "a", "write numbers with commas"),
            ("--weights", "1,2", "one weight for each policy"),
            ("--league", "nowhere.json", "play the league first"),
            ("--oracle", "fdi-attack", "trains the attacker of fdi"),
        )
    ),
    (("best-response", "rogue", "atacker", "--defender", "pd"), "not a role"),
    (("zoo", "show", "fdi-defens"), "fdi-defense"),
    (("train", "fdi-defens"), "fdi-defense"),
    (("nothing",), "No such command 'nothing'"),
]
JSON = [
    ("list", "rogue"),
    ("play", "disbanding", *SHORT),
    ("play", "cps_paper.testbed.robots.problem:TESTBED", "--set", "duration_s=60"),
    ("zoo", "list"),
    ("zoo", "show", "fdi-defense"),
    ("train",),
    ("evaluate", "rogue", "attacker", "--attacker", "random", "--episodes", "2", "--jobs", "1"),
]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda words: " ".join(words) or "cps-envs")
def test_help(command: Sequence[str]) -> None:
    result = succeeded(*command, "--help", columns=NARROWEST)
    assert "Usage" in result.stdout
    assert max(map(len, result.stdout.splitlines())) <= NARROWEST


def test_the_help_shows_every_command_with_one_sentence_in_panels_in_order() -> None:
    lines = invoke("--help", columns=NARROWEST).stdout.splitlines()
    titles = [line.split()[1] for line in lines if line.startswith("╭")]
    assert titles == ["Options", *dict.fromkeys(entry.panel for entry in ENTRIES.values())]
    first = next(place for place, line in enumerate(lines) if "─ Play ─" in line)
    names = [line.split()[1] for line in lines[first:] if line.startswith("│ ") and line[2] != " "]
    assert names == list(ENTRIES)
    assert set(names) == {command[0] for command in COMMANDS if command}
    assert not [line for line in lines[first:] if "…" in line]


def test_a_command_says_of_itself_what_the_list_of_commands_says() -> None:
    loaded = whole().commands
    for name, entry in ENTRIES.items():
        assert loaded[name].help.partition("\n\n")[0] == entry.summary


def test_the_list_of_problems_fits_a_screen_and_a_problem_shows_its_policies() -> None:
    lines = invoke("list", columns=NARROWEST).stdout.splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= NARROWEST
    assert "brink" in invoke("list", "hvac", columns=NARROWEST).stdout


@pytest.mark.parametrize(("arguments", "remedy"), REFUSED, ids=lambda value: " ".join(value)[:60])
def test_wrong_input_gets_one_message_that_names_the_remedy(
    arguments: Sequence[str], remedy: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for package in {"certify": ["highspy"]}.get(arguments[0], []):
        pytest.importorskip(package)
    monkeypatch.chdir(tmp_path)
    assert remedy in refusal(*arguments)
    assert not [path for path in tmp_path.rglob("*") if path.is_file() and not path.name.endswith(".lock")]


@pytest.mark.parametrize("arguments", JSON, ids=" ".join)
def test_json_is_all_that_is_on_stdout(
    arguments: Sequence[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    result = succeeded(*arguments, "--json")
    assert json.loads(result.stdout)
    plain = invoke(*arguments)
    assert "\x1b" not in plain.stdout + plain.stderr  # no colours in a pipe
    with pytest.raises(json.JSONDecodeError):
        json.loads(plain.stdout)


@pytest.mark.parametrize(
    ("arguments", "package", "extra"),
    [
        (("play", "disbanding", *SHORT, "--render", "film.png"), "imageio.v2", "render"),
        (("reproduce", "ch2", "--plot", "gains"), "matplotlib.figure", "baselines"),
        (("league", "rogue"), "scipy", "baselines"),
        (("train", "rogue-attack"), "torch", "train"),
        (("self-play", "rogue"), "torch", "train"),
        (("best-response", "rogue", "attacker", "--defender", "pd"), "torch", "train"),
    ],
    ids=lambda value: value if isinstance(value, str) else value[0],
)
def test_a_missing_package_is_told_with_its_remedy(
    arguments: Sequence[str], package: str, extra: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, package, None)
    assert f'pip install "cps-envs[{extra}]"' in refusal(*arguments)
    assert not list(tmp_path.iterdir())
