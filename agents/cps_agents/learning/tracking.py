"""Where the curves of a training run go: TensorBoard's files, Weights & Biases, MLflow, or nowhere."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from cps_agents.errors import CommandError
from cps_envs.core.errors import near, require


class RunTracker(Protocol):
    """Takes numbers by name in the course of a run."""

    def log(self, values: Mapping[str, float], steps: int) -> None:
        """What the numbers are after so many decisions."""

    def close(self) -> None:
        """Everything has been said."""


class TrackedRun(NamedTuple):
    """The run that is tracked."""

    name: str  # the same when the run goes on after an interruption
    group: str  # the recipe's name
    folder: Path
    knobs: Mapping[str, Any]


def make_tracker(kind: str, subject: TrackedRun) -> RunTracker:
    """A tracker by its name.

    Raises:
        CommandError: there is none of that name.
        MissingExtraError: its package is not installed.
    """
    check_tracker(kind)
    return TRACKERS[kind](subject)


def check_tracker(kind: str) -> None:
    """Whether there is a tracker of that name.

    Raises:
        CommandError: there is none.
    """
    if kind not in TRACKERS:
        raise CommandError(f"there is no tracker {kind!r}. {near(kind, TRACKERS)}")


class Silent:
    """A tracker that keeps nothing (`--tracker none`)."""

    def __init__(self, subject: TrackedRun) -> None:
        pass

    def log(self, values: Mapping[str, float], steps: int) -> None:
        """Nothing."""

    def close(self) -> None:
        """Nothing."""


class TensorBoard:
    """Event files in the run's folder `tensorboard/`, for `tensorboard --logdir runs`."""

    def __init__(self, subject: TrackedRun) -> None:
        require("tensorboard", extra="train", purpose="TensorBoard's files")
        from tensorboard.summary import Writer

        self._folder = subject.folder / "tensorboard"
        self._hook = threading.excepthook
        threading.excepthook = self._overhear
        with self._named():
            self._writer: Any = Writer(str(self._folder))

    def log(self, values: Mapping[str, float], steps: int) -> None:
        """One scalar for each name."""
        with self._named():
            for name, value in values.items():
                self._writer.add_scalar(name, value, steps)
            self._writer.flush()

    def close(self) -> None:
        """Close the file."""
        try:
            with self._named():
                self._writer.close()
        finally:
            threading.excepthook = self._hook

    def _overhear(self, caught: Any) -> None:
        """Leave out what ends TensorBoard's thread, such as a full disk: the writer's next call raises it again."""
        if type(caught.thread).__module__ != "tensorboard.summary.writer.event_file_writer":
            self._hook(caught)

    @contextmanager
    def _named(self) -> Iterator[None]:
        """While errors name the folder."""
        try:
            yield
        except OSError as error:
            raise OSError(error.errno, f"it cannot be written: {error.strerror}", str(self._folder)) from error


class WeightsAndBiases:
    """A run of the project `cps-envs`, grouped by recipe; its environment variables (WANDB_MODE, ...) hold as usual."""

    def __init__(self, subject: TrackedRun) -> None:
        require("wandb", extra="wandb", purpose="tracking with Weights & Biases")
        import wandb

        self._run: Any = wandb.init(
            project="cps-envs",
            name=subject.name,
            group=subject.group,
            id=subject.name,
            resume="allow",
            dir=str(subject.folder),
            config=dict(subject.knobs),
        )

    def log(self, values: Mapping[str, float], steps: int) -> None:
        """One record; its axis is `steps`, which a resumed run may repeat."""
        self._run.log({**values, "steps": steps})

    def close(self) -> None:
        """Upload what is left."""
        self._run.finish()


class MLflow:
    """A run of the experiment named as the recipe, where MLFLOW_TRACKING_URI says, or in ./mlruns."""

    def __init__(self, subject: TrackedRun) -> None:
        require("mlflow", extra="mlflow", purpose="tracking with MLflow")
        from mlflow.tracking import MlflowClient

        self._client: Any = MlflowClient()
        found = self._client.get_experiment_by_name(subject.group)
        experiment = found.experiment_id if found else self._client.create_experiment(subject.group)
        named = f"attributes.run_name = '{subject.name}'"
        earlier = self._client.search_runs([experiment], filter_string=named, max_results=1)
        self._run = (earlier[0] if earlier else self._start(experiment, subject)).info.run_id

    def _start(self, experiment: str, subject: TrackedRun) -> Any:
        run = self._client.create_run(experiment, run_name=subject.name)
        for name, value in subject.knobs.items():
            self._client.log_param(run.info.run_id, name, value)
        return run

    def log(self, values: Mapping[str, float], steps: int) -> None:
        """One metric for each name."""
        for name, value in values.items():
            self._client.log_metric(self._run, name, value, step=steps)

    def close(self) -> None:
        """Mark the run as ended."""
        self._client.set_terminated(self._run)


TRACKERS: Mapping[str, Callable[[TrackedRun], RunTracker]] = {
    "tensorboard": TensorBoard,
    "wandb": WeightsAndBiases,
    "mlflow": MLflow,
    "none": Silent,
}
