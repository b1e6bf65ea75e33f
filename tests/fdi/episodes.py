"""Episodes of false data injection for the tests of its policies."""

from __future__ import annotations

from functools import partial
from typing import Any

from cps_envs.fdi.problem import FDI
from tests import episodes

play = partial(episodes.play, FDI)
spec_of = partial(episodes.spec_of, FDI)


def task_settings(task: Any) -> dict[str, Any]:
    """The overrides that fix a task, "x4>4" or a `Task`."""
    attacked, target = str(task).split(">")
    return {"attacked": attacked, "target": int(target)}
