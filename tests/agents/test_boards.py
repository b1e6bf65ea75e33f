"""The boards that are shipped: files of today's tracks, who is blind has zero, halves of the episodes rank alike."""

from __future__ import annotations

from functools import cache

import pytest

pytest.importorskip("scipy", reason="needs the baselines")

from cps_agents.scoring.board import FOLDER, VERSION, BoardEntry, agreement, board, missing
from cps_agents.scoring.exploits import read_exploits
from cps_agents.scoring.kind import kind_of
from cps_agents.scoring.tracks import find_track, tracks
from cps_agents.zoo.references import origin_of
from cps_baselines.searched import found

BLIND = {"none", "random", "constant"}  # entries that never look at anything
LEAST = 0.9  # Kendall's tau between two halves
START = "untrained=true"


@cache
def rows_of(name: str) -> list[BoardEntry]:
    """A board; refuses files of another digest."""
    return board(find_track(name))


@pytest.mark.parametrize("name", tracks())
def test_what_does_not_look_is_not_above_zero(name: str) -> None:
    scores = {row.name: row.score for row in rows_of(name)}
    for blind in BLIND:
        assert scores[blind].estimate.mean <= scores[blind].half_width, scores[blind].line


@pytest.mark.parametrize("name", tracks())
def test_two_halves_of_the_episodes_rank_entries_alike(name: str) -> None:
    alike = agreement(rows_of(name))
    if alike is not None:
        assert alike.by_rank >= LEAST, alike


@pytest.mark.parametrize("name", tracks())
def test_entries_are_of_the_networks_that_ship_and_say_what_made_them(name: str) -> None:
    track = find_track(name)
    for row in rows_of(name):
        assert origin_of(track.problem, row.score.policy).sources == dict(row.score.sources), f"score {row.name} again"
        found = kind_of(track, row.score.policy)
        played = found.name == "from scratch" and row.score.kind.name == "advised"  # by what it began with
        assert row.score.kind == found or played, row.name


@pytest.mark.parametrize("name", tracks())
def test_best_responses_are_to_entries_of_the_board(name: str) -> None:
    rows = {row.name: row.exploits for row in rows_of(name)}
    for entry, exploit in read_exploits(FOLDER).get(name, {}).items():
        policy, _, seed = entry.partition("?seed=")
        assert rows[policy][seed] == exploit, "respond again"


@pytest.mark.skipif(VERSION == "v1", reason="v1 was frozen before every shipped policy was an entry")
@pytest.mark.parametrize("name", tracks())
def test_every_shipped_policy_of_a_role_is_an_entry(name: str) -> None:
    assert missing(find_track(name)) == []


@pytest.mark.skipif(VERSION == "v1", reason="v1 was played before what networks began with was")
@pytest.mark.parametrize("name", tracks())
def test_every_network_shows_what_it_began_with(name: str) -> None:
    assert all(row.score.began is not None for row in rows_of(name) if row.score.kind.network)


@pytest.mark.parametrize("name", tracks())
def test_what_a_search_began_with_is_an_entrant_too(name: str) -> None:
    track = find_track(name)
    entrants = {row.score.policy for row in rows_of(name)}
    for policy in entrants:
        if policy.partition("?")[0] in found(track.problem) and START not in policy:
            assert f"{policy}{'&' if '?' in policy else '?'}{START}" in entrants


def test_a_score_is_cheap() -> None:
    """CPU seconds of the networks that ship, on whatever machine has verified each: two minutes at the most."""
    spent = {name: row.score.cpu_s for name in tracks() for row in rows_of(name) if row.name == "network"}
    assert max(spent.values()) <= 120, spent
