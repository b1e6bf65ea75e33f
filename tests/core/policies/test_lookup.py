"""Names of policies: what is found, what is refused, and what an error says."""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces

from cps_envs.core.errors import ConfigurationError, MissingExtraError, UnknownNameError, near, require
from cps_envs.core.policies import lookup
from cps_envs.core.policies.lookup import policy_names, resolve_policy
from cps_envs.core.policies.policy import Idle, RoleSpec
from tests.core.toy import TOY, ToyConfig, ToyGame
from tests.core.toy_policies import Chase

ENTRIES = {
    "toy.defender.chase": "tests.core.toy_policies:Chase",
    "toy.defender.guess": f"{__name__}:Guess",
    "toy.defender.needs": "scipy:Policy",
    "toy.attacker.chase": "cps_envs.core.policies.policy:Idle",
}


class Picky(Idle):
    def __init__(
        self,
        spec: RoleSpec,
        count: int = 1,
        share: float | None = 0.5,
        word: str = "",
        other: Any = None,
        rival: Guess | None = None,
    ) -> None:
        super().__init__(spec)
        self.share = share


class Guess(Idle):
    def __init__(self, spec: RoleSpec, level: Any = 0, *, name: str = "") -> None:
        super().__init__(spec)
        self.level, self.name = level, name


def looked_up(spec: RoleSpec, word: str) -> Any:
    return {"something": READY}[word]


READY = Guess(ToyGame(ToyConfig(), 1).spec("defender"))
NUMBER = 3


def enter(monkeypatch: pytest.MonkeyPatch, mine: str | None = None) -> None:
    """The entry points of ENTRIES, and perhaps one more called "mine"."""
    named = ENTRIES if mine is None else ENTRIES | {"toy.defender.mine": mine}
    found = {name: EntryPoint(name, value, lookup.GROUP) for name, value in named.items()}
    monkeypatch.setattr(lookup, "_registered", lambda group=lookup.GROUP: found if group == lookup.GROUP else {})


@pytest.fixture(autouse=True)
def _entries(monkeypatch: pytest.MonkeyPatch) -> None:
    enter(monkeypatch)


@pytest.fixture
def spec() -> RoleSpec:
    return ToyGame(ToyConfig(), 1).spec("defender")


def test_names_of_a_role_are_sorted() -> None:
    assert policy_names("toy", "defender") == [
        *("always", "chase", "guess", "mixture", "needs", "none", "random", "trace")
    ]
    assert policy_names("toy", "attacker") == ["always", "chase", "mixture", "none", "random", "trace"]


@pytest.mark.parametrize("reference", ["chase", "toy.defender.chase", "tests.core.toy_policies:Chase"])
def test_name_full_name_and_module(reference: str, spec: RoleSpec) -> None:
    policy = resolve_policy(reference, spec)
    assert isinstance(policy, Chase)
    assert policy.spec is spec


@pytest.mark.parametrize(
    ("query", "wanted"),
    [
        ("counts=1", "has no option 'counts'. Did you mean 'count'?"),
        ("depth=1", "has no option 'depth'. Known: count, other, rival, share, word"),
        ("count=0.5", "count = 0.5 must be a whole number"),
        ("count=null", "count = None must be a whole number"),
        ("share='null'", r"share = .*null.* must be a number"),
        ("share=[]", r"share = \[\] must be a number"),
        ("word=-9", "word = -9 must be a word"),
        ("rival='null'", r"rival = .*null.* must be an object of Guess, which only code can hand over or null"),
    ],
)
def test_options_are_of_the_kind_that_the_policy_says(query: str, wanted: str, spec: RoleSpec) -> None:
    with pytest.raises(ConfigurationError, match=wanted):
        resolve_policy(f"{__name__}:Picky?{query}", spec)


@pytest.mark.parametrize("query", ["count=2", "share=1", "share=null", "share=.5", "word=yes&other=[1]", ""])
def test_options_of_the_right_kind_are_taken(query: str, spec: RoleSpec) -> None:
    assert isinstance(resolve_policy(f"{__name__}:Picky?{query}", spec), Picky)
    assert resolve_policy(f"{__name__}:Picky", spec, share=np.float32(0.25), count=np.int64(3)).share == 0.25  # type: ignore[attr-defined]


