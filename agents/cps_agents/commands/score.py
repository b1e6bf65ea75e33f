"""`cps-envs score`: a policy's number in a track, that others can compare with theirs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from cps_agents.commands.options import AsJson, AtCluster, Jobs, workers
from cps_agents.console import note, out, print_json
from cps_agents.files import check_writable, write_json
from cps_agents.progress import Progress
from cps_agents.scoring.board import agreement, rank_line, table
from cps_agents.scoring.board import board as ranked
from cps_agents.scoring.kind import Kind
from cps_agents.scoring.score import Score, score
from cps_agents.scoring.tracks import find_track, tracks
from cps_agents.scoring.verify import read_score
from cps_agents.scoring.verify import verify as check


class Scores(TyperGroup):
    """Commands of `cps-envs score`. Words that begin with none of them are a track and a policy to score."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command of the first word."""
        return super().resolve_command(ctx, args if args[0] in self.commands else ["policy", *args])


app = typer.Typer(
    cls=Scores, no_args_is_help=True, help="Score a policy in a track: `cps-envs score rogue-attack POLICY`."
)
Kinds = Annotated[str | None, typer.Option(help="What made it: reward, imitation, searched, rules or told.")]


@app.command("policy")
def score_policy(
    track: Annotated[str, typer.Argument(help="Such as rogue-attack; `cps-envs score board` lists them.")],
    policy: Annotated[str, typer.Argument(help="Reference, such as sb3:model.zip, zoo:runs/mine or tracker.")],
    dev: Annotated[bool, typer.Option("--dev", help="A quick look on other seeds; not to be cited.")] = False,
    kind: Kinds = None,
    numbers: Annotated[int, typer.Option(min=0, help="How many numbers were searched.")] = 0,
    to: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.json", help="Write the score with all pays here.")
    ] = None,
    jobs: Jobs = None,
    cluster: AtCluster = None,
    as_json: AsJson = False,
) -> None:
    """Play a policy against the panel of a track and print one line to cite, and its rank."""
    found = find_track(track)
    total = found.episodes * len(found.panel) // (8 if dev else 1)
    made = Kind(kind or "searched", numbers) if kind or numbers else None
    if to is not None:
        check_writable(to)
    where = workers(jobs, cluster)
    with Progress("episodes", total) as progress:
        scored = score(track, policy, split="dev" if dev else "test", kind=made, report=progress.update, workers=where)
        progress.update(total)
    try:
        if to is not None:
            write_json(to, scored.to_json())
    finally:  # what was played is printed, also where the disk is full
        if as_json:
            print_json(scored.to_json())
        else:
            _show(scored)
    if to is not None:
        note(f"Written: {to}")


def _show(scored: Score) -> None:
    out().print(scored.line, soft_wrap=True)
    for name, value in scored.opponents.items():
        out().print(f"  {name}: {value:.0f}", soft_wrap=True)
    if line := rank_line(scored):
        out().print(line, soft_wrap=True)
    out().print(f"Took {scored.cpu_s:.0f} CPU s.")


@app.command()
def board(
    track: Annotated[list[str] | None, typer.Argument(help="Tracks such as rogue-attack; default: all eight.")] = None,
) -> None:
    """Show who leads in each track."""
    for found in map(find_track, track or tracks()):
        rows = ranked(found)
        out().print(table(found, rows))
        if alike := agreement(rows):
            out().print(str(alike), soft_wrap=True)


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(help="A score that `--out` wrote.")],
    second: Annotated[Path, typer.Argument(help="Another one of the same track.")],
) -> None:
    """Say how far two scores are apart, in pairs on the same episodes, without playing."""
    one, two = read_score(first), read_score(second)
    found = one.minus(two)
    assert found.low is not None
    verdict = "surely different" if found.excludes_zero else "not surely different"
    out().print(f"{first}: {one.line}\n{second}: {two.line}", soft_wrap=True)
    out().print(f"difference {found.mean:+.1f} ({found.low:+.1f} to {found.high:+.1f}): {verdict}", soft_wrap=True)


@app.command()
def verify(
    file: Annotated[list[Path], typer.Argument(help="Scores that `--out` wrote.")],
    audit: Annotated[bool, typer.Option("--audit", help="Play fresh seeds, too.")] = False,
    draw: Annotated[int | None, typer.Option(min=0, max=99_999, help="Which fresh seeds; default: any.")] = None,
) -> None:
    """Check that files hold scores that their policies reach."""
    for path in file:
        found = check(path, audit=audit, draw=draw, say=lambda line: note(f"  {line}"))
        out().print(f"{path}: {found.line}", soft_wrap=True)
