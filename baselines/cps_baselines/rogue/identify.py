"""Extension beyond the paper: an attacker that finds out which defender it faces, and then responds to it."""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from cps_baselines.rogue.probing import Answers, Probe, checked_rows
from cps_baselines.rogue.switching import Switching
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.policies.adapter import advises
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.types import Array, FloatArray


class Known(NamedTuple):
    """The answers to K known defenders that were searched in preset `learning`, and how to recognise each."""

    against: tuple[str, ...]
    weights: FloatArray  # (K, 7) of `Switching`, found against each of them
    traces: FloatArray  # (K, 5) what the attacker sees of them, in the mean, after the probe
    probe: FloatArray  # (7,) weights of the probe
    probe_s: float


@lru_cache(maxsize=1)
def known() -> Known:
    """The searched responses that come with the package."""
    found = json.loads(files("cps_baselines.rogue").joinpath("contested.json").read_text(encoding="utf-8"))
    rows = found["found"]
    weights, traces = (np.array([row[name] for row in rows]) for name in ("weights", "trace"))
    return Known(tuple(row["against"] for row in rows), weights, traces, np.array(found["probe"]), found["probe_s"])


def in_one_look(found: Known) -> Answers:
    """What is known as the answers of `Probe`, at any power ratio and after one look."""
    at, traces = np.zeros((1, len(found.weights)), np.int64), found.traces[np.newaxis, :, np.newaxis]
    return Answers(found.against, np.ones(1), found.probe[np.newaxis], found.weights[np.newaxis], at, traces)


@lru_cache(maxsize=1)
def shipped() -> Answers:
    """The searched responses as those answers: one object, by which `informed` recognises the attacker."""
    return in_one_look(known())


class Identify(Probe):
    """Probes for `probe_s`, compares what it sees with known defenders, and answers the nearest one.

    The known defenders, their mean traces and the responses to them are in `contested.json`; `knowledge` are others.
    With `answers` (B,) it takes these rows instead of comparing, as searches do.
    """

    def __init__(self, spec: RoleSpec, knowledge: Known | None = None, answers: Array | None = None) -> None:
        found = knowledge or known()
        rows = checked_rows("answers", answers, len(found.weights))
        super().__init__(spec, answers=shipped() if knowledge is None else in_one_look(knowledge), row=rows)
        self.looks_s = (found.probe_s,)


@advises("cps_baselines.rogue.advised:Contesting")
def contested(spec: RoleSpec, against: str = "monitor") -> Switching:
    """Plays `switching` with weights searched against one defender in preset `learning`.

    Raises:
        ConfigurationError: nothing was searched against that defender.
    """
    names = known().against
    if against not in names:
        raise ConfigurationError(f"no response was searched against {against!r}. {near(against, names)}")
    policy = Switching(spec, known().weights[names.index(against)])
    policy.searched_numbers = policy.sets.size
    return policy
