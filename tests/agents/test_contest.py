"""What a contest plays, finds and judges."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
import pytest

import cps_agents.contest.contest as module
from cps_agents.arena.store import Store
from cps_agents.contest.contest import choose_variants, find_contests, play_contest
from cps_agents.contest.document import document
from cps_agents.contest.jobs import Effort, Played
from cps_agents.contest.rules import judge
from cps_agents.contest.search import run_search, with_options
from cps_agents.contest.tables import END, markdown, publish, summary, tables
from cps_agents.errors import CommandError
from cps_agents.machine import available_cores
from cps_baselines.arena import Contestant
from cps_baselines.contest import Column, Constraint, Contest, Search, Side, Variant
from cps_envs.core.seeds import TRAINING_START, VALIDATION
from cps_envs.core.types import ROLES, FloatArray
from tests.agents.command_line import invoke

TINY = Effort(
    budget_s=0.5, screening_episodes=1, validation_episodes=2, finalists=2, final_responses=2, final_episodes=4
)
SOLVED = {"fdi": {("something is left to infer", "defender")}}  # by `zoo:fdi-defense-cma`; docs/contest.md says so
PUBLISHED = Path(__file__).parents[2] / "docs" / "contest.json"
QUIET = Column("damage", "quiet", "median", "{:.1f}", against="none")
SHORT = {"duration_s": 6.0, "contact": "solid"}


def rogue() -> Contest:
    return Contest(
        problem="rogue",
        attackers=Side(
            policies=(Contestant("none"), Contestant("square")),
            constants=("always?action=0", "always?action=2"),
            searches=(Search("wave", "square", {"frequency_hz": (0.05, 0.5)}),),
        ),
        defenders=Side(
            policies=(Contestant("none"), Contestant("pd"), Contestant("sliding")),
            informed=(Contestant("told", policy="sliding"),),
            constants=("always?action=0",),
        ),
        variants=(Variant("tiny", "six seconds", "paper", SHORT), Variant("other", "five seconds", "paper", SHORT)),
        episodes=3,
        search_episodes=2,
        columns=(Column("damage", "worst damage", "smallest"), Column("damage", "hit", "share", "{:.0%}"), QUIET),
        notes=("A note.",),
    )


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Played:
    contest = rogue()
    return play_contest(contest, contest.variants[0], TINY, Store(tmp_path_factory.mktemp("cells")), 1)


def place_of(policy: str) -> dict[str, float]:
    return {name: float(text) for name, text in parse_qsl(policy.partition("?")[2])}


@pytest.mark.parametrize("ranges", [{"x": (0.0, 10.0)}, {"x": (0.0, 10.0), "y": (-1.0, 1.0), "z": (100.0, 900.0)}])
def test_a_search_finds_the_top_of_a_hill(ranges: Mapping[str, tuple[float, float]]) -> None:
    tried: list[range] = []

    def score(policy: str, seeds: range) -> FloatArray:
        tried.append(seeds)
        places = place_of(policy)
        shares = [(places[name] - low) / (high - low) for name, (low, high) in ranges.items()]
        return np.full(len(seeds), -sum((share - 0.8) ** 2 for share in shares))

    found = run_search(Search("hill", "plan?far=1", ranges), score, 1.0, 4, 1000)  # type: ignore[arg-type]
    assert found.policy.startswith("plan?far=1&x=")
    assert found.score > -1e-2
    assert found.candidates == len(tried)
    assert found.episodes == sum(map(len, tried))
    assert min(seeds.start for seeds in tried) == 1000
    assert len({seeds.start for seeds in tried}) > 3  # fresh episodes in each generation


def test_a_search_ends_with_its_budget_and_has_a_result_however_small_that_is() -> None:
    def score(policy: str, seeds: object) -> FloatArray:
        return np.zeros(2)

    found = run_search(Search("flat", "plan", {"x": (0.0, 1.0)}, {"x": 0.25}), score, 1e-9, 2, 0)
    assert found.policy == "plan?x=0.25"
    assert run_search(Search("nothing", "plan", {}), score, 1e-9, 2, 0).policy == "plan"


def test_options_are_written_so_that_they_can_be_read() -> None:
    assert with_options("a?b=1", {"c": 12345678.0, "d": 0.000012345}) == "a?b=1&c=12350000&d=0.00001234"
    assert with_options("a", {}) == "a"


def test_everybody_meets_everybody(played: Played) -> None:
    for attacker in ("none", "square"):
        for defender in ("none", "pd", "sliding", "told"):
            assert played.meetings[attacker, defender]["return"].shape == (3,)
    assert set(played.responses) == {"none", "pd", "sliding", "told"}
    assert {each["search"] for each in played.searches} == {"wave"}
    assert len(played.constants["attacker"]) == 2
    assert played.told().mean() >= 0


def test_searches_choices_and_tables_have_seeds_of_their_own(tmp_path: Path) -> None:
    contest = rogue()
    play_contest(contest, contest.variants[0], TINY, Store(tmp_path), 1)
    jobs = [json.loads(path.read_text())["job"] for path in tmp_path.glob("*.json")]
    cells = {range(job["first_seed"], job["first_seed"] + job["episodes"]) for job in jobs if job["kind"] == "meeting"}
    searches = [job["first_seed"] for job in jobs if job["kind"] != "meeting"]
    evaluation, *choices = sorted(cells, key=lambda seeds: seeds.start)
    assert (evaluation.start, len(evaluation)) == (0, 3)
    assert sorted(map(len, choices)) == [2, 4]  # the validation, and the last choice of a response
    assert not set(choices[0]) & set(choices[1])
    assert all(seed in VALIDATION for seeds in choices for seed in seeds)
    assert searches
    assert min(searches) >= TRAINING_START


def test_finished_work_is_not_done_again(tmp_path: Path) -> None:
    contest = rogue()
    store = Store(tmp_path)
    first = play_contest(contest, contest.variants[0], TINY, store, 1)
    again = play_contest(contest, contest.variants[0], TINY, store, 1)
    assert first.reused == 0
    assert again.reused == len(list(tmp_path.glob("*.json")))
    assert again.searches == first.searches
    np.testing.assert_array_equal(again.meetings["square", "pd"]["return"], first.meetings["square", "pd"]["return"])


def test_variants_that_are_not_judged_are_only_played(tmp_path: Path) -> None:
    contest = rogue()
    other = play_contest(contest, contest.variants[1], TINY, Store(tmp_path), 1)
    assert not other.searches
    found = document(other, TINY, {"command": "cps-envs contest"}, 1.0)
    assert found["holds"] is None
    assert [sheet.title.count("contest") for sheet in tables(found)] == [0, 0, 0]


def test_the_document_is_plain_and_its_tables_are_complete(played: Played) -> None:
    found = json.loads(json.dumps(document(played, TINY, {"command": "cps-envs contest"}, 1.0)))
    names = [row["name"] for row in found["defenders"]]
    assert names == ["none", "pd", "sliding", "told", "best constant"]
    assert found["attackers"][-1]["name"] == "told whom it faces"
    defenders, attackers, hidden, rules = tables(found)
    assert len(defenders.rows) == 5
    assert len(attackers.rows) == 4
    assert hidden.columns == ("defender", "excess over told, m/s", "worst damage", "hit", "quiet")
    assert {row[-1] for row in hidden.rows} == {"0.0"}
    assert {row[0] for row in rules.rows} >= {"nobody has won", "something can be done"}
    assert sum(found["game"]["attacker"].values()) == pytest.approx(1.0, abs=0.02)
    assert set(found["game"]["defender"]) <= {"none", "pd", "sliding"}
    attacks = [Contestant("none"), Contestant("square"), *played.found]
    paid = [
        [played.validation[each.name, name]["return"].mean() for name in ("none", "pd", "sliding")] for each in attacks
    ]
    value = found["game"]["value"]["mean"]
    assert np.min(paid, axis=1).max() - 1e-6 <= value <= np.max(paid, axis=0).min() + 1e-6  # pure strategies bound it
    text = markdown(found)
    assert "Value of the game" in text
    assert "Best response to pd" in text
    assert "- best constant, defender: `always?action=0`" in text
    attacker, defender = summary([found]).rows
    assert (attacker[0], defender[0]) == ("rogue, attacker", "rogue, defender")
    assert attacker[4].endswith("told whom it faces")
    assert defender[5].split()[-1] in ("none", "pd", "sliding")
    assert "- A note." in text


def test_the_constraint_compares_costs_episode_by_episode() -> None:
    """Costs vary by 10 between episodes; one that always costs 1 more is over the limit, one at chance is open."""
    harm, cost = Column("damage", "damage, m/s"), Column("cost", "cost, s")
    rule = Constraint(harm, cost, "usual")
    names = ("usual", "cheap", "dear", "at chance")
    contest = Contest("rogue", side("none"), side(*names), (Variant("a", "a"),), constraint=rule)
    played = Played(contest, contest.variants[0])
    generator = np.random.default_rng(0)
    episodes, noise = generator.uniform(0, 10, 40), generator.normal(0, 1, 40)
    beyond = {"usual": 0.0, "cheap": -1.0, "dear": 1.0, "at chance": noise - noise.mean()}
    for damage, (name, more) in enumerate(beyond.items()):
        meeting = {"return": episodes, "damage": np.full(40, float(damage)), "cost": episodes + more}
        played.meetings["none", name] = meeting
    found = json.loads(json.dumps(document(played, TINY, {"command": "cps-envs contest"}, 1.0)))
    sheet = next(each for each in tables(found) if "no more cost" in each.title)
    assert [(row[0], row[-1]) for row in sheet.rows] == [
        ("usual", "yes"),
        ("cheap", "yes"),
        ("at chance", "open"),
        ("dear", "no"),
    ]
    beyond = "beyond `usual`"
    assert sheet.columns == ("defender", "damage, m/s", beyond, "cost, s", beyond, "within")
    cheap = next(row for row in found["constraint"]["rows"] if row["name"] == "cheap")
    assert cheap["cost_beyond"] == pytest.approx({"mean": -1.0, "low": -1.0, "high": -1.0})
    assert cheap["harm_beyond"] == pytest.approx({"mean": 1.0, "low": 1.0, "high": 1.0})
    assert cheap["cost"]["mean"] == pytest.approx(episodes.mean() - 1)
    assert cheap["harm"]["mean"] == 1.0


def made(attacks: Mapping[str, Mapping[str, float]], **sides: Side) -> Played:
    """A contest whose every meeting pays what the table says, in all episodes."""
    contest = Contest("rogue", sides["attackers"], sides["defenders"], (Variant("a", "a"),), win_tolerance=1.0)
    played = Played(contest, contest.variants[0])
    for attacker, row in attacks.items():
        for defender, paid in row.items():
            played.meetings[attacker, defender] = {"return": np.full(4, paid)}
    played.validation = played.meetings
    return played


def side(*names: str, informed: tuple[str, ...] = (), need: float = 0.0) -> Side:
    return Side(tuple(map(Contestant, names)), (), tuple(map(Contestant, informed)), (), need, need)


def holding(played: Played) -> dict[tuple[str, str], bool]:
    return {(finding.rule, finding.role): finding.holds for finding in judge(played)}


def test_rules_hold_where_both_sides_have_something_to_win() -> None:
    table = {
        "none": {"none": 0.0, "guard": 2.0, "seer": 1.0},
        "hit": {"none": 20.0, "guard": 8.0, "seer": 1.0},
        "feint": {"none": 9.0, "guard": 12.0, "seer": 1.0},
    }
    played = made(
        table,
        attackers=side("none", "hit", "feint", need=0.5),
        defenders=side("none", "guard", informed=("seer",), need=0.5),
    )
    played.responses = {name: Contestant(best) for name, best in (("none", "hit"), ("guard", "feint"), ("seer", "hit"))}
    assert all(holding(played).values())
    assert set(holding(played)) == {
        (rule, role)
        for role in ROLES
        for rule in ("something can be done", "something is left to infer", "nobody has won")
    }


def test_rules_break_one_by_one() -> None:
    table = {"none": {"none": 0.0, "wall": 0.5, "seer": 0.0}, "hit": {"none": 20.0, "wall": 0.8, "seer": 0.0}}
    defenders = side("none", "wall", informed=("seer",), need=5.0)
    found = holding(made(table, attackers=side("none", "hit"), defenders=defenders))
    assert not found["nobody has won", "defender"]  # at most 0.8 where 0 is best, within the tolerance of 1
    assert not found["something is left to infer", "defender"]  # the seer leads by less than 5
    assert found["something can be done", "defender"]
    useless = {"none": {"none": 0.0, "wall": 0.0}, "hit": {"none": 20.0, "wall": 20.0}}
    found = holding(made(useless, attackers=side("none", "hit"), defenders=side("none", "wall")))
    assert not found["nobody has won", "attacker"]  # the same against everybody as without a defence
    assert not found["something can be done", "defender"]


def test_a_constant_that_is_best_breaks_the_rule() -> None:
    table = {
        "none": {"none": 0.0, "wall": 1.0, "constant 1": 0.0},
        "hit": {"none": 20.0, "wall": 9.0, "constant 1": 5.0},
    }
    played = made(table, attackers=side("none", "hit"), defenders=side("none", "wall"))
    played.constants = {"defender": [Contestant("constant 1", "always?action=3")]}
    broken = next(finding for finding in judge(played) if finding.rule == "no constant action is best")
    assert not broken.holds
    assert broken.worse == "best constant"
    assert broken.lead.mean == pytest.approx(-2.5)


def test_names_that_do_not_exist_are_refused() -> None:
    with pytest.raises(CommandError, match="has no variant 'tinny'"):
        choose_variants(rogue(), ["tinny"])


def test_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "find_contests", lambda names: [rogue()])
    out = str(tmp_path / "out")
    result = invoke("contest", "rogue", "--quick", "--jobs", "1", "--out", out)
    assert result.exit_code == 0, result.output
    assert "is it a contest?" in result.output
    assert json.loads((tmp_path / "out" / "contest.json").read_text())[0]["problem"] == "rogue"
    refused = invoke("contest", "rogue", "--quick", "--publish")
    assert refused.exit_code == 2
    assert "leave out" in refused.output


def test_publishing_keeps_the_other_variants(tmp_path: Path, played: Played) -> None:
    found = document(played, TINY, {"command": "cps-envs contest"}, 1.0)
    with pytest.raises(CommandError, match=r"contest\.md has no line"):
        publish([found], tmp_path)
    (tmp_path / "docs").mkdir()
    page = tmp_path / "docs" / "contest.md"
    page.write_text(f"# Contests\n\n{END}\nfrom before\n")
    first, second = find_contests([])[0], find_contests([])[-1]
    keys = [(each.problem, variant.name) for each in (first, second) for variant in each.variants[:2]]
    for problem, variant in reversed(keys):
        publish([{**found, "problem": problem, "variant": variant}], tmp_path)
    text = page.read_text()
    assert text.startswith("# Contests")
    assert "from before" not in text
    published = json.loads((tmp_path / "docs" / "contest.json").read_text())
    assert [(each["problem"], each["variant"]) for each in published] == keys


@pytest.mark.parametrize("contest", find_contests([]), ids=lambda contest: contest.problem)
def test_the_published_tables_are_of_the_declared_contest(contest: Contest) -> None:
    published = {
        each["variant"]: each for each in json.loads(PUBLISHED.read_text()) if each["problem"] == contest.problem
    }
    assert list(published) == [variant.name for variant in contest.variants]
    for found in published.values():
        for role in ROLES:
            side = contest.attackers if role == "attacker" else contest.defenders
            shown = [row["name"] for row in found[f"{role}s"] if row["kind"] == "policy"]
            assert shown == [each.name for each in side.policies]
    assert published[contest.variants[0].name]["effort"]["budget_s"] >= 40
    assert markdown(found) in PUBLISHED.with_suffix(".md").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("contest", find_contests([]), ids=lambda contest: contest.problem)
def test_every_problem_is_a_contest(contest: Contest, tmp_path: Path) -> None:
    """With short searches: what they find is less, and every rule has to hold all the same."""
    effort = Effort(budget_s=20.0)
    played = play_contest(contest, contest.variants[0], effort, Store(tmp_path), available_cores())
    broken = {(finding.rule, finding.role) for finding in judge(played) if not finding.holds}
    assert broken == SOLVED.get(contest.problem, set())
