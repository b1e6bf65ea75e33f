"""The leaderboard: every entry of `leaderboard/VERSION` that the verifier has played, in order, as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

import numpy as np

from cps_agents.scoring.exploits import Exploit, read_exploits
from cps_agents.scoring.kind import ADVISED, HAND_SET, PRIVILEGED, SCRATCH, SEARCHED
from cps_agents.scoring.results import read_score
from cps_agents.scoring.score import SEEDS, Score
from cps_agents.scoring.submission import RESULT, read_submission
from cps_agents.scoring.tracks import CHALLENGE, Track, tracks
from cps_agents.sheet import Sheet
from cps_agents.zoo.files import shipped_names
from cps_envs.core.policies.lookup import NEED_OPTIONS, load, parsed, policy_entry, policy_names
from cps_envs.core.policies.policy import setting_of
from cps_envs.core.types import SIGN, BoolArray, FloatArray

VERSION = CHALLENGE.rpartition("-")[2]  # such as v1
FOLDER = Path(__file__).parents[3] / "leaderboard" / VERSION  # of a clone; an installed package has none
HEAD = ("policy", "kind", "rank", "return as score", "began at", "training added", "worst opponent", "best response")
FRONT = {  # columns of the front table, and the kinds in each
    "hand-set": (HAND_SET,),
    "tuned by search": (SEARCHED,),
    "network from scratch": (SCRATCH,),
    "network advised": (ADVISED,),
    "privileged": (PRIVILEGED,),
}
NONE_YET = "none yet"
NOT_SEARCHED = "-"  # for a best response
HALVINGS = 200  # of the episodes, at random
SURE = 1.96  # standard errors of a difference that is no chance


@dataclass(frozen=True)
class BoardEntry:
    """An entry of a board."""

    name: str  # of the folder
    score: Score
    rank: int  # within its ladder; entries that are not surely different share one; 0: privileged, without a rank
    exploits: Mapping[str, Exploit] = field(default_factory=dict)  # best responses by training seed; "": to the entry

    @property
    def worst(self) -> tuple[str, Exploit] | None:
        """The best response that does most to the entry, with its training seed; None if nobody has looked."""
        sign = SIGN[self.score.frozen.track.role]
        return min(self.exploits.items(), key=lambda item: sign * item[1].pay.mean, default=None)


def entries(track: Track, folder: Path | None = None) -> dict[str, Score]:
    """The scores of a track by the names of their folders in `FOLDER` or another one, the best first.

    Raises:
        CommandError: an entry has changed since it was played, or is none.
        DamagedFileError: a file is damaged.
    """
    found = {
        path.parent.name: read_score(path) for path in sorted(((folder or FOLDER) / track.name).glob(f"*/{RESULT}"))
    }
    return dict(sorted(found.items(), key=lambda item: -item[1].estimate.mean))


def board(track: Track, folder: Path | None = None) -> list[BoardEntry]:
    """The rows of a track. Each ladder has ranks of its own, which count those who are surely better.

    A rank is shared with its first: all that are not surely worse than it.
    """
    rows: list[BoardEntry] = []
    leaders: dict[str, tuple[Score, int]] = {}  # of the present rank of each ladder
    counts: dict[str, int] = {}
    known = read_exploits(folder or FOLDER).get(track.name, {})
    for name, score in entries(track, folder).items():
        responses = _responses(name, score, known)
        ladder, rank = score.kind.ladder, 0
        if ladder:
            counts[ladder] = counts.get(ladder, 0) + 1
            leader, rank = leaders.get(ladder, (None, 0))
            if leader is None or leader.minus(score).excludes_zero:
                rank = counts[ladder]
                leaders[ladder] = score, rank
        rows.append(BoardEntry(name, score, rank, responses))
    return rows


def _responses(name: str, score: Score, known: Mapping[str, Exploit]) -> dict[str, Exploit]:
    """The best responses to an entry, and to its training seeds one by one: `NAME` and `NAME?seed=SEED`."""
    found = {"": known[name]} if name in known and known[name].fits(score) else {}
    for seed in filter(None, score.pays):
        exploit = known.get(f"{name}?seed={seed}")
        if exploit is not None and exploit.fits(score, int(seed)):
            found[seed] = exploit
    return found


def missing(track: Track, folder: Path | None = None) -> list[str]:
    """The policies of a role that this package ships, and that are no entry of its board: their references."""
    below = ((folder or FOLDER) / track.name).glob("*/entry.json")
    there = {parsed(each.policy).title for each in (read_submission(path.parent) for path in below)}
    named = policy_names(track.problem, track.role)
    entered = [name for name in named if name not in NEED_OPTIONS and not _elsewhere(track, name)]
    networks = [name for name in shipped_names() if name.startswith(track.name)]
    return [each for each in (*entered, *(f"zoo:{name}" for name in networks)) if each not in there]


def _elsewhere(track: Track, name: str) -> bool:
    """Whether a policy says that it plays in other settings than a track's."""
    entry = policy_entry(track.problem, track.role, name)
    return entry is not None and bool(setting_of(load(entry)))


@dataclass(frozen=True)
class Agreement:
    """How alike two disjoint halves of the episodes rank the entries above 0: Kendall's tau, mean over `HALVINGS`.

    `by_rank` is tau-b: entries share a rank in a half where their difference there, in pairs, may be chance. `by_mean`
    also counts the order of such entries.
    """

    entries: int
    by_rank: float
    by_mean: float

    def __str__(self) -> str:
        return (
            f"Two halves of the episodes rank the {self.entries} entries above 0 alike: tau-b {self.by_rank:.2f}, or "
            f"{self.by_mean:.2f} where none share a rank."
        )


