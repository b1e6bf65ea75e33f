"""Whether a file holds a score that its policy really reaches: numbers, networks, episodes, and fresh seeds."""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from cps_agents.arena.play import silent
from cps_agents.errors import CommandError
from cps_agents.scoring.frozen import TOLERANCE, read_frozen, read_pays
from cps_agents.scoring.kind import KINDS, Kind
from cps_agents.scoring.playing import answers, parted, pays, seeds_of
from cps_agents.scoring.score import Score
from cps_agents.scoring.tracks import CHALLENGE, find_track
from cps_agents.zoo.references import origin_of
from cps_envs.core.documents import MOST_BYTES, read_bytes, read_entry
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import FloatArray

DRAWN = 16  # episodes against each opponent that are played again
SAME = 0.95  # of them have to end as the file says: networks may differ a little on other machines
AUDITED = 4  # an audit plays this part of the episodes
MOST_DRAWS = 10**5  # of an audit's seeds
MOST_NUMBERS = 10**6
STATED = 0.02  # rounding of a stated number
REMEDY = "Make it with `cps-envs score TRACK POLICY`, and do not edit it."
Said = Callable[[str], None]


def read_score(path: Path) -> Score:
    """The score of a file.

    Raises:
        DamagedFileError: it is no such file, or its numbers are not those of its own pays.
        CommandError: it was made with another version of the challenge.
        UnknownNameError: there is no such track.
        OSError: it cannot be read.
    """
    document = read_entry(path, "score of cps-envs", REMEDY)
    document["challenge"].text([CHALLENGE])
    frozen = read_frozen(find_track(document["track"].text()))
    split = document["split"].text(["test", "dev"])
    if document["digest"].text() != frozen.digest:
        raise CommandError(
            f"{path} was made with another version of {CHALLENGE} {frozen.track.name}, digest "
            f"{document['digest'].text()} instead of {frozen.digest}: score the policy again"
        )
    kept = document["pays"].entries()
    count = len(frozen.pays[split][0]) // max(len(kept), 1)  # training seeds divide the episodes
    found = Score(
        frozen=frozen,
        split=split,
        policy=document["policy"].text(),
        kind=Kind(document["kind"].text(list(KINDS)), document["numbers"].whole(0, MOST_NUMBERS)),
        pays={seed: read_pays(frozen.track, rows, count) for seed, rows in kept.items()},
        sources={name: value.text() for name, value in document["sources"].entries().items()},
        playable=document["playable"].value is True,
        cpu_s=document["cpu_s"].number(0),
        versions={name: value.text() for name, value in document["versions"].entries().items()},
    )
    if not found.pays:
        raise document["pays"].error("pays of at least one training seed")
    stated = {name: value.number() for name, value in document["opponents"].entries().items()}
    own = found.opponents
    same = stated.keys() == own.keys() and all(abs(stated[name] - own[name]) <= STATED for name in own)
    same &= abs(document["score"].number() - found.estimate.mean) <= STATED
    if not same or document["line"].text() != found.line:
        raise document.source.error("its line or its scores are not those of its own pays")
    return found


def verify(path: Path, *, audit: bool = False, draw: int | None = None, say: Said = silent) -> Score:
    """Refuse a file whose policy does not reach its score; say what was found.

    Some episodes, which the file's own hash draws, are played again. An `audit` also plays seeds that nobody could
    have tuned on; `draw` numbers them.

    Raises:
        CommandError: the policy cannot be played from the file, is another one, or plays otherwise.
    """
    found = read_score(path)
    if not found.playable:
        raise CommandError(f"{path}: {found.policy!r} was a Python object; save it, and score its reference")
    origin = origin_of(found.frozen.track.problem, found.policy)
    if dict(origin.sources) != dict(found.sources):
        raise CommandError(f"{path}: networks or code of {found.policy!r} are not those that were scored: score again")
    players: dict[int | None, PolicyReference] = dict(origin.seeds)
    if {"" if seed is None else str(seed) for seed in players} != set(found.pays):
        raise CommandError(f"{path}: {found.policy!r} has other training seeds than those that were scored")
    generator = np.random.default_rng(list(hashlib.sha256(read_bytes(path, MOST_BYTES)).digest()))
    found.frozen.check_game()
    say(_replayed(found, players, generator))
    if audit:
        say(_audited(found, players, secrets.randbelow(MOST_DRAWS) if draw is None else draw))
    return found


def _replayed(found: Score, players: dict[int | None, PolicyReference], generator: np.random.Generator) -> str:
    """Play drawn episodes of one training seed again."""
    place = int(generator.integers(len(players)))
    seed = list(players)[place]
    track, kept = found.frozen.track, found.pays["" if seed is None else str(seed)]
    every = parted(seeds_of(track, found.split, found.episodes), len(players))[place]
    rows = [np.sort(generator.choice(len(own), min(DRAWN, len(own)), replace=False)) for own in every]
    seeds = [[own[row] for row in chosen] for own, chosen in zip(every, rows, strict=True)]
    again = np.concatenate(pays(track, players[seed], seeds))
    stated = np.concatenate([values[chosen] for values, chosen in zip(kept, rows, strict=True)])
    share = float((np.abs(again - stated) <= TOLERANCE).mean())
    off = abs(float((again - stated).mean()) / found.frozen.span) * 100
    if share < SAME or off > 1:
        raise CommandError(
            f"{found.policy!r} does not play as the file says: {share:.0%} of {len(again)} episodes end alike, and the "
            f"score of these is {off:.1f} off. Score the policy again."
        )
    return f"{len(again)} episodes played again: {share:.0%} end as the file says"


def _audited(found: Score, players: dict[int | None, PolicyReference], draw: int) -> str:
    """Play fresh seeds, beside the best answers on the same."""
    track = found.frozen.track
    seeds = seeds_of(track, "audit", max(found.episodes // AUDITED, 2 * len(players)), draw)
    known = answers(track, seeds)
    parts = parted(seeds, len(players))
    paid = {
        "" if seed is None else str(seed): pays(track, player, own)
        for (seed, player), own in zip(players.items(), parts, strict=True)
    }
    fresh = _elsewhere(found, known, paid)
    off = fresh.estimate.mean - found.estimate.mean
    most = 2 * float(np.hypot(fresh.half_width, found.half_width))
    text = f"audit {draw}: {fresh.estimate.mean:.1f} ± {fresh.half_width:.1f} on fresh seeds"
    if abs(off) > most:
        raise CommandError(f"{text}, {off:+.1f} from the stated {found.estimate.mean:.1f}: more than {most:.1f}")
    return text


def _elsewhere(found: Score, known: list[FloatArray], paid: dict[str, list[FloatArray]]) -> Score:
    """The same policy's score on other seeds."""
    frozen = replace(found.frozen, pays={"audit": known})
    return replace(found, frozen=frozen, split="audit", pays=paid)
