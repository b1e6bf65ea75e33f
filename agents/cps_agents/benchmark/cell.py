"""The pieces of work of a benchmark: plain data that any process can do."""

from __future__ import annotations

import hashlib
import json
import re
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib import import_module
from typing import Any, ClassVar, Protocol, cast

from cps_agents.zoo.references import form_of, weights_of
from cps_baselines.schedule import Entrant, Setting
from cps_envs.core.documents import Entry
from cps_envs.core.problem import Problem

Result = dict[str, Any]


@dataclass(frozen=True)
class Cell:
    """An attacker against a defender, some episodes in one batch."""

    kind: ClassVar[str] = "cell"
    problem: str
    setting: str
    preset: str
    overrides: Mapping[str, Any]
    attacker: str
    defender: str
    attacker_policy: str
    defender_policy: str
    episodes: int  # on seeds first_seed, first_seed + 1, ...
    weights: Mapping[str, str] = field(default_factory=dict)  # hashes of the trained policies
    first_seed: int = 0

    @property
    def label(self) -> str:
        """For progress and file names."""
        return f"{self.problem} {self.setting} {self.attacker} {self.defender}"

    def run(self) -> Result:
        """`metrics`: each metric's values, one per episode; `simulations`: episodes that an attacker planned on."""
        from cps_envs.core.play import play_episodes

        problem = problem_of(self.problem)
        config = problem.config(self.preset, self.overrides)
        attacker: Any = problem.policy(self.attacker_policy, problem.game(config, 1), "attacker")
        players: Any = {"attacker": attacker, "defender": self.defender_policy}
        outcome = play_episodes(problem, config, players, range(self.first_seed, self.first_seed + self.episodes))
        metrics = {name: values.tolist() for name, values in outcome.items()}
        return {"metrics": metrics, "simulations": getattr(attacker, "simulations", 0)}

    def check(self, result: Entry) -> None:
        """A finite value of each metric for each episode."""
        for values in result["metrics"].entries().values():
            values.numbers(self.episodes)
        result["simulations"].number(0)
        result["cpu_s"].number(0)


@dataclass(frozen=True)
class Preparation:
    """What an entrant finds out before it plays."""

    kind: ClassVar[str] = "preparation"
    problem: str
    setting: str
    preset: str
    overrides: Mapping[str, Any]
    entrant: str
    function: str  # module:function
    quick: bool
    opponent: str = ""  # the function's third argument, if it is to know

    @property
    def label(self) -> str:
        """For progress and file names."""
        return f"{self.problem} {self.setting} {self.entrant} prepares"

    def run(self) -> Result:
        """`policy`, the reference to play with, and `note`."""
        module, _, attribute = self.function.partition(":")
        config = problem_of(self.problem).config(self.preset, self.overrides)
        known = (config, self.quick, self.opponent) if self.opponent else (config, self.quick)
        return asdict(getattr(import_module(module), attribute)(*known))

    def check(self, result: Entry) -> None:
        """A reference and a note."""
        result["policy"].text()
        result["note"].text()


class Job(Protocol):
    """A piece of work that any process can do; a frozen dataclass of plain data."""

    kind: ClassVar[str]

    @property
    def problem(self) -> str:
        """The problem's name, or module:attribute."""

    @property
    def label(self) -> str:
        """For progress and file names."""

    def run(self) -> Result:
        """Do the work."""

    def check(self, result: Entry) -> None:
        """Refuse a kept result that this work cannot have.

        Raises:
            DamagedFileError: it has other entries, or numbers that are not finite.
        """


def problem_of(name: str) -> Problem:
    """A registered problem by its name, or another one by `module:attribute`."""
    from cps_envs import find_problem

    return find_problem(name)


def run_job(job: Job) -> Result:
    """Do a piece of work; its result also tells the CPU seconds it took."""
    start = time.process_time()
    return {**job.run(), "cpu_s": round(time.process_time() - start, 3)}


def plain(job: Job) -> dict[str, Any]:
    """The data of a piece of work."""
    return asdict(cast(Any, job))


def file_name(job: Job) -> str:
    """A readable name that is unique to the work."""
    text = json.dumps([job.kind, plain(job)], sort_keys=True)
    readable = re.sub(r"[^a-z0-9._]+", "-", job.label.lower())
    return f"{readable}-{hashlib.sha256(text.encode()).hexdigest()[:12]}.json"


def make_preparation(problem: str, setting: Setting, entrant: Entrant, quick: bool) -> Preparation:
    """The work of an entrant that prepares itself."""
    overrides = dict(setting.overrides)
    return Preparation(problem, setting.name, setting.preset, overrides, entrant.name, entrant.prepare, quick)


def make_cell(problem: str, setting: Setting, attacker: Entrant, defender: Entrant, episodes: int) -> Cell:
    """The work of a meeting, in the observation and action forms that trained policies know."""
    overrides, config = dict(setting.overrides), problem_of(problem).config(setting.preset, setting.overrides)
    for entrant in (attacker, defender):
        overrides |= form_of(entrant.reference, config)
    return Cell(
        problem=problem,
        setting=setting.name,
        preset=setting.preset,
        overrides=overrides,
        attacker=attacker.name,
        defender=defender.name,
        attacker_policy=attacker.reference,
        defender_policy=defender.reference,
        episodes=episodes,
        weights=weights_of(attacker.reference) | weights_of(defender.reference),
    )
