"""Every shipped policy can be made again, by the command in its card."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from safetensors.numpy import load, save

from cps_agents.errors import CommandError
from cps_agents.recipes.finding import RECIPES
from cps_agents.zoo.card import SHIPPED
from cps_agents.zoo.files import read_pair, shipped_names
from cps_envs import PROBLEMS
from tests.agents.command_line import succeeded
from tests.agents.trained import save_tiny
from tests.test_pages import parse
from tools.command import program
from tools.remake import steps as module
from tools.remake.__main__ import remake
from tools.remake.steps import calls, compare, do, steps


def test_nothing_shipped_is_an_orphan() -> None:
    planned = steps()
    assert sorted(name for step in planned for name in step.policies) == shipped_names()
    for step in planned:
        _, command, target, *options = step.command.split()
        assert step.cpu_s > 0
        if command == "train":
            assert step.policies == (target,)
            assert target in RECIPES
            assert options[:2] == ["--seeds", "5"]
        else:
            assert command == "self-play"
            assert target in PROBLEMS
            assert all("-self-play" in name for name in step.policies)


def test_what_a_policy_needs_is_made_before_it() -> None:
    order = [name for step in steps() for name in step.policies]
    for step in steps():
        assert all(order.index(needed) < order.index(step.policies[0]) for needed in step.needs)


def test_a_step_goes_on_where_it_stopped_and_so_does_a_self_play() -> None:
    (trained,) = steps(["rogue-defense"])
    runs, to = Path("runs"), Path("zoo")
    assert calls(trained, runs, to, 2) == [
        [*trained.command.split()[1:], "--resume", "--jobs", "2", "--out", "runs", "--to", "zoo"]
    ]
    (played,) = steps(["rogue-attack-self-play-1"])
    (first,) = calls(played, runs, to, None)
    assert first[:2] == ["self-play", "rogue"]
    assert first[-3:] == ["--resume", "--out", "runs/self-play-rogue"]


def test_cards_hold_commands_of_today() -> None:
    for step in steps():
        for arguments in calls(step, Path("runs"), Path("zoo"), 1):
            parse(arguments, step.command)


def test_the_commands_are_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (step,) = steps(["fdi-attack-self-play"])
    monkeypatch.setattr(module, "calls", lambda *_: [["zoo", "card", "fdi-attack-self-play", "--out", f"{tmp_path}/a"]])
    do(step, tmp_path, tmp_path, None)
    assert (tmp_path / "a").is_file()
    monkeypatch.setattr(module, "calls", lambda *_: [["zoo", "show", "unknown"]])
    with pytest.raises(CommandError, match="exit code 2"):
        do(step, tmp_path, tmp_path, None)


def test_the_plan_is_printed_with_its_cost() -> None:
    printed = succeeded("--dry-run", columns=200, program=program(remake)).output
    assert "CPU minutes in all" in printed
    assert "self-play hvac" in printed
    found = json.loads(succeeded("--dry-run", "--json", program=program(remake)).stdout)
    assert [step["command"] for step in found] == [step.command for step in steps()]


def test_an_unknown_policy_and_a_card_without_its_command_are_refused(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="is shipped"):
        steps(["hvac-attackk"])
    save_tiny(tmp_path / "mine.json", "rogue", "attacker", command="cps-envs train other --seeds 5")
    with pytest.raises(CommandError, match="does not make it"):
        steps(folder=tmp_path)


def test_a_policy_made_anew_is_compared_with_the_shipped_one(tmp_path: Path) -> None:
    name = "rogue-defense"
    shipped, data = read_pair(SHIPPED / f"{name}.json")
    for suffix in ("json", "safetensors"):
        shutil.copy(SHIPPED / f"{name}.{suffix}", tmp_path)
    assert compare((shipped, data), tmp_path) == f"{name} is the shipped policy, bit for bit."
    numbers = load(data)
    next(each for at, each in numbers.items() if at.startswith("3/layer")).reshape(-1)[0] += 0.25
    nearly = compare((shipped, save(numbers)), tmp_path)
    value = f"{shipped.seeds[str(shipped.best)]['validation']:.4g}"
    assert nearly == (
        f"{name} differs from the shipped policy. 4 of 5 training seeds are the same, bit for bit. "
        f"The largest difference of a number is 0.25. It scores {value} on validation seeds, {value} as shipped."
    )
    fewer = {key: array for key, array in numbers.items() if not key.startswith("0/")}
    assert "bit for bit" not in compare((shipped, save(fewer)), tmp_path)
