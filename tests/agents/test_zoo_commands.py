"""The command in the card of every shipped network is one of today, as `make train` runs it."""

from __future__ import annotations

import re
import shlex

import pytest

from cps_agents.recipes.finding import RECIPES
from cps_agents.zoo.card import SHIPPED, read_card
from cps_agents.zoo.files import shipped_names
from cps_envs import PROBLEMS
from tests.test_pages import parse


@pytest.mark.parametrize("name", shipped_names())
def test_a_card_names_the_command_that_made_it(name: str) -> None:
    path = SHIPPED / f"{name}.json"
    command = read_card(path).command
    assert re.findall(r'^  "command": "(cps-envs .*)",$', path.read_text(encoding="utf-8"), re.MULTILINE) == [command]
    _, word, target, *options = shlex.split(command)
    parse([word, target, *options, "--resume", "--out", "runs"], command)
    if word == "train":
        assert target == name
        assert target in RECIPES
        assert options[:2] == ["--seeds", "5"]
    else:
        assert (word, target in PROBLEMS) == ("self-play", True)
