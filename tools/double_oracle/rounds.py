"""A double oracle where the defender's choices are a finite list and the attacker's are searched.

The matrix holds every defender and the attacks found so far. Each round solves it, searches an attack on the
defender's mixed strategy, and adds the attack as a row. The value rises from round to round; what the last search
found against the mixture says how far it may still rise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cps_agents.arena.statistics import Estimate
from cps_agents.league.equilibrium import guaranteed, solve
from cps_envs.core.types import FloatArray, IntArray


class Searched(Protocol):
    """A game with finitely many defenders and an oracle for attacks; an attack is a vector of numbers."""

    def first(self) -> list[FloatArray]:
        """Attacks to begin with."""

    def row(self, attack: FloatArray) -> FloatArray:
        """What an attack is paid by each defender (n,)."""

    def fresh(self, attack: FloatArray, defenders: IntArray) -> FloatArray:
        """What these defenders pay an attack in episodes that chose nothing (k, E)."""

    def respond(self, defender: FloatArray, known: FloatArray, number: int) -> FloatArray:
        """The attack of round `number` against a mixture (n,) of the defenders; `known` is the best one so far."""


@dataclass(frozen=True)
class Row:
    """An attack with what every defender pays it."""

    attack: FloatArray
    paid: FloatArray  # (n,)


@dataclass(frozen=True)
class Round:
    """The matrix of the attacks so far, solved."""

    value: float  # of the episodes that chose the strategies
    attacker: FloatArray  # (m,) probabilities of the rows so far
    defender: FloatArray  # (n,) probabilities of the defenders
    response: float  # what the attack that was searched next is paid by this mixture of defenders
    least: float  # what the best single defender concedes to the worst of the attacks so far


def play_rounds(game: Searched, rows: list[Row], rounds: int) -> Iterator[Round]:
    """So many rounds; each adds a row. `rows` may hold what an earlier run found: its rounds are not searched again."""
    starts = game.first()
    rows.extend(Row(attack, game.row(attack)) for attack in starts[len(rows) :])
    for number in range(rounds):
        count = len(starts) + number
        matrix = np.stack([row.paid for row in rows[:count]])
        found = solve(matrix)
        if len(rows) == count:
            known = rows[int((matrix @ found.defender).argmax())].attack
            attack = game.respond(found.defender, known, number)
            rows.append(Row(attack, game.row(attack)))
        response = float(rows[count].paid @ found.defender)
        yield Round(found.value, found.attacker, found.defender, response, float(matrix.max(axis=0).min()))


def fresh_value(game: Searched, rows: list[Row], found: Round) -> Estimate:
    """The value of the game of a round's attacks and all defenders, in episodes that did not choose the strategies."""
    attacking, defending = np.flatnonzero(found.attacker), np.flatnonzero(found.defender)
    attacks = [row.attack for row in rows[: len(found.attacker)]]
    everybody = np.arange(len(found.defender))
    paid = sum(found.attacker[k] * game.fresh(attacks[k], everybody) for k in attacking)
    conceded = np.stack([found.defender[defending] @ game.fresh(attack, defending) for attack in attacks])
    return guaranteed(np.asarray(paid), conceded, found.attacker @ conceded)
