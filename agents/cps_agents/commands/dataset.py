"""`cps-envs dataset`: episodes between two policies in Minari's format."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

from cps_agents.commands.options import AsJson, Attacker, Changes, Config, Defender, Preset, described
from cps_agents.console import err, note, print_json
from cps_agents.datasets import dataset_name, write_dataset
from cps_envs import find_problem
from cps_envs.core.declare.seeds import TRAINING_START
from cps_envs.core.types import Role


class RecordedRole(str, Enum):
    """The role whose experience is recorded."""

    attacker = "attacker"
    defender = "defender"


def dataset(
    problem: Annotated[str, typer.Argument(help="Problem, such as fdi.")],
    role: Annotated[RecordedRole, typer.Option(help="Keep this role's observations, actions and rewards.")],
    attacker: Attacker = None,
    defender: Defender = None,
    preset: Preset = None,
    config: Config = None,
    overrides: Changes = None,
    episodes: Annotated[int, typer.Option(min=1, max=10_000_000, help="Record so many episodes.")] = 100,
    seed: Annotated[
        int, typer.Option(min=TRAINING_START, max=900_000_000, help="Seed of the first episode; the others count up.")
    ] = 10_000_000,
    name: Annotated[
        str | None,
        typer.Option("--id", help="Name of the dataset; default: from preset, policies and a hash of all settings."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Record episodes of two policies as a dataset for offline learning.

    Minari keeps it in ~/.minari/datasets, or where the variable MINARI_DATASETS_PATH says. Read it with
    minari.load_dataset(ID). Evaluations and scores never use the seeds of these episodes.
    """
    found = find_problem(problem)
    chosen, changes = described(found, preset, config, overrides)
    preset = chosen or found.usual_preset
    usual = found.opponents.get(preset, {})
    players: dict[Role, str] = {
        "attacker": attacker or usual["attacker"],
        "defender": defender or usual["defender"],
    }
    side: Role = "attacker" if role is RecordedRole.attacker else "defender"
    dataset_id = name or dataset_name(found, preset, changes, side, players, range(seed, seed + episodes))
    with err().status(f"playing {episodes} episodes"):
        made = write_dataset(found, side, players, preset, changes, range(seed, seed + episodes), dataset_id)
    steps = int(made.total_steps)
    if as_json:
        print_json({"id": dataset_id, "episodes": episodes, "steps": steps, "players": players, "preset": preset})
    else:
        note(f"Written: {dataset_id}, {episodes} episodes, {steps:,} steps. minari.load_dataset({dataset_id!r})")
