"""Policies by source: `zoo:NAME`, `zoo:PATH` for trained policies, `sb3:FILE.zip` for stable-baselines3 models."""

from __future__ import annotations

import pickle
import sys
from math import prod
from pathlib import Path
from typing import Any

from cps_agents.zoo.files import load
from cps_agents.zoo.wired import Head, WiredPolicy, wired_policy
from cps_envs.core.declare.config import check_count
from cps_envs.core.declare.training import NATIVE
from cps_envs.core.errors import ConfigurationError, MissingExtraError, UnknownNameError, require, shown
from cps_envs.core.learning.wiring import WiredBox, Wiring
from cps_envs.core.policies.lookup import check_spaces
from cps_envs.core.policies.policy import Policy, RoleSpec, takes_masks
from cps_envs.core.policies.trust import require_trust

USUAL = "PPO"  # the algorithm of a model that names none
OF_STATISTICS = b"stable_baselines3.common.vec_env.vec_normalize"  # with which a file of `VecNormalize` begins


def trained(
    name: str, spec: RoleSpec, *, seed: int | None = None, deterministic: bool | None = None, untrained: bool = False
) -> Policy:
    """A shipped policy by its name, or one of your own by the path of its card or of its training run.

    `seed` chooses a training seed (`zoo:hvac-attack?seed=3`), the best by validation if left out. Without
    `deterministic` it plays as its card says, which for most is the most likely action. With `untrained` it plays the
    network that its training began with.

    Raises:
        UnknownNameError: there is no such policy.
        ValueError: a damaged file, a seed that is not in it, or no untrained network in it.
        ConfigurationError: the policy does not fit the role.
    """
    card, network = load(name, seed, untrained=untrained)
    sampled = None if deterministic is None else not deterministic
    policy = wired_policy(spec, card, network, sampled=sampled)
    policy.found_in = (card.preset, card.overrides)
    return policy


def model(
    path: str | Policy,
    spec: RoleSpec,
    *,
    algorithm: str | None = None,
    sampled: bool = False,
    vecnormalize: str | None = None,
    frame_stack: int = 1,
) -> Policy:
    """A stable-baselines3 model of your own; `algorithm` is the class that saved it, such as MaskablePPO, PPO if None.

    It plays its most likely action, or with `sampled` one that is drawn from the episode's own generator; an algorithm
    that knows of masks chooses among the legal ones. A model that was trained in environments of `cps_agents.sb3.make`
    plays as it did there. What it saw through `VecNormalize` and `VecFrameStack` is named by the file of the one, which
    is "" for none, and by the number of frames of the other. Files are read with pickle, which can run any code. An
    object plays as its file does, and sees what its own environments have made, if nothing else is named.

    Raises:
        UnknownNameError: there is no such file or algorithm.
        UntrustedCodeError: the user has not agreed to run what the file holds, see `cps_envs.trust`.
        MissingExtraError: stable-baselines3 is not installed.
        ValueError: the file is damaged, or a model of another algorithm.
        ConfigurationError: the model does not fit the role, or an option does not fit the model.
    """
    found, kind = path, type(path).__name__
    if isinstance(path, str):
        kind = algorithm or USUAL
        found = read_model(path, kind, vecnormalize)
    if algorithm not in (None, kind):
        raise ConfigurationError(f"algorithm = {shown(algorithm)} is not that of this {kind}: leave it out")
    return playable(found, spec, sampled=sampled, vecnormalize=vecnormalize, frame_stack=frame_stack)


def read_model(path: str, algorithm: str, vecnormalize: str | None) -> Any:
    """A model of stable-baselines3 from its file, by the class that saved it. See `model` for what is raised."""
    if not Path(path).is_file():
        raise UnknownNameError(f"there is no file {path!r}: write sb3:PATH, a model that stable-baselines3 saved")
    require_trust(f"sb3:{path}")
    try:
        found = _algorithm(algorithm).load(path, device="cpu")
    except (UnknownNameError, MissingExtraError):
        raise
    except Exception as error:  # whatever zipfile, pickle and torch raise
        raise ValueError(f"{path} is no {algorithm} model, or damaged: {error}") from error
    if vecnormalize is None and (beside := _statistics_beside(Path(path))):
        raise ConfigurationError(
            f"beside {path} lies {beside.name}, of VecNormalize: say vecnormalize={beside} if the model has seen "
            "its inputs through it, or vecnormalize= if it has not"
        )
    return found


