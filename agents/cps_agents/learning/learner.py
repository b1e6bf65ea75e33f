"""Which learner does a job: policy search, or stable-baselines3, whose import takes seconds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cps_agents.learning.recipe import SEARCH
from cps_agents.learning.run import FINISHED, Job, check_resumable
from cps_agents.locking import alone_in
from cps_baselines.interruption import ending

Report = Callable[[int, str], None]  # steps done, a note


def learn(job: Job, report: Report = lambda steps, note: None) -> dict[str, Any]:
    """Train by the job's algorithm; returns what `run.json` holds. Ctrl-C and SIGTERM save first what there is.

    Raises:
        CommandError: there is another run in the folder, an unfinished one and no `resume`, a damaged checkpoint to go
            on from, an algorithm that does not fit the environment, or another command that writes here.
        MissingExtraError: what the algorithm needs is not installed.
    """
    with alone_in(job.folder), ending():
        before = job.run.read()
        if before.get("status") == FINISHED:
            job.run.check_same()
            return before
        check_resumable(job)
        if job.recipe.algorithm == SEARCH:
            from cps_agents.learning.search import search as train
        else:
            from cps_agents.learning.training import train
        train(job, report)
        return job.run.read()
