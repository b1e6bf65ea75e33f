"""The pieces of work of an arena, as plain data that any process can do: meetings first of all."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError, explain
from cps_envs.core.documents import Entry
from cps_envs.registration import find_problem

Result = dict[str, Any]


@dataclass(frozen=True)
class InVenue:
    """Base of jobs that play in one venue, a configuration of a problem."""

    venue: Venue

    @property
    def problem(self) -> str:
        """The problem's name, or module:attribute."""
        return self.venue.problem


@dataclass(frozen=True)
class Meeting(InVenue):
    """An attacker against a defender in a venue: some episodes in one batch.

    Who asks for it and what it is called there is no part of it: the same meeting is played once for everybody.
    """

    kind: ClassVar[str] = "meeting"
    attacker: str  # reference
    defender: str
    episodes: int  # on seeds first_seed, first_seed + 1, ...
    first_seed: int = 0
    sources: Mapping[str, str] = field(default_factory=dict)  # hashes of trained policies and of code of one's own
    label: str = field(default="", compare=False)  # for progress

    def run(self) -> Result:
        """`metrics`: each metric's values, one per episode."""
        from cps_envs.core.game.play import play_episodes

        problem, config = find_problem(self.problem), self.venue.config
        players: Any = {"attacker": self.attacker, "defender": self.defender}
        outcome = play_episodes(problem, config, players, range(self.first_seed, self.first_seed + self.episodes))
        return {"metrics": {name: values.tolist() for name, values in outcome.items()}}

    def check(self, result: Entry) -> None:
        """A finite value of each metric for each episode."""
        for values in result["metrics"].entries().values():
            values.numbers(self.episodes)
        result["cpu_s"].number(0)


class Job(Protocol):
    """A piece of work that any process can do; a frozen dataclass of plain data."""

    kind: ClassVar[str]

    @property
    def problem(self) -> str:
        """The problem's name, or module:attribute."""

    @property
    def label(self) -> str:
        """Its name in progress bars."""

    def run(self) -> Result:
        """Do the work."""

    def check(self, result: Entry) -> None:
        """Refuse a kept result that this work cannot have.

        Raises:
            DamagedFileError: it has other entries, or numbers that are not finite.
        """


def attempt(job: Job) -> Result:
    """The result of a job, and the CPU seconds it took; errors that the user can put right tell which job had them."""
    start = time.process_time()
    try:
        return {**job.run(), "cpu_s": round(time.process_time() - start, 3)}
    except Exception as error:
        message = explain(error)
        if message is None:
            raise
        raise CommandError(f"{job.problem} {job.label}: {message}") from error
