"""Playing an entry of the leaderboard, every episode of it, and writing what it reached."""

from __future__ import annotations

import json
import os
import secrets
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from cps_agents.arena.play import silent
from cps_agents.errors import CommandError
from cps_agents.scoring.apart import played_apart
from cps_agents.scoring.frozen import TOLERANCE, Frozen, read_frozen, rounded
from cps_agents.scoring.kind import ADVISED, CODE, SCRATCH, Kind
from cps_agents.scoring.playing import Report, answers, seeds_of
from cps_agents.scoring.results import write_result
from cps_agents.scoring.score import FRESH, Score, scored
from cps_agents.scoring.submission import CODE as CODE_FORM
from cps_agents.scoring.submission import NETWORK, REGISTERED, RESULT, Submission, read_submission
from cps_agents.zoo.code import hash_of
from cps_agents.zoo.files import find, starts_of
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.policies.lookup import parsed
from cps_envs.registration import find_problem

AGAIN = 16  # episodes against each opponent that code plays a second time
SAME = 0.95  # of them have to end alike
SURELY = 3.0  # standard errors by which nobody is worse in fresh episodes by chance
Said = Callable[[str], None]


def verify(folder: Path, report: Report = silent, say: Said = silent) -> Score:
    """Play an entry, all of its episodes, and write `result.json` in its folder, whatever was there.

    A network also plays as its wiring did before any training, and as many fresh episodes. Code plays fresh ones only,
    in a process of its own, and some of them twice.

    Raises:
        CommandError: it is no entry, plays otherwise when it plays again, or was trained on the episodes of the
            leaderboard.
        UnknownNameError: there is no such track or policy.
        ValueError: a file is damaged, or the policy fails.
    """
    submission = read_submission(folder)
    frozen = read_frozen(submission.track)
    frozen.check_game()
    if submission.form == CODE_FORM:
        found = _code(submission, frozen, report)
    else:
        found = scored(frozen, submission.policy, "test", report=report)
        if submission.card is not None:
            found = _with_start(found, submission)
        if submission.form == NETWORK:
            found = replace(found, policy=submission.name, sources={"entry": submission.digest})
            say(_compared(found, scored(frozen, submission.policy, FRESH, kind=found.kind, key=secrets.token_hex(16))))
    write_result(submission, found)
    return found


def _with_start(found: Score, submission: Submission) -> Score:
    """The score of a network with what it began with: neutral actions through its adapter, or untrained weights.

    The better of both counts where its file holds untrained weights. A network whose neutral actions are surely above
    score 0 was advised by its adapter, whatever the adapter's name is.
    """
    assert submission.card is not None
    track, adapter = submission.track, str(submission.card.wiring["adapter"])
    spec = find_problem(track.problem).game(track.venue.config, 1).spec(track.role)
    action = json.dumps(np.asarray(adapter_of(spec, adapter).neutral_action).tolist(), separators=(",", ":"))
    neutral = scored(found.frozen, f"always?adapter={adapter}&action={action}", "test", kind=found.kind)
    low = neutral.estimate.low
    if found.kind.name == SCRATCH and low is not None and low > 0:
        found = replace(found, kind=Kind(ADVISED, by=adapter))
    began, tree = [neutral], parsed(submission.policy)
    playing = {int(seed) for seed in ([tree.options["seed"]] if "seed" in tree.options else submission.card.seeds)}
    if playing <= set(starts_of(find(tree.name))):
        untrained = tree.with_option("untrained", "true")
        began.append(scored(found.frozen, untrained, "test", kind=found.kind))
    return replace(found, began=max(began, key=lambda score: score.estimate.mean))


def _compared(found: Score, fresh: Score) -> str:
    """Say what a network reaches in fresh episodes.

    Raises:
        CommandError: surely less than in the known ones.
    """
    off = found.estimate.mean - fresh.estimate.mean
    if off > SURELY * float(np.hypot(_error(found), _error(fresh))):
        raise CommandError(
            f"{found.policy} has {found.estimate.mean:.1f} in the episodes of the leaderboard, and "
            f"{fresh.estimate.mean:.1f} in fresh ones: it knows the former. Train it on training seeds, below 10^9"
        )
    return f"{fresh.estimate.mean:.1f} ± {fresh.half_width:.1f} in fresh episodes"


