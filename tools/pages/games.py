"""The table on each page of a game: who leads in its two tracks, and what the ends of the scale are paid."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from cps_agents.scoring.board import BoardEntry, front
from cps_agents.scoring.frozen import read_frozen
from cps_agents.scoring.tracks import Track, tracks
from cps_envs import PROBLEMS


def leaders(found: Mapping[str, Sequence[BoardEntry]]) -> dict[str, str]:
    """The table of each game by the name of its page, of these boards."""
    return {f"{name}.md": "\n".join(_leaders(name, found)) + "\n" for name in PROBLEMS}


def _leaders(problem: str, found: Mapping[str, Sequence[BoardEntry]]) -> Iterator[str]:
    """The best of every kind in both tracks, and what scores 0 and 100 are paid."""
    own = {name: track for name, track in tracks().items() if track.problem == problem}
    yield from front({name: found[name] for name in own}).markdown()
    yield ""
    yield from map(_scale, own.values())


def _scale(track: Track) -> str:
    frozen, unit = read_frozen(track), PROBLEMS[track.problem].unit
    return (
        f"* {track.name}: at score 0 the attacker's return is {frozen.zero:.3g}, at score 100 {frozen.told:.3g} {unit}."
    )
