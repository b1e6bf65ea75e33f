"""Episodes as Minari datasets, for learning offline."""

from __future__ import annotations

import hashlib
import json
import re
import warnings
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from cps_agents.errors import CommandError
from cps_envs.core.errors import require
from cps_envs.core.game import Game
from cps_envs.core.generators import seeded
from cps_envs.core.match import Match
from cps_envs.core.policy import (
    AnalyticPolicy,
    Generators,
    Knowledge,
    Policy,
    RoleSpec,
    State,
    ask,
    begun,
    is_decentralised,
    takes_masks,
)
from cps_envs.core.problem import Problem
from cps_envs.core.seen import Seen
from cps_envs.core.types import ROLES, SIGN, Array, BoolArray, Role, other

NUM_ENVS = 64  # episodes that are played at once


def name_of(
    problem: Problem,
    preset: str,
    overrides: Mapping[str, Any],
    role: Role,
    players: Mapping[Role, str],
    seeds: Sequence[int],
) -> str:
    """A dataset's name, such as `cps_envs/fdi/learning/attacker-tracker-cusum-1f0c9ab2-v0`.

    The hash tells apart what the words do not: other settings, other options of the policies, other episodes.
    """
    everything = [preset, dict(overrides), dict(players), seeds[0], len(seeds)]
    digest = hashlib.sha256(json.dumps(everything, sort_keys=True, default=repr).encode()).hexdigest()[:8]
    words = "-".join((role, *(players[each].partition("?")[0] for each in ROLES), digest)).lower()
    place = "/".join((problem.namespace, problem.name, preset))
    return f"{place}/{re.sub('[^a-z0-9_]+', '-', words)}-v{problem.version}"


def write_dataset(
    problem: Problem,
    role: Role,
    players: Mapping[Role, str],
    preset: str,
    overrides: Mapping[str, Any],
    seeds: Sequence[int],
    dataset_id: str,
) -> Any:
    """Play one episode per seed and keep what `role` saw, did and got; returns Minari's dataset.

    Rewards are the role's. `infos` hold the problem's metrics and, where there are any, the legal actions. The
    environment that Minari recovers has the other player as its opponent.

    Raises:
        CommandError: a dataset of that name exists, or the name is none.
        MissingExtraError: Minari is not installed.
    """
    minari = require("minari", extra="data", purpose="writing datasets")
    if not re.fullmatch(r"[\w./-]+-v\d+", dataset_id):
        raise CommandError(f"{dataset_id!r} is not the name of a dataset: it should be like cps_envs/fdi/oracle-v0")
    folder = import_module("minari.storage.datasets_root_dir").get_dataset_path(dataset_id)
    if Path(folder).exists():  # whole, or what an interrupted command has left
        raise CommandError(f"there is a dataset {dataset_id} already: choose another --id, or delete {folder}")
    options = {**overrides, "preset": preset, "opponent": players[other(role)]}
    env = gymnasium.make(f"{problem.namespace}:{problem.env_id(role)}", **options)
    config = problem.config(preset, overrides)
    episodes = [
        episode
        for start in range(0, len(seeds), NUM_ENVS)
        for episode in _record(problem, config, role, players, seeds[start : start + NUM_ENVS])
    ]
    buffers = [
        _buffer(number, seed, episode) for number, (seed, episode) in enumerate(zip(seeds, episodes, strict=True))
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # about links and addresses that are left out
        return minari.create_dataset_from_buffers(
            dataset_id=dataset_id,
            buffer=buffers,
            env=env,
            algorithm_name=players[role],
            description=f"{problem.summary} {' against '.join(players.values())}, preset {preset}, {dict(overrides)}",
            data_format="hdf5",
            requirements=["cps-envs"],
        )


def _buffer(number: int, seed: int, episode: Mapping[str, Any]) -> Any:
    buffer = import_module("minari.data_collector.episode_buffer")
    return buffer.EpisodeBuffer(id=number, seed=seed, **episode)


def _record(
    problem: Problem, config: Any, role: Role, players: Mapping[Role, str], seeds: Sequence[int]
) -> list[dict[str, Any]]:
    """What Minari keeps of each environment's episode."""
    game = problem.game(config, len(seeds))
    witness = Witness(game.spec(role), problem.policy(players[role], game, role))
    rival = other(role)
    match = Match(game, {role: witness, rival: problem.policy(players[rival], game, rival)})
    match.reset(np.ones(len(seeds), np.bool_), seeded(seeds))
    episodes = [_empty() for _ in seeds]
    _look(game, role, episodes, np.ones(len(seeds), np.bool_))
    while (active := (game.elapsed < game.horizon) & ~game.terminated).any():
        payoff = match.step({}, active, game.decision_interval[role])
        for row, b in enumerate(np.flatnonzero(active).tolist()):
            episode = episodes[b]
            episode["actions"].append(witness.actions[row])
            episode["rewards"].append(float(SIGN[role] * payoff[b]))
            episode["terminations"].append(bool(game.terminated[b] or game.elapsed[b] >= game.horizon))
            episode["truncations"].append(False)
        _look(game, role, episodes, active)
    return episodes


def _empty() -> dict[str, Any]:
    return {"observations": [], "actions": [], "rewards": [], "terminations": [], "truncations": [], "infos": {}}


def _look(game: Game, role: Role, episodes: Sequence[dict[str, Any]], envs: BoolArray) -> None:
    """Add what is to be seen now."""
    observation, mask, metrics = game.observe(role), game.action_mask(role), game.metrics()
    for b in np.flatnonzero(envs).tolist():
        episodes[b]["observations"].append(observation[b])
        infos = episodes[b]["infos"]
        for name, values in metrics.items():
            infos.setdefault(name, []).append(values.item(b))
        if mask is not None:
            infos.setdefault("action_mask", []).append(mask[b].astype(np.int8))


class Witness(AnalyticPolicy):
    """Plays as another policy does and remembers its last actions."""

    def __init__(self, spec: RoleSpec, policy: Policy) -> None:
        super().__init__(spec)
        self._policy = policy
        self.actions: Array = np.empty(0)
        self.masked, self.decentralised = takes_masks(policy), is_decentralised(policy)
        self.privileged = getattr(policy, "privileged", frozenset())

    def begin(self, generators: Generators, knowledge: Knowledge) -> State | None:
        """The policy's own."""
        return begun(self._policy, generators, knowledge)

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """What the policy plays, remembered."""
        actions, state = ask(self._policy, seen, state)
        self.actions = np.asarray(actions).astype(self.spec.action_space.dtype)
        return actions, state
