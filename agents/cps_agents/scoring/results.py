"""What the verifier found out about an entry: `result.json` in its folder, which only the verifier writes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.files import write_json
from cps_agents.scoring.frozen import Frozen, read_frozen, read_pays, texts
from cps_agents.scoring.kind import ADVISED, CODE, KINDS, MOST_NUMBERS, SEARCHED, Kind
from cps_agents.scoring.score import FRESH, Score
from cps_agents.scoring.submission import CODE as CODE_FORM
from cps_agents.scoring.submission import RESULT, Submission, read_submission
from cps_agents.scoring.tracks import CHALLENGE
from cps_envs.core.documents import Entry, read_entry

REMEDY = "Only the verifier writes it: run `make verify`."
STATED = 0.02  # rounding of a stated number
HIDDEN = ("policy", "track")  # what the folder itself tells


def write_result(submission: Submission, score: Score) -> Path:
    """Write what was played in the folder of its entry; returns the path."""
    path, began = submission.folder / RESULT, score.began
    content: dict[str, Any] = {name: value for name, value in score.to_json().items() if name not in HIDDEN}
    content = {"entry": submission.digest, **content}
    if began is not None:
        content["began_pays"] = {seed: texts(rows) for seed, rows in began.pays.items()}
    if score.split == FRESH:
        content |= {"key": score.key, "answers": texts(score.frozen.pays[FRESH])}
    write_json(path, content)
    return path


def read_score(path: Path) -> Score:
    """The score of an entry: its folder, or the `result.json` inside.

    Raises:
        DamagedFileError: the result is no such file, or its numbers are not those of its own pays.
        CommandError: there is none, it is of another version of the challenge, or the entry has changed since.
        UnknownNameError: there is no such track.
        OSError: it cannot be read.
    """
    folder = path.parent if path.name == RESULT else path
    if not (folder / RESULT).is_file():
        raise CommandError(f"{folder} has no {RESULT}: it is no entry that the verifier has played (`make verify`)")
    submission = read_submission(folder)
    document = read_entry(folder / RESULT, "result of `cps-envs score verify`", REMEDY)
    if document["entry"].text() != submission.digest:
        raise CommandError(f"{folder} has changed since it was played: run `make verify`")
    document["challenge"].text([CHALLENGE])
    frozen = read_frozen(submission.track)
    if document["digest"].text() != frozen.digest:
        raise CommandError(
            f"{folder} was played in another version of {CHALLENGE} {frozen.track.name}, digest "
            f"{document['digest'].text()} instead of {frozen.digest}: run `make verify`"
        )
    found = _score(document, submission, frozen)
    stated = {name: value.number() for name, value in document["opponents"].entries().items()}
    own = found.opponents
    same = stated.keys() == own.keys() and all(abs(stated[name] - own[name]) <= STATED for name in own)
    same &= abs(document["score"].number() - found.estimate.mean) <= STATED
    if not same or document["line"].text() != found.line:
        raise document.source.error("its line or its scores are not those of its own pays")
    return found


def _score(document: Entry, submission: Submission, frozen: Frozen) -> Score:
    split = document["split"].text([FRESH if submission.form == CODE_FORM else "test"])
    episodes = frozen.track.episodes
    if split == FRESH:
        frozen = replace(frozen, pays={FRESH: read_pays(frozen.track, document["answers"], episodes)})
    kind = document["kind"]
    name = kind["name"].text([CODE] if split == FRESH else [each for each in KINDS if each != CODE])
    by = kind["by"].text()
    if (name == ADVISED) != bool(by):
        raise kind.error("an adviser where a network is advised, and none elsewhere")
    numbers = kind["numbers"].whole(int(name == SEARCHED), MOST_NUMBERS * (name == SEARCHED))
    found = Score(
        frozen=frozen,
        split=split,
        policy=submission.policy if split == "test" else f"{submission.name}/policy.py",
        kind=Kind(name, by, numbers),
        pays=_pays(document["pays"], frozen),
        sources={name: value.text() for name, value in document["sources"].entries().items()},
        cpu_s=document["cpu_s"].number(0),
        versions={name: value.text() for name, value in document["versions"].entries().items()},
        key=document["key"].text() if split == FRESH else "",
    )
    if (began := document.get("began_pays")) is None:
        return found
    return replace(found, began=replace(found, pays=_pays(began, frozen)))


def _pays(entry: Entry, frozen: Frozen) -> dict[str, Any]:
    kept = entry.entries()
    if not kept:
        raise entry.error("pays of at least one training seed")
    count = frozen.track.episodes // len(kept)  # training seeds divide the episodes
    return {seed: read_pays(frozen.track, rows, count) for seed, rows in kept.items()}
