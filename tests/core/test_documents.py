"""Documents from strangers: size, depth and kind are checked, and the message names file, place and remedy."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.core.documents import (
    MOST_DEPTH,
    DamagedFileError,
    Entry,
    Source,
    entry_of,
    parse,
    read_entry,
    read_text,
)

SOURCE = Source("kept.json", "list of pumps", "Delete it.")
DOCUMENT = '{"pumps": [{"flow": 2.5, "name": "P1", "valves": 3, "on": true}]}'


def pump() -> Entry:
    return entry_of(DOCUMENT, SOURCE)["pumps"].rows()[0]


def test_what_fits_is_read() -> None:
    found = pump()
    assert found["flow"].number(0, 3) == 2.5
    assert found["valves"].whole(0, 3) == found["valves"].number() == 3
    assert found["name"].text() == found["name"].text(("P1", "P2")) == "P1"
    assert found.get("age") is None
    assert list(found.plain()) == ["flow", "name", "valves", "on"]


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda found: found["age"], "the entry pumps[0].age is missing"),
        (lambda found: found["flow"].number(3, 4), "pumps[0].flow is '2.5', but should be a number from 3 to 4"),
        (lambda found: found["flow"].whole(0, 9), "pumps[0].flow is '2.5', but should be a whole number from 0 to 9"),
        (lambda found: found["on"].number(), "pumps[0].on is 'True', but should be a finite number"),
        (lambda found: found["on"].whole(0, 1), "pumps[0].on is 'True', but should be a whole number from 0 to 1"),
        (lambda found: found["name"].number(), "pumps[0].name is 'P1', but should be a number"),
        (lambda found: found["name"].text(("P2",)), "pumps[0].name is 'P1', but should be one of P2"),
        (lambda found: found["flow"].text(), "pumps[0].flow is '2.5', but should be a text"),
        (lambda found: found["flow"].entries(), "pumps[0].flow is '2.5', but should be an object"),
        (lambda found: found.rows(), "but should be a list"),
        (lambda found: found["flow"].plain(), "but should be an object"),
    ],
)
def test_what_does_not_fit_is_named_with_its_place(ask: Callable[[Entry], object], message: str) -> None:
    with pytest.raises(DamagedFileError) as refused:
        ask(pump())
    assert str(refused.value).startswith("kept.json is no list of pumps (")
    assert str(refused.value).endswith("). Delete it.")
    assert message.replace("a finite number", "a number") in str(refused.value)


@pytest.mark.parametrize("value", ["1e999", "-1e999", f"1{'0' * 400}"])
def test_a_number_beyond_all_others_is_none(value: str) -> None:
    with pytest.raises(DamagedFileError, match="finite"):
        entry_of(value, SOURCE).number()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "Expecting value"),
        ('{"a": 1', "Expecting"),
        ("NaN", "NaN is no number"),
        ("[-Infinity]", "-Infinity is no number"),
        ("[" * 200_000, "nested too deeply"),
        ('{"a":' * 100_000 + "1" + "}" * 100_000, "nested too deeply"),
        ("[" * (MOST_DEPTH + 1) + "]" * (MOST_DEPTH + 1), "nested too deeply"),
        ("1" * 5000, "digits"),
    ],
)
def test_what_is_no_json_is_refused(text: str, reason: str) -> None:
    with pytest.raises(DamagedFileError, match=f"kept.json is no list of pumps .*{reason}.* Delete it"):
        entry_of(text, SOURCE)


def test_as_deep_as_allowed_is_read() -> None:
    assert parse("[" * MOST_DEPTH + "]" * MOST_DEPTH)


LEAVES = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()


@settings(max_examples=40)
@given(st.recursive(LEAVES, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner)))
def test_any_other_json_comes_back(value: Any) -> None:
    assert parse(json.dumps(value)) == value


def test_files_that_are_too_large_or_none_are_not_read(tmp_path: Path) -> None:
    path = tmp_path / "kept.json"
    path.write_text(DOCUMENT)
    assert read_entry(path, "list", "Delete it.", 1000)["pumps"].rows()
    with pytest.raises(DamagedFileError, match=r"kept\.json is no list .*bytes, more than 10.*Delete"):
        read_entry(path, "list", "Delete it.", 10)
    with pytest.raises(DamagedFileError, match="more than 10"):
        read_text(path, 10)
    with pytest.raises(DamagedFileError, match="it is no file"):
        read_entry(tmp_path, "list", "Delete it.")
    with pytest.raises(FileNotFoundError):
        read_entry(tmp_path / "none.json", "list", "Delete it.")
    path.write_bytes(b'{"a": "\xff"}')
    with pytest.raises(DamagedFileError, match="no text in UTF-8"):
        read_entry(path, "list", "Delete it.")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(DamagedFileError, match="it is no file"):
        read_entry(tmp_path / "pipe", "list", "Delete it.")


def test_texts_do_not_steer_a_terminal() -> None:
    for text in ("\x1b[2J", "a\x07", "\u202eabc", "\x9b2J"):
        with pytest.raises(DamagedFileError, match="digest has characters that steer a terminal"):
            entry_of(json.dumps({"digest": text}), Source("score.json", "score", "Make it."))["digest"].text()


def test_a_document_of_too_many_values_is_refused_before_it_is_read() -> None:
    with pytest.raises(ValueError, match="has 500001 lists and objects, more than 500000"):
        parse("[" + "[]," * 500_000)  # no JSON, which nobody has noticed yet
    with pytest.raises(ValueError, match="has 4000001 values, more than 4000000"):
        parse("[" + "1," * 4_000_001)


def test_lines_end_alike_on_every_system(tmp_path: Path) -> None:
    (tmp_path / "page.md").write_bytes(b"one\r\ntwo\n")
    assert read_text(tmp_path / "page.md") == "one\ntwo\n"
