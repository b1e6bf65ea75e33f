"""The checks pass a healthy toy problem, and each fails for something that it is there to find."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from cps_envs.core import conformance
from cps_envs.core.conformance import (
    CHECKS,
    LEARNING_CHECKS,
    Refinement,
    Subject,
    check_environment,
    check_problem,
    check_refinement,
    check_rows,
    check_seeding,
    find_subject,
    refine,
    run_check,
)
from cps_envs.core.game.game import Game
from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import ROLES
from tests.core import mutants_learning
from tests.core.learned_toy import LEARNED, LearnedDefenseEnv
from tests.core.mutants import of
from tests.core.mutants_travel import MUTANTS
from tests.core.toy import TOY, ToyAttackEnv, ToyAttackVectorEnv, ToyDefenseEnv, ToyGame

SLOW = ("check_subprocess", "check_stable_baselines3")
QUICK = [check for check in CHECKS if check.__name__ not in SLOW]
QUICK_LEARNING = [check for check in LEARNING_CHECKS if check.__name__ not in SLOW]
CASES = [(name, i) for name, makers in MUTANTS.items() for i in range(len(makers))]
LEARNING_CASES = [(name, i) for name, makers in mutants_learning.MUTANTS.items() for i in range(len(makers))]
IDLE = {"attacker": "cps_envs.core.policies.policy:Idle", "defender": "cps_envs.core.policies.policy:Idle"}


def test_every_check_has_a_mutant() -> None:
    assert set(MUTANTS) == {check.__name__ for check in CHECKS}
    assert {*MUTANTS, *mutants_learning.MUTANTS} >= {check.__name__ for check in LEARNING_CHECKS}


@pytest.mark.parametrize(("name", "number"), CASES)
def test_check_finds_mutant(name: str, number: int) -> None:
    if name == "check_stable_baselines3":
        pytest.importorskip("stable_baselines3")
    with pytest.raises(AssertionError):
        getattr(conformance, name)(MUTANTS[name][number]())


@pytest.mark.parametrize(("name", "number"), LEARNING_CASES)
def test_check_finds_mutant_of_the_interface_for_learners(name: str, number: int) -> None:
    with pytest.raises(AssertionError):
        getattr(conformance, name)(mutants_learning.MUTANTS[name][number]())


def test_the_interface_for_learners_conforms() -> None:
    outcomes = check_problem(LEARNED, presets=["learning"], checks=(), learning_checks=QUICK_LEARNING)
    assert len(outcomes) == len(QUICK_LEARNING) * len(ROLES)
    skipped = {(outcome.check, "Attack" in outcome.subject) for outcome in outcomes if outcome.status == "skipped"}
    assert skipped == {("check_swarm", True), ("check_rows", True), ("check_flat", False)}


@pytest.mark.parametrize(("interface", "expected"), [(None, 3), ("native", 1), ("learning", 2)])
def test_both_interfaces_are_checked_unless_one_is_named(interface: str | None, expected: int) -> None:
    options = {} if interface is None else {"interface": interface}
    checks = {"checks": [check_seeding], "learning_checks": [check_seeding, check_rows]}
    outcomes = check_environment(LearnedDefenseEnv, preset="learning", **checks, **options)  # type: ignore[arg-type]
    assert len(outcomes) == expected
    assert len(check_environment(LearnedDefenseEnv, preset="paper", **checks)) == 1  # type: ignore[arg-type]


def test_toy_problem_conforms_in_every_preset() -> None:
    outcomes = check_problem(TOY, checks=QUICK)
    assert len(outcomes) == len(QUICK) * len(TOY.presets) * len(ROLES)
    skipped = {(outcome.check, "Attack" in outcome.subject) for outcome in outcomes if outcome.status == "skipped"}
    assert skipped == {("check_swarm", True), ("check_live_swarm", True), ("check_flat", False)}


def test_toy_passes_the_slow_checks_once() -> None:
    checks = [check for check in CHECKS if check.__name__ in SLOW]
    outcomes = check_environment("tests.core.toy:toys/ToyDefense-v0", checks=checks)
    assert [outcome.check for outcome in outcomes] == [check.__name__ for check in checks]


def test_a_class_is_checked_without_id_and_without_vector_class() -> None:
    class Plain(ToyAttackEnv):
        """No vector class beside it."""

    Plain.__module__ = "tests.core.toy_policies"
    subject = find_subject(Plain, {})
    assert subject.vector_class.role == "attacker"
    outcome = run_check(conformance.check_spec, subject)
    assert (outcome.status, outcome.reason) == ("skipped", "the environment has no id")


def test_a_class_finds_the_vector_class_of_its_module() -> None:
    assert find_subject(ToyAttackEnv, {}).vector_class is ToyAttackVectorEnv


@pytest.mark.parametrize("target", [dict, "CartPole-v1"])
def test_foreign_environments_are_refused(target: Any) -> None:
    with pytest.raises(TypeError, match="RoleEnv"):
        find_subject(target, {})


def test_arguments_without_json_form_skip_the_spec_check() -> None:
    subject = find_subject("tests.core.toy:toys/ToyDefense-v0", {"opponent": conformance.Scripted([0, 1])})
    assert run_check(conformance.check_spec, subject).status == "skipped"
    assert run_check(conformance.check_determinism, subject).status == "passed"


def test_a_problem_without_a_viewer_conforms_undrawn() -> None:
    outcome = run_check(conformance.check_rendering, of(viewer=""))
    assert (outcome.status, "no viewer" in outcome.reason) == ("skipped", True)


def test_a_failure_names_check_subject_and_place() -> None:
    with pytest.raises(AssertionError, match=r"check_live_observations of .*'learning'.*attacker's.*time_s\[0\]"):
        run_check(conformance.check_live_observations, MUTANTS["check_live_observations"][0]())


@pytest.mark.parametrize(
    ("attribute", "value", "fault"),
    [
        ("name", "tanks", "Wrong.name is 'tanks', but its Problem's is 'toy'"),
        ("decision_interval", dict.fromkeys(ROLES, 0), "decision_interval['attacker'] of Wrong is 0: it has to be at"),
        ("neutral_action", {role: [0.0] for role in ROLES}, "neutral_action['attacker'] of Wrong has shape (1,), its"),
        ("metrics", lambda: {"fee": 0.0}, "metrics()['fee'] of Wrong has shape (): with B environments it is (B,)"),
        ("observe", lambda role: 1 / 0, "ZeroDivisionError: division by zero"),
        ("team", None, "ConfigurationError: the adapter 'axis' has 2 agents, but "),
    ],
)
def test_a_beginner_s_mistake_is_named(attribute: str, value: Any, fault: str) -> None:
    class Wrong(ToyGame):
        def __init__(self, config: Any, num_envs: int) -> None:
            super().__init__(config, num_envs)
            setattr(self, attribute, partial(Game.team, self) if attribute == "team" else value)

    check = conformance.check_batch if attribute == "observe" else conformance.check_declaration
    with pytest.raises(AssertionError, match=re.escape(f"{check.__name__} of Single, preset='learning': {fault}")):
        run_check(check, of("defender", game=Wrong))


def test_ids_that_nobody_registers_are_named() -> None:
    with pytest.raises(AssertionError, match=r"toys/ToyAttack-v7 is not registered: its module has to run register"):
        check_problem(replace(TOY, version=7))


def test_outcomes_are_counted_by_their_reasons() -> None:
    assert str(check_problem(TOY, presets=["paper"], checks=[conformance.check_swarm])) == (
        "1 passed\n1 skipped: no swarm form: the attacker of 'toy' has no decentralised form"
    )


def test_variants_bring_entries_to_life() -> None:
    still = {"preset": "paper", "guard_speed": 0.0, "drift": 0.0, "opponent": "cps_envs.core.policies.policy:Idle"}
    subject = of("defender", kwargs=still)
    fixed = Subject(subject.single_class, subject.vector_class, still, variants=({"guard_speed": 1.0, "drift": 0.1},))
    conformance.check_live_observations(fixed)


def test_missing_stable_baselines3_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> Any:
        raise ImportError(f"No module named {name!r}")

    monkeypatch.setattr("cps_envs.core.conformance.foreign.importlib.import_module", missing)
    outcome = run_check(conformance.check_stable_baselines3, find_subject(ToyDefenseEnv, {}))
    assert outcome.status == "skipped"
    assert "not installed" in str(outcome)


def test_both_means_are_over_the_same_seeds() -> None:
    found = refine(TOY, IDLE, {"drift": 0.5}, seeds=(3, 4), duration_s=6.0)
    for value, overrides in ((found.coarse, {"duration_s": 6.0}), (found.fine, {"duration_s": 6.0, "drift": 0.5})):
        expected = play_episodes(TOY, TOY.config("paper", overrides), IDLE, (3, 4))["return"].mean()
        assert value == expected
    assert found.coarse != found.fine


def test_a_change_is_relative_to_the_coarse_result_and_to_no_less_than_the_floor() -> None:
    assert Refinement(10.0, 12.0, 1.0).change == pytest.approx(0.2)
    assert Refinement(-10.0, -12.0, 1.0).change == pytest.approx(0.2)
    assert Refinement(0.0, 0.05, 1.0).change == pytest.approx(0.05)


def test_too_large_a_change_is_refused_with_both_results() -> None:
    assert check_refinement(TOY, IDLE, {}, tolerance=0.0).change == 0.0
    with pytest.raises(AssertionError, match=r"toy.*drift.*becomes"):
        check_refinement(TOY, IDLE, {"drift": 0.5}, tolerance=0.001)
