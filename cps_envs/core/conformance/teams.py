"""A role as a team: its agents as rows of a batch and as agents of PettingZoo, one episode or many."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from cps_envs.core.conformance.actors import Crew, flat
from cps_envs.core.conformance.interfaces import episode_of
from cps_envs.core.conformance.recording import EXTRA_STEPS, difference, episode_steps, record
from cps_envs.core.conformance.subject import NUM_ENVS, NotApplicableError, Subject
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.learning.outside import Outside
from cps_envs.core.types import Array

TOLERANCE = 1e-9


def check_swarm(subject: Subject) -> None:
    """The agents of the swarm form together are the single environment with their actions joined.

    In the interface for learners each of them is a row of the batch with a row for each agent.

    Raises:
        NotApplicableError: the role has no swarm form.
    """
    subject.swarm()
    if subject.interface == NATIVE:
        _compare_with_single(subject)
    else:
        _compare_with_rows(subject)


def _compare_with_single(subject: Subject) -> None:
    swarm = subject.swarm()
    actions, results = record(swarm, seed=25)
    single = subject.single()
    info = single.reset(seed=25)[1]
    outside = Outside(single.game, subject.role, subject.problem.swarm[subject.role])
    seen, memory = outside.seen(), outside.adapter.begin(1)
    ends = [False, False]
    for step, result in enumerate(results):
        if step:
            stacked = np.stack([actions[step - 1][agent] for agent in swarm.possible_agents])
            together, memory = outside.act(seen, memory, stacked[np.newaxis])
            _, _, *ends, info = single.step(together[0])
            seen = outside.seen()
        for agent, shown in result[-1].items():
            over = [part[agent] for part in result[2:4]] if step else [False, False]
            found = difference(_metrics(shown), _metrics(info)) or difference(over, ends)
            assert found is None, f"{agent} of the swarm and the single environment part at step {step}: {found}"


def _compare_with_rows(subject: Subject) -> None:
    swarm = subject.swarm()
    actions, results = record(swarm, seed=25)
    adapter = subject.kwargs.get("adapter", subject.problem.swarm[subject.role])
    batch = subject.batch(1, per_agent=True, adapter=adapter, autoreset=AutoresetMode.NEXT_STEP)
    result: tuple[Any, ...] = batch.reset(seed=25)
    for step, theirs in enumerate(results):
        if step:
            result = batch.step(np.stack([actions[step - 1][agent] for agent in swarm.possible_agents]))
        for row, agent in enumerate(swarm.possible_agents):
            mine, shown = episode_of(result, row), [part[agent] for part in theirs]
            pairs = [*zip(mine[:-1], shown[:-1], strict=True), (_metrics(mine[-1]), _metrics(shown[-1]))]
            found = next(filter(None, (difference(*pair) for pair in pairs)), None)
            assert found is None, f"row {row} of the batch and {agent} of the swarm part at step {step}: {found}"


def _metrics(info: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in info.items() if name not in ("action_mask", "due")}


def check_rows(subject: Subject) -> None:
    """A team as one agent and its agents as rows give the same episodes bit for bit, in all three autoreset modes.

    The row of the team has those of its agents side by side. Its reward is that of the role.

    Raises:
        NotApplicableError: the role is no team, or it is shown in its native interface.
    """
    if subject.interface == NATIVE or subject.batch(1, per_agent=True).agents == 1:
        raise NotApplicableError("the role is one agent")
    for mode in AutoresetMode:
        team, rows = (subject.batch(autoreset=mode, per_agent=each) for each in (False, True))
        crew = Crew(rows, 34)
        joint: tuple[Any, ...] = team.reset(seed=34)
        alone: tuple[Any, ...] = rows.reset(seed=34)
        for step in range(episode_steps(team) + EXTRA_STEPS):
            _assert_side_by_side(subject, joint, alone, f"{mode}: at step {step}")
            if mode == AutoresetMode.DISABLED and step and (ended := joint[2] | joint[3]).any():
                joint = team.reset(options={"reset_mask": ended})
                alone = rows.reset(options={"reset_mask": ended})
            actions = crew.act(alone[-1])
            joint = team.step(actions.reshape(NUM_ENVS, *(team.single_action_space.shape or ())))
            alone = rows.step(actions)


def _assert_side_by_side(subject: Subject, joint: tuple[Any, ...], alone: tuple[Any, ...], where: str) -> None:
    pairs = {"observations": (joint[0], alone[0].reshape(NUM_ENVS, -1))}
    if len(joint) > 2:
        paid = np.array([subject.paid(list(own)) for own in alone[1].reshape(NUM_ENVS, -1)])
        close = np.abs(paid - joint[1]) <= TOLERANCE * np.maximum(1.0, np.abs(paid))
        pairs["rewards"] = (joint[1], np.where(close, joint[1], paid))
        for place, kind in ((2, "terminated"), (3, "truncated")):
            pairs[kind] = (np.repeat(joint[place], len(alone[place]) // NUM_ENVS), alone[place])
        if "final_obs" in joint[-1]:
            last = [row for row in alone[-1]["final_obs"] if row is not None]
            pairs["final_obs"] = (
                np.concatenate([row for row in joint[-1]["final_obs"] if row is not None]),
                np.concatenate(last),
            )
    if "action_mask" in joint[-1]:
        pairs["action_mask"] = (joint[-1]["action_mask"], alone[-1]["action_mask"].reshape(NUM_ENVS, -1))
    for name, pair in pairs.items():
        found = difference(*pair, name)
        assert found is None, f"{where} the row of the team (left) and those of its agents (right) differ: {found}"


def check_agents_batch(subject: Subject) -> None:
    """Episode i of a batched parallel or swarm form seeded s is the single one seeded s + i, in all autoreset modes."""
    for mode in AutoresetMode:
        _compare_batch(subject.parallel_batch(autoreset=mode), [subject.parallel() for _ in range(NUM_ENVS)], mode)
    try:
        swarms = [subject.swarm() for _ in range(NUM_ENVS)]
    except NotApplicableError:
        return
    _compare_batch(subject.swarm_batch(autoreset=AutoresetMode.SAME_STEP), swarms, AutoresetMode.SAME_STEP)


def _compare_batch(batch: Any, singles: list[Any], mode: AutoresetMode) -> None:
    crew, steps = Crew(batch, 35), episode_steps(batch)
    result: tuple[Any, ...] = batch.reset(seed=35)
    for b, single in enumerate(singles):
        _assert_episode(result, b, single.reset(seed=35 + b), f"{mode}: after the first reset")
    ended = np.zeros(NUM_ENVS, np.bool_)
    for step in range(steps):
        where = f"{mode}: at step {step}"
        early = np.arange(NUM_ENVS) == 1 if step == max(1, steps // 3) else np.zeros(NUM_ENVS, np.bool_)
        if early.any() or (mode == AutoresetMode.DISABLED and ended.any()):
            mask = early | (ended if mode == AutoresetMode.DISABLED else early)
            seeds = [77 if marked else None for marked in early]
            result = batch.reset(seed=seeds, options={"reset_mask": mask.copy()})
            for b in np.flatnonzero(mask).tolist():
                _assert_episode(result, b, singles[b].reset(seed=seeds[b]), f"{where}, after a reset of {mask}")
            ended = ended & ~mask
        actions = crew.act(result[-1])
        before, ended = ended, np.zeros(NUM_ENVS, np.bool_)
        result = batch.step(actions)
        for b, single in enumerate(singles):
            if mode == AutoresetMode.NEXT_STEP and before[b]:
                _assert_episode(result, b, single.reset(), f"{where}, where episode {b} starts anew")
                continue
            theirs = single.step({agent: action[b] for agent, action in actions.items()})
            ended[b] = not single.agents
            if mode == AutoresetMode.SAME_STEP and ended[b]:
                _assert_final(result, b, theirs, where)
                _assert_episode((result[0], result[-1]), b, single.reset(), f"{where}, after the end of episode {b}")
            else:
                _assert_episode(result, b, theirs, where)


def _assert_episode(result: tuple[Any, ...], b: int, theirs: tuple[Any, ...], where: str) -> None:
    """Whether one episode of a batch's result is what the single environment has returned, of a reset or a step."""
    observations, *numbers, infos = result
    for agent in theirs[0]:
        pairs = [(observations[agent][b], theirs[0][agent])]
        pairs += [(mine[agent][b].item(), own[agent]) for mine, own in zip(numbers, theirs[1:-1], strict=False)]
        found = next(filter(None, (difference(*pair) for pair in pairs)), None)
        found = found or _info_difference(infos, agent, b, theirs[-1][agent], ended="final_info" in infos)
        assert found is None, f"{where} {agent} of episode {b} in the batch (left) and alone (right) differ: {found}"