def agreement(rows: Sequence[BoardEntry]) -> Agreement | None:
    """How alike two halves of the episodes rank a board; None where all above 0 may be level."""
    above = [row for row in rows if row.rank and row.score.split == "test" and row.score.estimate.mean > 0]
    if not above or not above[0].score.minus(above[-1].score).excludes_zero:
        return None
    pairs = np.array(list(combinations(range(len(above)), 2)))
    every = [[values.ravel() for values in row.score.strata] for row in above]  # training seeds divide the episodes
    count = min(len(values) for strata in every for values in strata)
    paid = np.array([[values[:count] for values in strata] for strata in every])  # (entries, opponents, episodes)
    differences = paid[pairs[:, 0]] - paid[pairs[:, 1]]
    generator, by_rank, by_mean = np.random.default_rng(0), [], []
    for _ in range(HALVINGS):
        mixed = generator.permuted(np.broadcast_to(np.arange(count), paid.shape[1:]), axis=1)[np.newaxis]
        halves = (mixed[:, :, : count // 2], mixed[:, :, count // 2 :])
        (one, sure), (two, surely) = (_order(np.take_along_axis(differences, half, axis=2)) for half in halves)
        told_apart = np.sqrt(sure.sum() * surely.sum())
        by_rank.append((one * two)[sure & surely].sum() / told_apart if told_apart else np.nan)
        by_mean.append((one * two).mean())
    return Agreement(len(above), float(np.nanmean(by_rank)), float(np.mean(by_mean)))


def _order(differences: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Of pairs with differences (pairs, opponents, episodes): who is better, 1 or -1, and whether that is no chance."""
    mean = differences.mean(axis=(1, 2))
    error = np.sqrt((differences.var(axis=2, ddof=1) / differences.shape[2]).sum(axis=1)) / differences.shape[1]
    return np.sign(mean), np.abs(mean) > SURE * error


def rank_line(score: Score, folder: Path | None = None) -> str:
    """Where a score stands on the leaderboard; empty where there is none."""
    if score.split != "test":
        return ""
    if not score.kind.ranked:
        return "Without a rank: it is privileged, told more than its role observes."
    ladder = score.kind.ladder
    others = [row.score for row in board(score.frozen.track, folder) if row.score.kind.ladder == ladder]
    if not others:
        return f"The leaderboard has no {ladder} yet."
    better = sum(each.minus(score).excludes_zero and each.estimate.mean > score.estimate.mean for each in others)
    count = {0: "none is", 1: "one is"}.get(better, f"{better} are")
    return f"Rank {better + 1} of its kind, {ladder}: of {len(others)} on the leaderboard {count} surely better."


def table(track: Track, rows: Sequence[BoardEntry]) -> Sheet:
    """A board."""
    return Sheet(track.name, HEAD, [_cells(row) for row in rows])


def _cells(row: BoardEntry) -> tuple[str, ...]:
    score, found, added = row.score, row.score.opponents, row.score.added
    worst = min(found, key=lambda name: found[name])
    seeds = score.by_seed
    low = min(seeds, key=lambda seed: seeds[seed])
    spread = f", seed {low}: {seeds[low]:.1f}" if len(seeds) > 1 else ""
    return (
        row.name,
        kind_text(score),
        str(row.rank or "-"),
        f"{score.estimate.mean:.1f} ± {score.half_width:.1f}{spread}",
        "" if score.began is None else f"{score.began.estimate.mean:.1f}",
        "" if added is None or added.low is None else f"{added.mean:+.1f} ({added.low:+.1f} to {added.high:+.1f})",
        f"{found[worst]:.0f} ({worst})",
        _response_text(row),
    )


def _response_text(row: BoardEntry) -> str:
    if row.worst is None:
        return NOT_SEARCHED
    seed, exploit = row.worst
    of = f", to seed {seed}" if seed else ", to the default seed" if len(row.score.pays) > 1 else ""
    return f"{exploit}{of}"


def kind_text(score: Score) -> str:
    """The kind of an entry; a network says if what it began with was not played, and if it has few training seeds."""
    seeds = len(score.pays)
    few = f", {seeds} training seed{'s' * (seeds > 1)}" if score.kind.network and seeds < SEEDS else ""
    unplayed = ", by its adapter's name alone" if score.kind.name == SCRATCH and score.began is None else ""
    return f"{score.kind}{unplayed}{few}"


def front(boards: Mapping[str, Sequence[BoardEntry]]) -> Sheet:
    """One row for each track that has entries: the best of every kind, with its half width."""
    rows = [
        [name, *(_best([row for row in rows if _shown(row, kinds)]) for kinds in FRONT.values())]
        for name, rows in boards.items()
        if rows
    ]
    return Sheet("", ("track", *FRONT), rows)


def _shown(row: BoardEntry, kinds: Sequence[str]) -> bool:
    """Whether an entry is of one of these kinds; a network is from scratch if what it began with was played."""
    kind = row.score.kind.name
    return kind in kinds and (kind != SCRATCH or row.score.began is not None)


def _best(rows: Sequence[BoardEntry]) -> str:
    if not rows:
        return NONE_YET
    score = rows[0].score
    return f"{rows[0].name} {score.estimate.mean:.0f} ± {score.half_width:.0f}"


def boards() -> dict[str, list[BoardEntry]]:
    """The boards of all eight tracks, by name."""
    return {name: board(track) for name, track in tracks().items()}
