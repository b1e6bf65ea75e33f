"""Legal actions are marked alike everywhere, and impossible ones are refused without a trace."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.conformance.actors import Crew, allows, flat
from cps_envs.core.conformance.recording import difference, episode_steps, has_ended, record
from cps_envs.core.conformance.subject import Subject
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.interfaces.vector_env import RoleVectorEnv
from cps_envs.core.types import AGENTS, ROLES, Array


def check_action_masks(subject: Subject) -> None:
    """`action_masks()` and `info["action_mask"]` agree; something is always legal, between decisions only waiting."""
    masked = hasattr(subject.single(), "action_masks")
    if masked:
        for make in (subject.single, subject.batch):
            _check_face(make(), subject)
    else:
        _assert_maskless(subject)
    if subject.interface == NATIVE:
        has_mask = subject.game().action_mask(subject.role) is not None
        assert has_mask == masked, "action_masks has to be there where the game has masks, and nowhere else"
        _check_between_decisions(subject)


def _assert_maskless(subject: Subject) -> None:
    for name, make in subject.interfaces().items():
        info = make().reset(seed=0)[1]
        info = info.get(AGENTS[subject.role], info)
        assert "action_mask" not in info, f"the {name} interface's info has an action_mask, the game's role has none"
    for make in (subject.single, subject.batch):
        assert not hasattr(make(), "action_masks"), "action_masks has to be missing where the role has no masks"


def _check_face(env: Any, subject: Subject) -> None:
    crew, space = Crew(env, 81), subject.single().action_space
    result = env.reset(seed=81)
    for step in range(episode_steps(env)):
        masks, shown = env.action_masks(), result[-1]["action_mask"]
        assert masks.dtype == np.bool_, f"action_masks() has dtype {masks.dtype}, not bool"
        assert shown.dtype == np.int8, f'info["action_mask"] has dtype {shown.dtype}, not int8'
        message = f'at step {step} action_masks() {masks.tolist()} is not info["action_mask"] {shown.tolist()}'
        assert np.array_equal(masks, shown), message
        for mask in np.atleast_2d(masks):
            _assert_usable(space, mask, step)
        result = env.step(crew.act(result[-1]))
        if has_ended(env, result):
            return


def _assert_usable(space: Any, mask: Array, step: int) -> None:
    counts = [int(space.n)] if isinstance(space, spaces.Discrete) else np.ravel(space.nvec).tolist()
    assert mask.shape == (sum(counts),), f"a mask of shape {mask.shape} does not fit {space}: {sum(counts)} entries"
    for part in np.split(mask, np.cumsum(counts)[:-1]):
        assert part.any(), f"at step {step} no action of {space} is legal: {mask.tolist()}"


def _check_between_decisions(subject: Subject) -> None:
    env = subject.parallel()
    game, crew = env.game, Crew(env, 82)
    result: tuple[Any, ...] = env.reset(seed=82)
    while env.agents:
        for role in ROLES:
            mask = flat(result[-1][AGENTS[role]].get("action_mask"))
            waiting = game.elapsed[0] % game.decision_interval[role] != 0
            if mask is not None and waiting:
                entries = np.size(game.neutral_action[role])
                only_neutral = mask.sum() == entries and allows(
                    game.action_space[role], mask, game.neutral_action[role]
                )
                message = f"between two decisions of the {role} only the neutral action is legal, not {mask.tolist()}"
                assert only_neutral, message
        result = env.step(crew.act(result[-1]))


def check_bad_actions(subject: Subject) -> None:
    """Impossible actions raise ValueError and leave the episode as it was; a Box clips what lies outside."""
    for name, make in subject.interfaces().items():
        actions, expected = record(make(), seed=83)
        env = make()
        env.reset(seed=83)
        for bad in _impossible(env, actions[0]):
            _assert_refused(env, bad, name)
        found = difference(env.step(actions[0]), expected[1])
        assert found is None, f"the {name} interface: a refused action leaves a trace in the episode: {found}"
        _check_clipping(make, actions[0], name)


def _assert_refused(env: Any, bad: Any, name: str) -> None:
    try:
        env.step(bad)
    except ValueError:
        return
    except Exception as error:
        raise AssertionError(
            f"the {name} interface answers the action {bad!r} with {error!r}, not a ValueError"
        ) from error
    raise AssertionError(f"the {name} interface accepts the impossible action {bad!r}")


def _impossible(env: Any, good: Any) -> Iterator[Any]:
    """Actions of wrong shape, type or range, in the form that the interface takes."""
    if isinstance(good, dict):
        for agent in good:
            for bad in _impossible_arrays(env.action_space(agent), good[agent]):
                yield {**good, agent: bad}
        yield {agent: action for agent, action in good.items() if agent != next(iter(good))}
    else:
        space = env.single_action_space if isinstance(env, RoleVectorEnv) else env.action_space
        yield from _impossible_arrays(space, good)


def _impossible_arrays(space: Any, good: Any) -> Iterator[Any]:
    array = np.asarray(good)
    yield np.stack([array, array])
    yield np.full(array.shape, "left")
    yield None
    yield np.full(array.shape, np.nan)
    if isinstance(space, spaces.Box):
        yield np.full(array.shape, np.inf)
    else:
        count = space.n if isinstance(space, spaces.Discrete) else space.nvec
        yield array * 0 + space.start + count
        yield array * 0 + space.start - 1
        yield array + 0.5


def _check_clipping(make: Any, good: Any, name: str) -> None:
    one, two = make(), make()
    space = one.action_space(next(iter(good))) if isinstance(good, dict) else getattr(one, "single_action_space", None)
    space = one.action_space if space is None else space
    if not isinstance(space, spaces.Box):
        return
    agent = next(iter(good)) if isinstance(good, dict) else None
    edge = np.broadcast_to(space.high, np.shape(good if agent is None else good[agent]))
    one.reset(seed=84)
    two.reset(seed=84)
    results = [
        env.step(action if agent is None else {**good, agent: action})
        for env, action in ((one, edge), (two, edge + 3.0))
    ]
    found = difference(*results)
    assert found is None, f"the {name} interface: an action outside the box is not clipped to it: {found}"
