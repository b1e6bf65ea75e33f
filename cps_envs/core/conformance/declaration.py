"""The declaration of a problem and the attributes of its game fit together, before anything is played."""

from __future__ import annotations

import numpy as np

from cps_envs.core.conformance.subject import NUM_ENVS, Subject
from cps_envs.core.game.game import Game
from cps_envs.core.learning.outside import Outside
from cps_envs.core.types import ROLES


def check_declaration(subject: Subject) -> None:
    """The game has the problem's name and all attributes of `Game`, in their shapes, and the team that is declared."""
    problem, role = subject.problem, subject.role
    preset = subject.kwargs.get("preset", problem.usual_preset)
    game = problem.game(problem.config(preset, {}), NUM_ENVS)
    kind = type(game).__name__
    for attribute in Game.__annotations__:
        assert hasattr(game, attribute), f"{kind} has no {attribute!r}, which cps_envs.core.game.game.Game explains"
    assert game.name == problem.name, f"{kind}.name is {game.name!r}, but its Problem's is {problem.name!r}"
    for each in ROLES:
        interval = game.decision_interval[each]
        assert interval >= 1, f"decision_interval[{each!r}] of {kind} is {interval}: it has to be at least 1"
        own, wanted = np.shape(game.neutral_action[each]), game.action_space[each].shape
        assert own == wanted, f"neutral_action[{each!r}] of {kind} has shape {own}, its action_space {wanted}"
    for name, values in game.metrics().items():
        shape = np.shape(values)
        assert shape == (NUM_ENVS,), f"metrics()[{name!r}] of {kind} has shape {shape}: with B environments it is (B,)"
    if role in problem.swarm and preset == problem.usual_preset:  # others may have no team
        Outside(game, role, problem.swarm[role])
