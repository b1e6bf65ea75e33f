"""What `score verify` and the boards refuse and count, by value, of scores whose episodes nobody has to play."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs the baselines")

from cps_agents.errors import CommandError
from cps_agents.scoring import board, frozen, verify
from cps_agents.scoring.kind import Kind
from cps_agents.scoring.playing import parted, seeds_of
from cps_agents.scoring.score import Score
from cps_agents.zoo.references import Origin
from cps_envs.core.documents import DamagedFileError
from tests.agents.test_scoring import BEST, DEFENSE, EPISODES, MADE, SMALL, made

OPPONENTS = ("cusum", "chi2")
Edit = Callable[[dict[str, Any]], None]


@pytest.fixture(autouse=True)
def _tracks(monkeypatch: pytest.MonkeyPatch) -> None:
    """The only track is the small one, with pays that are made up."""
    monkeypatch.setattr(verify, "find_track", lambda name: SMALL)
    monkeypatch.setattr(verify, "read_frozen", lambda track: MADE)
    monkeypatch.setattr(frozen.Frozen, "check_game", lambda self: None)


class Stage:
    """Plays a policy by giving back what a score states, but for what `change` adds, and keeps what it was asked."""

    def __init__(self, stated: Score, change: Any = 0.0) -> None:
        self.stated, self.change, self.asked = stated, change, []  # type: ignore[var-annotated]
        count = len(stated.pays)
        whole = seeds_of(SMALL, stated.split, stated.episodes)
        self.known = {}
        for name, part in zip(stated.pays, parted(whole, count), strict=True):
            for place, own in enumerate(part):
                values = stated.pays[name][place]
                self.known |= {(name, place, seed): value for seed, value in zip(own, values, strict=True)}

    def __call__(self, track: Any, player: Any, seeds: Any) -> list[Any]:
        self.asked.append((player, [list(own) for own in seeds]))
        name = player.partition("seed=")[2]
        paid = [np.array([self.known[name, place, seed] for seed in own]) for place, own in enumerate(seeds)]
        flat = np.concatenate(paid)
        flat[: np.size(self.change)] += self.change
        return np.split(flat, [len(paid[0])])


def players(found: Score) -> dict[int | None, Any]:
    return {int(name) if name else None: f"p?seed={name}" for name in found.pays}


def replayed(found: Score, change: Any, monkeypatch: pytest.MonkeyPatch, draw: int = 0) -> tuple[str, Stage]:
    stage = Stage(found, change)
    monkeypatch.setattr(verify, "pays", stage)
    return verify._replayed(found, players(found), np.random.default_rng(draw)), stage


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (0.0, "100%"),
        (np.full(32, 0.0019), "100%"),
        (np.full(32, -0.0019), "100%"),
        ([1.2], "97%"),  # one of 32, and the mean is 0.94 points off
        ([-1.2], "97%"),
        ([1.4], None),  # 1.09
        ([-1.4], None),
        ([0.01, 0.01], None),  # two of 32 are more than 5%
        (np.full(32, 0.0021), None),
    ],
)
def test_episodes_have_to_end_as_stated(change: Any, told: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    if told is None:
        with pytest.raises(CommandError, match=r"'mine' does not play as the file says: \d+% of 32 episodes end alike"):
            replayed(made(), change, monkeypatch)
        return
    text, stage = replayed(made(), change, monkeypatch)
    assert text == f"32 episodes played again: {told} end as the file says"
    ((player, seeds),) = stage.asked
    assert player == "p?seed="
    for own, every in zip(seeds, seeds_of(SMALL, "test", EPISODES), strict=True):
        assert own == sorted(set(own))
        assert len(own) == verify.DRAWN
        assert set(own) <= set(every)
    assert seeds[0] != [seed - seeds[1][0] + seeds[0][0] for seed in seeds[1]]  # drawn for each opponent


def test_one_training_seed_plays_its_part_again(monkeypatch: pytest.MonkeyPatch) -> None:
    found, met = made(4), set()
    for draw in range(12):
        text, stage = replayed(found, 0.0, monkeypatch, draw)
        assert text == "12 episodes played again: 100% end as the file says"
        ((player, seeds),) = stage.asked
        place = int(player[-1])
        assert seeds == [list(own[6 * place : 6 * place + 6]) for own in seeds_of(SMALL, "test", EPISODES)]
        met.add(place)
    assert met == {0, 1, 2, 3}


def audited(off: float, monkeypatch: pytest.MonkeyPatch, seeds: int = 1) -> tuple[str, list[Any]]:
    """An audit in which the policy scores as stated, but for `off` points."""
    found, asked = made(seeds), []  # type: ignore[var-annotated]
    shown = [(score - 100) / 25 for score in found.opponents.values()]
    known = [np.linspace(5, 7, 6 if seeds < 4 else 8), np.linspace(4, 8, 6 if seeds < 4 else 8)]

    def pays(track: Any, player: Any, own: Any) -> list[Any]:
        asked.append((player, [list(each) for each in own]))
        size, place = len(own[0]), int(player.partition("seed=")[2] or 0)
        parts = [best[place * size : (place + 1) * size] for best in known]
        return [best + less + 0.04 * off for best, less in zip(parts, shown, strict=True)]

    monkeypatch.setattr(verify, "pays", pays)
    monkeypatch.setattr(verify, "answers", lambda track, every: known)
    return verify._audited(found, players(found), 7), asked


def test_an_audit_plays_a_quarter_of_the_episodes_on_seeds_of_its_draw(monkeypatch: pytest.MonkeyPatch) -> None:
    text, asked = audited(0.0, monkeypatch)
    assert text.startswith(f"audit 7: {made().estimate.mean:.1f} ± ")
    assert asked == [("p?seed=", [list(own) for own in seeds_of(SMALL, "audit", 6, 7)])]
    _, asked = audited(0.0, monkeypatch, seeds=4)  # two episodes each at least
    every = seeds_of(SMALL, "audit", 8, 7)
    parts = [[list(own[2 * place : 2 * place + 2]) for own in every] for place in range(4)]
    assert asked == [(f"p?seed={place}", parts[place]) for place in range(4)]


def test_an_audit_allows_two_half_widths_of_the_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    most = 2 * made().half_width  # what is played in the audit above has none of its own
    for share in (-0.98, 0.98):
        assert "on fresh seeds" in audited(share * most, monkeypatch)[0]
    for share in (-1.02, 1.02):
        with pytest.raises(CommandError, match=rf"fresh seeds, [+-]\d+\.\d from the stated .*: more than {most:.1f}"):
            audited(share * most, monkeypatch)


def written(found: Score, folder: Path, edit: Edit | None = None, name: str = "mine") -> Path:
    document = found.to_json()
    if edit is not None:
        edit(document)
    folder.mkdir(exist_ok=True)
    path = folder / f"{name}.json"
    path.write_text(json.dumps(document))
    return path


def test_a_file_says_again_all_that_it_was_made_of(tmp_path: Path) -> None:
    kind = Kind("searched", 7)
    found = made(2, policy="x", kind=kind, cpu_s=1.5, sources={"a": "1"}, versions={"numpy": "2"}, playable=False)
    again = verify.read_score(written(found, tmp_path))
    for name in ("split", "policy", "kind", "sources", "playable", "cpu_s", "versions", "line"):
        assert getattr(again, name) == getattr(found, name), name
    for seed, rows in found.pays.items():
        np.testing.assert_array_equal(again.pays[seed], np.round(rows, 3))
    look = made(split="dev", pays={"": [best[:3] - 1.0 for best in BEST]})
    assert verify.read_score(written(look, tmp_path)).episodes == 3


def raised(name: str, by: float) -> Edit:
    def edit(document: dict[str, Any]) -> None:
        document[name] += by

    return edit


def opponent(name: str, by: float) -> Edit:
    return lambda document: document["opponents"].update({name: document["opponents"][name] + by})


@pytest.mark.parametrize("by", [-1.0, 1.0])
@pytest.mark.parametrize("what", ["score", *OPPONENTS])
def test_stated_numbers_may_be_rounded_and_no_more(what: str, by: float, tmp_path: Path) -> None:
    def edit(size: float) -> Edit:
        return raised(what, size) if what == "score" else opponent(what, size)

    found = made(pays={"": [np.round(paid, 3) for paid in made().pays[""]]})
    verify.read_score(written(found, tmp_path, edit(0.014 * by)))
    with pytest.raises(DamagedFileError, match="its line or its scores are not those of its own pays"):
        verify.read_score(written(found, tmp_path, edit(0.03 * by)))


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"line": "other"}, DamagedFileError, "its line or its scores"),
        ({"opponents": {"cusum": 1.0}}, DamagedFileError, "its line or its scores"),
        ({"digest": "1" * 12}, CommandError, "digest 111111111111 instead of 000000000000: score the policy again"),
        ({"challenge": "challenge-v0"}, DamagedFileError, "challenge is"),
        ({"split": "audit"}, DamagedFileError, "split is"),
        ({"kind": "magic"}, DamagedFileError, "kind is"),
        ({"numbers": 10**6 + 1}, DamagedFileError, "numbers is"),
        ({"numbers": -1}, DamagedFileError, "numbers is"),
        ({"cpu_s": -1}, DamagedFileError, "cpu_s is"),
        ({"pays": {}}, DamagedFileError, "pays of at least one training seed"),
        ({"pays": {"": [" ".join(["3"] * (EPISODES - 1))] * 2}}, DamagedFileError, "24 finite numbers"),
        ({"pays": {"": [" ".join(["3"] * EPISODES)]}}, DamagedFileError, "each of the 2 opponents"),
    ],
    ids=lambda value: next(iter(value), "") if isinstance(value, dict) else "",
)
def test_other_files_are_refused(change: Any, error: type[Exception], message: str, tmp_path: Path) -> None:
    with pytest.raises(error, match=message):
        verify.read_score(written(made(), tmp_path, lambda document: document.update(change)))


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What a verification does, one thing after the other; its policy has two training seeds and one network."""
    done: list[Any] = []
    origin = Origin(None, (), {0: "p?seed=0", 1: "p?seed=1"}, {"net": "1"})
    monkeypatch.setattr(verify, "origin_of", lambda problem, policy: done.append((problem, policy)) or origin)
    monkeypatch.setattr(frozen.Frozen, "check_game", lambda self: done.append("the game"))
    monkeypatch.setattr(verify, "_replayed", lambda found, own, generator: f"again {sorted(own)}")
    monkeypatch.setattr(verify, "_audited", lambda found, own, draw: f"audit {draw}")
    monkeypatch.setattr(verify.secrets, "randbelow", lambda most: most - 1)
    return done


