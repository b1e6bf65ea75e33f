"""Options that commands share, and what they say at their end."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.console import assignments, note
from cps_agents.errors import CommandError
from cps_agents.files import check_writable
from cps_agents.machine import available_cores
from cps_agents.part import WHOLE, Part, parse_part
from cps_envs.core.declare.foreign import ForeignSettingWarning
from cps_envs.core.game.configuration_file import ARGUMENT, with_file
from cps_envs.core.game.problem import Problem
from cps_envs.core.types import ROLES, Role

if TYPE_CHECKING:  # commands that play nothing start without it
    from cps_agents.arena.store import Store
    from cps_agents.workers import Where

MEETINGS = Path("results/meetings")
KEPT = "Keep finished games in this folder, which all commands share."
POLICY = "A name from `cps-envs list`, or name?option=value. Default: the preset's own."
SEVERAL = "A policy's name, zoo:NAME, or `all`: computed and shipped ones. May be repeated."
FRESH = "Play everything again, also what is kept."
Jobs = Annotated[int | None, typer.Option(min=1, help="Use so many processes; default: all cores.")]
CLUSTER = "Work on a Ray cluster, with all of its cores: `auto` on one of its machines, or ray://HOST:10001."
AtCluster = Annotated[str | None, typer.Option("--cluster", metavar="ADDRESS", help=CLUSTER)]
PART = "Do every N-th piece of work, from the I-th on: N such commands share a folder (docs: Many machines)."
OfPart = Annotated[Part | None, typer.Option("--part", metavar="I/N", parser=parse_part, help=PART)]
Preset = Annotated[str | None, typer.Option(help="Start from this preset. Default: learning.")]
Attacker = Annotated[str | None, typer.Option(help=POLICY)]
Defender = Annotated[str | None, typer.Option(help=POLICY)]
Attackers = Annotated[list[str] | None, typer.Option("--attacker", metavar="NAME", help=SEVERAL)]
Defenders = Annotated[list[str] | None, typer.Option("--defender", metavar="NAME", help=SEVERAL)]
Fresh = Annotated[bool, typer.Option("--fresh", help=FRESH)]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Html = Annotated[Path | None, typer.Option(metavar="DIR", help="Also write a page for the browser to this folder.")]
Changes = Annotated[
    list[str] | None, typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated.")
]
CONFIG = "A system of your own, see `list PROBLEM --config`; --set wins over it."
Config = Annotated[Path | None, typer.Option("--config", metavar="FILE.toml", help=CONFIG)]
Knobs = Annotated[
    list[str] | None, typer.Option("--knob", metavar="NAME=VALUE", help="Change a knob; may be repeated.")
]
ORACLE = "By shared-ppo (our own PPO), search (numbers of hand-made policies), or a recipe; may be repeated."
STEPS = "Decisions for each method and training seed, searches included."
BUDGET = "CPU time for each method and training seed; default: 60."
Oracles = Annotated[list[str] | None, typer.Option("--oracle", metavar="NAME", help=ORACLE)]


def whole(text: str) -> int:
    """A positive whole number, also written as 1e6 or 1_000_000.

    Raises:
        typer.BadParameter: it is none.
    """
    with suppress(ValueError):
        number = float(text)
        if number >= 1 and number.is_integer():
            return int(number)
    raise typer.BadParameter(f"{text!r} is not a whole number of at least 1, such as 500000 or 5e5")


Steps = Annotated[int | None, typer.Option(parser=whole, metavar="N", help=STEPS)]
BudgetS = Annotated[float | None, typer.Option("--budget", metavar="SECONDS", min=0.1, help=BUDGET)]


def _able_to_keep(folder: Path) -> Path:
    """A folder in which games can be kept, said before they are played. One that is there may only be read.

    Raises:
        CommandError: nothing can be kept there.
    """
    try:
        if not folder.is_dir():
            check_writable(folder / "meeting.json")
    except OSError as error:
        raise CommandError(
            f"finished games cannot be kept in {folder} ({error.strerror}): name a folder that can be written, with "
            "--meetings DIR or in CPS_ENVS_MEETINGS"
        ) from error
    return folder


Meetings = Annotated[
    Path,
    typer.Option("--meetings", metavar="DIR", envvar="CPS_ENVS_MEETINGS", help=KEPT, callback=_able_to_keep),
]


def workers(jobs: int | None, cluster: str | None) -> Where:
    """Where the work is done: by so many processes, by default as many as there are cores, or by a cluster.

    Raises:
        CommandError: both are asked for, or no cluster answers.
        MissingExtraError: a cluster is asked for, and Ray is not installed.
    """
    if cluster is None:
        return jobs or available_cores()
    if jobs is not None:
        raise CommandError("--jobs counts processes of this machine, and --cluster takes all cores: leave one out")
    from cps_agents.cluster import join

    found = join(cluster)
    note(str(found))
    return found


def kept(folder: Path, *, fresh: bool, part: Part | None = None) -> Store:
    """Where finished meetings are kept.

    Raises:
        CommandError: everything is to be played again, by parts that find each other's meetings there.
    """
    from cps_agents.arena.store import Store

    if fresh and part is not None:
        raise CommandError("--part finds there what other parts have played, and --fresh does not: leave one out")
    return Store(folder, fresh=fresh, part=part or WHOLE)


def role_named(text: str) -> Role:
    """The role of this name.

    Raises:
        CommandError: it is no role.
    """
    found: Role | None = next((role for role in ROLES if role == text), None)
    if found is None:
        raise CommandError(f"{text!r} is not a role: write attacker or defender")
    return found


def described(
    problem: Problem, preset: str | None, config: Path | None, changes: Sequence[str] | None
) -> tuple[str | None, dict[str, Any]]:
    """The preset and the changed fields that a user asks for: those of a configuration file, then those of --set.

    The preset is None where neither the file nor the user names one.

    Raises:
        DamagedFileError: the file is no configuration.
        ConfigurationError: it is for another problem or preset, or a field cannot be right.
        ValueError: a change is not written as FIELD=VALUE.
    """
    chosen, values = with_file(problem, preset, {**assignments(changes or []), ARGUMENT: config})
    for sentence in problem.foreign_to(problem.config(chosen, values)):
        note(f"Note: {sentence}.")
        warnings.filterwarnings("ignore", re.escape(sentence), ForeignSettingWarning)  # once is enough
    return chosen, values


def conclude(files: Sequence[Path], store: Store, *notes: str) -> None:
    """Say what was found finished and what was written."""
    all_of = f"Reused {store.reused} of {store.asked} meetings; --fresh plays them again."
    again = all_of if store.reused else ""
    written = f"Written: {', '.join(map(str, files))}." if files else ""
    if said := " ".join(filter(None, (*notes, again, written))):
        note(said)
