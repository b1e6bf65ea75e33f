"""One simulator, three interfaces: single, batch and parallel give the same trajectory."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from cps_envs.core.conformance.actors import Crew, flat
from cps_envs.core.conformance.recording import assert_same, difference, episode_steps, record
from cps_envs.core.conformance.replay import Scripted
from cps_envs.core.conformance.subject import NUM_ENVS, Subject
from cps_envs.core.interfaces.outside import Outside
from cps_envs.core.types import AGENTS, ROLES, Role, other

Actions = list[dict[str, Any]]
Results = list[tuple[Any, ...]]
Due = dict[Role, list[int]]


def check_batch(subject: Subject) -> None:
    """Environment i of a batch seeded s is the single environment seeded s + i, bit for bit, for a whole episode."""
    seed = 21
    singles = [record(subject.single(), seed=seed + b) for b in range(NUM_ENVS)]
    batch = subject.batch(autoreset_mode=AutoresetMode.NEXT_STEP)
    envs: list[Results] = [[] for _ in range(NUM_ENVS)]
    result: tuple[Any, ...] = batch.reset(seed=seed)
    neutral = batch.game.neutral_action[subject.role].astype(batch.single_action_space.dtype)
    for step in range(max(len(actions) for actions, _ in singles) + 1):
        for b in range(NUM_ENVS):
            if step <= len(singles[b][0]):
                envs[b].append(episode_of(result, b))
        played = [actions[step] if step < len(actions) else neutral for actions, _ in singles]
        result = batch.step(np.stack(played))
    for b, (_, expected) in enumerate(singles):
        message = f"environment {b} of a batch seeded {seed} is not the single environment seeded {seed + b}"
        assert_same(expected, envs[b], message)


def episode_of(result: tuple[Any, ...], b: int) -> tuple[Any, ...]:
    """What a single environment would have returned for one environment of a batch's result."""
    *arrays, info = result
    keys = [key for key in info if not key.startswith("_") and f"_{key}" in info and info[f"_{key}"][b]]
    values = {key: info[key][b] for key in keys}
    own = {key: value if isinstance(value, np.ndarray) else value.item() for key, value in values.items()}
    first = arrays[0][b]
    return (first, *(array[b].item() for array in arrays[1:]), own)


def check_parallel(subject: Subject) -> None:
    """The role's environment against a replay of its rival, or an idle one, is the parallel environment.

    Observations, metrics and ends are the same bit for bit. So is the reward where the role decides at every game step;
    otherwise it is the sum over the steps of a decision, which may round differently. Against an idle rival the game
    advances by whole decisions at once, so its course must not depend on how it is cut into steps.
    """
    rival = other(subject.role)
    actions, results, due = _play_both(subject, seed=22)
    _compare(subject, 22, Scripted([actions[t][AGENTS[rival]] for t in due[rival]]), (actions, results, due))
    _compare(subject, 26, "none", _play_both(subject, seed=26, idle=rival))


def _compare(subject: Subject, seed: int, opponent: Any, played: tuple[Actions, Results, Due]) -> None:
    actions, results, due = played
    agent, interval = AGENTS[subject.role], subject.game().decision_interval[subject.role]
    single = subject.single(opponent=opponent)
    mine: Results = [single.reset(seed=seed)]
    theirs: Results = [(results[0][0][agent], _flattened(results[0][1][agent]))]
    for step in due[subject.role]:
        mine.append(single.step(actions[step][agent]))
        last = min(step + interval, len(actions))
        rewards = [results[t][1][agent] for t in range(step + 1, last + 1)]
        observation, _, *ends, info = (part[agent] for part in results[last])
        theirs.append((observation, _settled(sum(rewards), mine[-1][1]), *ends, _flattened(info)))
        if mine[-1][2] or mine[-1][3]:
            break
    assert_same(mine, theirs, f"the {subject.role}'s environment and the parallel one give different trajectories")
    steps = -(-len(actions) // interval)
    assert len(mine) - 1 == steps, (
        f"the single interface ends after {len(mine) - 1} decisions, the parallel one after {steps}"
    )


def _flattened(info: dict[str, Any]) -> dict[str, Any]:
    """An agent's info with its mask in the form of the single environment."""
    return {**info, "action_mask": flat(info["action_mask"])} if "action_mask" in info else info


def _settled(total: float, reward: float) -> float:
    """`reward` where a sum of rewards equals it up to rounding, else the sum."""
    return reward if abs(total - reward) <= 1e-9 * max(1.0, abs(total)) else total


def _play_both(subject: Subject, *, seed: int, idle: Role | None = None) -> tuple[Actions, Results, Due]:
    """A parallel episode in which both act at every step, due or not, and the steps at which each was due."""
    env = subject.parallel()
    crew = Crew(env, seed)
    neutral = {} if idle is None else {AGENTS[idle]: env.game.neutral_action[idle]}
    actions: Actions = []
    results: Results = [env.reset(seed=seed)]
    while env.agents and len(actions) < episode_steps(env):
        shown: dict[str, dict[str, Any]] = results[-1][-1]
        actions.append({**crew.act(shown), **neutral})
        results.append(env.step(actions[-1]))
    intervals = env.game.decision_interval
    return actions, results, {role: list(range(0, len(actions), intervals[role])) for role in ROLES}


def check_held_actions(subject: Subject) -> None:
    """In the parallel interface what a role sends between its decisions has no effect."""
    intervals = subject.game().decision_interval
    if all(interval == 1 for interval in intervals.values()):
        return
    actions, results, _ = _play_both(subject, seed=23)
    env = subject.parallel()
    crew = Crew(env, 24)
    assert difference(env.reset(seed=23), results[0]) is None, "the parallel interface does not repeat its reset"
    for step, action in enumerate(actions):
        blank: dict[str, dict[str, Any]] = {agent: {} for agent in AGENTS.values()}  # no mask: anything in the space
        noise = crew.act(blank)
        sent = {AGENTS[role]: (noise if step % intervals[role] else action)[AGENTS[role]] for role in ROLES}
        found = difference(env.step(sent), results[step + 1])
        assert found is None, f"an action sent between two decisions has an effect at game step {step}: {found}"


def check_swarm(subject: Subject) -> None:
    """The agents of the swarm form together are the single environment with their actions joined.

    Raises:
        NotApplicableError: the role has no swarm form.
    """
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
        metrics = {name: value for name, value in info.items() if name != "action_mask"}
        for agent, shown in result[-1].items():
            own = {name: value for name, value in shown.items() if name != "action_mask"}
            over = [part[agent] for part in result[2:4]] if step else [False, False]
            found = difference(own, metrics) or difference(over, ends)
            assert found is None, f"{agent} of the swarm and the single environment part at step {step}: {found}"
