"""The examination of trained policies: what is played, judged, written and published."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_agents.arena.challenge import HAPPENED, Challenge
from cps_agents.arena.meeting import Preparation, Result
from cps_agents.arena.play import Played
from cps_agents.arena.store import Store
from cps_agents.catalogue import policies
from cps_agents.errors import CommandError
from cps_agents.results import rogue
from cps_agents.results.block import Bar, Block, Row, completed, teacher_of
from cps_agents.results.document import document, merged
from cps_agents.results.examination import Findings, examine, find_blocks, missing_of, pairing
from cps_agents.results.front import Front, front_table
from cps_agents.results.judging import MISSING, NOT_REACHED, ON_AVERAGE, REACHED, judge, worst
from cps_agents.results.publication import publish, record
from cps_agents.results.report import END, START, readme_table, results_markdown, tables, with_table
from cps_agents.results.searches import best_wave, fixed_plan
from cps_agents.results.tables import bar_lines, best_baseline, judged_against, overall
from cps_agents.zoo.card import read_card
from cps_agents.zoo.files import shipped_names
from cps_agents.zoo.references import is_trained, missing_names, weights_of
from cps_baselines.arena import Contestant, Venue
from cps_envs.core import lookup
from cps_envs.core.errors import UnknownNameError
from cps_envs.core.lookup import NEED_OPTIONS, policy_names
from cps_envs.registration import find_problem
from cps_envs.testbed.problem import TESTBED
from tests.agents.command_line import invoke
from tests.agents.trained import save_tiny

ROOT = Path(__file__).parents[2]
SHORT = {"duration_s": 3.0, "contact": "solid"}
MACHINE = {"command": "cps-envs benchmark", "cpu": "x", "versions": {"cps-envs": "0"}}
NOBODY_ELSE = dict.fromkeys(policy_names("rogue", "attacker"), "a test")
CHALLENGE = Challenge(Venue("rogue", "paper", SHORT), "attacker", "pd", 3)
BLOCK = Block(
    name="tiny",
    title="tiny attacker",
    target="above nothing.",
    problem="rogue",
    role="attacker",
    metric="damage",
    learned=(Contestant("learned", "zoo:nobody"),),
    baselines=(Contestant("none"), Contestant("square"), Contestant("best", optimum=True, policy="duty_square")),
    rows=(Row("pd", (CHALLENGE,)), Row("both", (CHALLENGE, replace(CHALLENGE, opponent="sliding")), bars=())),
    bars=(Bar(beat=("none",), or_equal=True), Bar(value=1e6)),
    shown=("collisions",),
    left_out=NOBODY_ELSE,
)


@pytest.fixture
def block(tmp_path: Path) -> Block:
    save_tiny(tmp_path / "tiny.json", "rogue", "attacker", overrides=SHORT, seeds=5)
    return replace(BLOCK, learned=(Contestant("learned", f"zoo:{tmp_path / 'tiny.json'}"),))


def found(scores: dict[str, Any], block: Block = BLOCK) -> Findings:
    """Findings of a block of one row: the metric of each contestant, (training seeds, episodes)."""
    results: dict[Any, list[Result]] = {
        (block.name, 0, 0, name): [{"metrics": {"damage": row, "return": row, "collisions": row}} for row in rows]
        for name, rows in scores.items()
    }
    return Played(results)


def verdict(bar: Bar, learned: Any, role: Any = "attacker", **baselines: Any) -> str:
    block = replace(BLOCK, rows=(Row("one", (CHALLENGE,)),), bars=(bar,), role=role)
    return worst([each.verdict for each in judge(block, 0, found({"learned": learned, **baselines}, block))])


TEN_PAIRS = 10
FIVE = np.tile([[4.0, 6.0], [4.1, 6.1], [3.9, 5.9], [4.0, 6.0], [4.0, 6.0]], TEN_PAIRS)


@pytest.mark.parametrize(
    ("bar", "expected"),
    [
        (Bar(value=0.5), REACHED),
        (Bar(value=4.9), ON_AVERAGE),
        (Bar(value=5.5), NOT_REACHED),
        (Bar(value=5.1, less=True), ON_AVERAGE),
        (Bar(value=50.0, less=True), REACHED),
        (Bar(value=4.9, by_mean=True), REACHED),
    ],
)
def test_a_number_is_passed_by_the_whole_interval(bar: Bar, expected: str) -> None:
    assert verdict(bar, FIVE) == expected


def test_a_baseline_is_passed_in_pairs() -> None:
    baseline = [[3.0, 5.0] * TEN_PAIRS]  # the spread over episodes is larger than the difference, but common
    assert verdict(Bar(beat=("square",)), FIVE, square=baseline) == REACHED
    assert verdict(Bar(beat=("square",)), FIVE, "defender", square=baseline) == NOT_REACHED
    assert verdict(Bar(beat=("square",), factor=2.0), FIVE, "defender", square=baseline) == REACHED
    assert verdict(Bar(beat=("square", "none")), FIVE, square=baseline, none=[[9.0, 9.0] * TEN_PAIRS]) == NOT_REACHED


def test_a_tie_counts_only_where_it_may() -> None:
    same = [[4.0, 6.0]] * 5
    assert verdict(Bar(beat=("square",)), same, square=[[4.0, 6.0]]) == NOT_REACHED
    assert verdict(Bar(beat=("square",), or_equal=True), same, square=[[4.0, 6.0]]) == REACHED


def test_of_many_baselines_the_hardest_is_shown() -> None:
    bar = Bar(beat=("none", "square"))
    block = replace(BLOCK, rows=(Row("one", (CHALLENGE,)),), bars=(bar,))
    scores = {"learned": FIVE, "none": FIVE[:1] - 2, "square": FIVE[:1] - 1, "best": FIVE[:1]}
    (row,) = document([block], found(scores, block), MACHINE, False)["problems"]["rogue"]["blocks"][0]["rows"]
    (line,) = bar_lines(row, "learned")
    assert line.startswith("above all 2, hardest square: +1 (")
    assert row["verdicts"] == {"learned": REACHED}


def test_a_bar_above_every_baseline_takes_all_that_the_table_shows() -> None:
    block = replace(BLOCK, rows=(Row("one", (CHALLENGE,)),), bars=(Bar(every=True),))
    scores = {"learned": FIVE, "none": FIVE[:1] - 2, "square": FIVE[:1] + 1, "best": FIVE[:1] + 9}
    judgements = judge(block, 0, found(scores, block))
    assert [(each.against, each.verdict) for each in judgements] == [("none", REACHED), ("square", NOT_REACHED)]
    made = document([block], found(scores, block), MACHINE, False)["problems"]["rogue"]["blocks"][0]
    assert list(judged_against(made)) == ["Verdicts on learned are against: none; square."]
    assert "Verdicts on learned are against: none; square." in results_markdown(
        document([block], found(scores, block), MACHINE, False)
    )


def test_the_best_baseline_is_the_hardest_in_common_episodes() -> None:
    block = replace(BLOCK, rows=(Row("one", (CHALLENGE,)),), bars=(Bar(every=True),))
    few = FIVE[:1, :4] + 0.5  # plays less, and what the learned policy finds easier
    learned = np.hstack([FIVE[:, :4], FIVE[:, 4:] + 5])
    scores = {"learned": learned, "none": learned[:1] - 1, "square": few, "best": FIVE[:1]}
    made = document([block], found(scores, block), MACHINE, False)["problems"]["rogue"]["blocks"][0]
    text = best_baseline(made, made["rows"][0], "learned")
    assert text.startswith("square 5.50; -0.50 (")
    assert text.endswith(" in 4 common episodes")


def test_a_baseline_with_one_training_seed_is_marked(block: Block, tmp_path: Path) -> None:
    rival = f"{block.learned[0].reference}?seed=1"
    part = replace(block, baselines=(Contestant("rival", rival), Contestant("none")), bars=(Bar(every=True),))
    made = document([part], examine([part], Store(tmp_path / "cells"), workers=1), MACHINE, False)
    assert [each["caution"] != "" for each in made["problems"]["rogue"]["blocks"][0]["baselines"]] == [True, False]
    text = results_markdown(made)
    assert "| rival (one seed) |" in text
    assert "rival (one seed): one training seed: its seed noise is not in the interval." in text


def test_few_training_seeds_reach_nothing() -> None:
    assert verdict(Bar(value=0.5), FIVE[:4]) == ON_AVERAGE


def test_bars_can_be_for_one_policy_only() -> None:
    two = replace(
        BLOCK,
        learned=(Contestant("learned"), Contestant("second")),
        rows=(Row("one", (CHALLENGE,), (Bar(value=0.0, of=("second",)),)),),
    )
    judgements = judge(two, 0, found({"learned": FIVE, "second": FIVE}, two))
    assert [each.policy for each in judgements] == ["second"]


def test_everything_is_played_once_and_kept(block: Block, tmp_path: Path) -> None:
    reports: list[tuple[int, int, str]] = []
    store = Store(tmp_path / "cells")
    findings = examine([block], store, workers=1, report=lambda *report: reports.append(report))
    assert findings.jobs == 2 * (5 + 3)  # two arenas, of which one is in both rows
    assert [report[:2] for report in reports] == [(k, 16) for k in range(1, 17)]
    assert len(findings.results["tiny", 0, 0, "learned"]) == 5
    assert findings.results["tiny", 0, 0, "square"] == findings.results["tiny", 1, 0, "square"]
    assert examine([block], store, workers=1).reused == 16


def test_missing_policies_are_listed(block: Block, tmp_path: Path) -> None:
    assert missing_of(BLOCK) == {"learned": ["nobody"]}
    gone = examine([BLOCK], Store(tmp_path / "cells"), workers=1)
    assert gone.jobs == 0
    text = results_markdown(document([BLOCK], gone, MACHINE, False))
    assert "Missing: learned, because there is no trained policy nobody." in text
    assert "**missing**" in text
    row = Row("nobody", (replace(CHALLENGE, opponent="zoo:nobody"),))
    part = replace(block, rows=(row, *block.rows))
    made = document([part], examine([part], Store(tmp_path / "cells"), workers=1), MACHINE, False)
    assert [each["verdicts"] for each in made["problems"]["rogue"]["blocks"][0]["rows"][:2]] == [
        {"learned": MISSING},
        {"learned": NOT_REACHED},
    ]


def test_baselines_can_search_first(block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def run(job: Preparation) -> Result:
        asked.append((job.function, job.quick, job.opponent, job.venue.overrides))
        return {"policy": "square?frequency_hz=0.3", "note": "0.3 Hz"}

    monkeypatch.setattr(Preparation, "run", run)
    searching = replace(
        block, baselines=(Contestant("wave", prepare="module:function", for_each=True),), bars=(Bar(beat=("wave",)),)
    )
    findings = examine([searching], Store(tmp_path / "cells"), workers=1, quick=True)
    assert asked[0] == ("module:function", True, "pd", SHORT)
    assert len(asked) == 2
    plain = replace(block, baselines=(Contestant("wave", policy="square?frequency_hz=0.3"),), bars=())
    expected = examine([plain], Store(tmp_path / "others"), workers=1, quick=True)
    for place in ((0, 0), (1, 1)):
        key = ("tiny", *place, "wave")
        assert findings.results[key][0]["metrics"] == expected.results[key][0]["metrics"]
    assert "wave (pd): 0.3 Hz" in results_markdown(document([searching], findings, MACHINE, False))


def test_the_document_tells_everything(block: Block, tmp_path: Path) -> None:
    findings = examine([block], Store(tmp_path / "cells"), workers=1)
    made = json.loads(json.dumps(document([block], findings, MACHINE, False)))
    (row, both) = made["problems"]["rogue"]["blocks"][0]["rows"]
    score = row["scores"]["learned"]
    assert (score["seeds"], score["episodes"]) == (5, 3)
    assert both["scores"]["learned"]["episodes"] == 6
    assert score["low"] <= score["mean"] <= score["high"]
    assert set(row["differences"]["learned"]) == {"none", "square", "best"}
    assert [(each["relation"], each["limit"]) for each in row["judgements"]] == [
        ("at least", "none"),
        ("above", "1e+06"),
    ]
    assert row["verdicts"] == {"learned": NOT_REACHED}
    assert both["verdicts"] == {}
    text = results_markdown(made)
    for part in ("### tiny attacker", "above 1e+06", "| pd |", "5 training seeds", "damage, mean (95 % interval)"):
        assert part in text
    front = Front("rogue, attacker", "damage", "tiny", row["title"], "learned", "square")
    *_, cells = front_table(made, (front, replace(front, block="unknown")))
    assert cells.startswith("| rogue, attacker: damage | square ")
    assert cells.endswith("| not judged |")
    assert "*" not in cells  # everybody has played the same episodes
    row["scores"]["square"]["episodes"] -= 1
    assert "* |" in front_table(made, (front,))[-1]
    assert "best " in cells  # what is possible
    assert "duty_square" not in cells
    heads = [line.startswith("| role: what counts |") for line in readme_table(made).splitlines()]
    assert heads == [False, True, False, False]
    assert [len(list(each.columns)) for each in tables(made)] == [5]


def test_verdicts_in_a_few_words() -> None:
    def rows(*verdicts: str) -> dict[str, Any]:
        return {"rows": [{"verdicts": {"learned": verdict}} for verdict in verdicts]}

    assert overall(rows(REACHED), "learned") == "reached"
    assert overall(rows(REACHED, REACHED), "learned") == "reached, all 2 rows"
    assert overall(rows(REACHED, NOT_REACHED, REACHED), "learned") == "reached 2, not reached 1 of 3 rows"
    assert overall(rows(), "learned") == "not judged"


def test_publishing_keeps_the_other_blocks(block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    readme = tmp_path / "README.md"
    new = document([block], examine([block], Store(tmp_path / "cells"), workers=1), MACHINE, False)
    with pytest.raises(CommandError, match="no section between"):
        publish(new, tmp_path)
    readme.write_text(f"# Title\n\n{START}\nold\n{END}\n\nMore.\n")
    (tiny,) = new["problems"]["rogue"]["blocks"]
    other = {**new, "problems": {"hvac": {"blocks": [{**tiny, "name": "hvac-attack"}]}}}
    monkeypatch.setattr(rogue, "BLOCKS", (block, replace(block, name="second")))
    publish(other, tmp_path)
    publish({**new, "problems": {"rogue": {"blocks": [{**tiny, "name": "second"}]}}}, tmp_path)
    publish(new, tmp_path)
    kept = json.loads((tmp_path / "docs" / "results.json").read_text())
    assert list(kept["problems"]) == ["hvac", "rogue"]
    assert [each["name"] for each in kept["problems"]["rogue"]["blocks"]] == ["tiny", "second"]
    assert (tmp_path / "docs" / "results.md").read_text() == results_markdown(kept)
    text = readme.read_text()
    assert text == with_table(text, kept)
    assert text.startswith("# Title\n")
    assert text.endswith("More.\n")
    assert "old" not in text
    with pytest.raises(CommandError, match="a look, no result"):
        publish({**new, "quick": True}, tmp_path)
    with pytest.raises(ValueError, match="no section"):
        with_table("nothing", kept)
    assert merged({"format": -1, "problems": {"fdi": 1}}, new, {"rogue": ["tiny"]}) == new


def test_a_card_records_what_its_policy_reached(block: Block, tmp_path: Path) -> None:
    card = save_tiny(tmp_path / "tiny.json", "rogue", "attacker", overrides=SHORT, evaluation={"other": {}})
    made = document([block], examine([block], Store(tmp_path / "cells"), workers=1), MACHINE, False)
    before = weights_of(f"zoo:{tmp_path / 'tiny.json'}")
    for each in made["problems"]["rogue"]["blocks"][0]["learned"]:
        each["policy"] = "zoo:tiny"
    recorded = read_card(record("tiny", made, tmp_path))
    score = made["problems"]["rogue"]["blocks"][0]["rows"][0]["scores"]["learned"]
    assert recorded.evaluation["tiny"]["pd"]["mean"] == score["mean"]
    assert recorded.evaluation["tiny"]["pd"]["metric"] == "damage"
    assert recorded.evaluation["other"] == {}
    assert replace(recorded, evaluation={"other": {}}) == card
    assert weights_of(f"zoo:{tmp_path / 'tiny.json'}") == before  # finished cells stay valid


def test_what_is_published_is_current() -> None:
    kept = json.loads((ROOT / "docs" / "results.json").read_text(encoding="utf-8"))
    page, readme = (ROOT / name for name in ("docs/results.md", "README.md"))
    message = "run `make pages`"
    assert page.read_text(encoding="utf-8") == results_markdown(kept), message
    text = readme.read_text(encoding="utf-8")
    assert text == with_table(text, kept), message
    assert not kept["quick"]


def test_declared_blocks_are_sound() -> None:
    blocks = find_blocks()
    assert len({block.name for block in blocks}) == len(blocks)
    for block in blocks:
        names = [each.name for each in block.contestants]
        assert len(set(names)) == len(names)
        for row in block.rows:
            for bar in block.bars_of(row):
                assert set(bar.beat) <= {each.name for each in block.contestants}
                assert set(bar.of) <= {each.name for each in block.learned}
                assert bar.beat or bar.every or bar.value is not None
            for challenge in row.challenges:
                assert challenge.role == block.role
                assert challenge.config is not None
                for each in block.baselines:
                    if not each.prepare:
                        pairing(challenge, each, True).meetings({})


@pytest.mark.parametrize("block", find_blocks(), ids=lambda block: block.name)
def test_every_policy_of_the_role_is_a_baseline(block: Block) -> None:
    registered = policies(find_problem(block.problem), block.role)
    usual = {entry.name for entry in registered if not entry.privileged} - set(NEED_OPTIONS)
    played = {each.reference.partition("?")[0] for each in block.baselines}
    assert usual - played <= set(block.left_out)
    assert all(block.left_out.values())
    for each in block.learned:
        teacher = teacher_of(each)
        assert not teacher or teacher in {found.reference for found in block.contestants}
    for bar in (bar for row in block.rows for bar in block.bars_of(row) if bar.every):
        assert set(block.rivals_of(bar)) == {each.name for each in block.baselines if not each.optimum}


def test_teachers_are_rivals_of_their_learners() -> None:
    known = {block.name: block for block in find_blocks()}
    references = {each.reference for each in known["hvac-attack"].baselines}
    assert {"brink", "brink?gain=0.2&margin_c2=0.02", "constant?reading_c=10"} <= references
    for row in known["hvac-attack"].rows:
        (above, *_) = known["hvac-attack"].bars_of(row)
        assert {"lowest", "brink", "teacher of learned"} <= set(known["hvac-attack"].rivals_of(above))
    bars = known["fdi-defense"].bars_of(known["fdi-defense"].rows[0])
    assert any("model" in known["fdi-defense"].rivals_of(bar) for bar in bars)


def taught_by_a_trained_one() -> list[tuple[str, str]]:
    """Each shipped policy that learned from a trained one, and that one's reference."""
    found = [(f"zoo:{name}", teacher_of(Contestant(name, f"zoo:{name}"))) for name in shipped_names()]
    return [(name, teacher) for name, teacher in found if is_trained(teacher) and not teacher.startswith("mixture")]