def test_a_name_that_a_policy_does_not_know_is_no_accident(spec: RoleSpec) -> None:
    with pytest.raises(ConfigurationError, match="cannot be built with these options"):
        resolve_policy(f"{__name__}:looked_up?word=nothing", spec)


def test_objects_are_used_as_they_are(spec: RoleSpec) -> None:
    assert resolve_policy(READY, spec) is READY
    assert resolve_policy(f"{__name__}:READY", spec) is READY


def test_options_come_from_the_query_or_the_caller(spec: RoleSpec) -> None:
    policy: Any = resolve_policy("guess?level=[[1,2.5]]&name=plain text", spec)
    assert (policy.level, policy.name) == ([[1, 2.5]], "plain text")
    assert resolve_policy("guess?level=1", spec, level=2).level == 2  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("text", "value"),
    [(".5", 0.5), ("-2.", -2.0), ("1e-3", 1e-3), ("True", True), ("true", True), (".", "."), ("1.2.3", "1.2.3")],
)
def test_options_are_read_as_people_type_them(spec: RoleSpec, text: str, value: object) -> None:
    policy: Any = resolve_policy(f"guess?level={text}", spec)
    assert policy.level == value
    assert type(policy.level) is type(value)


def test_unknown_name_offers_the_near_ones(spec: RoleSpec) -> None:
    with pytest.raises(UnknownNameError, match=r"toy has no defender policy 'chas'. Did you mean 'chase'\?"):
        resolve_policy("chas", spec)


def test_a_policy_of_the_other_role_is_refused_by_name(spec: RoleSpec) -> None:
    with pytest.raises(
        UnknownNameError, match=r"no defender policy 'toy.attacker.chase'. 'chase' is an attacker of toy"
    ):
        resolve_policy("toy.attacker.chase", spec)


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("lurk", "toy has no defender policy 'lurk'. 'lurk' is an attacker of toy."),
        ("toy.attacker.lurk", "'lurk' is an attacker of toy."),
        ("dig", "'dig' is a defender of mine."),
        ("tests.core.toy_policies:Approach", "is no defender policy of toy. 'lurk' is an attacker of toy."),
        ('mixture?policies=["chase","lurk"]', "'lurk' is an attacker of toy."),
    ],
)
def test_whose_policy_it_is_is_told(
    reference: str, message: str, spec: RoleSpec, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(ENTRIES, "toy.attacker.lurk", "tests.core.toy_policies:Approach")
    monkeypatch.setitem(ENTRIES, "mine.defender.dig", "tests.core.toy_policies:Wander")
    enter(monkeypatch)
    with pytest.raises(UnknownNameError) as refused:
        resolve_policy(reference, spec)
    assert message in str(refused.value)


def test_an_object_made_for_somebody_else_is_refused(spec: RoleSpec) -> None:
    game = ToyGame(ToyConfig(), 1)
    with pytest.raises(ConfigurationError, match="is an attacker of toy, not a defender of toy"):
        resolve_policy(Guess(game.spec("attacker")), spec)
    with pytest.raises(ConfigurationError, match="is a defender of hvac, not a defender of toy"):
        resolve_policy(Guess(replace(spec, problem="hvac")), spec)


@pytest.mark.parametrize("kind", ["observation_space", "action_space"])
def test_a_model_with_other_spaces_is_refused(kind: str, spec: RoleSpec) -> None:
    model: Any = Guess(spec)
    model.observation_space, model.action_space = spec.fields.space(), spec.action_space
    assert resolve_policy(model, spec) is model
    setattr(model, kind, spaces.Box(-1, 1, (99,)))
    with pytest.raises(ConfigurationError, match=rf"has the {kind} Box.*99.*trained in another configuration"):
        resolve_policy(model, spec)


def test_options_that_are_nested_too_deeply_are_refused(spec: RoleSpec) -> None:
    with pytest.raises(ValueError, match=r"nested too deeply: \[\["):
        resolve_policy(f"guess?level={'[' * 100_000}", spec)


@pytest.mark.parametrize("reference", ["no_such_module:x", "tests.core.toy_policies:Nobody"])
def test_nothing_to_import(reference: str, spec: RoleSpec) -> None:
    with pytest.raises(UnknownNameError, match="no policy can be imported"):
        resolve_policy(reference, spec)


@pytest.mark.parametrize(("package", "extra"), [("scipy", "baselines"), ("pymoo", "genetic")])
def test_missing_package_names_the_command(
    package: str, extra: str, spec: RoleSpec, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    enter(monkeypatch, f"{package}:Policy")
    with pytest.raises(MissingExtraError, match=rf"'{package}'.*pip install \"cps-envs\[{extra}\]\"") as missing:
        resolve_policy("mine", spec)
    assert missing.value.name == package


REMEDY = "Correct its line in pyproject.toml and install its package again"


@pytest.mark.parametrize(
    ("value", "fault"),
    [
        ("no_such_package.policies:Policy", f"there is no module 'no_such_package'. {REMEDY}"),
        ("tests.core.toy_policys:Chase", f"there is no module 'tests.core.toy_policys'. {REMEDY}"),
        ("tests.core.toy_policies:Chaze", f"the module has no 'Chaze'. Did you mean 'Chase'? {REMEDY}"),
        ("typo:Policy", "the module cannot be imported: ModuleNotFoundError: No module named 'numpyy'"),
    ],
)
def test_a_wrong_entry_point_is_named(
    value: str, fault: str, spec: RoleSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "typo.py").write_text("import numpyy")
    monkeypatch.syspath_prepend(tmp_path)
    enter(monkeypatch, value)
    with pytest.raises(UnknownNameError) as refused:
        resolve_policy("mine", spec)
    assert str(refused.value).startswith(f"the entry point toy.defender.mine names {value}, but {fault}")


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        (3, "is not a policy: it has no method predict"),
        (f"{__name__}:NUMBER", "could not be built"),
        (f"{__name__}:READY?level=1", "built already"),
        ("builtins:print", "is not a policy"),
    ],
)
def test_what_is_no_policy(reference: Any, message: str, spec: RoleSpec) -> None:
    with pytest.raises(TypeError, match=message):
        resolve_policy(reference, spec)


