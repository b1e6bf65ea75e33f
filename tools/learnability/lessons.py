"""An ordinary learner on a role: PPO of stable-baselines3 with the settings that the role's page names."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.files import alone_in, replacing, write_json
from cps_envs.core.documents import read_entry
from cps_envs.core.errors import require

MODEL, START, RUN = "model.zip", "start.zip", "run.json"
Report = Callable[[float, str], None]  # CPU seconds so far, and how it stands


@dataclass(frozen=True)
class Lesson:
    """A role that one training seed is to learn within so many CPU seconds, the environments' included."""

    name: str  # such as RogueAttack
    seed: int
    cpu_s: float
    folder: Path  # of this training seed

    @property
    def record(self) -> dict[str, Any]:
        """What the folder says of the run.

        Raises:
            DamagedFileError: it is no record of a run.
        """
        return read_entry(self.folder / RUN, "record of a training run", "Delete the folder and train again.").plain()

    @property
    def done(self) -> bool:
        """Whether the folder holds what it is to hold.

        Raises:
            CommandError: it holds a run with other settings.
        """
        if not (self.folder / RUN).is_file():
            return False
        found = self.record
        asked = {"name": self.name, "seed": self.seed, "cpu_s_asked": self.cpu_s}
        if any(found.get(key) != value for key, value in asked.items()):
            raise CommandError(f"{self.folder} holds another run: name another folder with --out, or delete it")
        return (self.folder / MODEL).is_file()


def teach(lesson: Lesson, report: Report = lambda done_s, note: None) -> dict[str, Any]:
    """Train, save the untrained and the trained model, and return what `run.json` holds.

    Raises:
        CommandError: the folder holds another run, or another process writes there.
        MissingExtraError: stable-baselines3 is not installed.
    """
    require("stable_baselines3", extra="sb3", purpose="training an ordinary learner")
    with alone_in(lesson.folder):
        if lesson.done:
            return lesson.record
        return _teach(lesson, report)


def _teach(lesson: Lesson, report: Report) -> dict[str, Any]:
    import torch
    from stable_baselines3 import PPO

    from cps_agents.sb3 import StickyPolicy, make

    torch.set_num_threads(1)
    before = time.process_time()
    envs = make(lesson.name)
    model = PPO(StickyPolicy, envs, seed=lesson.seed, **envs.settings)
    with replacing(lesson.folder / START) as draft:
        model.save(draft)
    began, planned = time.process_time(), model.lr_schedule
    model.lr_schedule = lambda _: planned(max(1.0 - (time.process_time() - began) / lesson.cpu_s, 0.0))
    model.learn(10**12, callback=_limited(began, lesson.cpu_s, report))
    cpu_s, model.lr_schedule = time.process_time() - began, planned
    with replacing(lesson.folder / MODEL) as draft:
        model.save(draft)
    found = {
        "name": lesson.name,
        "seed": lesson.seed,
        "cpu_s_asked": lesson.cpu_s,
        "cpu_s": round(cpu_s, 1),
        "cpu_s_to_begin": round(began - before, 1),
        "rows": int(model.num_timesteps),
        "training_return": _recent(model),
        "settings": {name: repr(value) for name, value in envs.settings.items()},
    }
    write_json(lesson.folder / RUN, found)
    return found


def _recent(model: Any) -> float | None:
    """The mean return of the latest training episodes; None before any has ended."""
    returns = [episode["r"] for episode in model.ep_info_buffer]
    return float(np.mean(returns)) if returns else None


def _limited(began: float, cpu_s: float, report: Report) -> Any:
    """A callback that ends training after so many CPU seconds, and reports on the way."""
    from stable_baselines3.common.callbacks import BaseCallback

    class Limit(BaseCallback):
        def _on_step(self) -> bool:
            used = time.process_time() - began
            recent = _recent(self.model) if self.n_calls % 16 == 0 else None
            if recent is not None:
                report(used, f"return {recent:.4g}")
            return used < cpu_s

    return Limit()
