"""One simulator, three interfaces: single, batch and parallel give the same trajectory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode

from cps_envs.core.conformance.actors import Crew, flat
from cps_envs.core.conformance.recording import assert_same, difference, episode_steps, record
from cps_envs.core.conformance.replay import Scripted
from cps_envs.core.conformance.subject import NUM_ENVS, Subject
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.game.game import Game
from cps_envs.core.types import ROLES, Array, BoolArray, FloatArray, Role, other

Results = list[tuple[Any, ...]]


class Played(NamedTuple):
    """An episode of the parallel environment in which all agents act at every step, due or not."""

    actions: list[dict[str, Any]]
    results: Results
    agents_of: Mapping[Role, Sequence[str]]
    moves: Mapping[Role, list[Array]]  # what the roles did in the game at each of their decisions


def check_batch(subject: Subject) -> None:
    """Environment i of a batch seeded s is the single environment seeded s + i, bit for bit, for a whole episode."""
    seed = 21
    singles = [record(subject.single(), seed=seed + b) for b in range(NUM_ENVS)]
    batch = subject.batch(autoreset=AutoresetMode.NEXT_STEP)
    envs: list[Results] = [[] for _ in range(NUM_ENVS)]
    result: tuple[Any, ...] = batch.reset(seed=seed)
    neutral = np.asarray(batch.neutral_action).astype(batch.single_action_space.dtype)
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
    """The role's environment against a replay of its rival is the parallel environment.

    Observations, metrics and ends are the same bit for bit where the role decides; the row of a team has those of its
    agents side by side. So is the reward where each step is a decision; otherwise it is the sum over the steps of a
    decision, which may round differently. In the native interface an idle rival is tried, too: then the game advances
    by whole decisions at once, so its course must not depend on how it is cut into steps.
    """
    rival = other(subject.role)
    played = _play_both(subject, seed=22)
    _compare(subject, 22, Scripted(played.moves[rival]), played)
    if subject.interface == NATIVE:
        _compare(subject, 26, "none", _play_both(subject, seed=26, idle=rival))


def _compare(subject: Subject, seed: int, opponent: Any, played: Played) -> None:
    actions, results, agents = played.actions, played.results, played.agents_of[subject.role]
    single = subject.single(opponent=opponent)
    mine: Results = [single.reset(seed=seed)]
    theirs: Results = [(_row(results[0][0], agents), _shown(results[0][-1], agents))]
    due = [step for step in range(len(actions)) if results[step][-1][agents[0]]["due"]]
    for step, last in zip(due, [*due[1:], len(actions)], strict=True):
        mine.append(single.step(_together(actions[step], agents, single.action_space)))
        _, rewards, *ends, infos = zip(*results[step + 1 : last + 1], strict=True)
        info = _shown(infos[-1], agents)
        if "cost" in info:
            info["cost"] = settled(sum(each[agents[0]]["cost"] for each in infos), mine[-1][-1].get("cost", 0.0))
        paid = sum(subject.paid([each[agent] for agent in agents]) for each in rewards)
        over = [kind[-1][agents[0]] for kind in ends]
        theirs.append((_row(results[last][0], agents), settled(paid, mine[-1][1]), *over, info))
        if mine[-1][2] or mine[-1][3]:
            break
    assert_same(mine, theirs, f"the {subject.role}'s environment and the parallel one give different trajectories")
    assert len(mine) - 1 == len(due), (
        f"the single interface ends after {len(mine) - 1} decisions, the parallel one after {len(due)}"
    )


def _row(observations: Mapping[str, Array], agents: Sequence[str]) -> Array:
    """What the agents of a role observe, side by side."""
    return np.concatenate([observations[agent] for agent in agents])


def _together(actions: Mapping[str, Any], agents: Sequence[str], space: spaces.Space[Any]) -> Any:
    """What the agents of a role do, as one action of the role."""
    return np.concatenate([np.ravel(actions[agent]) for agent in agents]).reshape(space.shape or ())


def _shown(infos: Mapping[str, dict[str, Any]], agents: Sequence[str]) -> dict[str, Any]:
    """The agents' infos as that of the single environment, masks side by side."""
    info = {name: value for name, value in infos[agents[0]].items() if name != "due"}
    if "action_mask" in info:
        parts: list[Any] = [flat(infos[agent]["action_mask"]) for agent in agents]
        info["action_mask"] = np.concatenate(parts)
    return info


def settled(total: float, value: float) -> float:
    """`value` where a sum equals it up to rounding, else the sum."""
    return value if abs(total - value) <= 1e-9 * max(1.0, abs(total)) else total


def _play_both(subject: Subject, *, seed: int, idle: Role | None = None) -> Played:
    env = subject.parallel()
    crew, moves = Crew(env, seed), _watched(env.game)
    neutral = {} if idle is None else {agent: env.neutral_action(agent) for agent in env.agents_of[idle]}
    played = Played([], [env.reset(seed=seed)], env.agents_of, moves)
    while env.agents and len(played.actions) < episode_steps(env):
        shown: dict[str, dict[str, Any]] = played.results[-1][-1]
        played.actions.append({**crew.act(shown), **neutral})
        played.results.append(env.step(played.actions[-1]))
    return played


def _watched(game: Game) -> Mapping[Role, list[Array]]:
    """What the roles of one environment do at each of their decisions from now on."""
    moves: dict[Role, list[Array]] = {role: [] for role in ROLES}
    advance = game.advance

    def watching(actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        for role in ROLES:
            if game.elapsed[0] % game.decision_interval[role] == 0:
                moves[role].append(np.copy(actions[role][0]))
        return advance(actions, envs, num_steps)

    game.advance = watching  # type: ignore[method-assign]
    return moves


def check_held_actions(subject: Subject) -> None:
    """In the parallel interface what agents send while no decision of theirs is due has no effect."""
    played = _play_both(subject, seed=23)
    env = subject.parallel()
    crew = Crew(env, 24)
    assert difference(env.reset(seed=23), played.results[0]) is None, "the parallel interface does not repeat its reset"
    for step, action in enumerate(played.actions):
        infos: dict[str, dict[str, Any]] = played.results[step][-1]
        noise = crew.act({agent: {} for agent in infos})  # no mask: anything in the space
        sent = {agent: (action if infos[agent]["due"] else noise)[agent] for agent in infos}
        found = difference(env.step(sent), played.results[step + 1])
        assert found is None, f"an action sent between two decisions has an effect at step {step}: {found}"
