"""`python -m tools.rogue.rounds`: search attacks on `box_in`, then its numbers against the worst of them, in turn.

At the end, fresh searches attack the old and the new numbers alike. The worst attack on each is chosen in some worlds
and judged in others, at half the step: see `cps_paper.rogue.worlds`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from cps_agents.console import note, out
from cps_agents.files import write_json
from cps_agents.sheet import Sheet
from cps_baselines.evolution import Evolution
from cps_baselines.rogue.boxing_in import BoxingIn
from cps_baselines.rogue.families import BOXING_IN
from cps_baselines.rogue.switching import SIZE, Switching, shipped_weights
from cps_baselines.searched import searched
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import Array, FloatArray
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.problem import ROGUE
from cps_paper.rogue.worlds import REPORTED, world_config
from tools.command import run
from tools.evolving import evolve
from tools.recipes.rogue import EXPLOITERS, SEARCHED, TUNED, WAVES
from tools.rogue.switching import SEARCHED as TRIED
from tools.rogue.switching import SELECTED

RATIOS = (1.15, 1.2, 1.25, 1.3)
EVERY_RATIO = (1.0, 1.3)  # of the usual attackers
USUAL = (SEARCHED, WAVES)  # nobody searched these against `box_in`: what they do must not grow
POPULATION = 16  # of every search
DEVIATION = 0.15  # of a search for numbers, in steps of the family
WORLDS, FINAL_WORLDS, USUAL_EPISODES = 3, 16, 12
WORST = 6  # attacks at each ratio that numbers are searched against
PRICE = 10.0  # of what the usual attackers do, or the formation costs, beyond what it was
Laws = dict[float, FloatArray]  # (A, 7) by power ratio


def damages(numbers: FloatArray, laws: FloatArray, ratio: float, worlds: range, *, refined: bool = False) -> FloatArray:
    """Damages (P, A, worlds), m/s, of laws (A, 7) against numbers (P, 38)."""
    count, config = len(worlds), boxed_in(ratio, refined=refined)
    attacker = Switching(
        ROGUE.game(config, 1).spec("attacker"), np.repeat(np.tile(laws, (len(numbers), 1)), count, axis=0)
    )
    rows, seeds = np.repeat(numbers, len(laws) * count, axis=0), [*worlds] * (len(numbers) * len(laws))
    done: FloatArray = play(config, attacker, rows, seeds)["damage"].reshape(len(numbers), len(laws), count)
    return done


def usual(numbers: FloatArray, first: int, episodes: int) -> FloatArray:
    """Damage (m/s) and formation cost (s) of each row of numbers (P, 38) where the usual attackers play, (P, 2)."""
    rows, seeds = np.repeat(numbers, episodes, axis=0), [*range(first, first + episodes)] * len(numbers)
    played = [play(boxed_in(EVERY_RATIO), attacker, rows, seeds) for attacker in USUAL]
    paid = np.array([[each[name] for name in ("damage", "formation_cost_s")] for each in played])
    means: FloatArray = paid.reshape(len(USUAL), 2, len(numbers), episodes).mean(axis=(0, 3)).T
    return means


def boxed_in(ratio: float | tuple[float, float], *, refined: bool = False) -> RogueConfig:
    """The worlds where `box_in` commands accelerations."""
    return replace(world_config(ratio, refined=refined), defense_action="command")


def play(config: RogueConfig, attacker: PolicyReference, numbers: FloatArray, seeds: list[int]) -> dict[str, Array]:
    """One episode per seed, each against its own row of numbers (B, 38)."""
    defender = BoxingIn(ROGUE.game(config, 1).spec("defender"), numbers)
    return play_episodes(ROGUE, config, {"attacker": attacker, "defender": defender}, seeds)


def search_attacks(numbers: FloatArray, ratio: float, known: FloatArray, seed: int, generations: int) -> FloatArray:
    """Laws that do much against numbers (1, 38): the best of the last generations from zero and from two known laws."""
    first, found = TRIED + seed * 10_000, []
    best = known[int(damages(numbers, known, ratio, range(first, first + WORLDS)).mean(axis=2).argmax())]
    for run_, origin in enumerate((np.zeros(SIZE), shipped_weights()["all", 1.3], best)):

        def judge(laws: FloatArray, generation: int) -> FloatArray:
            start = first + (1 + generation) * WORLDS
            done: FloatArray = damages(numbers, laws, ratio, range(start, start + WORLDS)).mean(axis=(0, 2))
            return done

        length = np.linalg.norm(origin)
        place, spread = (origin * np.sqrt(SIZE) / length, 0.5) if length else (origin, 1.0)
        sizes = {"population": POPULATION, "generations": generations}
        found += [law for _, law in evolve(judge, place, spread, **sizes, seed=[seed, run_])][-3:]
    return np.round(found, 4)


def search_numbers(numbers: FloatArray, laws: Laws, seed: int, generations: int) -> FloatArray:
    """Numbers (1, 38) against the worst laws at each ratio, with the usual attackers doing no more; begins at some."""
    starts = zip(BOXING_IN.numbers, numbers[0].tolist(), strict=True)
    family = replace(BOXING_IN, numbers=tuple(replace(each, start=start) for each, start in starts))
    evolution = Evolution(np.zeros(numbers.shape[1]), DEVIATION, seed=[seed], population=POPULATION)
    for generation in range(generations):
        first = TRIED + seed * 10_000 + 5_000 + generation * USUAL_EPISODES
        allowed = usual(numbers, first, USUAL_EPISODES)

        def judge(points: FloatArray, first: int = first, allowed: FloatArray = allowed) -> FloatArray:
            rows, worlds = family.values(points), range(first, first + WORLDS)
            done = [damages(rows, some, ratio, worlds).mean(axis=2).max(axis=1) for ratio, some in laws.items()]
            grown = np.maximum(0.0, usual(rows, first, USUAL_EPISODES) - allowed).sum(axis=1)
            worth: FloatArray = -np.mean(done, axis=0) - PRICE * grown
            return worth

        evolution.step(judge)
    return family.values(evolution.mean[np.newaxis])


def worst(numbers: FloatArray, laws: FloatArray, ratio: float) -> tuple[FloatArray, float]:
    """The law (7,) that does most against numbers (1, 38) in some worlds, and its mean damage in others, m/s."""
    chosen, judged = (range(first, first + FINAL_WORLDS) for first in (SELECTED, REPORTED))
    law = laws[int(damages(numbers, laws, ratio, chosen, refined=True)[0].mean(axis=1).argmax())]
    return law, float(damages(numbers, law[np.newaxis], ratio, judged, refined=True).mean())


def rounds(
    count: Annotated[int, typer.Option("--rounds", min=1, help="Search attacks and then numbers so often.")] = 3,
    generations: Annotated[int, typer.Option(min=1, help="Generations of each search for numbers.")] = 25,
    attacks: Annotated[int, typer.Option(min=3, help="Generations of each search for an attack.")] = 14,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the searches.")] = 0,
    to: Annotated[Path | None, typer.Option("--out", help="Write numbers and laws to this file.")] = None,
) -> None:
    """Search attacks on box_in at four power ratios, then its numbers against the worst, in turn."""
    old = new = BOXING_IN.row(searched("rogue", "box_in"))
    laws: Laws = dict.fromkeys(RATIOS, np.array(EXPLOITERS))
    for turn in range(seed, seed + count):
        for ratio, known in laws.items():
            found = search_attacks(new, ratio, known, turn, attacks)
            laws[ratio] = np.concatenate([known, found])
            note(f"round {turn - seed + 1}, ratio {ratio}: {worst(new, laws[ratio], ratio)[1]:.1f} m/s")
        first = range(TRIED, TRIED + WORLDS)
        doing = {ratio: damages(new, some, ratio, first)[0].mean(axis=1) for ratio, some in laws.items()}
        new = search_numbers(
            new, {ratio: laws[ratio][np.argsort(-done)[:WORST]] for ratio, done in doing.items()}, turn, generations
        )
    rows, kept = [], {}
    for ratio, known in laws.items():
        cells = []
        for numbers in (old, new):
            fresh = search_attacks(numbers, ratio, known, seed + count, attacks)
            law, done = worst(numbers, np.concatenate([known, fresh]), ratio)
            cells.append(f"{done:.1f}")
            kept[f"{ratio} {'new' if numbers is new else 'old'}"] = TUNED.format(*law)
        rows.append((f"worst attack, ratio {ratio}", *cells))
    before, after = usual(np.concatenate([old, new]), REPORTED, 200)
    names = ("usual attackers: damage", "usual attackers: formation cost, s")
    rows += [(name, f"{one:.2f}", f"{two:.2f}") for name, one, two in zip(names, before, after, strict=True)]
    out().print(Sheet("Damage, m/s", ("", "shipped numbers", "new numbers"), rows))
    if to is not None:
        write_json(to, {"numbers": dict(zip(BOXING_IN.names, new[0].tolist(), strict=True)), "worst": kept})


if __name__ == "__main__":
    run(rounds, "python -m tools.rogue.rounds")
