"""Which policy does better than another one, as the catalogue and the cards say it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cps_agents.zoo.card import Card
from cps_agents.zoo.markdown import to_markdown
from cps_agents.zoo.rivals import better_rival
from tests.agents.command_line import invoke
from tests.agents.trained import save_tiny


def examined(card: Card, name: str, *means: float, table: str = "duel", **facts: Any) -> Card:
    """The card under another name, with these means in the rows of a table."""
    rows = {str(row): {"metric": "damage", "mean": mean} for row, mean in enumerate(means)}
    return replace(card, name=name, evaluation={table: rows, "other": {}}, **facts)


@pytest.fixture
def card(tmp_path: Path) -> Card:
    return save_tiny(tmp_path / "tiny.json", "rogue", "attacker")


@pytest.mark.parametrize(
    ("means", "says"),
    [
        ((2.0, 3.0, 4.0), "zoo:rival has the better mean in every row of duel."),
        ((2.0, 3.0, 2.5), "zoo:rival has the better mean in 2 of 3 rows of duel."),
        ((2.0, 1.0, 2.5), ""),
        ((1.0, 2.0, 3.0), ""),  # it equals the policy itself
    ],
)
def test_the_rival_with_most_rows_is_named(card: Card, means: tuple[float, ...], says: str) -> None:
    mine, rival = examined(card, "mine", 1.0, 2.0, 3.0), examined(card, "rival", *means)
    assert better_rival(mine, [mine, rival]) == says


def test_a_defender_wants_less_and_only_its_own_tables_count(card: Card) -> None:
    mine = examined(card, "mine", 1.0, 2.0, role="defender")
    assert better_rival(mine, [examined(card, "less", 0.5, 1.5, role="defender")]).startswith("zoo:less ")
    for other in (
        examined(card, "more", 2.0, 3.0, role="defender"),
        examined(card, "attacker", 0.5, 1.5),
        examined(card, "elsewhere", 0.5, 1.5, role="defender", problem="fdi"),
        examined(card, "alone", 0.5, 1.5, role="defender", table="exam"),
    ):
        assert not better_rival(mine, [other])


def test_the_catalogue_and_the_card_name_it(card: Card) -> None:
    text = "zoo:rogue-attack-recurrent has the better mean in every row of rogue-attack."
    assert f"rogue-attack-ppo: {text}" in " ".join(invoke("zoo", "list").stdout.split())
    for command in ("show", "card"):
        assert text in invoke("zoo", command, "rogue-attack-ppo").stdout
    assert text not in invoke("zoo", "card", "rogue-attack-recurrent").stdout
    mine, rival = examined(card, "mine", 1.0), examined(card, "rival", 2.0)
    assert "zoo:rival has the better mean in every row of duel." in to_markdown(mine, [rival])
