"""What baselines find out about an opponent before they play; they search on seeds that evaluation never uses."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from cps_baselines.arena import Prepared
from cps_baselines.disbanding.genetic import GivenPlans
from cps_baselines.disbanding.plan_search import SearchSettings, search_plan
from cps_baselines.rogue.reproduction.headroom import DUTIES, DUTY_HZ
from cps_baselines.rogue.square import SquareWave
from cps_envs.core.play import finish, play_episodes
from cps_envs.core.seeds import TRAINING_START
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.rogue.problem import ROGUE

SCREENING, INSTANCES = 2, 30  # episodes on which the search judges a plan, and on which it judges its best ones
FINALISTS = 12
QUICK = SearchSettings(population=6, generations=2)
QUICK_WAVES = 6


def told(config: Any, quick: bool, opponent: str) -> Prepared:
    """The rogue attacker `probe` that is told its opponent, the teacher of the recurrent attacker."""
    return Prepared(f"probe?against={opponent}", "told the controller")


def fixed_plan(config: Any, quick: bool, opponent: str) -> Prepared:
    """The plan that the genetic algorithm finds against a defender, one for all instances: highest mean payoff.

    Few instances favour plans that suit them, and many take long: the search looks at a few, and of its best plans the
    one counts that does best in many others.
    """
    screening, instances, finalists = (1, 2, 3) if quick else (SCREENING, INSTANCES, FINALISTS)
    seen: dict[bytes, tuple[float, FloatArray]] = {}

    def evaluate(plans: FloatArray) -> FloatArray:
        paid = _paid(config, opponent, plans, range(TRAINING_START, TRAINING_START + screening))
        seen.update((plan.tobytes(), (value, plan)) for plan, value in zip(plans, paid.tolist(), strict=True))
        return paid

    search_plan(
        evaluate,
        num_platoons=config.max_platoons,
        budget=config.max_budget,
        latest_s=int(config.duration_s),
        seed=0,
        settings=QUICK if quick else None,
    )
    best = np.array([plan for _, plan in sorted(seen.values(), key=lambda each: -each[0])[:finalists]])
    first = TRAINING_START + screening
    judged = _paid(config, opponent, best, range(first, first + instances))
    times = best[int(judged.argmax())]
    events = [(int(row) + 1, int(times[row])) for row in np.flatnonzero(np.isfinite(times))[::-1]]
    plan = ", ".join(f"platoon {platoon} at {time_s} s" for platoon, time_s in events)
    note = f"{plan}; the best against {opponent} in {instances} instances, of {len(best)} finalists among {len(seen)}"
    return Prepared(f"plan?events=[{','.join(f'[{platoon},{time_s}]' for platoon, time_s in events)}]", note)


def _paid(config: Any, opponent: str, plans: FloatArray, seeds: range) -> FloatArray:
    """The mean payoff of disbanding times (P, N) over episodes, (P,)."""
    envs = [seed for _ in plans for seed in seeds]
    attacker = GivenPlans(DISBANDING.game(config, 1).spec("attacker"), np.repeat(plans, len(seeds), axis=0))
    match = DISBANDING.match(config, len(envs), {"attacker": attacker, "defender": opponent})
    match.reset(np.ones(len(envs), np.bool_), [seeding.np_random(seed)[0] for seed in envs])
    payoff: FloatArray = finish(match).reshape(len(plans), len(seeds)).mean(axis=1)
    return payoff


def best_wave(config: Any, quick: bool, opponent: str) -> Prepared:
    """The square wave, of many frequencies and duties, that does the most damage to a controller."""
    waves = list(product(DUTY_HZ, DUTIES))[:: len(DUTY_HZ) * len(DUTIES) // QUICK_WAVES if quick else 1]
    frequencies_hz, duties = np.array(waves).T
    attacker = SquareWave(ROGUE.game(config, 1).spec("attacker"), frequencies_hz, duties)
    outcome = play_episodes(ROGUE, config, {"attacker": attacker, "defender": opponent}, [TRAINING_START] * len(waves))
    frequency_hz, duty = waves[int(outcome["damage"].argmax())]
    note = f"{frequency_hz:g} Hz, duty {duty:g}; the best of {len(waves)} against {opponent}"
    return Prepared(f"square?frequency_hz={frequency_hz}&duty={duty}", note)
