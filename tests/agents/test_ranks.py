"""What the leaderboard counts, by value, of scores whose episodes nobody has to play."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs the baselines")

from cps_agents.arena.statistics import Estimate
from cps_agents.scoring import board
from cps_agents.scoring.kind import Kind
from cps_agents.scoring.score import Score
from tests.agents.test_scoring import BEST, EPISODES, SMALL, made

NOISE = np.random.default_rng(0).normal(0, 0.3, (2, EPISODES))
NOISE -= NOISE.mean(axis=1, keepdims=True)


def chain() -> dict[str, Score]:
    """Two ties in a row whose ends differ, and one who is told more."""

    def paid(*parts: Any) -> Any:
        return {"": list(np.round(np.stack(BEST) - 2.0 + sum(parts), 3))}

    return {
        "told": made(pays=paid(2.0), kind=Kind("privileged")),
        "first": made(pays=paid(0.07, 0.0 * NOISE), kind=Kind("hand-set")),
        "second": made(pays=paid(NOISE), kind=Kind("searched", numbers=1)),
        "third": made(pays=paid(-0.07, 0.0 * NOISE), kind=Kind("searched", numbers=3)),
        "net": made(pays=paid(-0.5), began=made(pays=paid(-2.0))),
        "last": made(pays=paid(-1.0), kind=Kind("hand-set")),
        "advised": made(pays=paid(-1.5), kind=Kind("advised", by="pd")),
    }


def test_a_rank_is_shared_with_its_first_and_not_with_the_row_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board, "entries", lambda track, folder: chain())
    rows = board.board(SMALL)
    assert [(row.name, row.rank) for row in rows] == [
        ("told", 0),
        ("first", 1),
        ("second", 1),  # not surely worse than the first
        ("third", 3),  # not surely worse than the second, but than the first
        ("net", 1),  # of the networks from scratch
        ("last", 4),
        ("advised", 1),  # of the advised ones
    ]
    table = board.table(SMALL, rows)
    assert [row[:3] for row in table.rows] == [
        ("told", "privileged", "-"),
        ("first", "hand-set", "1"),
        ("second", "tuned by search, 1 number", "1"),
        ("third", "tuned by search, 3 numbers", "3"),
        ("net", "network from scratch, 1 training seed", "1"),
        ("last", "hand-set", "4"),
        ("advised", "network advised by pd, 1 training seed", "1"),
    ]
    assert table.rows[1][3] == f"{100 - 25 * 1.93:.1f} ± 0.0"
    assert table.rows[4][4:6] == ("0.0", "+37.5 (+37.5 to +37.5)")
    assert table.rows[5][4:] == ("", "", "25 (cusum)", "-")
    front = board.front({"fdi-attack": rows, "none": []}).rows
    assert [cell.partition(" ")[0] for cell in front[0]] == ["fdi-attack", "first", "second", "net", "advised", "told"]
    assert front[0][2].startswith("second 50 ± ")
    assert len(front) == 1
    assert board.kind_text(made(5, began=made(1))) == "network from scratch"
    assert board.kind_text(made(4, began=made(1))) == "network from scratch, 4 training seeds"
    assert board.kind_text(made(5)) == "network from scratch, by its adapter's name alone"
    unplayed = [replace(row, score=replace(row.score, began=None)) for row in rows]
    assert board.front({"fdi-attack": unplayed}).rows[0][3] == board.NONE_YET


def test_a_row_names_the_worst_training_seed() -> None:
    found = made(5)
    low = min(found.by_seed, key=lambda seed: found.by_seed[seed])
    assert board._cells(board.BoardEntry("x", found, 1))[3].endswith(f", seed {low}: {found.by_seed[low]:.1f}")


def test_a_line_counts_who_is_surely_better_of_its_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board, "entries", lambda track, folder: chain())
    ranks = {name: board.rank_line(each) for name, each in chain().items()}
    start = "of its kind, controller: of 4 on the leaderboard"
    assert ranks["told"] == "Without a rank: it is privileged, told more than its role observes."
    assert ranks["first"] == ranks["second"] == f"Rank 1 {start} none is surely better."
    assert ranks["third"] == f"Rank 2 {start} one is surely better."
    assert ranks["last"] == f"Rank 4 {start} 3 are surely better."
    assert ranks["net"].startswith("Rank 1 of its kind, network from scratch: of 1 ")
    assert board.rank_line(replace(chain()["last"], split="dev")) == ""
    monkeypatch.setattr(board, "entries", lambda track, folder: {"told": chain()["told"]})
    assert board.rank_line(chain()["last"]) == "The leaderboard has no controller yet."


def test_a_best_response_is_to_the_network_that_it_fits_and_the_worst_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    class Found:
        def __init__(self, mean: float, seed: int | None = None, fits: bool = True) -> None:
            self.pay = Estimate(mean, mean - 1, mean + 1, 1, 9)
            self.fits = lambda score, own=None: fits and own == seed

        def __str__(self) -> str:
            return f"{self.pay.mean:g}"

    known: Any = {
        "five": Found(4.0),
        "five?seed=2": Found(3.0, 2),
        "five?seed=3": Found(2.0, 3, fits=False),
        "five?seed=9": Found(1.0, 9),  # it has no such seed
        "one": Found(5.0),
    }
    monkeypatch.setattr(board, "entries", lambda track, folder: {"five": made(5), "one": made(1, draw=1)})
    monkeypatch.setattr(board, "read_exploits", lambda folder: {"fdi-attack": known})
    five, one = board.board(SMALL)
    assert dict(five.exploits) == {"": known["five"], "2": known["five?seed=2"]}
    assert five.worst == ("2", known["five?seed=2"])  # an attacker wants more
    assert board._cells(five)[7] == "3, to seed 2"
    assert board._cells(one)[7] == "5"


def test_agreement_is_of_entries_above_0_in_two_halves(monkeypatch: pytest.MonkeyPatch) -> None:
    draws = np.random.default_rng(3).normal(0, 1.0, (3, 2, EPISODES))
    scores = [made(pays={"": list(np.stack(BEST) - 2.0 + 0.2 * place + draws[place])}) for place in range(3)]
    low = made(pays={"": list(np.stack(BEST) - 9.0)})
    rows = [board.BoardEntry(str(rank), each, rank) for rank, each in enumerate([*scores, low], 1)]
    rows += [board.BoardEntry("told", low, 0)]
    found = board.agreement(rows)
    assert found is not None
    generator, taus, orders = np.random.default_rng(0), [], []
    for _ in range(board.HALVINGS):
        mixed = generator.permuted(np.broadcast_to(np.arange(EPISODES), (2, EPISODES)), axis=1)
        halves: list[Any] = []
        for half in (mixed[:, :12], mixed[:, 12:]):
            own = [np.take_along_axis(np.concatenate(each.strata), half, axis=1) for each in scores]
            order = []
            for a, b in ((0, 1), (0, 2), (1, 2)):
                apart = own[a] - own[b]
                error = np.hypot(*(apart.std(axis=1, ddof=1) / np.sqrt(12))) / 2
                order.append((np.sign(apart.mean()), abs(apart.mean()) > 1.96 * error))
            halves.append(order)
        pairs = list(zip(*halves, strict=True))
        orders.append(np.mean([one[0] * two[0] for one, two in pairs]))
        both = np.sqrt(sum(one[1] for one, _ in pairs) * sum(two[1] for _, two in pairs))
        if both:
            taus.append(sum(one[0] * two[0] for one, two in pairs if one[1] and two[1]) / both)
    assert found.entries == 3
    assert found.by_mean == pytest.approx(np.mean(orders))
    assert found.by_rank == pytest.approx(np.mean(taus))
    assert 0 < found.by_rank < 1