def _assert_final(result: tuple[Any, ...], b: int, theirs: tuple[Any, ...], where: str) -> None:
    """The same for an episode that has ended and begun anew in the same step."""
    infos = result[-1]
    assert infos["_final_obs"][b], f"{where} the batch does not mark the end of episode {b}"
    last = {name: infos["final_info"][name] for name in _metrics(theirs[-1][next(iter(theirs[-1]))])}
    for agent in theirs[0]:
        own = [infos["final_obs"][agent][b], *(part[agent][b].item() for part in result[1:4])]
        pairs = [*zip(own, (part[agent] for part in theirs[:4]), strict=True)]
        pairs += [({name: values[b].item() for name, values in last.items()}, _metrics(theirs[-1][agent]))]
        found = next(filter(None, (difference(*pair) for pair in pairs)), None)
        assert found is None, f"{where} the end of episode {b} for {agent} in the batch and alone differ: {found}"


def _info_difference(
    infos: Mapping[str, Any], agent: str, b: int, own: Mapping[str, Any], *, ended: bool
) -> str | None:
    """Where an agent's info differs; `ended`: the batch's cost is that of the step, also where episodes begin anew."""
    apart = {"cost"} if ended and infos["_final_obs"][b] else set()
    metrics = {name: value for name, value in _metrics(own).items() if name not in apart}
    found = difference({name: infos[name][b].item() for name in metrics}, metrics)
    found = found or difference(bool(infos[agent]["due"][b]), own["due"])
    mask: Array | None = infos[agent]["action_mask"][b] if "action_mask" in infos[agent] else None
    return found or difference(mask, flat(own.get("action_mask")))
