"""A system of one's own from a TOML file, through every door; and files that are broken, each refused in a sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import pytest

import cps_envs
from cps_envs import PROBLEMS, learning_env, load_config
from cps_envs.core.documents import DamagedFileError
from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.game.configuration_file import template
from cps_envs.hvac_v0 import parallel_env

HOUSE = """
problem = "hvac"
preset = "hard"

[payoff]
a_impact = 1.0
energy_kwh = 0.1

[fields]
num_steps = 230
onset_step = [10, 20]
heat_capacity_j_per_k = [5e5, 7e5, 4e5, 5e5]
controller = "qp"
"""
pytestmark = pytest.mark.filterwarnings("ignore:payoff is not the one")


def house(folder: Path, text: str = HOUSE, name: str = "house.toml") -> str:
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


def test_every_door_takes_the_file(tmp_path: Path) -> None:
    path = house(tmp_path)
    found = load_config(path)
    assert (found.problem.name, found.preset, found.config.num_steps) == ("hvac", "hard", 230)
    assert found.config.payoff == (("a_impact", 1.0), ("energy_kwh", 0.1))
    assert found.config.onset_step == (10, 20)
    doors: list[Any] = [
        gymnasium.make("cps_envs/HvacAttack-v0", config=path).unwrapped,
        gymnasium.make_vec("cps_envs/HvacDefense-v0", num_envs=2, vectorization_mode="vector_entry_point", config=path),
        parallel_env(config=path),
        learning_env("HvacDefense", 2, config=path),
    ]
    for env in doors:
        assert env.config == found.config
        assert env.preset == "hard"
    assert doors[0].overrides == found.overrides  # what a trained network is played in


def test_what_stands_beside_the_file_wins(tmp_path: Path) -> None:
    env: Any = gymnasium.make("cps_envs/HvacAttack-v0", config=house(tmp_path), num_steps=300, payoff="energy")
    assert (env.unwrapped.config.num_steps, env.unwrapped.config.payoff) == (300, "energy")
    assert env.unwrapped.config.controller == "qp"


def test_fields_of_the_file_win_over_the_days_that_learners_practise(tmp_path: Path) -> None:
    text = 'problem = "hvac"\n[fields]\ncompromised_weights = [0, 1]\n'
    assert learning_env("HvacAttack", 2, config=house(tmp_path, text)).config.compromised_weights == (0, 1)


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("preset", ["paper", "learning"])
def test_a_template_changes_nothing_and_each_of_its_lines_may_be_used(name: str, preset: str, tmp_path: Path) -> None:
    problem = PROBLEMS[name]
    text = template(problem, preset)
    usual = problem.config(preset, {})
    assert load_config(house(tmp_path, text)).config == usual
    lines = [line.removeprefix("# ") if " = " in line and "METRIC" not in line else line for line in text.splitlines()]
    whole = [line for line in lines if not line.startswith("traces")]
    found = load_config(house(tmp_path, "\n".join(whole)))
    assert found.config == usual
    assert set(found.overrides) == set(vars(usual))
    assert max(map(len, text.splitlines())) < 250


def test_a_template_says_unit_bounds_and_source() -> None:
    text = template(PROBLEMS["hvac"], "paper")
    assert "# step_s = 120.0  # s, 1 to 3600; paper: 1/120 Hz" in text.splitlines()
    assert '# payoff = "impact"  # what the attacker wants: impact, discomfort, energy' in text


def test_a_file_with_a_mark_of_windows_is_read(tmp_path: Path) -> None:
    (tmp_path / "house.toml").write_bytes(b"\xef\xbb\xbf" + HOUSE.replace("\n", "\r\n").encode())
    assert load_config(tmp_path / "house.toml").config.num_steps == 230


BROKEN = {
    "no TOML": ("problem = hvac\n", "Invalid value"),
    "a key twice": ('problem = "hvac"\nproblem = "fdi"\n', "Cannot overwrite a value"),
    "an unclosed table": ('problem = "hvac"\n[fields\n', "is no configuration in TOML"),
    "empty": ("", "the entry problem is missing"),
    "no problem": ('preset = "paper"\n', "the entry problem is missing"),
    "a number as problem": ("problem = 3\n", "problem is '3', but should be a text"),
    "an unknown problem": ('problem = "hvaq"\n', "house.toml: there is no problem 'hvaq'. Did you mean 'hvac'"),
    "an unknown preset": ('problem = "hvac"\npreset = "papper"\n', "no preset 'papper'. Did you mean 'paper'"),
    "a list as preset": ('problem = "hvac"\npreset = ["paper"]\n', "preset is"),
    "an unknown entry": ('problem = "hvac"\npayof = "energy"\n', "no entry 'payof'. Did you mean 'payoff'"),
    "a field outside": ('problem = "hvac"\nnum_steps = 300\n', r"no entry 'num_steps'.*below \[fields\]"),
    "fields as a number": ('problem = "hvac"\nfields = 3\n', "fields is '3', but should be an object"),
    "an unknown field": ('problem = "hvac"\n[fields]\nnum_step = 3\n', "no field 'num_step'.*'num_steps'"),
    "out of bounds": (
        'problem = "hvac"\n[fields]\nnum_steps = 1\n',
        r"house.toml: num_steps = 1 is outside \[2,",
    ),
    "a text for a number": ('problem = "hvac"\n[fields]\nnum_steps = "many"\n', "must be a whole number"),
    "a table for a number": ('problem = "hvac"\n[fields.num_steps]\nmany = 3\n', "must be a whole number"),
    "fields that do not fit": ('problem = "hvac"\n[fields]\nnum_sensors = 5\n', "a zone has one or two sensors"),
    "not a number": ('problem = "hvac"\n[fields]\nreference_c = nan\n', "fields.reference_c is 'nan', but should be a"),
    "infinity": ('problem = "hvac"\n[fields]\nreference_c = inf\n', "but should be a finite number"),
    "a date": ('problem = "hvac"\n[fields]\nreference_c = 2026-01-01\n', "but should be a number, a text"),
    "payoff twice": ('problem = "hvac"\npayoff = "energy"\n[fields]\npayoff = "impact"\n', "payoff is named twice"),
    "a payoff of nothing": ('problem = "hvac"\n[payoff]\n', "pays nothing"),
    "a weight that is none": ('problem = "hvac"\n[payoff]\na_impact = "1"\n', "weight of a_impact is '1'"),
    "traces that are not there": ('problem = "hvac"\ntraces = "weather.csv"\n', "traces = 'weather.csv' is no file"),
    "traces as a number": ('problem = "hvac"\ntraces = 3\n', "traces is '3', but should be a text"),
    "too deep": ('problem = "hvac"\nfields = ' + "{a=" * 80 + "1" + "}" * 80 + "\n", "nested too deeply"),
    "too large": ('problem = "hvac"\n#' + "x" * 2**20, "more than 1048576"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_file_is_refused_in_a_sentence(what: str, tmp_path: Path) -> None:
    text, message = BROKEN[what]
    with pytest.raises((ConfigurationError, DamagedFileError, UnknownNameError), match=message) as raised:
        load_config(house(tmp_path, text))
    assert "house.toml" in str(raised.value)
    assert "\n" not in str(raised.value)


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="cannot be read: No such file"):
        load_config(tmp_path / "nothing.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(DamagedFileError, match="it is no file"):
        load_config(tmp_path / "folder.toml")
    with pytest.raises(ConfigurationError, match=r"must be a file that ends in \.toml"):
        load_config(house(tmp_path, name="house.json"))
    (tmp_path / "bytes.toml").write_bytes(b"problem = '\xff'")
    with pytest.raises(DamagedFileError, match="no text in UTF-8"):
        load_config(tmp_path / "bytes.toml")
    with pytest.raises(ConfigurationError, match="config = 3 must be the path"):
        gymnasium.make("cps_envs/HvacAttack-v0", config=3)


def test_a_file_of_another_problem_or_preset_is_refused(tmp_path: Path) -> None:
    path = house(tmp_path)
    with pytest.raises(ConfigurationError, match="for the problem 'hvac', not for 'rogue'"):
        gymnasium.make("cps_envs/RogueAttack-v0", config=path)
    with pytest.raises(ConfigurationError, match="the preset 'hard', and 'easy' is asked for"):
        gymnasium.make("cps_envs/HvacAttack-v0", config=path, preset="easy")


def test_weights_of_an_unknown_metric_are_refused_at_make(tmp_path: Path) -> None:
    path = house(tmp_path, 'problem = "hvac"\n[payoff]\na_impct = 1.0\n')
    with pytest.raises(ConfigurationError, match=r"no metric 'a_impct'.*'a_impact'"):
        gymnasium.make("cps_envs/HvacAttack-v0", config=path)


def test_load_config_is_public() -> None:
    assert "load_config" in cps_envs.__all__
