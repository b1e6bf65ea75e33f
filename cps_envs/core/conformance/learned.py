"""What the interface for learners promises beyond the native one: flat actions, and training on the same episodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode

from cps_envs.core.conformance.actors import Crew
from cps_envs.core.conformance.recording import assert_same, difference, episode_steps, record
from cps_envs.core.conformance.subject import NUM_ENVS, NotApplicableError, Subject
from cps_envs.core.declare.actions import choices_of, flat_masks, unflattened
from cps_envs.core.declare.seeds import training_seed
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.types import Array

COPIES = 2
RUN = 3  # number of the training run


def check_flat(subject: Subject) -> None:
    """With `flat=True` one number stands for all entries of an action, and nothing else changes, bit for bit.

    Raises:
        NotApplicableError: actions are continuous, or have too many combinations.
    """
    try:
        flat = subject.single(flat=True)
    except ConfigurationError as error:
        raise NotApplicableError(f"no flat form: {error}") from error
    assert isinstance(flat.action_space, spaces.Discrete), f"flat=True gives {flat.action_space}, not Discrete"
    plain = subject.single()
    choices, shape = choices_of(plain.action_space), plain.action_space.shape or ()
    numbers, results = record(flat, seed=29)
    entries = unflattened(np.array(numbers), choices).reshape(-1, *shape)
    expected: list[tuple[Any, ...]] = [plain.reset(seed=29), *(plain.step(action) for action in entries)]
    masks = [[result[-1].pop("action_mask", None) for result in run] for run in (results, expected)]
    assert_same(results, expected, "flat=True and the entries of the same actions give different trajectories")
    for step, (mine, parts) in enumerate(zip(*masks, strict=True)):
        legal = None if parts is None else flat_masks(parts.astype(np.bool_)[np.newaxis], choices)[0].astype(np.int8)
        found = difference(mine, legal)
        assert found is None, f"at step {step} the mask of flat=True differs from that of the entries: {found}"
    batch = subject.batch(flat=True, autoreset=AutoresetMode.NEXT_STEP)
    observation = batch.reset(seed=29)[0]
    found = difference(observation[0], results[0][0])
    assert found is None, f"a batch with flat=True starts otherwise than the single environment: {found}"
    found = difference(batch.step(np.full(NUM_ENVS, numbers[0]))[0][0], results[1][0])
    assert found is None, f"a batch with flat=True goes on otherwise than the single environment: {found}"


def check_training(subject: Subject) -> None:
    """The environment that learners train on is the vector form on training seeds, bit for bit.

    Copies of an episode begin at its start, and rewards are plain: staggered starts and shaping are for learners only.

    Raises:
        NotApplicableError: the role is shown in its native interface.
    """
    if subject.interface == NATIVE:
        raise NotApplicableError("the native interface is not trained on")
    options: dict[str, Any] = {name: value for name, value in subject.kwargs.items() if name != "interface"}
    plain = {"pay_power": 1.0, "relative": False, **options}
    learned = LearningVectorEnv(
        subject.problem, subject.role, 2 * COPIES, seed=RUN, copies=COPIES, per_agent=False, **plain
    )
    form = subject.batch(2 * COPIES, opponent=learned.opponent, **practised(subject))
    crew = Crew(form, 36)
    mine: tuple[Any, ...] = learned.reset()
    theirs: tuple[Any, ...] = form.reset(seed=[training_seed(RUN) + place % 2 for place in range(2 * COPIES)])
    for step in range(episode_steps(form)):
        _assert_alike(mine, theirs, step)
        actions: Array = crew.act(theirs[-1])
        mine, theirs = learned.step(actions), form.step(actions)
    _assert_alike(mine, theirs, episode_steps(form))


def practised(subject: Subject) -> dict[str, Any]:
    """Fields of the configuration that training episodes have, and the subject does not set."""
    training = subject.problem.training.get(subject.role)
    fields = training.practised if training is not None and subject.is_learned else {}
    return {name: value for name, value in fields.items() if name not in subject.kwargs}


def _assert_alike(mine: tuple[Any, ...], theirs: tuple[Any, ...], step: int) -> None:
    for place, (own, other) in enumerate(zip(mine[:-1], theirs[:-1], strict=True)):
        found = difference(own, other, f"result[{place}]")
        assert found is None, f"the environment for training and the vector form differ at step {step}: {found}"
    for name, values in theirs[-1].items():
        if name != "final_info":
            found = difference(mine[-1].get(name), values, f"info[{name!r}]")
            assert found is None, f"the environment for training and the vector form differ at step {step}: {found}"
