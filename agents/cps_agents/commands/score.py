"""`cps-envs score`: a policy's number in a track, that others can compare with theirs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from cps_agents.commands.options import AsJson, AtCluster, Jobs, workers
from cps_agents.console import note, out, print_json
from cps_agents.errors import CommandError
from cps_agents.progress import Progress
from cps_agents.scoring.board import FOLDER, agreement, rank_line, table
from cps_agents.scoring.board import board as ranked
from cps_agents.scoring.results import read_score
from cps_agents.scoring.score import Score, score
from cps_agents.scoring.submission import CODE, Submission, read_submission
from cps_agents.scoring.tracks import find_track, tracks
from cps_agents.scoring.verify import changed
from cps_agents.scoring.verify import verify as play
from cps_envs.core.policies.trust import require_trust


class Scores(TyperGroup):
    """Commands of `cps-envs score`. Words that begin with none of them are a track and a policy to score."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command of the first word."""
        return super().resolve_command(ctx, args if args[0] in self.commands else ["policy", *args])


app = typer.Typer(
    cls=Scores, no_args_is_help=True, help="Score a policy in a track: `cps-envs score rogue-attack POLICY`."
)


@app.command("policy")
def score_policy(
    track: Annotated[str, typer.Argument(help="Such as rogue-attack; `cps-envs score board` lists them.")],
    policy: Annotated[str, typer.Argument(help="Reference, such as sb3:model.zip, zoo:runs/mine or tracker.")],
    dev: Annotated[bool, typer.Option("--dev", help="A quick look on other seeds; not to be cited.")] = False,
    jobs: Jobs = None,
    cluster: AtCluster = None,
    as_json: AsJson = False,
) -> None:
    """Play a policy against the panel of a track: one line to cite, and its rank."""
    found = find_track(track)
    total = found.episodes * len(found.panel) // (8 if dev else 1)
    where = workers(jobs, cluster)
    with Progress("episodes", total) as progress:
        scored = score(track, policy, split="dev" if dev else "test", report=progress.update, workers=where)
        progress.update(total)
    if as_json:
        print_json(scored.to_json())
    else:
        _show(scored)


def _show(scored: Score) -> None:
    out().print(scored.line, soft_wrap=True)
    for name, value in scored.opponents.items():
        out().print(f"  {name}: {value:.0f}", soft_wrap=True)
    out().print(f"Kind: {scored.kind}.", soft_wrap=True)
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
    first: Annotated[Path, typer.Argument(help="Folder of an entry that was played.")],
    second: Annotated[Path, typer.Argument(help="Another one of the same track.")],
) -> None:
    """Say how far two entries are apart, in pairs on the same episodes, without playing."""
    one, two = read_score(first), read_score(second)
    found = one.minus(two)
    assert found.low is not None
    verdict = "surely different" if found.excludes_zero else "not surely different"
    out().print(f"{first}: {one.line}\n{second}: {two.line}", soft_wrap=True)
    out().print(f"difference {found.mean:+.1f} ({found.low:+.1f} to {found.high:+.1f}): {verdict}", soft_wrap=True)


@app.command()
def verify(
    folder: Annotated[
        list[Path] | None, typer.Argument(help="Entries, such as leaderboard/v1/rogue-attack/mine.")
    ] = None,
    since: Annotated[
        str | None, typer.Option(metavar="BRANCH", help="Those that this branch has changed since it left BRANCH.")
    ] = None,
) -> None:
    """Play entries of the leaderboard, all episodes, and write their `result.json`."""
    if bool(folder) == (since is not None):
        raise CommandError("name entries, such as leaderboard/v1/rogue-attack/mine, or --since BRANCH")
    folders = list(folder or ()) if since is None else changed(since, FOLDER)
    submissions = [read_submission(each) for each in folders]  # all of them, before any plays
    for each in submissions:
        if each.form == CODE:
            require_trust(str(each.folder / "policy.py"))
    for each in submissions:
        found = _verified(each)
        began = "" if found.began is None else f", began at {found.began.estimate.mean:.1f}"
        out().print(f"{each.folder}: {found.line}; {found.kind}{began}", soft_wrap=True)
    if not submissions:
        note("No entry has changed.")


def _verified(submission: Submission) -> Score:
    track = submission.track
    with Progress(f"episodes of {submission.name}", track.episodes * len(track.panel)) as progress:
        return play(submission.folder, progress.update, lambda line: note(f"  {line}"))
