"""What names code needs the user's consent; what an installed package or a program hands over does not."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

import cps_envs
from cps_envs.core.errors import UntrustedCodeError
from cps_envs.core.policies import lookup
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.policy import Idle, RoleSpec
from cps_envs.core.policies.trust import VARIABLE, require_trust
from tests.core.toy import TOY, ToyAttackEnv, ToyConfig, ToyGame
from tests.core.toy_policies import Chase

CODE = "tests.core.toy_policies:Chase"
REMEDIES = r"--trust.*cps_envs\.trust\(\).*CPS_ENVS_TRUST=1"


@pytest.fixture(autouse=True)
def _nobody_agreed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)


@pytest.fixture
def spec() -> RoleSpec:
    return ToyGame(ToyConfig(), 1).spec("defender")


@pytest.mark.parametrize(
    "reference",
    [
        CODE,
        f"{CODE}?option=1",
        "builtins:print",
        f'mixture?policies=["none","{CODE}"]',
        f'mixture?policies=["mixture?policies=[\\"{CODE}\\"]"]',
    ],
)
def test_a_text_that_names_code_is_refused_with_three_remedies(reference: str, spec: RoleSpec) -> None:
    with pytest.raises(UntrustedCodeError, match=REMEDIES):
        resolve_policy(reference, spec)


def test_nothing_is_imported_before_the_user_agrees(spec: RoleSpec, tmp_path: Path, monkeypatch: Any) -> None:
    (tmp_path / "trap_of_trust.py").write_text("raise SystemExit('imported')\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    lookups: list[Callable[[], Any]] = [
        lambda: resolve_policy("trap_of_trust:Policy", spec),
        lambda: cps_envs.find_problem("trap_of_trust:PROBLEM"),
        lambda: ToyAttackEnv(opponent="trap_of_trust:Policy"),
    ]
    for find in lookups:
        with pytest.raises(UntrustedCodeError, match="trap_of_trust"):
            find()
    assert "trap_of_trust" not in sys.modules
    cps_envs.trust()
    for find in lookups:
        with pytest.raises(SystemExit, match="imported"):
            find()


@pytest.mark.parametrize("value", ["0", "", "false", "yes"])
def test_only_a_one_is_consent(value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, value)
    with pytest.raises(UntrustedCodeError):
        require_trust(CODE)


def test_consent_holds_for_this_process_and_those_it_starts(spec: RoleSpec, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "0")  # is put back afterwards
    cps_envs.trust()
    assert isinstance(resolve_policy(CODE, spec), Chase)
    program = "from cps_envs.core.policies.trust import require_trust; require_trust('a:b')"
    subprocess.run([sys.executable, "-c", program], check=True)


def test_objects_and_registered_names_need_no_consent(spec: RoleSpec, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint("toy.defender.chase", CODE, lookup.GROUP)
    found = {"cps_envs.policies": {entry.name: entry}, "cps_envs.policy_sources": {"mine": _source()}}
    monkeypatch.setattr(lookup, "_registered", lambda group=lookup.GROUP: found[group])
    assert isinstance(resolve_policy("chase", spec), Chase)
    assert isinstance(resolve_policy("none", spec), Idle)
    assert isinstance(resolve_policy("mine:any", spec), Idle)
    policy = Chase(spec)
    assert resolve_policy(policy, spec) is policy
    mixture: Any = resolve_policy("mixture", spec, policies=[policy, "chase"])
    assert mixture.policies[0] is policy


def _source() -> EntryPoint:
    return EntryPoint("mine", f"{__name__}:find", lookup.SOURCES)


def find(name: str, spec: RoleSpec) -> Idle:
    return Idle(spec)


def test_what_a_problem_declares_needs_no_consent_and_nothing_else_passes_with_it() -> None:
    mixed = f'mixture?policies=["{CODE}"]'
    problem = replace(TOY, opponents={**TOY.opponents, "paper": {"attacker": "none", "defender": mixed}})
    game = ToyGame(ToyConfig(), 1)
    policy: Any = problem.policy(mixed, game, "defender")
    assert isinstance(policy.policies[0], Chase)
    for other in (CODE, f"{mixed}&weights=[1]"):
        with pytest.raises(UntrustedCodeError):
            problem.policy(other, game, "defender")
    assert ToyAttackEnv(preset="paper").opponent == CODE  # the toy's own
    assert isinstance(TOY.policy(CODE, game, "defender"), Chase)
