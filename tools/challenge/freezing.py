"""Freeze a track: find the best policy that does not look, and play it and the best answers often."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from cps_agents.files import write_json
from cps_agents.scoring import frozen
from cps_agents.scoring.playing import answers, pays, seeds_of
from cps_agents.scoring.tracks import CHALLENGE, Track
from cps_envs.core.declare.actions import choices_of
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.types import FloatArray
from cps_envs.registration import find_problem
from tools.challenge.constants import declared
from tools.challenge.constants.adapters import constants_of, native_constants

ROUNDS = ((64, 8), (8, 2), (1, 1))  # constants play such a part of the episodes, and so many of them stay
FEWEST = 4  # episodes against each opponent, in every round
MOST_CONSTANTS = 600  # of an adapter
Said = Callable[[str], None]


def freeze(track: Track, episodes: int, candidates: Sequence[str] = (), say: Said = lambda line: None) -> Path:
    """Play on split dev, and the answers on split test; returns the file that holds what was frozen.

    Constants meet in rounds: all play a few of the episodes, the best of them more, the last two all. Where there are
    `candidates`, only those play, all episodes.
    """
    left = list(candidates) or every_constant(track)
    say(f"{track.name}: {len(left)} constants")
    seeds = seeds_of(track, "dev", episodes)
    rows: dict[str, list[FloatArray]] = {}
    for part, kept in ROUNDS if not candidates else ROUNDS[-1:]:
        few = [own[: max(episodes // part, FEWEST)] for own in seeds]
        rows = {policy: pays(track, policy, few) for policy in left}
        left = sorted(rows, key=lambda policy: -track.sign * mean_pay(track, rows[policy]))[:kept]
        say(f"  of {len(few[0])} episodes: {', '.join(f'{each} {mean_pay(track, rows[each]):.3f}' for each in left)}")
    zero = left[0]
    dev, test = answers(track, seeds), answers(track, seeds_of(track, "test", track.episodes))
    for rival, best, worst in zip(track.panel, dev, rows[zero], strict=True):
        say(f"  {rival.name}: answer {best.mean():.3f}, zero {worst.mean():.3f}")
    path = frozen.FOLDER / f"{track.name}.json"
    write_json(
        path,
        {
            "challenge": CHALLENGE,
            "track": track.name,
            "identity": frozen.identity(track),
            "zero": round(mean_pay(track, rows[zero]), frozen.PLACES + 2),
            "told": round(mean_pay(track, dev), frozen.PLACES + 2),
            "zero_policy": zero,
            "episodes": episodes,
            "pays": {
                "test": frozen.texts(test),
                "dev": frozen.texts([own[: track.episodes // frozen.DEV] for own in dev]),
            },
        },
    )
    return path


def every_constant(track: Track) -> list[str]:
    """Policies of a role that never look, those of the adapter that learners play it through included.

    A continuous action of an adapter sets the numbers of a controller, which looks: it is none of them. Nor is what an
    adapter does that begins as a controller: there the role's first adapter stands for it.
    """
    problem = find_problem(track.problem)
    spec = problem.game(track.venue.config, 1).spec(track.role)
    adapter = problem.training[track.role].adapter
    if adapter not in {NATIVE, *spec.adapters}:
        adapter = next(iter(spec.adapters))
    choices = choices_of(adapter_of(spec, adapter).action_space)
    constants = declared(track.problem, track.role)
    own = constants_of(spec, adapter, MOST_CONSTANTS) if choices else []
    return list(dict.fromkeys(["none", "random", *constants, *native_constants(spec), *own]))


def mean_pay(track: Track, rows: Sequence[FloatArray]) -> float:
    """The weighted mean over the opponents."""
    return float(np.dot(track.shares, [own.mean() for own in rows]))
