"""The folder of one training run, one recipe and one seed: what has to be done, and what the folder says of it.

It says so while the policy is being trained, however that ends, and what `run.json` tells can be trained again.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from cps_agents.console import to_json
from cps_agents.errors import CommandError
from cps_agents.files import write_json, write_text
from cps_agents.learning.recipe import Recipe, changed, differing, knobs_of
from cps_agents.learning.tracking import RunTracker, make_tracker
from cps_agents.machine import versions
from cps_agents.recipes.finding import find_recipe
from cps_envs.core.documents import Entry, Source, entry_of, read_entry, read_text

RUNNING, INTERRUPTED, FINISHED = "running", "interrupted", "finished"
REMEDY = "Delete the folder and train again."
MOST_STEPS = 10**15
Report = Callable[[int, str], None]  # how much of `Recipe.budget` is done, a note


@dataclass(frozen=True)
class TrainingJob:
    """A recipe, a seed, and the folder of their run; plain data that any process can do.

    The folder holds `run.json` (recipe, command, versions, how far), `evaluations.jsonl`, the best policy so far by
    validation (`policy.json` and `policy.safetensors` of a network, `searched.json` of numbers), a checkpoint to go on
    from, and what a tracker writes, such as `tensorboard/`.
    """

    recipe: Recipe
    seed: int
    folder: Path
    command: str
    resume: bool = False
    tracker: str = "tensorboard"

    @property
    def card(self) -> Path:
        """The best policy's card."""
        return self.folder / "policy.json"

    def read(self) -> dict[str, Any]:
        """What `write` has written; empty if nothing.

        Raises:
            DamagedFileError: the file is damaged.
        """
        path = self.folder / "run.json"
        if not path.is_file():
            return {}
        found = read_entry(path, "record of a training run", REMEDY)
        _check(found)
        return found.plain()

    def write(self, **progress: Any) -> None:
        """Update `run.json`: recipe, seed and command with what is given, the rest as it was."""
        kind = type(self.recipe)  # what the knobs belong to, where it is not the usual class
        base = "" if kind is Recipe else f"{kind.__module__}:{kind.__qualname__}"
        fixed = {"base": base, "recipe": knobs_of(self.recipe), "seed": self.seed, "command": self.command}
        write_json(self.folder / "run.json", {**self.read(), **fixed, **progress})

    def append_evaluation(self, row: dict[str, Any]) -> None:
        """Add a line to `evaluations.jsonl`."""
        path = self.folder / "evaluations.jsonl"
        before = read_text(path) if path.is_file() else ""
        write_text(path, before + json.dumps(json.loads(to_json(row))) + "\n")

    def evaluations(self) -> Iterator[dict[str, Any]]:
        """The lines of `evaluations.jsonl`.

        Raises:
            DamagedFileError: a line is none that `append_evaluation` wrote.
        """
        path = self.folder / "evaluations.jsonl"
        for number, line in enumerate(read_text(path).splitlines() if path.is_file() else (), start=1):
            found = entry_of(line, Source(f"{path}, line {number},", "evaluation of a training run", REMEDY))
            for value in found.entries().values():
                value.number()
            yield found.plain()

    def check_same(self) -> None:
        """Whether what lies there is of this recipe and seed.

        Raises:
            CommandError: it is of another.
        """
        found = self.read()
        if not found:
            return
        others = differing(found.get("recipe", {}), knobs_of(self.recipe))
        if others or found.get("seed") != self.seed:
            raise CommandError(
                f"{self.folder} holds a run of another recipe (other: {', '.join(others) or 'seed'}). Choose another "
                "--out, or delete it."
            )

    def check_resumable(self) -> None:
        """Whether the job may begin, or go on.

        Raises:
            CommandError: there is another run in the folder, or an unfinished one and `resume` is false.
            DamagedFileError: `run.json` is damaged.
        """
        self.check_same()
        if self.read().get("steps") and not self.resume:
            raise CommandError(f"{self.folder} holds an unfinished run: continue with --resume, or delete it")

    def start_tracker(self) -> RunTracker:
        """Where its curves go."""
        return make_tracker(self.tracker, self.folder)


def _check(found: Entry) -> None:
    """Check that a run's folder holds what others read from it, as `TrainingJob.write` wrote it."""
    found["recipe"].entries()
    found["seed"].whole(0, MOST_STEPS)
    found["status"].text((RUNNING, INTERRUPTED, FINISHED))
    for name in ("steps", "done"):
        if (count := found.get(name)) is not None:
            count.whole(0, MOST_STEPS)
    for name in ("cpu_s", "best_score"):
        if (number := found.get(name)) is not None and number.value is not None:
            number.number()


@contextmanager
def recording(job: TrainingJob) -> Iterator[RunTracker]:
    """Says that the run is running, and at the end that it is finished, or interrupted; gives its tracker."""
    before, tracker = job.read(), job.start_tracker()
    try:
        started = before.get("started", time.time())
        job.write(status=RUNNING, versions=versions(), started=started)
        yield tracker
        job.write(status=FINISHED)
    except BaseException:
        with suppress(OSError):  # of a full disk, which is what has to be told
            job.write(status=INTERRUPTED)
        raise
    finally:
        tracker.close()


class Earlier(NamedTuple):
    """The recipe and the seed of an earlier run."""

    recipe: Recipe
    seed: int


def read_earlier(path: Path) -> Earlier:
    """Recipe and seed of a run's `run.json`.

    Raises:
        DamagedFileError: it is no record of a training run.
        CommandError: no such file, or there is no such recipe.
        UntrustedCodeError: its recipe is code of your own, and the user has not agreed to run it.
    """
    if not path.is_file():
        raise CommandError(f"{path} is not a file: name the run.json of a training run")
    found = read_entry(path, "record of a training run", "Name the run.json of a training run.")
    knobs, seed, base = found["recipe"].plain(), found["seed"].whole(0, MOST_STEPS), found["base"].text()
    try:
        recipe = find_recipe(base) if base else Recipe()
    except CommandError as error:
        raise CommandError(f"{path}: {error}") from error
    return Earlier(changed(recipe, knobs), seed)