def test_options_of_a_built_policy_are_refused(spec: RoleSpec) -> None:
    with pytest.raises(TypeError, match="built already"):
        resolve_policy(READY, spec, level=1)


def test_the_policy_of_a_problem_is_found_by_role() -> None:
    assert isinstance(TOY.policy("chase", ToyGame(ToyConfig(), 1), "attacker"), Idle)


@pytest.mark.parametrize("name", ["none", "toy.defender.none"])
def test_every_role_has_an_idle_policy_and_mixtures(name: str, spec: RoleSpec) -> None:
    assert isinstance(resolve_policy(name, spec), Idle)
    mixture: Any = resolve_policy('mixture?policies=["none","chase"]', spec)
    assert [type(policy) for policy in mixture.policies] == [Idle, Chase]


@pytest.mark.parametrize("query", ["half", "a=1&b", "speed=[[[x"])
def test_malformed_options_are_explained(query: str) -> None:
    spec = TOY.game(TOY.config("paper", {}), 1).spec("attacker")
    with pytest.raises((ConfigurationError, TypeError), match=r"option|built"):
        resolve_policy(f"tests.core.toy_policies:Approach?{query}", spec)


def test_near_offers_close_names_else_all() -> None:
    assert near("heuristc", ["heuristic", "mpc"]) == "Did you mean 'heuristic'?"
    assert near("zzz", ["b", "a"]) == "Known: a, b."
    assert near("zzz", []) == "There is nothing to choose from."


def test_require_gives_the_module_or_the_command() -> None:
    assert require("json", extra="render", purpose="writing").__name__ == "json"
    with pytest.raises(
        MissingExtraError, match=r"drawing needs the package 'no_such'.*pip install \"cps-envs\[render\]\""
    ):
        require("no_such.part", extra="render", purpose="drawing")


def test_errors_are_of_the_kinds_that_callers_expect() -> None:
    assert issubclass(ConfigurationError, ValueError)
    assert issubclass(MissingExtraError, ImportError)
    assert str(UnknownNameError("no such name")) == "no such name"
