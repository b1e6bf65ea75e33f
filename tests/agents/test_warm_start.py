"""Going on with a trained network: it plays as it did, with the same scaling, and the value learns first."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

import torch

from cps_agents.errors import CommandError
from cps_agents.learning.learner import learn
from cps_agents.learning.recipe import changed
from cps_agents.learning.run import TrainingJob
from cps_agents.learning.shared import make_learner
from cps_agents.learning.warm_start import fits
from cps_agents.recipes.learning import learning_recipe
from tests.agents.arms import ARMS

SMALL = {"hidden": (16, 16), "total_timesteps": 1_280, "evaluations": 1, "evaluation_episodes": 2}
RECIPE = changed(learning_recipe(ARMS, "attacker"), {"problem": "tests.agents.arms:ARMS", **SMALL})


@pytest.fixture(name="earlier", scope="module")
def _earlier(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder: Path = tmp_path_factory.mktemp("run")
    learn(TrainingJob(RECIPE, 0, folder, "cps-envs train", tracker="none"))
    return f"zoo:{folder}"


def test_it_begins_with_the_weights_and_the_scaling_of_the_network(earlier: str) -> None:
    recipe = changed(RECIPE, {"start": earlier, "value_warm_up": 1})
    first, second = make_learner(recipe, 0), make_learner(recipe, 1)
    assert first.envs.wired.wiring == second.envs.wired.wiring
    first.start()
    rows = torch.from_numpy(first.rows)
    played = first.network.outputs(rows).detach().numpy()
    np.testing.assert_array_equal(played, second.network.outputs(rows).detach().numpy())
    value = first.network.values(rows, torch.from_numpy(first.envs.privileged())).detach().numpy()
    first.improve(1.0)
    np.testing.assert_array_equal(played, first.network.outputs(rows).detach().numpy())  # the value alone has learned
    truth = torch.from_numpy(first.envs.privileged())
    assert np.abs(first.network.values(rows, truth).detach().numpy() - value).max() > 0
    first.updates += 1
    first.improve(1.0)
    assert np.abs(first.network.outputs(rows).detach().numpy() - played).max() > 0


def test_a_network_that_sees_or_acts_otherwise_is_refused(earlier: str) -> None:
    assert fits(earlier, RECIPE)
    others = (changed(RECIPE, {"frame_skip": 2}), changed(RECIPE, {"hidden": (8, 8)}))
    assert not any(fits(earlier, other) for other in others)
    assert not fits("none", RECIPE)
    with pytest.raises(CommandError, match="sees and acts"):
        make_learner(replace(others[0], start=earlier), 0)
