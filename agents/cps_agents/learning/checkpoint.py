"""Going on from a checkpoint of stable-baselines3 without running code from it.

The file holds numbers, which torch reads by itself, and settings, many of them pickled. The settings are those of the
recipe, so only whole numbers, such as the steps so far, are taken from there, and nothing is unpickled.
"""

from __future__ import annotations

import pickle
import zipfile
from typing import Any

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.save_util import load_from_zip_file

from cps_agents.errors import CommandError
from cps_agents.learning.model import make_model
from cps_agents.learning.run import MOST_STEPS, Run
from cps_agents.learning.training_envs import TrainingEnvs
from cps_envs.core.documents import Source, entry_of
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
