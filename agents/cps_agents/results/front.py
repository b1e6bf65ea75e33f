"""The table on the first page: one row for each role, beside the paper's method and what is possible."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cps_agents.results.document import Document
from cps_agents.results.tables import Block, number, optimum, score_text
from cps_agents.table import Table
from cps_agents.zoo.references import card_of, is_missing

HEAD = ("role: what counts", "paper's method", "best computed", "learned", "best possible", "exploitability")


@dataclass(frozen=True)
class Front:
    """The row of the results that stands for a role."""

    role: str
    counts: str  # what the numbers are, and whether more or less is better
    block: str
    row: str
    learned: str
    paper: str = ""  # the baseline that is the paper's method; the paper has none if empty
    possible: str = ""  # where the row does not say what is
    unit: str = ""  # of the worst attack's pay, where it is not that of the row


FRONTS = (
    Front(
        "disbanding, attacker",
        "slower traffic, collisions ↑",
        "disbanding-attack-plans",
        "one to four platoons",
        "searched",
        "ga",
    ),
    Front(
        "disbanding, defender",
        "slower traffic, % ↓",
        "disbanding-defense-searched",
        "Table 2.2, tau = 0.1 s, x_d = 5 m",
        "broadcast",
        "mpc",
        possible="bound 11.9",  # gaps of 1 m; python -m cps_baselines.disbanding.yardsticks bounds
        unit="points",
    ),
    Front(
        "false data, attacker",
        "share of the best impact ↑",
        "fdi-attack",
        "one sensor, 14 tasks",
        "learned",
        "bnb",
    ),
    Front(
        "false data, defender",
        "impact, m/s ↓",
        "fdi-defense-searched",
        "against tracker",
        "searched",
    ),
    Front(
        "HVAC, attacker",
        "error of 3 sensors, °C² ↑",
        "hvac-attack-mtd2-searched",
        "mtd2, 3 of 4 sensors",
        "searched",
        "constant",
    ),
    Front(
        "HVAC, defender",
        "error, °C² ↓",
        "hvac-defense-searched",
        "mean over all attacks of the contest",
        "searched",
        "mtd2",
    ),
    Front(
        "rogue, attacker",
        "damage, m/s ↑",
        "rogue-attack",
        "all six, ratio 1",
        "recurrent",
        "square",
    ),
    Front(
        "rogue, defender",
        "damage, m/s ↓",
        "rogue-defense",
        "mean of the eight rows below",
        "searched",
        "disband_7",
    ),
)


def front_table(document: Document, fronts: tuple[Front, ...] = FRONTS) -> list[str]:
    """The lines of the table; roles that the document does not have are left out."""
    blocks = {block["name"]: block for problem in document["problems"].values() for block in problem["blocks"]}
    found = [(front, _row(blocks, front.block, front.row)) for front in fronts]
    return Table("", HEAD, [_cells(front, blocks, row) for front, row in found if row is not None]).markdown()


def _row(blocks: Mapping[str, Block], block: str, title: str) -> Mapping[str, Any] | None:
    rows = blocks[block]["rows"] if block in blocks else []
    return next((row for row in rows if row["title"] == title), None)


def _cells(front: Front, blocks: Mapping[str, Block], row: Mapping[str, Any]) -> list[str]:
    block = blocks[front.block]
    possible = front.possible or optimum(block, row).rpartition("; ")[2].partition(" (")[0]
    return [
        f"{front.role}: {front.counts}",
        _number(front, block, row, front.paper) if front.paper else "none",
        _best(front, block, row),
        score_text(block, row, front.learned, beside=False),
        possible or "not known",
        _exploitability(front, block, row),
    ]


def _number(front: Front, block: Block, row: Mapping[str, Any], name: str) -> str:
    """A baseline and its mean; a star says that it played fewer episodes than the learned policy."""
    titles = {each["name"]: each["title"] for each in block["baselines"]}
    score = row["scores"].get(name)
    if not score:
        return "not played"
    fewer = score["episodes"] < row["scores"][front.learned]["episodes"]
    return f"{titles[name]} {number(block, row, score['mean'])}{'*' if fewer else ''}"


def _best(front: Front, block: Block, row: Mapping[str, Any]) -> str:
    """The best baseline that is not told more than its role may know."""
    sign = 1.0 if block["role"] == "attacker" else -1.0
    known = {
        each["name"]: sign * row["scores"][each["name"]]["mean"]
        for each in block["baselines"]
        if not each["optimum"] and each["name"] in row["scores"]
    }
    return _number(front, block, row, max(known, key=lambda name: known[name])) if known else "none"


def _exploitability(front: Front, block: Block, row: Mapping[str, Any]) -> str:
    """What the worst attack found is paid; of an attacker, how much of the best attack known it reaches.

    Where the row knows the best of all searches its share counts: the card's yardstick is only what can play quickly.
    """
    if share := row.get("shares", {}).get(front.learned):
        return f"{share:.1%} of best"
    reference = next(each["policy"] for each in block["learned"] if each["name"] == front.learned)
    card = None if is_missing(reference) else card_of(reference)
    if card is not None and card.exploitability:
        return f"{card.exploitability['pay']['mean']:.2f} {front.unit}".rstrip()
    if card is not None and card.share:
        return f"{card.share['share']['mean']:.1%} of best"
    return "not judged"
