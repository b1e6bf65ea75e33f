"""`cps-envs play`: episodes between two policies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from agents.console import assignments, err, make_table, out, print_json
from agents.errors import built_by_user

if TYPE_CHECKING:
    from rich.console import Console

    from agents.film import Film
    from cps_envs.core.problem import Problem
    from cps_envs.core.types import Array, Role

POLICY = "A name from `cps-envs list`, name?option=value, or module:attribute; the preset's own if left out."
RENDER = "human (a window), or FILE.mp4, FILE.gif (a film), FILE.png (one picture)."


def play(
    problem: Annotated[str, typer.Argument(help="The problem, such as disbanding.")],
    attacker: Annotated[str | None, typer.Option(help=POLICY)] = None,
    defender: Annotated[str | None, typer.Option(help=POLICY)] = None,
    preset: Annotated[str, typer.Option(help="The configuration to start from.")] = "paper",
    overrides: Annotated[
        list[str] | None, typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the first episode; the others count up.")] = 0,
    episodes: Annotated[int, typer.Option(min=1, help="How many, played as one batch.")] = 1,
    render: Annotated[str | None, typer.Option(help=RENDER)] = None,
    fps: Annotated[float, typer.Option(help="Frames per second of a film.")] = 10.0,
    speed: Annotated[float, typer.Option(help="Game seconds per second of film.")] = 10.0,
    at: Annotated[float | None, typer.Option(help="Game second of a picture; the end if left out.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Machine-readable output.")] = False,
) -> None:
    """Play episodes between an attacker and a defender and print their metrics."""
    from agents.film import Film
    from cps_envs import find_problem

    found = find_problem(problem)
    config = found.config(preset, assignments(overrides or []))
    film = Film(render, fps, speed, at) if render is not None else None
    usual = found.opponents[preset]
    players: dict[Role, str] = {
        "attacker": attacker or usual["attacker"],
        "defender": defender or usual["defender"],
    }
    outcome, paid = _play(found, config, players, range(seed, seed + episodes), film)
    heading = {"problem": problem, "preset": preset, "config": config} | dict(players)
    if as_json:
        print_json(_document(heading, seed, outcome))
    else:
        _print(out(), heading, seed, outcome, paid)


def _play(
    problem: Problem, config: Any, players: Mapping[Role, str], seeds: range, film: Film | None
) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Metrics by name, each (episodes,), and which of them add up to the return."""
    import numpy as np
    from gymnasium.utils import seeding

    from agents.film import play_shown
    from agents.progress import Progress
    from cps_envs.core.play import finish

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
            err().print(f"showed seed {seeds[0]} of {len(seeds)} episodes: {film.target}", soft_wrap=True)
    metrics = {name: np.array(values) for name, values in match.game.metrics().items()}
    return {"return": payoff, **metrics}, match.game.payoff_parts


def _document(heading: Mapping[str, Any], seed: int, outcome: Mapping[str, Array]) -> dict[str, Any]:
    from dataclasses import asdict

    count = len(outcome["return"])
    episodes = [
        {"seed": seed + lane, **{name: values[lane].item() for name, values in outcome.items()}}
        for lane in range(count)
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
    width = max((console.width - 32) // 11, 1)  # episodes beside each other
    for first in range(0, count, width):
        lanes = range(first, min(first + width, count))
        rows = [(name, *(_number(values[lane]) for lane in lanes)) for name, values in outcome.items()]
        console.print(make_table("", ("Metric", *(f"seed {seed + lane}" for lane in lanes)), rows))
    if count > 1:
        rows = [
            (name, *map(_number, (values.mean(), values.std(), values.min(), values.max())))
            for name, values in outcome.items()
        ]
        console.print(make_table(f"{count} episodes", ("Metric", "mean", "deviation", "min", "max"), rows))
    console.print(f"The return is what the attacker is paid: {' + '.join(paid)}.")


def _number(value: float) -> str:
    return f"{value:.0f}" if float(value).is_integer() else f"{value:.3f}"