def test_a_verification_checks_the_game_plays_again_and_audits_if_asked(said: list[Any], tmp_path: Path) -> None:
    path = written(made(2, sources={"net": "1"}), tmp_path)
    start: list[Any] = [("fdi", "mine"), "the game", "again [0, 1]"]
    for options, more in (({}, []), ({"audit": True, "draw": 0}, ["audit 0"]), ({"audit": True}, ["audit 99999"])):
        said.clear()
        found = verify.verify(path, say=said.append, **options)  # type: ignore[arg-type]
        assert said == start + more
        assert found.line == made(2).line


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"sources": {"net": "1"}, "playable": False}, "was a Python object; save it"),
        ({"sources": {"net": "2"}}, "are not those that were scored"),
        ({"sources": {}}, "are not those that were scored"),
        ({"sources": {"net": "1"}, "pays": made(3).pays}, "has other training seeds than those that were scored"),
    ],
    ids=str,
)
def test_another_policy_is_refused_before_it_plays(changed: Any, message: str, said: list[Any], tmp_path: Path) -> None:
    with pytest.raises(CommandError, match=message):
        verify.verify(written(made(2, **changed), tmp_path), say=said.append)
    assert "the game" not in said


NOISE = np.random.default_rng(0).normal(0, 0.3, (2, EPISODES))
NOISE -= NOISE.mean(axis=1, keepdims=True)


