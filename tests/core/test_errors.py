from __future__ import annotations

import pytest

from cps_envs.core.errors import ConfigurationError, MissingExtraError, UnknownNameError, near, require


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
