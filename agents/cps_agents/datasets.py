"""Episodes as Minari datasets, for learning offline."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from cps_agents.errors import CommandError
from cps_agents.files import DRAFTS, draft_name, replacing, sweep
from cps_envs.core.compute.generators import seeded
from cps_envs.core.errors import require
from cps_envs.core.game.game import Game
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.lookup import parsed
from cps_envs.core.types import ROLES, SIGN, BoolArray, Role, other

NUM_ENVS = 64  # episodes that are played at once
BLOCK_BYTES = 1 << 20
HEADER_BYTES = 4096  # of an array in a file of HDF5, at most
ROOT = "MINARI_DATASETS_PATH"  # the variable by which Minari knows where datasets are
NAMESPACE = "namespace_metadata.json"  # what makes a folder a namespace of Minari


def dataset_name(
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
    words = "-".join((role, *(parsed(players[each]).title for each in ROLES), digest)).lower()
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

    A dataset is whole or not there: it takes its place when all of it is written.
    Rewards are the role's. `infos` hold the problem's metrics and, where there are any, the legal actions. The
    environment that Minari recovers has the other player as its opponent.

    Raises:
        CommandError: a dataset of that name exists, the name is none, or the problem has no Gymnasium ids.
        MissingExtraError: Minari is not installed.
    """
    minari = require("minari", extra="data", purpose="writing datasets")
    if not re.fullmatch(r"[\w./-]+-v\d+", dataset_id):
        raise CommandError(f"{dataset_id!r} is not the name of a dataset: it should be like cps_envs/fdi/oracle-v0")
    root = Path(import_module("minari.storage.datasets_root_dir").get_dataset_path())
    folder = root / dataset_id
    if folder.exists():
        raise CommandError(f"there is a dataset {dataset_id} already: choose another --id, or delete {folder}")
    env = _recovered(problem, role, {**overrides, "preset": preset, "opponent": players[other(role)]})
    config = problem.config(preset, overrides)
    episodes = [
        episode
        for start in range(0, len(seeds), NUM_ENVS)
        for episode in _record(problem, config, role, players, seeds[start : start + NUM_ENVS])
    ]
    buffers = [
        _buffer(number, seed, episode) for number, (seed, episode) in enumerate(zip(seeds, episodes, strict=True))
    ]
    with _drafted(root, dataset_id) as drafts, warnings.catch_warnings():
        _have_room(drafts, size_of(episodes))
        warnings.simplefilter("ignore", UserWarning)  # about links and addresses that are left out
        minari.create_dataset_from_buffers(
            dataset_id=dataset_id,
            buffer=buffers,
            env=env,
            algorithm_name=players[role],
            description=f"{problem.summary} {' against '.join(players.values())}, preset {preset}, {dict(overrides)}",
            data_format="hdf5",
            requirements=["cps-envs"],
        )
    return minari.load_dataset(dataset_id)


def _recovered(problem: Problem, role: Role, options: Mapping[str, Any]) -> Any:
    """The environment that Minari writes into a dataset by its id, and makes again from that.

    Raises:
        CommandError: the problem has no ids.
    """
    name = problem.env_id(role)
    try:
        return gymnasium.make(f"{problem.namespace}:{name}", **options)
    except (gymnasium.error.UnregisteredEnv, ModuleNotFoundError) as error:
        raise CommandError(
            f"a dataset names its environment by Gymnasium's id, and there is no {name}: let {problem.namespace!r}, "
            f"the namespace of {problem.name}, be the module that calls cps_envs.register(...) for it"
        ) from error


def size_of(episodes: Sequence[Mapping[str, Any]]) -> int:
    """The bytes that a dataset of these episodes takes, at most."""
    arrays = [
        values
        for episode in episodes
        for values in (*episode["infos"].values(), *(episode[name] for name in episode if name != "infos"))
    ]
    return sum(np.asarray(values).nbytes + HEADER_BYTES for values in arrays)


def _have_room(folder: Path, size: int) -> None:
    """Fail now if a disk is full: HDF5 ends the process when it cannot write.

    Raises:
        OSError: a file of this size cannot be written in the folder.
    """
    with replacing(folder / "room") as draft, draft.open("wb") as file:
        for start in range(0, size, BLOCK_BYTES):
            file.write(bytes(min(BLOCK_BYTES, size - start)))
    (folder / "room").unlink()


@contextmanager
def _drafted(root: Path, dataset_id: str) -> Iterator[Path]:
    """While Minari writes a dataset into a hidden folder of `root`, which takes its place there when all went well."""
    drafts, before = root / DRAFTS / draft_name(), os.environ.get(ROOT)
    sweep(drafts.parent)
    drafts.mkdir(parents=True)
    os.environ[ROOT] = str(drafts)
    try:
        yield drafts
        (root / dataset_id).parent.mkdir(parents=True, exist_ok=True)
        for namespace in sorted(drafts.rglob(NAMESPACE)):
            if not (place := root / namespace.relative_to(drafts)).exists():
                os.replace(namespace, place)
        os.replace(drafts / dataset_id, root / dataset_id)
    finally:
        if before is None:
            del os.environ[ROOT]
        else:
            os.environ[ROOT] = before
        shutil.rmtree(drafts, ignore_errors=True)
        with suppress(OSError):
            drafts.parent.rmdir()  # if nobody else writes there


def _buffer(number: int, seed: int, episode: Mapping[str, Any]) -> Any:
    buffer = import_module("minari.data_collector.episode_buffer")
    return buffer.EpisodeBuffer(id=number, seed=seed, **episode)


def _record(
    problem: Problem, config: Any, role: Role, players: Mapping[Role, str], seeds: Sequence[int]
) -> list[dict[str, Any]]:
    """What Minari keeps of each environment's episode."""
    match = problem.match(config, len(seeds), players)
    game, kind = match.game, match.game.action_space[role].dtype
    match.reset(np.ones(len(seeds), np.bool_), seeded(seeds))
    episodes = [_empty() for _ in seeds]
    _look(game, role, episodes, np.ones(len(seeds), np.bool_))
    while (active := (game.elapsed < game.horizon) & ~game.terminated).any():
        payoff = match.step({}, active, game.decision_interval[role])
        actions = match.action(role).astype(kind)
        for b in np.flatnonzero(active).tolist():
            episode = episodes[b]
            episode["actions"].append(actions[b])
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
