"""The seeded search that found the numbers of the disbanding defender `string`: CMA-ES.

`cps-envs search-string` made what stands in `string.json` beside this module: for each form a result with the search
and the start that it was found from.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np

from cps_baselines.disbanding.string_controller import SHAPE, SIZE, Gains, StringController
from cps_baselines.evolution import make_strategy
from cps_envs.core.documents import Entry
from cps_envs.core.lookup import PolicyReference, resolve_policy
from cps_envs.core.play import play_episodes
from cps_envs.core.types import FloatArray, Role
from cps_envs.disbanding.problem import DISBANDING

FIRST_DRAW = 20_000_000  # far from the seeds that anything is evaluated on
Report = Callable[[int, dict[str, Any]], None]  # trials so far, the result so far

# Where a search starts, by hand: 5 m behind everybody, at the predecessor's speed, by the disbanded vehicle's command.
START = Gains(
    gap=0.3,
    reach_m=10.0,
    wanted_m=5.0,
    headway_s=0.0,
    closing=1.0,
    closing_lag=0.0,
    predecessor=0.2,
    predecessor_lag=0.0,
    own=0.0,
    ahead_closing=0.5,
    ahead_acceleration=0.0,
    ahead_command=0.8,
    cap=1.0,
    excess_mps=0.5,
    law=0.0,
    forgetting=0.2,
)
# How far a number is worth moving: the search's unit.
STEP = Gains(
    gap=0.2,
    reach_m=4.0,
    wanted_m=2.0,
    headway_s=0.1,
    closing=0.5,
    closing_lag=1.0,
    predecessor=0.4,
    predecessor_lag=0.8,
    own=0.3,
    ahead_closing=0.3,
    ahead_acceleration=0.3,
    ahead_command=0.4,
    cap=0.4,
    excess_mps=0.5,
    law=0.2,
    forgetting=0.2,
)


SEARCHED = SIZE - 1  # of a class of vehicles: all but the last, which these searches leave at zero
THRESHOLD_MPS = 1.0  # where the search of the own detection starts; it goes on by factors
SETTINGS: Mapping[str, Mapping[str, Any]] = {"warned": {}, "local": {}, "informed": {"warning": "broadcast"}}


@dataclass(frozen=True)
class StringSearch:
    """What is searched for; every field is written into the result.

    A candidate is judged on new draws of a preset in every generation, the same ones for all its candidates.
    """

    form: str = "warned"
    preset: str = "learning"
    attackers: tuple[str, ...] = (
        "lead",
        "spread",
        "random",
        "timed?pause_s=20&jam=2",
        "timed?pause_s=40&jam=1",
        "timed?pause_s=60&jam=3&jam_s=0",
        "timed?pause_s=60&jam=2&jam_at=2",
    )
    trials: int = 1400  # candidate policies
    population: int = 14  # candidates per generation
    draws: int = 16  # episodes of each
    spread: float = 0.4  # initial standard deviation, in units of STEP
    seed: int = 0
    least_gap_m: float = 1.5  # a smallest gap below this costs a point per metre
    overrides: Mapping[str, Any] = field(default_factory=dict)  # of the preset, beside what the form sets


class Candidates(NamedTuple):
    """Policies to be judged."""

    gains: FloatArray  # (P, 2, 17)
    detection_mps: FloatArray  # (P,)


def found_before(result: Entry) -> Candidates:
    """The one policy of an earlier result of `search_string`.

    Raises:
        DamagedFileError: it is no such result.
    """
    states, searched = SHAPE[0], SEARCHED
    rows = result["gains"].rows()
    if len(rows) != states:
        raise result["gains"].error(f"{states} lists of {searched} gains")
    gains = np.array([[Gains(*row.numbers(searched)) for row in rows]])
    return Candidates(gains, np.array([result["detection_mps"].number(0)]))


def candidates_of(points: FloatArray, start: Candidates) -> Candidates:
    """What points (P, 33) of the search mean: steps from a start (1 candidate), and a power of e for the threshold."""
    steps = np.zeros((len(points), *SHAPE))
    steps[..., :SEARCHED] = points[:, :-1].reshape(len(points), -1, SEARCHED)
    return Candidates(start.gains + steps * np.array(STEP), start.detection_mps * np.exp(points[:, -1]))


def search_string(
    search: StringSearch, report: Report | None = None, start: Candidates | None = None
) -> dict[str, Any]:
    """The gains (2, 16) and the threshold with their cost and the search that found them, ready for JSON.

    `start` replaces `START`. The result is the mean of the search distribution, which the chance of a generation's
    draws moves less than it does its best candidate.
    """
    start = start or Candidates(np.tile(np.array(START), (1, 2, 1)), np.array([THRESHOLD_MPS]))
    strategy = make_strategy(np.zeros(2 * SEARCHED + 1), search.spread, population=search.population, seed=search.seed)
    trials, found = 0, {}
    while trials < search.trials:
        points = strategy.ask()
        first_seed = FIRST_DRAW + 1_000_000 * search.seed + trials // search.population * search.draws
        costs = candidate_costs(candidates_of(np.array(points), start), search, first_seed)
        strategy.tell(points, costs.tolist())
        trials += len(points)
        middle = candidates_of(strategy.mean[np.newaxis], start)
        found = {
            "gains": np.round(middle.gains[0, :, :SEARCHED], 4).tolist(),
            "detection_mps": round(float(middle.detection_mps[0]), 4),
            "cost": round(float(costs.mean()), 4),
            "search": asdict(search),
            "start": {"gains": start.gains[0, :, :SEARCHED].tolist(), "detection_mps": float(start.detection_mps[0])},
        }
        if report is not None:
            report(trials, found)
    return found


def candidate_costs(candidates: Candidates, search: StringSearch, first_seed: int) -> FloatArray:
    """Costs (P,): mean return of the attackers, plus what small gaps cost."""
    config = DISBANDING.config(search.preset, {**SETTINGS.get(search.form, {}), **search.overrides})
    game = DISBANDING.game(config, 1)
    spec = game.spec("defender")
    gains, thresholds = (np.repeat(part, search.draws, axis=0) for part in candidates)
    defender = StringController(spec, form=search.form, gains=gains, detection_mps=thresholds)
    attacker = resolve_policy("mixture", game.spec("attacker"), policies=search.attackers)
    players: dict[Role, PolicyReference] = {"attacker": attacker, "defender": defender}
    seeds = [first_seed + draw for draw in range(search.draws)] * len(candidates.gains)
    outcome = play_episodes(DISBANDING, config, players, seeds)
    cost = outcome["return"] + np.maximum(0.0, search.least_gap_m - outcome["smallest_gap_m"])
    means: FloatArray = cost.reshape(-1, search.draws).mean(axis=1)
    return means
