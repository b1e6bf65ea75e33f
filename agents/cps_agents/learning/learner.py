"""Which learner does a job: our own PPO, whose import takes seconds, or policy search.

Several training runs go one after the other or side by side, with one bar for all.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from cps_agents.cluster import check_seen, marked
from cps_agents.files import alone_in
from cps_agents.interruption import ending
from cps_agents.learning.recipe import SEARCH
from cps_agents.learning.run import FINISHED, Report, TrainingJob
from cps_agents.progress import Progress
from cps_agents.workers import Where, Workers


def learn(job: TrainingJob, report: Report = lambda steps, note: None, wait_s: float = 0.0) -> dict[str, Any]:
    """Train by the job's algorithm; returns what `run.json` holds. Ctrl-C and SIGTERM save first what there is.

    Another command's end, that writes into the job's folder, is waited for so many seconds.

    Raises:
        CommandError: there is another run in the folder, an unfinished one and no `resume`, a damaged checkpoint to go
            on from, an algorithm that does not fit the environment, or another command that writes here.
        MissingExtraError: what the algorithm needs is not installed.
    """
    if _finished(job):
        return job.read()
    with alone_in(job.folder, wait_s), ending():
        if _finished(job):
            return job.read()
        job.check_resumable()
        if job.recipe.algorithm == SEARCH:
            from cps_agents.learning.search import search as train
        else:
            from cps_agents.learning.shared import train
        train(job, report)
        return job.read()


def _finished(job: TrainingJob) -> bool:
    """Whether its folder holds a finished run; one of another recipe is refused."""
    done = job.read().get("status") == FINISHED
    if done:
        job.check_same()
    return done


POLL_EVERY_S = 1.0
DEATH_S = 120.0  # in which a process whose machine is lost lets go of its folder


def train_all(jobs: Sequence[TrainingJob], workers: Where, title: str) -> list[dict[str, Any]]:
    """What each job's `run.json` holds at the end; at most one process per job.

    Raises:
        CommandError: see `learn`; or the folders are not those that the machines of a cluster see.
    """
    total = sum(job.recipe.budget for job in jobs)
    with Progress(title, total) as progress, Workers(workers, len(jobs)) as pool:
        if workers == 1 or (isinstance(workers, int) and len(jobs) <= 1):
            return [learn(job, _counting(progress, job, jobs[:place])) for place, job in enumerate(jobs)]
        with _watching(jobs, progress):
            if isinstance(workers, int):
                done = {job.folder: found for job, found in pool.run(learn, jobs)}
            else:
                done = _elsewhere(jobs, pool)
    return [done[job.folder] for job in jobs]


def _elsewhere(jobs: Sequence[TrainingJob], pool: Workers) -> dict[Path, dict[str, Any]]:
    """Train on the machines of a cluster. A job goes on where it stood when its machine died."""
    for job in jobs:
        if not _finished(job):
            job.check_resumable()
    home = Path(os.path.commonpath([job.folder.absolute() for job in jobs]))
    with marked(home) as mark:
        asked = [replace(job, resume=True) for job in jobs]
        return {job.folder: found for job, found in pool.run(partial(_learn_seen, mark), asked)}


def _learn_seen(mark: Path, job: TrainingJob) -> dict[str, Any]:
    check_seen(mark)
    return learn(job, wait_s=DEATH_S)


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
