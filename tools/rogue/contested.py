"""The searches behind `contested.json`: responses to defenders of preset `learning`, and what tells these apart.

`python -m tools.rogue.contested contested.json` makes the file anew; it takes a quarter of an hour.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cps_baselines.rogue.probing import trace_of
from cps_baselines.rogue.switching import SIZE, Switching, shipped_weights
from cps_envs.core.game.game import Game
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import FloatArray, Role
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.problem import ROGUE
from tools.evolving import evolve
from tools.rivals.rogue import RESPONDED_TO

SEARCHED, REPORTED = 40_000_000, 50_000_000  # first seeds of the worlds
PROBE_S = 4.0  # chosen: the slowest of these defenders has answered by then
ATTACKED = {"attack_share": 1.0}  # a search looks at episodes with an attack only


@dataclass(frozen=True)
class ContestedSearch:
    """How long a search takes; every field is written into the result."""

    generations: int = 14
    population: int = 14
    restarts: int = 2  # from zero and from the general weights of `switching`
    spread: float = 1.0
    worlds: int = 6  # in which a candidate is judged
    final_worlds: int = 48
    seed: int = 0


def search_response(against: str, search: ContestedSearch) -> dict[str, Any]:
    """Weights (7,) with their mean return over unseen worlds in m/s, and the defender's mean trace, ready for JSON."""
    general = shipped_weights()["all", 1.0]
    origins = [np.zeros(SIZE), general * np.sqrt(SIZE) / np.linalg.norm(general)][: search.restarts]
    champions: list[FloatArray] = []
    for run, origin in enumerate(origins):

        def judge(candidates: FloatArray, generation: int, run: int = run) -> FloatArray:
            first = SEARCHED + (run * search.generations + generation) * search.worlds
            return returns(candidates, against, first, search.worlds)

        sizes = {"population": search.population, "generations": search.generations}
        best = [weights for _, weights in evolve(judge, origin, search.spread, **sizes, seed=[search.seed, run])]
        champions += best[-5:]
    worlds = search.final_worlds
    judged = returns(np.array(champions), against, REPORTED, worlds)
    weights = np.round(champions[int(judged.argmax())], 4)
    verified = returns(weights[np.newaxis], against, REPORTED + worlds, worlds)[0]
    trace = np.round(mean_trace(against, general, worlds), 4)
    return {
        "against": against,
        "weights": weights.tolist(),
        "verified": round(float(verified), 2),
        "trace": trace.tolist(),
        "search": asdict(search),
    }


def returns(weights: FloatArray, against: str, first: int, worlds: int) -> FloatArray:
    """The mean return (P,) in m/s of candidates (P, 7) over the same episodes with an attack."""
    seeds = list(range(first, first + worlds)) * len(weights)
    attacker = Switching(_config().spec("attacker"), np.repeat(weights, worlds, axis=0))
    players: dict[Role, Any] = {"attacker": attacker, "defender": against}
    played = play_episodes(ROGUE, _config().config, players, seeds)["return"]
    found: FloatArray = played.reshape(len(weights), worlds).mean(axis=1)
    return found


def mean_trace(against: str, probe: FloatArray, worlds: int) -> FloatArray:
    """What the attacker sees in the mean (5,) `PROBE_S` after its onset at time 0, if it probes from there."""
    config: RogueConfig = ROGUE.config("learning", {**ATTACKED, "onset_s": 0.0, "duration_s": 10.0})
    attacker = Switching(ROGUE.game(config, 1).spec("attacker"), probe)
    traces: list[FloatArray] = []

    def look(game: Game) -> None:
        if game.elapsed[0] == round(PROBE_S / config.control_period_s):
            traces.append(trace_of(Seen(game.fields["attacker"], game.observe("attacker"))))

    players: dict[Role, Any] = {"attacker": attacker, "defender": against}
    play_episodes(ROGUE, config, players, list(range(REPORTED, REPORTED + worlds)), on_step=look)
    mean: FloatArray = traces[0].mean(axis=0)
    return mean


def _config() -> Game:
    return ROGUE.game(ROGUE.config("learning", ATTACKED), 1)


def document(search: ContestedSearch) -> dict[str, Any]:
    """Everything that `identify` and `contested` need."""
    rows = [search_response(against, search) for against in RESPONDED_TO]
    return {"probe": shipped_weights()["all", 1.0].tolist(), "probe_s": PROBE_S, "found": rows}


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(document(ContestedSearch()), indent=1) + "\n", encoding="utf-8")
