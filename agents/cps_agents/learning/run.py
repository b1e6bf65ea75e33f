"""The folder of one training run: one recipe, one seed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cps_agents.console import to_json
from cps_agents.errors import CommandError
from cps_agents.files import write_json, write_text
from cps_agents.learning.knobs import differing, knobs_of
from cps_agents.learning.recipe import Recipe
from cps_envs.core.documents import Entry, Source, entry_of, read_entry, read_text

RUNNING, INTERRUPTED, FINISHED = "running", "interrupted", "finished"
REMEDY = "Delete the folder and train again."
MOST_STEPS = 10**15


@dataclass(frozen=True)
class Run:
    """Where things lie.

    `run.json` (recipe, command, versions, how far), `evaluations.jsonl`, `checkpoint.zip` to go on from, `policy.json`
    and `policy.safetensors` (the best so far by validation), and what a tracker writes, such as `tensorboard/`.
    """

    folder: Path
    recipe: Recipe
    seed: int
    command: str

    @property
    def checkpoint(self) -> Path:
        """The model as it is."""
        return self.folder / "checkpoint.zip"

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
        base = type(self.recipe)().name  # the shipped recipe that the knobs belong to; "" if there is none
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


def _check(found: Entry) -> None:
    """That what other runs rely on is there as `Run.write` wrote it."""
    found["recipe"].entries()
    found["seed"].whole(0, MOST_STEPS)
    found["status"].text((RUNNING, INTERRUPTED, FINISHED))
    for name in ("steps", "resumptions"):
        if (count := found.get(name)) is not None:
            count.whole(0, MOST_STEPS)
    for name in ("cpu_s", "best_score"):
        if (number := found.get(name)) is not None and number.value is not None:
            number.number()