@pytest.mark.parametrize(("policy", "teacher"), taught_by_a_trained_one())
def test_who_learned_from_a_trained_policy_is_judged_against_it(policy: str, teacher: str) -> None:
    blocks = [block for block in find_blocks() if policy in {each.reference for each in block.learned}]
    assert blocks
    for block in blocks:
        (mine,) = (each.name for each in block.learned if each.reference == policy)
        (its,) = (each for each in block.contestants if each.reference == teacher)
        for row in block.rows:
            bars = [bar for bar in block.bars_of(row) if its.name in block.rivals_of(bar)]
            assert not block.bars_of(row) or any(not bar.of or mine in bar.of for bar in bars)


def test_a_learned_teacher_gets_a_bar_and_a_paired_difference() -> None:
    names = {"residual": "disbanding-defense-residual", "broadcast": "disbanding-defense-cma"}
    learned = tuple(Contestant(name, f"zoo:{policy}") for name, policy in names.items())
    challenge = Challenge(Venue("disbanding", "paper", {"duration_s": 5.0}), "defender", "lead", 2)
    block = completed(
        replace(
            BLOCK,
            problem="disbanding",
            role="defender",
            learned=learned,
            baselines=(Contestant("square"),),
            rows=(Row("one", (challenge,)), Row("shown", (challenge,), bars=())),
            bars=(Bar(value=9.0),),
            left_out=dict.fromkeys(policy_names("disbanding", "defender"), "a test"),
        )
    )
    judged, shown = block.rows
    assert block.bars_of(judged)[-1] == Bar(beat=("broadcast",), of=("residual",))
    assert not block.bars_of(shown)
    scattered = np.arange(5.0)[:, np.newaxis] + FIVE  # the seeds differ more than each differs from its own start
    scores = {"residual": scattered - 0.5, "broadcast": scattered, "square": FIVE[:1]}
    made = document([block], found(scores, block), MACHINE, False)["problems"]["disbanding"]["blocks"][0]
    row = made["rows"][0]
    assert set(row["differences"]["residual"]) == {"square", "broadcast"}
    assert set(row["differences"]["broadcast"]) == {"square"}
    (judgement,) = (each for each in row["judgements"] if each["against"])
    assert (judgement["policy"], judgement["against"], judgement["verdict"]) == ("residual", "broadcast", REACHED)
    assert judgement["mean"] == pytest.approx(-0.5)
    assert judgement["high"] < 0
    assert "Verdicts on residual are against: broadcast." in judged_against(made)


