"""One training run from start to end, or from where it stopped.

It goes on from a checkpoint of stable-baselines3 without running code from it. The file holds numbers, which torch
reads by itself, and settings, many of them pickled. The settings are those of the recipe, so only whole numbers, such
as the steps so far, are taken from there, and nothing is unpickled.
"""

from __future__ import annotations

import pickle
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.save_util import load_from_zip_file

from cps_agents.errors import CommandError
from cps_agents.learning.aggregation import aggregate, begin_taught
from cps_agents.learning.best_episodes import BestEpisodes, SelfImitation
from cps_agents.learning.callback import TrackerWriter, TrainingCallback, ValueWarmUp
from cps_agents.learning.demonstrations import Demonstrations, demonstrate, join
from cps_agents.learning.export import make_card, network_of_model, policy_of
from cps_agents.learning.imitation import imitate
from cps_agents.learning.model import check_fit, make_model, scaling_of, wander
from cps_agents.learning.plan_search import search_plans
from cps_agents.learning.recipe import IMITATION, RECURRENT
from cps_agents.learning.run import MOST_STEPS, Report, Run, TrainingJob, recording, resumption_of
from cps_agents.learning.training_envs import TrainingEnvs, make_envs
from cps_envs.core.documents import Source, entry_of
from cps_envs.core.seeds import training_seed
from cps_envs.core.types import Array

REMEDY = "Delete the folder and train again."
SCALING = ("columns", "mean", "deviation")  # of `FixedScaling`
COUNTS = ("num_timesteps", "_n_updates", "_episode_num", "_n_calls")  # of which an algorithm has some
MOST_BYTES = 2**30  # of all that the file holds, unpacked
BROKEN = (ValueError, OSError, EOFError, RuntimeError, KeyError, TypeError, AttributeError, pickle.UnpicklingError)


def load_checkpoint(run: Run, envs: TrainingEnvs, device: str) -> BaseAlgorithm:
    """The model of a run's recipe as its checkpoint left it: networks, optimizers, and how far it is.

    Raises:
        CommandError: the file is damaged, or of another recipe.
    """
    try:
        counts = _counts(run)
        _, parameters, variables = load_from_zip_file(run.checkpoint, load_data=False, device=device)
        model = make_model(run.recipe, envs, _scaling(parameters), run.seed, device)
        model.set_parameters(parameters, device=device)
        for name, value in (variables or {}).items():
            if value is not None:
                getattr(model, name).data.copy_(value.data)  # such as the weight of SAC's entropy
    except (*BROKEN, zipfile.BadZipFile) as error:
        raise CommandError(f"{run.checkpoint} is damaged ({error}): delete the folder and train again") from error
    for name, count in counts.items():
        setattr(model, name, count)
    return model


def _counts(run: Run) -> dict[str, int]:
    """How far the run is."""
    with zipfile.ZipFile(run.checkpoint) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
        if size > MOST_BYTES:
            raise ValueError(f"it holds {size} bytes, more than {MOST_BYTES}")
        text = archive.read("data").decode()
    found = entry_of(text, Source("its entry data", "record of stable-baselines3", REMEDY))
    found["num_timesteps"].whole(0, MOST_STEPS)
    return {name: found[name].whole(0, MOST_STEPS) for name in COUNTS if found.get(name) is not None}


def _scaling(parameters: Any) -> dict[str, Array]:
    """What the inputs are scaled by, which is a part of the network."""
    weights = parameters["policy"]
    found = [name.removesuffix("columns") for name in weights if name.endswith("features_extractor.columns")]
    prefix = found[0] if found else ""
    return {name: weights[f"{prefix}{name}"].cpu().numpy() for name in SCALING}


