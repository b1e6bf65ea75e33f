"""The frozen numbers of a track: what scores 0 and 100 are paid, and what the best answers got in its episodes."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.scoring.playing import answers, seeds_of
from cps_agents.scoring.tracks import CHALLENGE, Track
from cps_envs.core.documents import Entry, read_entry
from cps_envs.core.types import FloatArray
from cps_envs.registration import find_problem

FOLDER = Path(__file__).with_name("v1")
FIELDS = FOLDER / "fields.json"
PLACES = 3  # digits behind the point of a pay in a file
TOLERANCE = 2e-3  # between a pay in a file and the same episode, played again
REPLAYED = 8  # episodes against each opponent, before a score
DEV = 8  # a look at split dev takes this part of the episodes
REMEDY = "Install this version of cps-envs again."


@dataclass(frozen=True)
class Frozen:
    """Pays of the attacker, in the unit of the problem."""

    track: Track
    zero: float  # of the best policy that does not look: score 0
    told: float  # of the best answer to each opponent, weighted: score 100
    zero_policy: str
    episodes: int  # against each opponent, behind these two
    pays: dict[str, list[FloatArray]]  # split -> of the answers, for each opponent and episode
    digest: str

    @property
    def span(self) -> float:
        """The pay from score 0 to score 100; positive for attackers, negative for defenders."""
        return self.told - self.zero

    def values(self, split: str, place: int, paid: FloatArray) -> FloatArray:
        """Scores of single episodes, (S, E), against the opponent at a place of the panel; 100 as its best answer.

        Row s of the pays is of the s-th of S parts of the episodes.
        """
        best = self.pays[split][place][: paid.size].reshape(paid.shape)
        found: FloatArray = 100.0 + 100.0 * (paid - best) / self.span
        return found

    def check_game(self) -> None:
        """Play some of the frozen episodes again.

        Raises:
            CommandError: they end otherwise, so scores could not be compared.
        """
        again = answers(self.track, seeds_of(self.track, "test", REPLAYED))
        for rival, mine, kept in zip(self.track.panel, again, self.pays["test"], strict=True):
            if not np.allclose(mine, kept[:REPLAYED], rtol=0.0, atol=TOLERANCE):
                raise other_game(self.track, f"the episodes against {rival.name!r} end otherwise")


def other_game(track: Track, reason: str) -> CommandError:
    """What to raise where scores could not be compared."""
    return CommandError(
        f"this installation plays another game than {CHALLENGE} {track.name}: {reason}. "
        "Install the version of cps-envs that the board names, without changes."
    )


def identity(track: Track) -> str:
    """A hash of all that a track declares: panel, configuration and version of the environment."""
    panel = [
        {"name": each.name, "policy": each.reference, "answer": each.answer, "weight": each.weight}
        for each in track.panel
    ]
    declared = {"problem": track.problem, "role": track.role, "episodes": track.episodes, "panel": panel}
    plain = [CHALLENGE, declared, described(track.venue.config), find_problem(track.problem).version]
    return hashlib.sha256(json.dumps(plain).encode()).hexdigest()[:12]


def described(config: Any) -> str:
    """A configuration with all fields of the freeze; a field that came later counts where it has not its default."""
    name = type(config).__name__
    rows = read_entry(FIELDS, "list of frozen fields", REMEDY)[name].rows()
    frozen = [row.text() for row in rows]
    later = [each for each in dataclasses.fields(config) if each.name not in frozen]
    changed = [each.name for each in later if getattr(config, each.name) != each.default]
    return f"{name}({', '.join(f'{each}={getattr(config, each)!r}' for each in [*frozen, *changed])})"


def rounded(paid: FloatArray) -> FloatArray:
    """Pays with the digits that a file has."""
    found: FloatArray = np.round(paid, PLACES)
    return found


def texts(pays: Sequence[FloatArray]) -> list[str]:
    """Pays as a file has them, a line for each opponent."""
    return [" ".join(f"{value:.12g}" for value in rounded(paid).tolist()) for paid in pays]


def read_frozen(track: Track) -> Frozen:
    """The frozen numbers of a track.

    Raises:
        CommandError: there are none, or they are of another panel or configuration than the track has here.
        DamagedFileError: the file is no such document.
    """
    path = FOLDER / f"{track.name}.json"
    if not path.is_file():
        raise CommandError(f"{track.name} is not frozen yet: `python -m tools.challenge {track.name}` does that")
    document = read_entry(path, "file of frozen numbers", REMEDY)
    if document["identity"].text() != identity(track):
        raise other_game(track, "panel, configuration or version have changed")
    counts = {"test": track.episodes, "dev": track.episodes // DEV}
    return Frozen(
        track=track,
        zero=document["zero"].number(),
        told=document["told"].number(),
        zero_policy=document["zero_policy"].text(),
        episodes=document["episodes"].whole(1, 10**6),
        pays={split: read_pays(track, document["pays"][split], count) for split, count in counts.items()},
        digest=hashlib.sha256(json.dumps(document.plain()).encode()).hexdigest()[:12],
    )


def read_pays(track: Track, entry: Entry, episodes: int) -> list[FloatArray]:
    """Pays of a document, of so many episodes against each opponent."""
    rows = entry.rows()
    if len(rows) != len(track.panel):
        raise entry.error(f"a list with a line for each of the {len(track.panel)} opponents")
    return [_pays(row, episodes) for row in rows]


def _pays(row: Entry, episodes: int) -> FloatArray:
    words = row.text().split()
    try:
        found = np.array(words, np.float64)
    except ValueError:
        raise row.error("numbers with spaces between them") from None
    if len(found) != episodes or not np.isfinite(found).all():
        raise row.error(f"{episodes} finite numbers")
    return found
