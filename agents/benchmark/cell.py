"""The pieces of work of a benchmark: plain data that any process can do."""

from __future__ import annotations

import hashlib
import json
import re
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib import import_module
from typing import Any, ClassVar

from baselines.schedule import Entrant, Setting

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
    episodes: int  # on seeds 0, 1, ...

    @property
    def label(self) -> str:
        """For progress and file names."""
        return f"{self.problem} {self.setting} {self.attacker} {self.defender}"

    def run(self) -> Result:
        """`metrics`: each metric's values, one per episode."""
        from cps_envs import find_problem
        from cps_envs.core.play import play_episodes

        problem = find_problem(self.problem)
        config = problem.config(self.preset, self.overrides)
        players: Any = {"attacker": self.attacker_policy, "defender": self.defender_policy}
        outcome = play_episodes(problem, config, players, range(self.episodes))
        return {"metrics": {name: values.tolist() for name, values in outcome.items()}}


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

    @property
    def label(self) -> str:
        """For progress and file names."""
        return f"{self.problem} {self.setting} {self.entrant} prepares"

    def run(self) -> Result:
        """`policy`, the reference to play with, and `note`."""
        from cps_envs import find_problem

        module, _, attribute = self.function.partition(":")
        config = find_problem(self.problem).config(self.preset, self.overrides)
        prepared = getattr(import_module(module), attribute)(config, self.quick)
        return asdict(prepared)


Job = Cell | Preparation


def run_job(job: Job) -> Result:
    """Do a piece of work; its result also tells the CPU seconds it took."""
    start = time.process_time()
    return {**job.run(), "cpu_s": round(time.process_time() - start, 3)}


def file_name(job: Job) -> str:
    """A readable name that is unique to the work."""
    text = json.dumps([job.kind, asdict(job)], sort_keys=True)
    readable = re.sub(r"[^a-z0-9._]+", "-", job.label.lower())
    return f"{readable}-{hashlib.sha256(text.encode()).hexdigest()[:12]}.json"


def make_preparation(problem: str, setting: Setting, entrant: Entrant, quick: bool) -> Preparation:
    """The work of an entrant that prepares itself."""
    overrides = dict(setting.overrides)
    return Preparation(problem, setting.name, setting.preset, overrides, entrant.name, entrant.prepare, quick)


def make_cell(problem: str, setting: Setting, attacker: Entrant, defender: Entrant, episodes: int) -> Cell:
    """The work of a meeting."""
    return Cell(
        problem=problem,
        setting=setting.name,
        preset=setting.preset,
        overrides=dict(setting.overrides),
        attacker=attacker.name,
        defender=defender.name,
        attacker_policy=attacker.reference,
        defender_policy=defender.reference,
        episodes=episodes,
    )
