"""Which other trained policy does better, by the published tables in which both are examined."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from cps_agents.zoo.card import Card
from cps_agents.zoo.references import PREFIX

MOST = 0.5  # share of the common rows beyond which a rival is named


def better_rival(card: Card, rivals: Sequence[Card]) -> str:
    """The rival with the better mean in most rows of the tables of both, as a sentence; empty where nobody has it.

    More is better for attackers and less for defenders, as in the tables.
    """
    found = [(sum(rows.values()) / len(rows), len(rows), name, rows) for name, rows in _compared(card, rivals) if rows]
    share, count, name, rows = max(found, key=lambda each: each[:3], default=(0.0, 0, "", {}))
    where = "every row" if share == 1 else f"{sum(rows.values())} of {count} rows"
    tables = ", ".join(sorted({table for table, _ in rows}))
    return f"{PREFIX}{name} has the better mean in {where} of {tables}." if share > MOST else ""


def _compared(card: Card, rivals: Sequence[Card]) -> Iterator[tuple[str, Mapping[tuple[str, str], bool]]]:
    """For each rival in the same role: its name, and whether it is better, by table and row of both."""
    sign = 1.0 if card.role == "attacker" else -1.0
    mine = _means(card)
    for rival in (each for each in rivals if (each.problem, each.role) == (card.problem, card.role)):
        other = _means(rival)
        yield rival.name, {at: sign * (other[at] - mine[at]) > 0 for at in mine.keys() & other.keys()}


def _means(card: Card) -> Mapping[tuple[str, str], float]:
    """What a policy reached, by table and row."""
    return {
        (table, row): found["mean"]
        for table, rows in card.evaluation.items()
        for row, found in rows.items()
        if isinstance(found, Mapping) and "mean" in found
    }
