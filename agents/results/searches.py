"""What baselines find out about an opponent before they play; they search on seeds that evaluation never uses."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from agents.learning.seeds import TRAINING_START
from baselines.disbanding.genetic import GivenPlans
from baselines.disbanding.plan_search import SearchSettings, search_plan
from baselines.rogue.reproduction.headroom import DUTIES, DUTY_HZ
from baselines.rogue.square import SquareWave
from baselines.schedule import Prepared
from cps_envs.core.play import finish, play_episodes
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.rogue.problem import ROGUE

INSTANCES = 2  # episodes on which a plan is judged in the search; with a slow defender each costs about a second
QUICK = SearchSettings(population=6, generations=2)
QUICK_WAVES = 6


def told(config: Any, quick: bool, opponent: str) -> Prepared:
    """The rogue attacker `probe` that is told its opponent, the teacher of the recurrent attacker."""
    return Prepared(f"probe?against={opponent}", "told the controller")


def fixed_plan(config: Any, quick: bool, opponent: str) -> Prepared:
    """The plan that the genetic algorithm finds against a defender, one for all instances: highest mean payoff."""
    seeds = range(TRAINING_START, TRAINING_START + (1 if quick else INSTANCES))

    def evaluate(plans: FloatArray) -> FloatArray:
        envs = [seed for _ in plans for seed in seeds]
        spec = DISBANDING.game(config, 1).spec("attacker")
        attacker = GivenPlans(spec, np.repeat(plans, len(seeds), axis=0))
        match = DISBANDING.match(config, len(envs), {"attacker": attacker, "defender": opponent})
        match.reset(np.ones(len(envs), np.bool_), [seeding.np_random(seed)[0] for seed in envs])
        payoff: FloatArray = finish(match).reshape(len(plans), len(seeds)).mean(axis=1)
        return payoff

    found = search_plan(
        evaluate,
        num_platoons=config.max_platoons,
        budget=config.max_budget,
        latest_s=int(config.duration_s),
        seed=0,
        settings=QUICK if quick else None,
    )
    events = ",".join(f"[{platoon},{time_s}]" for platoon, time_s in found.events)
    plan = ", ".join(f"platoon {platoon} at {time_s} s" for platoon, time_s in found.events)
    note = f"{plan}; found against {opponent} by {found.simulations * len(seeds)} simulations"
    return Prepared(f"plan?events=[{events}]", note)


def best_wave(config: Any, quick: bool, opponent: str) -> Prepared:
    """The square wave, of many frequencies and duties, that does the most damage to a controller."""
    waves = list(product(DUTY_HZ, DUTIES))[:: len(DUTY_HZ) * len(DUTIES) // QUICK_WAVES if quick else 1]
    frequencies_hz, duties = np.array(waves).T
    attacker = SquareWave(ROGUE.game(config, 1).spec("attacker"), frequencies_hz, duties)
    outcome = play_episodes(ROGUE, config, {"attacker": attacker, "defender": opponent}, [TRAINING_START] * len(waves))
    frequency_hz, duty = waves[int(outcome["damage"].argmax())]
    note = f"{frequency_hz:g} Hz, duty {duty:g}; the best of {len(waves)} against {opponent}"
    return Prepared(f"square?frequency_hz={frequency_hz}&duty={duty}", note)
