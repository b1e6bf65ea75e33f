"""What a defence can reach, and the strongest defenders beside it: `python -m tools.disbanding.yardsticks`.

`bounds`: the least E_v of any defence for one and two attacks, by the smallest gap. `cells`: defenders in the cells of
Tables 2.2 and 2.3. `learning`: defenders in preset `learning`, paired with `informed`. `residuals`: how far `joint` is
from the solutions of its programs in the same cells. The tables are Markdown.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from cps_baselines.disbanding.joint import BEST
from cps_envs.core.game.match import Match
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.types import Array, FloatArray
from cps_envs.disbanding.problem import DISBANDING
from tools.disbanding.bounds import least_error_of_two, least_errors

TAUS_S, GAPS_M, DESIRED_GAPS_M = (0.1, 0.3, 0.5), (0.0, 1.0, 3.0, 5.0), (5.0, 4.0)
TWO_ATTACKS = {
    "platoons 10 and 9 at 2 s and 100 s": "table_2_3",
    "platoons 10 and 9 at 1 s and 40 s": "plan?events=[[10,1],[9,40]]",
}
DEFENDERS = ("none", "mpc", "mpc_tuned", "feedback", "string", "informed", "joint")
ATTACKS = ("none", "lead", "spread", "timed?pause_s=40&jam=1")
FIRST_SEED = 900_000  # of evaluation, and of no other table


def bounds() -> Iterable[str]:
    """A row for each attack and smallest gap, a column for each tau."""
    yield from header("attack, average over", "smallest gap (m)", *(f"tau = {tau_s} s" for tau_s in TAUS_S))
    configs = [DISBANDING.config("paper", {"tau_s": tau_s, "attack_budget": 2}) for tau_s in TAUS_S]
    for gap_m in GAPS_M:
        values = [least_errors(config, gap_m)["velocity_error_intact"][0] for config in configs]
        yield row("platoon 10 at 1 s, intact", f"{gap_m:g}", *(f"{value:.2f}" for value in values))
    for title, attacker in TWO_ATTACKS.items():
        for gap_m in GAPS_M[1:]:  # no defender touched under two attacks
            values = [least_error_of_two(config, gap_m, attacker=attacker)[0] for config in configs]
            yield row(f"{title}, all", f"{gap_m:g}", *(f"{value:.2f}" for value in values))


def cells(defenders: Sequence[str]) -> Iterable[str]:
    """E_v of defenders in the twelve cells, with intact vehicles in collisions or the smallest gap.

    For one attack the bound at that gap stands behind it: what no defence undercuts that keeps such gaps.
    """
    places = [(gap_m, tau_s) for gap_m in DESIRED_GAPS_M for tau_s in TAUS_S]
    yield from header("table", "defender", *(f"{gap_m:g} m, {tau_s} s" for gap_m, tau_s in places), "CPU s per episode")
    for table, attacker, metric in (("2.2", "lead", "intact"), ("2.3", "table_2_3", "all")):
        for defender in defenders:
            texts, spent_s = [], []
            for gap_m, tau_s in places:
                config = DISBANDING.config("paper", {"tau_s": tau_s, "desired_gap_m": gap_m, "report": "safety"})
                outcome, cpu_s = timed_play(config, attacker, defender, [0])
                collided, gap = outcome["collided_intact"][0], outcome["smallest_gap_m"][0]
                crash = f", {collided:.0f} collided" if collided else f", {gap:.1f} m"
                if table == "2.2" and not collided:
                    least = least_errors(config, float(gap))["velocity_error_intact"][0]
                    crash += f" (bound {least:.2f})"
                texts.append(f"{outcome[f'velocity_error_{metric}'][0]:.2f}{crash}")
                spent_s.append(cpu_s)
            yield row(table, f"`{defender}`", *texts, f"{min(spent_s):.2f}")


def learning(defenders: Sequence[str], episodes: int) -> Iterable[str]:
    """Mean return against some attacks, paired with `informed` (95 % interval), collisions and CPU time."""
    titles = ("mean return", "minus `informed`", "episodes with a collision", "smallest gap (m)", "CPU s per episode")
    yield from header("defender", *titles)
    config, seeds = DISBANDING.config("learning", {}), range(FIRST_SEED, FIRST_SEED + episodes)
    reference = np.mean([timed_play(config, attack, "informed", seeds)[0]["return"] for attack in ATTACKS], axis=0)
    for defender in defenders:
        played = [timed_play(config, attack, defender, seeds) for attack in ATTACKS]
        returns = np.mean([outcome["return"] for outcome, _ in played], axis=0)
        more = returns - reference
        half = 1.96 * more.std(ddof=1) / np.sqrt(episodes)
        crashed = np.mean([outcome["collided_intact"] > 0 for outcome, _ in played])
        gap = min(outcome["smallest_gap_m"].min() for outcome, _ in played)
        cpu_s = np.mean([cpu_s for _, cpu_s in played]) / episodes
        texts = (f"{returns.mean():.2f}", f"{more.mean():+.2f} ± {half:.2f}", f"{crashed:.0%}", f"{gap:.2f}")
        yield row(f"`{defender}`", *texts, f"{cpu_s:.2f}")


def residuals() -> Iterable[str]:
    """For each cell the largest residual of `joint` in the episode, and the decisions below its tolerance."""
    yield from header("attack", "gap (m)", "tau (s)", "largest residual", f"decisions below {BEST.tolerance:g}")
    for attacker in ("lead", "table_2_3"):
        for gap_m in DESIRED_GAPS_M:
            for tau_s in TAUS_S:
                left = residuals_of(DISBANDING.config("paper", {"tau_s": tau_s, "desired_gap_m": gap_m}), attacker)
                share = float(np.mean(left < BEST.tolerance))
                yield row(f"`{attacker}`", f"{gap_m:g}", f"{tau_s}", f"{left.max():.4f}", f"{share:.1%}")


def residuals_of(config: Any, attacker: str) -> FloatArray:
    """The residual of each decision of `joint` in an episode, see `joint_program.solve_joint`."""
    game = DISBANDING.game(config, 1)
    players = {"attacker": attacker, "defender": "joint"}
    match = Match(game, {role: resolve_policy(name, game.spec(role)) for role, name in players.items()})  # type: ignore[arg-type, misc]
    match.reset(np.ones(1, np.bool_), [np.random.default_rng(0)])
    found = []
    while game.elapsed[0] < game.horizon and not game.terminated[0]:
        match.step({}, np.ones(1, np.bool_), game.decision_interval["defender"])
        found.append(float(match.beliefs("defender")["residual"][0]))
    return np.array(found)


def timed_play(config: Any, attacker: str, defender: str, seeds: Sequence[int]) -> tuple[dict[str, Array], float]:
    """The outcome of episodes, and the CPU seconds that they took."""
    started = time.process_time()
    outcome = play_episodes(DISBANDING, config, {"attacker": attacker, "defender": defender}, seeds)
    return outcome, time.process_time() - started


def header(*titles: str) -> Iterable[str]:
    """The first two lines of a table."""
    yield row(*titles)
    yield "|" + "---|" * len(titles)


def row(*texts: str) -> str:
    """A line of a table."""
    return f"| {' | '.join(texts)} |"


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", choices=("bounds", "cells", "learning", "residuals"))
    parser.add_argument("--defender", action="append", help="only this one; may be repeated")
    parser.add_argument("--episodes", type=int, default=20, help="of each meeting in `learning`")
    given = parser.parse_args()
    defenders = given.defender or DEFENDERS
    tables = {
        "bounds": bounds(),
        "cells": cells(defenders),
        "learning": learning(defenders, given.episodes),
        "residuals": residuals(),
    }
    for line in tables[given.table]:
        print(line, flush=True)


if __name__ == "__main__":
    main()
