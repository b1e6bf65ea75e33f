"""Cards as Markdown: their header is what hubs read, their block runs, and they list what was used."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from cps_agents.zoo.card import Card, read_card
from cps_agents.zoo.files import find, shipped_names
from cps_agents.zoo.markdown import to_markdown
from tests.test_pages import parse, run_command
from tests.test_words import private

ROOT = Path(__file__).parents[2]
EACH_CARD = pytest.mark.parametrize("name", shipped_names())


def printed(name: str) -> tuple[Card, str]:
    card = read_card(find(name))
    return card, to_markdown(card)


def block(text: str) -> list[str]:
    return [line.removeprefix("$ ") for line in text.partition("```console\n")[2].partition("```")[0].splitlines()]


def header(text: str) -> dict[str, Any]:
    """The front matter. Its lists are written as JSON, which is YAML, too."""
    lines = [line.partition(": ") for line in text.split("---\n")[1].splitlines()]
    return {name: json.loads(value) if value.startswith("[") else value for name, _, value in lines}


@EACH_CARD
def test_the_header_names_task_and_result(name: str) -> None:
    card, text = printed(name)
    head = header(text)
    (model,) = head["model-index"]
    (result,) = model["results"]
    assert (head["pipeline_tag"], head["library_name"], model["name"]) == ("reinforcement-learning", "cps-envs", name)
    assert result["task"]["type"] == "reinforcement-learning"
    assert result["metrics"][0]["value"] == card.seeds[str(card.best)]["validation"]


@EACH_CARD
def test_the_block_is_installed_and_read_as_printed(name: str) -> None:
    install, *plays = block(printed(name)[1])
    extras = re.fullmatch(r'pip install "cps-envs\[(.*)\]"', install)
    assert extras
    assert set(extras[1].split(",")) == {"cli", "baselines"}  # the command line, and the opponents
    assert len(plays) == 2
    for line in plays:
        parse(shlex.split(line)[1:], line)


def test_the_block_runs(tmp_path: Path) -> None:
    for line in block(printed("rogue-attack")[1])[1:]:
        run_command(tmp_path, f"{line} --set duration_s=5")


@EACH_CARD
def test_a_card_lists_what_was_used_in_the_words_of_the_field(name: str) -> None:
    card, text = printed(name)
    knobs = json.loads(text.rpartition("```json\n")[2].partition("```")[0])
    assert set(knobs) < set(card.recipe)
    assert all(knobs.values())
    assert not {"population", "buffer_size", "scenes"} & set(knobs)
    assert "stable-baselines3" not in text
    assert "osqp" not in text or card.problem == "disbanding"
    assert not private(text)