@pytest.mark.slow
@pytest.mark.parametrize("block", find_blocks(), ids=lambda block: block.name)
def test_every_baseline_can_play_every_row(block: Block) -> None:
    for challenge in (challenge for row in block.rows for challenge in row.challenges):
        for each in (each for each in block.baselines if not each.prepare and not missing_names(challenge.opponent)):
            for meeting in pairing(replace(challenge, episodes=1), replace(each, episodes=0), True).meetings({}):
                assert meeting.run()["metrics"][block.metric]


def test_metrics_of_declared_blocks_exist() -> None:
    for block in find_blocks():
        challenge = block.rows[0].challenges[0]
        metrics = {"return", *examination_metrics(challenge)}
        wanted = {block.metric, block.per, *block.shown} - {""}
        wanted |= {bar.metric for row in block.rows for bar in block.bars_of(row) if bar.metric}
        assert {name.removesuffix(HAPPENED) for name in wanted} <= metrics, block.name


def examination_metrics(challenge: Challenge) -> set[str]:
    return set(find_problem(challenge.venue.problem).game(challenge.config, 1).metrics())


def test_searches_return_policies() -> None:
    disbanding = find_problem("disbanding")
    config = disbanding.config("easy", {"duration_s": 10.0, "attack_budget": 2})
    plan = fixed_plan(config, True, "copy")
    assert plan.policy.startswith("plan?events=[[")
    assert "the best against copy in 2 instances, of 3 finalists" in plan.note
    disbanding.policy(plan.policy, disbanding.game(config, 1), "attacker")
    problem = find_problem("rogue")
    config = problem.config("paper", {**rogue.world(1.0), "duration_s": 3.0})
    wave = best_wave(config, True, "pd")
    problem.policy(wave.policy, problem.game(config, 1), "attacker")
    assert "of 6 against pd" in wave.note or "of 7 against pd" in wave.note


