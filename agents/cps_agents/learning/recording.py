"""What a run's folder says while it is being trained, however that ends."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from cps_agents.errors import CommandError
from cps_agents.learning.job import Job
from cps_agents.learning.run import FINISHED, INTERRUPTED, RUNNING
from cps_agents.learning.tracking import Tracker, make_tracker
from cps_agents.machine import versions


def check_resumable(job: Job) -> None:
    """Whether a job may begin, or go on.

    Raises:
        CommandError: there is another run in the folder, or an unfinished one that nobody asked to go on with.
        DamagedFileError: `run.json` is damaged.
    """
    job.run.check_same()
    if job.run.read().get("steps") and not job.resume:
        raise CommandError(f"{job.folder} holds an unfinished run: continue with --resume, or delete it")


def resumption_of(job: Job) -> int:
    """How often the run has been gone on with, this time included; 0 for the first."""
    return int(job.run.read().get("resumptions", -1)) + 1


@contextmanager
def recording(job: Job) -> Iterator[Tracker]:
    """Says that the run is running, and at the end that it is finished, or interrupted; gives its tracker."""
    run, before = job.run, job.run.read()
    tracker = make_tracker(job.tracker, job.subject)
    try:
        started = before.get("started", time.time())
        run.write(status=RUNNING, resumptions=resumption_of(job), versions=versions(), started=started)
        yield tracker
        run.write(status=FINISHED)
    except BaseException:
        with suppress(OSError):  # of a full disk, which is what has to be told
            run.write(status=INTERRUPTED)
        raise
    finally:
        tracker.close()