def chain() -> dict[str, Score]:
    """Two ties in a row whose ends differ, and one who is told more."""

    def paid(*parts: Any) -> Any:
        return {"": list(np.round(np.stack(BEST) - 2.0 + sum(parts), 3))}

    return {
        "told": made(pays=paid(2.0), kind=Kind("told")),
        "first": made(pays=paid(0.07, 0.0 * NOISE)),
        "second": made(pays=paid(NOISE), kind=Kind("rules")),
        "third": made(pays=paid(-0.07, 0.0 * NOISE), kind=Kind("searched", 3)),
        "last": made(pays=paid(-1.0), kind=Kind("imitation")),
    }


def test_a_rank_is_shared_with_its_first_and_not_with_the_row_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board, "entries", lambda track, folder: chain())
    rows = board.board(SMALL)
    assert [(row.name, row.rank, row.exploit) for row in rows] == [
        ("told", 0, None),
        ("first", 1, None),
        ("second", 1, None),  # not surely worse than the first
        ("third", 3, None),  # not surely worse than the second, but than the first
        ("last", 4, None),
    ]
    table = board.table(SMALL, rows)
    assert [(row[0], row[1], row[6]) for row in table.rows] == [
        ("told", "told", "told"),
        ("first", "1", "network, by reward, 1 training seed(s)"),
        ("second", "1", "rules"),
        ("third", "3", "3 searched numbers"),
        ("last", "4", "network, by imitation, 1 training seed(s)"),
    ]
    assert table.rows[1][2] == f"{100 - 25 * 1.93:.1f}"
    assert table.rows[4][4] == "25 (cusum)"
    front = board.front({"fdi-attack": rows, "none": []}).rows
    assert [cell.partition(" ")[0] for cell in front[0]] == ["fdi-attack", "second", "third", "first", "told"]
    assert front[0][1].startswith("second 50 ± ")
    assert len(front) == 1
    assert board.kind_text(made(5)) == "network, by reward"
    assert board.kind_text(made(4)) == "network, by reward, 4 training seed(s)"


