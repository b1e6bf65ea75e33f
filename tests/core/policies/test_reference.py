"""Texts that name policies: the tree of each, by value, and what a name may hold."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cps_envs.core.declare.panel import mixture, written
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.reference import MOST_DEPTH, Reference, parse_reference

SOURCES = frozenset(("zoo", "sb3"))


def parse(text: str) -> Reference:
    return parse_reference(text, SOURCES)


def inside(text: str) -> list[str]:
    return [each.text for each in parse(text).walk()][1:]


@pytest.mark.parametrize(
    ("text", "source", "name", "options"),
    [
        ("pd", "", "pd", {}),
        ("pd?", "", "pd", {}),
        ("rogue.defender.pd?gain=2", "", "rogue.defender.pd", {"gain": 2}),
        ("plan?events=[[10,1]]&word=a:b", "", "plan", {"events": [[10, 1]], "word": "a:b"}),
        ("x?number=1e+5&share=.5&empty=&flag=True", "", "x", {"number": 1e5, "share": 0.5, "empty": "", "flag": True}),
        ("x?word=%26%3D%25", "", "x", {"word": "&=%"}),
        ('x?word="a&b=c"&next=1', "", "x", {"word": "a&b=c", "next": 1}),
        ('x?word="a&b=1', "", "x", {"word": '"a', "b": 1}),  # no JSON, so the text ends at the &
        ("x?list=%5B1%2C2%5D", "", "x", {"list": [1, 2]}),
        ("my.module:Policy?gain=2", "my.module", "Policy", {"gain": 2}),
        ("zoo:hvac-attack?seed=3", "zoo", "hvac-attack", {"seed": 3}),
        (
            "zoo:/runs/lr=0.001,seed=3?seed=1&untrained=true",
            "zoo",
            "/runs/lr=0.001,seed=3",
            {"seed": 1, "untrained": True},
        ),
        ("zoo:/a&b/c]d/e\"f/g'h/ä b%20c+d", "zoo", "/a&b/c]d/e\"f/g'h/ä b%20c+d", {}),
        ("zoo:/runs/why?", "zoo", "/runs/why?", {}),
        ("zoo:/runs/a?b?seed=1", "zoo", "/runs/a?b", {"seed": 1}),
        ("zoo:/runs/a?lr=1/policy.json?seed=1", "zoo", "/runs/a?lr=1/policy.json", {"seed": 1}),
        ("zoo:a?word=b?c", "zoo", "a", {"word": "b?c"}),
        ("sb3:C:\\m,1\\model.zip?algorithm=SAC", "sb3", "C:\\m,1\\model.zip", {"algorithm": "SAC"}),
        ("zoo", "", "zoo", {}),
        (":x", "", ":x", {}),
        ("zoo:", "", "zoo:", {}),
    ],
)
def test_a_text_is_a_tree(text: str, source: str, name: str, options: dict[str, Any]) -> None:
    found = parse(text)
    assert (found.source, found.name, found.options, found.policies) == (source, name, options, ())


@pytest.mark.parametrize("text", ["x?a", "x?=1", "x?a=1&", "x?a=1&&b=2", "x?a=1&b", "x?&a=1"])
def test_options_are_pairs(text: str) -> None:
    with pytest.raises(ConfigurationError, match="options are written as name=value&name=value"):
        parse(text)


def test_an_option_has_one_value() -> None:
    with pytest.raises(ConfigurationError, match="'a' is given twice"):
        parse("x?a=1&b=2&a=3")
    with pytest.raises(ConfigurationError, match="nested too deeply"):
        parse(f"x?a={'[' * 100}{']' * 100}")


def test_policies_inside_are_found_wherever_they_stand() -> None:
    assert inside('mixture?policies=["none","pd?gain=1","a:b"]&weights=[1,2,3]') == ["none", "pd?gain=1", "a:b"]
    assert inside('mixture?policies=["zoo:/x/a&b","none"]') == ["zoo:/x/a&b", "none"]
    assert inside("my:Wrapper?inner=zoo:mine") == ["zoo:mine"]
    assert inside('my:Wrapper?way={"then":["sb3:m.zip"],"word":"zoo","key":"a:b"}') == ["sb3:m.zip"]
    deep = mixture(["none", mixture(["zoo:ä,1", "b"], [1, 2])])
    assert inside(deep) == ["none", mixture(["zoo:ä,1", "b"], [1, 2]), "zoo:ä,1", "b"]


def test_mixtures_inside_mixtures_have_an_end() -> None:
    text = "none"
    for _ in range(MOST_DEPTH + 1):
        text = "mixture?policies=[" + json.dumps(text).replace("%", "%25").replace('"', "%22").replace("&", "%26") + "]"
    with pytest.raises(ConfigurationError, match="nested too deeply"):
        parse(text)


@given(st.lists(st.text(min_size=1), min_size=1, max_size=3))
def test_what_a_mixture_writes_is_read_back(names: list[str]) -> None:
    policies = [f"zoo:{name}/policy.json" for name in names]
    found = parse(mixture(policies))
    assert [(each.source, each.name) for each in found.policies] == [("zoo", f"{name}/policy.json") for name in names]
    assert found.is_mixture


@example({"_": "NaN"})
@given(st.dictionaries(st.from_regex(r"[a-z_]+", fullmatch=True), st.text() | st.integers() | st.lists(st.text())))
def test_what_is_written_is_read_back(options: dict[str, Any]) -> None:
    found = parse(written("name", **options))
    assert (found.name, found.options) == ("name", options)


def test_a_file_s_options_may_name_other_files() -> None:
    found = parse("sb3:a?b=1/m.zip?vecnormalize=a?b=1/s.pkl&frame_stack=4")
    assert (found.name, found.options) == ("a?b=1/m.zip", {"vecnormalize": "a?b=1/s.pkl", "frame_stack": 4})
    assert parse("zoo:m.zip?/a?b=1").options == {"b": 1}


def test_one_more_option() -> None:
    assert parse("zoo:/a?b").with_option("seed", 1) == "zoo:/a?b?seed=1"
    assert parse("zoo:/a?b?x=2").with_option("seed", 1) == "zoo:/a?b?x=2&seed=1"
