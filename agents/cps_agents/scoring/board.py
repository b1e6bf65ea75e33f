"""The boards: every score in `leaderboard/v1`, in order, as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.scoring.exploits import Exploit, read_exploits
from cps_agents.scoring.score import SEEDS, Score
from cps_agents.scoring.tracks import Track, tracks
from cps_agents.scoring.verify import read_score
from cps_agents.sheet import Sheet
from cps_envs.core.types import BoolArray, FloatArray

FOLDER = Path(__file__).parents[3] / "leaderboard" / "v1"  # of a clone; an installed package has none
HEAD = ("policy", "rank", "score", "±", "worst opponent", "best response", "kind")
FRONT = ("track", "best rules", "best searched", "best network", "told")
NONE_YET = "none yet"
NOT_SEARCHED = "-"  # for a best response
HALVINGS = 200  # of the episodes, at random
SURE = 1.96  # standard errors of a difference that is no chance


@dataclass(frozen=True)
class BoardEntry:
    """An entry of a board."""

    name: str  # of the file
    score: Score
    rank: int  # entries that are not surely different share one; 0: told, without a rank
    exploit: Exploit | None = None  # None: nobody has looked for one


def entries(track: Track, folder: Path | None = None) -> dict[str, Score]:
    """The scores of a track by the names of their files in `FOLDER` or another folder, the best first.

    Raises:
        CommandError: a file is of another track or of split dev.
        DamagedFileError: a file is no score.
    """
    found = {}
    for path in sorted(((folder or FOLDER) / track.name).glob("*.json")):
        found[path.stem] = read_score(path)
        if (found[path.stem].frozen.track.name, found[path.stem].split) != (track.name, "test"):
            raise CommandError(f"{path} is no score of {track.name} on split test: it belongs elsewhere")
    return dict(sorted(found.items(), key=lambda item: -item[1].estimate.mean))


def board(track: Track, folder: Path | None = None) -> list[BoardEntry]:
    """The rows of a track: ranks count those who are surely better than the first of a rank."""
    rows: list[BoardEntry] = []
    leader: Score | None = None  # of the present rank
    ranked = rank = 0
    exploits = read_exploits(folder or FOLDER).get(track.name, {})
    for name, score in entries(track, folder).items():
        found = exploits.get(name)
        exploit = found if found is not None and found.fits(score) else None
        if not score.kind.ranked:
            rows.append(BoardEntry(name, score, 0, exploit))
            continue
        ranked += 1
        if leader is None or leader.minus(score).excludes_zero:
            leader, rank = score, ranked
        rows.append(BoardEntry(name, score, rank, exploit))
    return rows


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
    """How alike two halves of the episodes rank a board; None where fewer than two ranks are above 0."""
    above = [row for row in rows if row.rank and row.score.estimate.mean > 0]
    if len({row.rank for row in above}) < 2:
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
    """Where a score stands on the board; empty where there is no board."""
    others = [row.score for row in board(score.frozen.track, folder) if row.rank]
    if not others or score.split != "test":
        return ""
    if not score.kind.ranked:
        return "Without a rank: it is told more than its role observes."
    better = sum(each.minus(score).excludes_zero and each.estimate.mean > score.estimate.mean for each in others)
    count = {0: "none is", 1: "one is"}.get(better, f"{better} are")
    return f"Rank {better + 1} on the board: of its {len(others)} entries {count} surely better."


def table(track: Track, rows: Sequence[BoardEntry]) -> Sheet:
    """A board."""
    cells = []
    for row in rows:
        found = row.score.opponents
        worst = min(found, key=lambda name: found[name])
        cells.append(
            (
                row.name,
                str(row.rank or "told"),
                f"{row.score.estimate.mean:.1f}",
                f"{row.score.half_width:.1f}",
                f"{found[worst]:.0f} ({worst})",
                str(row.exploit or NOT_SEARCHED),
                kind_text(row.score),
            )
        )
    return Sheet(track.name, HEAD, cells)


def kind_text(score: Score) -> str:
    """The kind of an entry; a network with few training seeds says how many."""
    few = score.kind.network and len(score.pays) < SEEDS
    return f"{score.kind}{f', {len(score.pays)} training seed(s)' if few else ''}"


def front(boards: Mapping[str, Sequence[BoardEntry]]) -> Sheet:
    """One row for each track that has entries: the best of every kind, with its half width."""
    groups = (("rules",), ("searched",), ("reward", "imitation"), ("told",))
    rows = [
        [name, *(_best([row for row in rows if row.score.kind.name in group]) for group in groups)]
        for name, rows in boards.items()
        if rows
    ]
    return Sheet("", FRONT, rows)


def _best(rows: Sequence[BoardEntry]) -> str:
    if not rows:
        return NONE_YET
    score = rows[0].score
    return f"{rows[0].name} {score.estimate.mean:.0f} ± {score.half_width:.0f}"


def boards() -> dict[str, list[BoardEntry]]:
    """The boards of all eight tracks, by name."""
    return {name: board(track) for name, track in tracks().items()}