def train(job: TrainingJob, report: Report) -> None:
    """Train with stable-baselines3; see `learner.learn`.

    Raises:
        CommandError: the algorithm does not fit the environment, or the checkpoint is damaged.
    """
    torch.set_num_threads(1)
    run = job.run
    envs = make_envs(job.recipe, training_seed(job.seed, resumption_of(job)))
    check_fit(job.recipe, envs)

    def note(steps: int, text: str) -> None:
        run.write(phase=text)
        report(steps, text)

    with recording(job) as tracker:
        callback = TrainingCallback(run, envs, report)
        best = BestEpisodes()
        model = load_checkpoint(run, envs, job.device) if run.checkpoint.is_file() else None
        if job.recipe.algorithm == IMITATION:
            with _interruptible(callback, in_step=False):
                aggregate(model, run, job.device, envs, callback, tracker, report)
        else:
            model = model or _begin(job, envs, best, note)
            model.set_logger(Logger(folder=None, output_formats=[TrackerWriter(tracker)]))
            run.write(phase="learning")
            with _interruptible(callback, in_step=True):
                _learn(model, run, callback, best)
    envs.close()


def _begin(job: TrainingJob, envs: TrainingEnvs, best: BestEpisodes, report: Report) -> BaseAlgorithm:
    """An untrained model, or one that imitates the teacher, or the best plans of a search."""
    recipe, seed = job.recipe, training_seed(job.seed)
    if recipe.algorithm in RECURRENT and recipe.taught:
        return begin_taught(job.run, job.device, envs, report)
    shown = demonstrate(recipe, range(seed, seed + recipe.teacher_episodes)) if recipe.taught else None
    if recipe.search_steps:
        search_plans(envs, recipe, best, seed, lambda steps, mean: report(0, f"search, {steps:,} steps: {mean:.3g}"))
        shown = best.demonstrations()
    scaling = scaling_of(envs, recipe, shown.observations if shown else wander(envs, seed))
    model = make_model(recipe, envs, scaling, job.seed, job.device)
    if shown is not None and recipe.search_steps:
        loss = imitate(model.policy, shown, recipe, np.random.default_rng(seed))
        report(0, f"imitation of the best plans: loss {loss:.3g}")
    elif shown is not None:
        _imitate(model, shown, job, envs, report)
    return model


def _imitate(model: BaseAlgorithm, shown: Demonstrations, job: TrainingJob, envs: TrainingEnvs, report: Report) -> None:
    """Rounds of imitation; from the second on the student plays and the teacher corrects it."""
    recipe, seed = job.recipe, training_seed(job.seed)
    generator = np.random.default_rng(seed)
    card = make_card(job.run, envs, {})
    for number in range(recipe.teacher_rounds):
        if number > 0:
            first = seed + number * recipe.teacher_episodes
            student = policy_of(card, network_of_model(model, recipe.activation))
            shown = join(shown, demonstrate(recipe, range(first, first + recipe.teacher_episodes), student))
        loss = imitate(model.policy, shown, recipe, generator)
        report(0, f"imitation, round {number + 1}: loss {loss:.3g}")


def _learn(model: BaseAlgorithm, run: Run, callback: TrainingCallback, best: BestEpisodes) -> None:
    recipe = run.recipe
    left = recipe.total_steps - model.num_timesteps
    callbacks: list[BaseCallback] = [callback]
    if recipe.value_warm_up:
        callbacks.append(ValueWarmUp(recipe.value_warm_up))
    if recipe.self_imitation:
        seed = training_seed(run.seed)
        callbacks.append(SelfImitation(best, recipe.self_imitation, recipe.batch_size, seed))
    if left > 0:
        model.learn(left, callback=callbacks, reset_num_timesteps=model.num_timesteps == 0)


@contextmanager
def _interruptible(callback: TrainingCallback, *, in_step: bool) -> Iterator[None]:
    """Lets an interruption leave a policy; `in_step`: the model is worth a checkpoint at any time."""
    try:
        yield
    except KeyboardInterrupt:
        if getattr(callback, "model", None) is not None:
            callback.save_unfinished(checkpoint=in_step)
        raise
