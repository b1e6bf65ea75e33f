"""A meeting of two policies: played, shown, and printed metric by metric."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.utils import seeding

from cps_agents.arena.meeting import Meeting
from cps_agents.console import err, out, print_json
from cps_agents.errors import built_by_user
from cps_agents.film import Film, play_shown
from cps_agents.progress import Progress
from cps_agents.table import Table
from cps_envs.core.play import finish
from cps_envs.core.problem import Problem
from cps_envs.core.types import Array, Role
from cps_envs.registration import find_problem

if TYPE_CHECKING:
    from rich.console import Console


def show_meeting(meeting: Meeting, film: Film | None, as_json: bool) -> None:
    """Play a meeting, filming its first episode, and print the metrics."""
    problem, config, seed = find_problem(meeting.problem), meeting.venue.config, meeting.first_seed
    players: dict[Role, str] = {"attacker": meeting.attacker, "defender": meeting.defender}
    outcome, paid = _play(problem, config, players, range(seed, seed + meeting.episodes), film)
    heading = {"problem": problem.name, "preset": meeting.venue.preset, "config": config} | dict(players)
    if as_json:
        print_json(_document(heading, seed, outcome))
    else:
        _print(out(), heading, seed, outcome, paid)


def _play(
    problem: Problem, config: Any, players: Mapping[Role, str], seeds: range, film: Film | None
) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Metrics by name, each (episodes,), and which of them add up to the return."""
    with built_by_user():
        match = problem.match(config, len(seeds), players)
        match.reset(np.ones(len(seeds), np.bool_), [seeding.np_random(seed)[0] for seed in seeds])
        if film is None:
            with err().status("playing; the first time, the physics is compiled, too"):
                payoff = finish(match)
        else:
            total = len(film.stops(match.game))
            with Progress("frames", total) as progress:
                payoff = play_shown(match, film, problem, lambda done, _: progress.update(done))
            err().print(f"Shown: seed {seeds[0]} ({film.target}).", soft_wrap=True)
    metrics = {name: np.array(values) for name, values in match.game.metrics().items()}
    return {"return": payoff, **metrics}, match.game.payoff_parts


def _document(heading: Mapping[str, Any], seed: int, outcome: Mapping[str, Array]) -> dict[str, Any]:
    count = len(outcome["return"])
    episodes = [
        {"seed": seed + b, **{name: values[b].item() for name, values in outcome.items()}} for b in range(count)
    ]
    mean = {name: float(values.mean()) for name, values in outcome.items()}
    return {**heading, "config": asdict(heading["config"]), "episodes": episodes, "mean": mean}


def _print(
    console: Console, heading: Mapping[str, Any], seed: int, outcome: Mapping[str, Array], paid: tuple[str, ...]
) -> None:
    console.print(
        f"[bold]{heading['problem']}[/] (preset {heading['preset']}): "
        f"attacker [bold]{heading['attacker']}[/] against defender [bold]{heading['defender']}[/]"
    )
    count = len(outcome["return"])
    numbers = [(name, *map(_number, values)) for name, values in outcome.items()]
    console.print(Table("", ("Metric", *(f"seed {seed + b}" for b in range(count))), numbers))
    if count > 1:
        rows = [
            (name, *map(_number, (values.mean(), values.std(), values.min(), values.max())))
            for name, values in outcome.items()
        ]
        console.print(Table(f"{count} episodes", ("Metric", "mean", "deviation", "min", "max"), rows))
    console.print(f"The return is what the attacker is paid: {' + '.join(paid)}.")


def _number(value: float) -> str:
    return f"{value:.0f}" if float(value).is_integer() else f"{value:.3f}"