def _error(score: Score) -> float:
    """The standard error of a score over episodes alone, where its networks stay the same."""
    parts = [(values.var(axis=1, ddof=1) / values.shape[1]).sum() / values.shape[0] ** 2 for values in score.strata]
    return float(np.sqrt(sum(parts))) / len(parts)


def _code(submission: Submission, frozen: Frozen, report: Report) -> Score:
    """The score of code, in episodes that nobody knew when it was handed in.

    Raises:
        CommandError: it plays otherwise in a second run, or has changed files.
        PolicyError: it fails.
    """
    track, key, before = frozen.track, secrets.token_hex(16), _watched(submission)
    seeds, start = seeds_of(track, FRESH, track.episodes, int(key, 16)), os.times()
    paid = [rounded(row) for row in played_apart(track, submission.policy, seeds, secrets.randbits(64), report)]
    spent = sum(after - earlier for after, earlier in zip(os.times()[:4], start[:4], strict=True))
    few = [own[:AGAIN] for own in seeds]
    again = played_apart(track, submission.policy, few, secrets.randbits(64), silent)
    alike = np.mean([np.abs(one[:AGAIN] - two) <= TOLERANCE for one, two in zip(paid, again, strict=True)])
    if alike < SAME:
        raise CommandError(
            f"{submission.name} plays otherwise when it plays again: {alike:.0%} of {sum(map(len, few))} episodes end "
            "alike. Let it decide from the rows of an episode alone, and draw from generators of fixed seeds"
        )
    if _watched(submission) != before:
        raise CommandError(f"{submission.name} has changed files of the leaderboard or of the verifier while it played")
    return Score(
        frozen=replace(frozen, pays={FRESH: [rounded(own) for own in answers(track, seeds)]}),
        split=FRESH,
        policy=submission.name,
        kind=Kind(CODE),
        pays={"": paid},
        sources={"entry": submission.digest},
        cpu_s=spent,
        key=key,
    )


def _watched(submission: Submission) -> list[str]:
    """Hashes of what code at play must leave as it is."""
    folders = submission.folder.parents[1], Path(__file__).parent
    files = [sorted(each for each in folder.rglob("*.*") if each.is_file()) for folder in folders]
    files = [[each for each in own if each.suffix not in (".pyc", ".nbi", ".nbc")] for own in files]
    return [hash_of(own, folder) for own, folder in zip(files, folders, strict=True)]


def changed(since: str, boards: Path) -> list[Path]:
    """The entries below `boards`, a folder of a clone, that a branch has changed since it left another one.

    Entries that have never been played are among them.

    Raises:
        CommandError: git does not know the branch; or somebody's network or code comes with changes of other files,
            which could change how it is judged.
    """
    root = boards.parents[1]
    command = ["git", "diff", "--name-only", "--no-renames", "-z", f"{since}...", "--"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True)
    if done.returncode:
        raise CommandError(f"git cannot compare this branch with {since}: {done.stderr.strip()[:200]}")
    paths = [root / name for name in done.stdout.split("\0") if name]
    inside = [path for path in paths if path.is_relative_to(boards)]
    parts = {path: path.relative_to(boards).parts for path in inside}
    found = sorted({boards.joinpath(*names[:2]) for names in parts.values() if len(names) >= 3})
    found += [
        folder for folder in sorted(boards.glob("*/*/")) if folder not in found and not (folder / RESULT).is_file()
    ]
    found = [folder for folder in found if folder.is_dir()]
    foreign = [folder for folder in found if read_submission(folder).form != REGISTERED]
    others = [path for path in paths if len(parts.get(path, ())) != 3]
    if foreign and others:
        raise CommandError(
            f"{foreign[0].relative_to(root)} comes with a change of {others[0].relative_to(root)}: a branch with a "
            "network or with code of somebody else changes nothing but its folder"
        )
    return found