def test_the_command_examines_and_writes(block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rogue, "BLOCKS", (block,))
    command = ["benchmark", "rogue", "--suite", "learned", "--jobs", "1", "--out", str(tmp_path / "out")]
    result = invoke(*command, "--quick")
    assert result.exit_code == 0, result.output
    assert "tiny attacker" in result.stdout
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        ".lock",
        "README-table.md",
        "results.json",
        "results.md",
    ]
    result = invoke(*command, "--json")
    assert json.loads(result.stdout)["problems"]["rogue"]["blocks"][0]["name"] == "tiny"
    result = invoke("benchmark", "rogue", "--suite", "learned", "--list")
    assert "tiny" in result.stdout
    for wrong in (["--table", "tine"], ["--publish", "--quick"]):
        assert invoke(*command, *wrong).exit_code == 2


def test_what_the_blocks_name_needs_no_consent(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint("cps_agents.results.robots", "cps_agents.results.robots:find", lookup.SOURCES)
    found = {lookup.GROUP: lookup._registered(lookup.GROUP), lookup.SOURCES: {entry.name: entry}}
    monkeypatch.setattr(lookup, "_registered", lambda group=lookup.GROUP: found[group])
    monkeypatch.delenv("CPS_ENVS_TRUST")
    spec = TESTBED.game(TESTBED.config("mitigated", {}), 1).spec("defender")
    assert lookup.resolve_policy("cps_agents.results.robots:mitigation?period_s=0.5", spec)
    with pytest.raises(UnknownNameError, match="no policy of robots 'find'"):
        lookup.resolve_policy("cps_agents.results.robots:find", spec)
    assert find_problem("cps_envs.testbed.problem:TESTBED") is TESTBED


def test_every_registered_rogue_attacker_and_the_teacher_are_in_the_table() -> None:
    names = {each.reference.partition("?")[0] for each in completed(rogue.ATTACK).baselines}
    assert set(policy_names("rogue", "attacker")) - {"none", *NEED_OPTIONS} <= names
    assert any(each.prepare.endswith(":told") for each in rogue.ATTACK.baselines)
    ratios = {float(row.challenges[0].venue.overrides["power_ratio"]) for row in rogue.ATTACK.rows}
    assert ratios == {1.0, 1.1, 1.2, 1.3}


def test_shares_of_the_best_known_stand_beside_it() -> None:
    block = replace(BLOCK, rows=(replace(BLOCK.rows[0], best_known=4.0),))
    made = document([block], found({"learned": FIVE / 2.5, "square": FIVE[:1]}, block), MACHINE, False)
    (row,) = made["problems"]["rogue"]["blocks"][0]["rows"]
    assert row["shares"] == {"learned": 0.5}
    assert "best known 4.00 (learned 50%)" in results_markdown(made)
