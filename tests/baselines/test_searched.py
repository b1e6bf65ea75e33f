"""Policies with numbers that a search found: which numbers they have, and what they play with them."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import numpy as np
import pytest

from cps_baselines.family import Family, find_family, play_family
from cps_baselines.searched import searched
from cps_envs import PROBLEMS
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.types import other
from tests.episodes import spec_of

SHORT: dict[str, dict[str, Any]] = {
    "disbanding": {"num_platoons": 3, "vehicles_per_platoon": 3, "duration_s": 30.0},
    "fdi": {},
    "hvac": {"num_steps": 260, "onset_step": 210},
}
KEPT = {
    (problem, name): entry
    for problem in SHORT
    for name, entry in json.loads(
        files(f"cps_baselines.{problem}").joinpath("searched.json").read_text(encoding="utf-8")
    ).items()
}
OPTIONS = {f"cacc_{told}": f"cacc?told={told}" for told in ("broadcast", "radio", "robots")}  # of one policy
RIVALS = {
    "disbanding": {"defender": "lead"},
    "fdi": {"attacker": "cusum", "defender": "tracker"},
    "hvac": {"attacker": "largest", "defender": "tracker"},
}


FAMILIES = {
    "cacc": "disbanding-local",
    "cacc_broadcast": "disbanding-broadcast",
    "cacc_radio": "disbanding-radio",
    "cacc_robots": "disbanding-broadcast",
    "hypotheses": "fdi-hypotheses",
    "task_tracker": "fdi-task-tracker",
    "bayes": "hvac-bayes-together",
    "warm_tracker": "hvac-tracker-warm",
}


def family_of(name: str) -> Family:
    """What the numbers of a policy belong to."""
    return find_family(FAMILIES[name])


def preset_of(name: str) -> str:
    """A preset that the policy can play."""
    return "learning" if find_family(FAMILIES[name]).problem in ("fdi", "hvac") or name == "cacc_radio" else "paper"


@pytest.mark.parametrize(("problem", "name"), KEPT)
def test_a_policy_plays_its_family_by_the_searched_numbers(problem: str, name: str) -> None:
    numbers, family, found = searched(problem, name), family_of(name), PROBLEMS[problem]
    config = found.config(preset_of(name), SHORT[problem])
    assert tuple(numbers) == family.names
    rival = RIVALS[problem][family.role]
    players: Any = {family.role: OPTIONS.get(name, name), other(family.role): rival}
    expected = play_family(family, found, config, rival, family.row(numbers), [3])["return"]
    assert play_episodes(found, config, players, [3])["return"] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("problem", "name"), KEPT)
def test_untrained_it_plays_what_the_search_began_with(problem: str, name: str) -> None:
    family, reference = family_of(name), OPTIONS.get(name, name)
    spec = spec_of(PROBLEMS[problem], family.role, preset_of(name), **SHORT[problem])
    joint = "&" if "?" in reference else "?"
    start, begun = resolve_policy(f"{reference}{joint}untrained=true", spec), family.build(spec, family.row({}))
    mine, expected = (vars(each) for each in (start, begun))
    assert mine.keys() - {"searched_numbers"} == expected.keys() - {"searched_numbers"}
    for attribute, value in expected.items():
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(mine[attribute], value)


@pytest.mark.parametrize("entry", KEPT.values(), ids=map("-".join, KEPT))
def test_searched_numbers_say_what_searched_them(entry: dict[str, Any]) -> None:
    for each in [entry, *filter(None, [entry.get("then")])]:
        assert each["command"].split()[0] in ("cps-envs", "python")
        assert len(each["commit"]) == 12


def test_each_number_is_an_option() -> None:
    spec = spec_of(PROBLEMS["hvac"], "defender", "learning")
    resolve_policy("bayes?together=0.5", spec)
    for reference, message in (
        ("bayes?togeher=0.5", "no number 'togeher'. Did you mean 'together'"),
        ("bayes?together=much", "must be a number"),
        ("bayes?heat_w=-1", "have to be positive"),
    ):
        with pytest.raises(ConfigurationError, match=message):
            resolve_policy(reference, spec)
    with pytest.raises(ConfigurationError, match="told = 'all' is not known"):
        resolve_policy("cacc?told=all", spec_of(PROBLEMS["disbanding"], "defender", "easy"))
