"""A film of the documentation shows what its caption says."""

from __future__ import annotations

from pathlib import Path

import pytest

from cps_envs import find_problem
from cps_envs.core.game.play import play_episodes
from tools.films import FILMS


@pytest.mark.parametrize("problem", FILMS)
def test_the_filmed_episode_is_what_its_caption_says(problem: str) -> None:
    film, found = FILMS[problem], find_problem(problem)
    changes = {name: float(value) for name, _, value in (change.partition("=") for change in film.changes)}
    players = {"attacker": film.attacker, "defender": film.defender}
    metrics = play_episodes(found, found.config(film.preset, changes), players, [film.seed])
    for name, (least, most) in film.holds.items():
        assert least <= metrics[name][0] <= most, name
    assert f"![{film.caption}](images/{problem}.gif)" in Path(f"docs/{problem}.md").read_text(encoding="utf-8")