def test_a_line_counts_who_is_surely_better(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board, "entries", lambda track, folder: chain())
    ranks = {name: board.rank_line(each) for name, each in chain().items()}
    assert ranks["told"] == "Without a rank: it is told more than its role observes."
    assert ranks["first"] == ranks["second"] == "Rank 1 on the board: of its 4 entries none is surely better."
    assert ranks["third"] == "Rank 2 on the board: of its 4 entries one is surely better."
    assert ranks["last"] == "Rank 4 on the board: of its 4 entries 3 are surely better."
    assert board.rank_line(replace(chain()["last"], split="dev")) == ""
    monkeypatch.setattr(board, "entries", lambda track, folder: {"told": chain()["told"]})
    assert board.rank_line(chain()["last"]) == ""


def test_entries_are_the_files_of_a_folder_the_best_first(tmp_path: Path) -> None:
    folder = tmp_path / "fdi-attack"
    for name, each in reversed(chain().items()):
        written(each, folder, name=name)
    assert list(board.entries(SMALL, tmp_path)) == list(chain())
    assert list(board.entries(DEFENSE, tmp_path)) == []
    look = made(split="dev", pays={"": [best[:3] - 1.0 for best in BEST]})
    path = written(look, folder, name="look")
    with pytest.raises(CommandError, match="is no score of fdi-attack on split test: it belongs elsewhere"):
        board.entries(SMALL, tmp_path)
    path.unlink()
    (tmp_path / "fdi-defense").mkdir()
    written(chain()["last"], tmp_path / "fdi-defense")
    with pytest.raises(CommandError, match="is no score of fdi-defense on split test"):
        board.entries(DEFENSE, tmp_path)


def test_a_best_response_is_to_the_score_that_it_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    class Found:
        def __init__(self, fits: bool) -> None:
            self.fits = lambda score: fits

    answers: Any = {"first": Found(True), "second": Found(False), "told": Found(True)}
    monkeypatch.setattr(board, "entries", lambda track, folder: chain())
    monkeypatch.setattr(board, "read_exploits", lambda folder: {"fdi-attack": answers})
    found = {row.name: row.exploit for row in board.board(SMALL)}
    assert (found["first"], found["told"]) == (answers["first"], answers["told"])
    assert found["second"] is found["third"] is None


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