def playable(
    policy: Any, spec: RoleSpec, *, sampled: bool = False, vecnormalize: str | None = None, frame_stack: int = 1
) -> Policy:
    """A policy for a role from an object that tells its spaces, such as a model of stable-baselines3; see `model`.

    What was trained in the interface for learners plays through it. A recurrent model is handed its state, and
    `episode_start` where an episode begins. Other objects are returned as they are.

    Raises:
        ConfigurationError: the model does not fit the role, or an option does not fit the model.
    """
    space: Any = getattr(policy, "observation_space", None)
    wired, kind = isinstance(space, WiredBox), type(policy).__name__
    if not _is_model(policy):
        if vecnormalize or frame_stack != 1 or (sampled and not wired):
            raise ConfigurationError(f"{kind} is no model of stable-baselines3: it takes no options")
        return WiredPolicy(spec, space.wiring, None, Head(sampled=sampled), policy) if wired else policy
    from cps_agents.sb3_models import draws, head_of, is_plain, layered, layers_around, layers_named, outputs_of_model

    if sampled and not draws(policy):
        raise ConfigurationError(f"{kind} has no distribution of actions to draw from: leave out sampled=true")
    size = space.shape[0] if wired else spec.fields.size
    layers, frames = layers_around(getattr(policy, "env", None)), check_count("frame_stack", frame_stack)
    if vecnormalize is not None or frames > 1:
        layers = layers_named(statistics_of(vecnormalize) if vecnormalize else None, frames, size)
    stacked = prod(layer.keywords.get("frames", 1) for layer in layers)
    if wired:
        if stacked > 1:
            raise ConfigurationError(f"this {kind} sees {size} inputs of the interface for learners, one frame each")
        if is_plain(policy) and not layers:
            return WiredPolicy(spec, space.wiring, outputs_of_model(policy), head_of(policy, sampled=sampled))
        wiring = space.wiring
    else:
        _check_frames(policy, size, stacked)
        check_spaces(policy, f"this {kind}", spec, stacked)
        wiring = Wiring(spec.problem, spec.role, NATIVE, masked=takes_masks(policy), plain=True)
    return WiredPolicy(spec, wiring, None, Head(sampled=sampled), layered(policy, layers))


def _is_model(policy: Any) -> bool:
    """Whether it is a model of stable-baselines3, or the network of one."""
    base = sys.modules.get("stable_baselines3.common.base_class")
    return base is not None and isinstance(policy, (base.BaseAlgorithm, base.BasePolicy))


def _check_frames(policy: Any, size: int, frames: int) -> None:
    """Check that a model sees as many frames of a role's own observation as is said.

    Raises:
        ConfigurationError: it sees other ones.
    """
    shape = getattr(policy.observation_space, "shape", None) or (0,)
    times = shape[0] // size
    if len(shape) == 1 and times > 1 and shape[0] == times * size and times != frames:
        raise ConfigurationError(
            f"this {type(policy).__name__} sees {shape[0]} inputs, {times} times those of the role: say "
            f"frame_stack={times} if VecFrameStack has stacked them, else it was trained in another configuration"
        )


def _statistics_beside(path: Path) -> Path | None:
    """A file of `VecNormalize` in the folder of a model."""
    for each in sorted(path.parent.iterdir()):
        try:
            if each.is_file() and each.suffix != ".zip":
                with each.open("rb") as file:
                    if OF_STATISTICS in file.read(len(OF_STATISTICS) + 64):
                        return each
        except OSError:  # of somebody else
            continue
    return None


def statistics_of(path: str) -> Any:
    """A `VecNormalize` that its `save` has written.

    Raises:
        UnknownNameError: there is no such file.
        UntrustedCodeError: the user has not agreed to run what it holds.
        ValueError: the file is damaged, or something else.
    """
    if not Path(path).is_file():
        raise UnknownNameError(f"there is no file {path!r}: vecnormalize names what VecNormalize.save has written")
    require_trust(f"vecnormalize={path}")
    try:
        found = pickle.loads(Path(path).read_bytes())
    except Exception as error:  # whatever pickle raises
        raise ValueError(f"{path} is no file of VecNormalize, or damaged: {error}") from error
    if not hasattr(found, "normalize_obs"):
        raise ValueError(f"{path} holds no VecNormalize but {type(found).__name__}")
    return found


def _algorithm(name: str) -> Any:
    purpose = "playing a model of stable-baselines3"
    for package in ("stable_baselines3", "sb3_contrib"):
        module = require(package, extra="sb3", purpose=purpose)
        if hasattr(module, name):
            return getattr(module, name)
    raise UnknownNameError(f"neither stable-baselines3 nor sb3-contrib has an algorithm {name!r}")
