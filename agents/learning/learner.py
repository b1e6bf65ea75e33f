"""Which learner does a job: policy search, or stable-baselines3, whose import takes seconds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from agents.learning.job import Job
from agents.learning.recipe import SEARCH

Report = Callable[[int, str], None]  # steps done, a note


def learn(job: Job, report: Report = lambda steps, note: None) -> dict[str, Any]:
    """Train by the job's algorithm; returns what `run.json` holds. See `search.search` and `training.train`."""
    if job.recipe.algorithm == SEARCH:
        from agents.learning.search import search

        return search(job, report)
    from agents.learning.training import train

    return train(job, report)
