"""`python -m tools.rogue.judging FILE`: the shipped numbers of `box_in` beside those of a file, on the same episodes.

The file is what `tools.rogue.rounds --out` wrote, or `searched.json` of another commit. Every attacker that can play
meets both, and so do the laws that searches with a seed of their own find against each of both: the worst law of all
is chosen for each in some worlds and judged in others, at half the step.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from cps_agents.arena.admission import able, usual
from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.console import note, out
from cps_agents.sheet import Sheet
from cps_baselines.arena import Contestant, Venue
from cps_baselines.rogue.families import BOXING_IN
from cps_baselines.searched import searched
from cps_envs.core.declare.config import configure
from cps_envs.core.documents import read_entry
from cps_envs.core.types import FloatArray
from cps_paper.rogue.worlds import SETTING
from tools.command import run
from tools.recipes.rogue import EXPLOITERS
from tools.rogue.rounds import EVERY_RATIO, RATIOS, boxed_in, damages, play, search_attacks

POLICY = "box_in"
CHOSEN, JUDGED = 40_000_000, 50_000_000  # first seeds, of worlds that no search has seen
HEAD = ("", "shipped", "file", "shipped less file")


def numbers_in(path: Path) -> FloatArray:
    """The numbers (1, 38) in a file.

    Raises:
        DamagedFileError, OSError: it is no such file.
    """
    document = read_entry(path, "file of numbers", "Make it with `python -m tools.rogue.rounds --out FILE`.")
    row = document.entries().get(POLICY, document)["numbers"]
    return np.array([[row[name].number() for name in BOXING_IN.names]])


def attackers() -> tuple[Contestant, ...]:
    """All that can play where `box_in` does, but those that are told the opponent."""
    venue = Venue("rogue", "paper", {**SETTING, "defense_action": "command"})
    return able(venue, "attacker", usual(venue, "attacker"))


def outcomes(attacker: Contestant, numbers: FloatArray, episodes: int) -> tuple[FloatArray, FloatArray]:
    """Damages (m/s) and formation costs (s), (P, episodes), of an attacker of any power against numbers (P, 38)."""
    config, seeds = configure(boxed_in(EVERY_RATIO), attacker.overrides), range(JUDGED, JUDGED + episodes)
    found = play(config, attacker.reference, np.repeat(numbers, episodes, axis=0), [*seeds] * len(numbers))
    damage, cost = (found[name].reshape(len(numbers), episodes) for name in ("damage", "formation_cost_s"))
    return damage, cost


def worst_damages(numbers: FloatArray, laws: FloatArray, ratio: float, worlds: int) -> FloatArray:
    """Damages (P, worlds), m/s, of the law in (A, 7) that does most to each of the numbers (P, 38) in other worlds."""
    some = damages(numbers, laws, ratio, range(CHOSEN, CHOSEN + worlds), refined=True).mean(axis=2)
    others = range(JUDGED, JUDGED + worlds)
    worst = [laws[[place]] for place in some.argmax(axis=1)]
    found = [damages(numbers[[k]], law, ratio, others, refined=True)[0, 0] for k, law in enumerate(worst)]
    return np.array(found)


def judging(
    file: Annotated[Path, typer.Argument(help="Numbers to compare with: of rounds --out, or another searched.json.")],
    episodes: Annotated[int, typer.Option(min=2, help="Of each attacker.")] = 100,
    worlds: Annotated[int, typer.Option(min=2, help="In which a worst law is chosen, and as many that judge it.")] = 32,
    attacks: Annotated[int, typer.Option(min=3, help="Generations of each search for an attack.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Of the searches.")] = 100,
) -> None:
    """Compare the shipped numbers of box_in with others, against all attackers and freshly searched ones."""
    both = np.concatenate([BOXING_IN.row(searched("rogue", POLICY)), numbers_in(file)])
    rows, costs = [], []
    for attacker in attackers():
        damage, cost = outcomes(attacker, both, episodes)
        rows.append(_row(attacker.name, damage))
        costs.append(cost)
        note("  ".join(rows[-1]))
    for ratio in RATIOS:
        laws = np.array(EXPLOITERS)
        found = [search_attacks(each[np.newaxis], ratio, laws, seed, attacks) for each in both]
        rows.append(
            _row(f"worst law, ratio {ratio}", worst_damages(both, np.concatenate([laws, *found]), ratio, worlds))
        )
        note("  ".join(rows[-1]))
    rows.append(_row("formation cost of all attackers, s", np.mean(costs, axis=0)))
    out().print(Sheet(f"Damage to {POLICY}, m/s", HEAD, rows))


def _row(name: str, values: FloatArray) -> tuple[str, ...]:
    """Means of values (2, episodes), and the difference in pairs."""
    one, two = values.mean(axis=1)
    return name, f"{one:.2f}", f"{two:.2f}", _interval(estimate([(values[0] - values[1])[np.newaxis]]))


def _interval(found: Estimate) -> str:
    return f"{found.mean:+.2f} ({found.low:+.2f} to {found.high:+.2f})"


if __name__ == "__main__":
    run(judging, "python -m tools.rogue.judging")
