"""Which learner does a job: our own PPO, whose import takes seconds, or policy search.

Several training runs go one after the other or side by side, with one bar for all.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from cps_agents.files import alone_in
from cps_agents.interruption import ending
from cps_agents.learning.recipe import SEARCH
from cps_agents.learning.run import FINISHED, Report, TrainingJob
from cps_agents.progress import Progress
from cps_agents.workers import Workers


def learn(job: TrainingJob, report: Report = lambda steps, note: None) -> dict[str, Any]:
    """Train by the job's algorithm; returns what `run.json` holds. Ctrl-C and SIGTERM save first what there is.

    Raises:
        CommandError: there is another run in the folder, an unfinished one and no `resume`, a damaged checkpoint to go
            on from, an algorithm that does not fit the environment, or another command that writes here.
        MissingExtraError: what the algorithm needs is not installed.
    """
    with alone_in(job.folder), ending():
        before = job.read()
        if before.get("status") == FINISHED:
            job.check_same()
            return before
        job.check_resumable()
        if job.recipe.algorithm == SEARCH:
            from cps_agents.learning.search import search as train
        else:
            from cps_agents.learning.shared import train
        train(job, report)
        return job.read()


POLL_EVERY_S = 1.0


def train_all(jobs: Sequence[TrainingJob], workers: int, title: str) -> list[dict[str, Any]]:
    """What each job's `run.json` holds at the end; at most one process per job."""
    total = sum(job.recipe.budget for job in jobs)
    with Progress(title, total) as progress, Workers(min(workers, len(jobs))) as pool:
        if workers == 1 or len(jobs) == 1:
            return [learn(job, _counting(progress, job, jobs[:place])) for place, job in enumerate(jobs)]
        with _watching(jobs, progress):
            done = {job.folder: found for job, found in pool.run(learn, jobs)}
    return [done[job.folder] for job in jobs]


def _counting(progress: Progress, job: TrainingJob, before: Sequence[TrainingJob]) -> Report:
    """Adds what the jobs before have done; `before` are finished."""
    first = sum(done.recipe.budget for done in before)

    def report(done: int, note: str) -> None:
        progress.update(first + min(done, job.recipe.budget), f"seed {job.seed}: {note}")

    return report


@contextmanager
def _watching(jobs: Sequence[TrainingJob], progress: Progress) -> Iterator[None]:
    """Moves the bar by what other processes write into their folders."""
    over = threading.Event()

    def poll() -> None:
        while not over.wait(POLL_EVERY_S):
            done, notes = _state(jobs)
            progress.update(done, "; ".join(notes))

    thread = threading.Thread(target=poll, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _state(jobs: Sequence[TrainingJob]) -> tuple[int, list[str]]:
    done, notes = 0, []
    for job in jobs:
        found, budget = job.read(), job.recipe.budget
        done += min(int(found.get("done", found.get("steps", 0))), budget)
        if found.get("best_score") is not None:
            notes.append(f"seed {job.seed}: best {found['best_score']:.3g}")
    return done, notes
